import { describe, expect, it } from 'vitest';

import type { Estimate } from '../../src/api/messages';
import { EstimateHistory } from '../../src/state/estimate_history';
import { estimate, parameter, pointOf } from './samples';

const at = (k: number, changes: Partial<Estimate> = {}): Estimate =>
  estimate({ time: 0.1 * k, samples: k, sequence: k, ...changes });

describe('EstimateHistory', () => {
  it('joins the history that the daemon kept with what comes then', () => {
    const history = new EstimateHistory();
    history.load([1, 2, 3].map((k) => pointOf(at(k))));
    history.append(at(3));  // a stream begins with the present estimate
    history.append(at(4));
    expect(Array.from(history.series('k')?.x ?? []).map((x) => Math.round(10 * x))).toEqual([1, 2, 3, 4]);
  });

  it('keeps the whole course of a long session that it watches for long', () => {
    const history = new EstimateHistory();
    const total = 100_000;
    history.load(Array.from({ length: 391 }, (_, k) => pointOf(at(256 * k))));  // of 100,000 estimates
    for (let k = 256 * 390 + 1; k <= 2 * total; ++k) history.append(at(k));
    const sequences = Array.from(history.series('k')?.x ?? []).map((x) => Math.round(10 * x));
    const steps = sequences.slice(1, -1).map((value, i) => value - (sequences[i] as number));
    expect(new Set(steps)).toEqual(new Set([256]));
    expect([sequences[0], sequences[sequences.length - 1]]).toEqual([0, 2 * total]);
  });

  it('does not take an estimate that is older than the last', () => {
    const history = new EstimateHistory();
    history.append(at(5));
    history.append(at(4));
    expect(history.length).toBe(1);
  });

  it('goes over to samples where the time begins again with each run', () => {
    const history = new EstimateHistory();
    history.append(at(1, { time: 5 }));
    expect(history.hasRuns).toBe(false);
    history.append(at(2, { time: 0.1 }));
    expect(history.hasRuns).toBe(true);
    expect(Array.from(history.series('k')?.x ?? [])).toEqual([1, 2]);
  });

  it('follows parameters of runs as they come and go, with the others kept', () => {
    const history = new EstimateHistory();
    history.append(at(1, { parameters: [parameter('k', { mean: 1 }), parameter('x_0[0]', { mean: 10 })] }));
    history.append(at(2, { parameters: [parameter('k', { mean: 2 }), parameter('x_0[1]', { mean: 20 })] }));
    expect(history.series('x_0[0]')).toBeNull();
    expect(Array.from(history.series('k')?.mean ?? [])).toEqual([1, 2]);
    expect(Array.from(history.series('x_0[1]')?.mean ?? [])).toEqual([NaN, 20]);
  });

  it('marks where the expansion moved, but not what it finds at first', () => {
    const history = new EstimateHistory();
    const expansion = (reexpansions: number): Estimate['expansion'] => ({ ...estimate().expansion, reexpansions });
    history.append(at(10, { expansion: expansion(3) }));
    history.append(at(20, { expansion: expansion(3) }));
    history.append(at(30, { expansion: expansion(5) }));
    expect(history.reexpansionTicks()).toEqual([3]);
    // What is loaded again adds what this page has missed, and nothing twice.
    history.load([20, 30, 40].map((k) => pointOf(at(k, { expansion: expansion(k === 40 ? 6 : k === 30 ? 5 : 3) }))));
    expect(history.reexpansionTicks()).toEqual([3, 4]);
    for (let k = 41; k < 5000; ++k) history.append(at(k, { expansion: expansion(k) }));
    expect(history.reexpansionTicks().length).toBeLessThanOrEqual(200);
  });

  it('stays as small after a hundred thousand estimates as after two thousand', () => {
    const history = new EstimateHistory();
    const one = at(0);
    const feed = (from: number, to: number): void => {
      for (let k = from; k < to; ++k) history.append({ ...one, time: k, samples: k, sequence: k });
    };
    feed(0, 2000);
    globalThis.gc?.();
    const before = process.memoryUsage();
    feed(2000, 100_000);
    globalThis.gc?.();
    const after = process.memoryUsage();
    expect(history.length).toBeLessThanOrEqual(1024);
    const series = history.series('k');
    expect(series?.x[series.x.length - 1]).toBe(99_999);
    // Typed arrays are what could grow; the heap is the collector's affair.
    expect(after.arrayBuffers - before.arrayBuffers).toBeLessThan(1 << 20);
  });
});
