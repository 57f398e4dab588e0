import { describe, expect, it } from 'vitest';

import { readPrediction } from '../../src/api/messages';
import { signalWindow, windowLength } from '../../src/state/signal_window';
import { levelOf, outline, smoothed } from '../../src/view/contours';
import { stripRange } from '../../src/view/strip_range';
import { readRoute } from '../../src/view/route';
import { recording } from './samples';

describe('the range of a strip', () => {
  const prior = { lower: 0, upper: 100 };
  it('shows the prior at first', () => {
    const [low, high] = stripRange(prior, [1], [99], false);
    expect(low).toBeLessThan(0);
    expect(high).toBeGreaterThan(100);
  });
  it('gives the present band an eighth of the height, and never more than all there is', () => {
    const [low, high] = stripRange(prior, [1, 49], [99, 51], false);
    expect((51 - 49) / (high - low)).toBeCloseTo(0.12);
    expect((low + high) / 2).toBeCloseTo(50);
    expect(stripRange(prior, [1, 49], [99, 51], true)).toEqual([-6, 106]);
  });
  it('is a range whatever comes', () => {
    for (const values of [[], [NaN], [0], [5]]) {
      for (const each of [prior, { lower: 0, upper: 0 }, { lower: NaN, upper: NaN }]) {
        const [low, high] = stripRange(each, values, values, false);
        expect(high).toBeGreaterThan(low);
      }
    }
  });
});

describe('outlines of a density', () => {
  // A round Gaussian: the region of highest density that holds p has the radius √(−2 log(1 − p)).
  const n = 64;
  const step = 8 / n;
  const at = (i: number): number => -4 + (i + 0.5) * step;
  const density = Array.from({ length: n * n }, (_, k) => Math.exp(-(at(Math.floor(k / n)) ** 2 + at(k % n) ** 2) / 2));
  it.each([0.5, 0.68, 0.95])('hold %d of the probability', (p) => {
    const segments = outline(density, n, n, levelOf(density, p));
    const radius = Math.sqrt(-2 * Math.log(1 - p));
    expect(segments.length).toBeGreaterThan(20);
    for (const [x1, y1] of segments) {
      const r = Math.hypot(-4 + (x1 + 0.5) * step, -4 + (y1 + 0.5) * step);
      expect(Math.abs(r - radius)).toBeLessThan(step);
    }
  });
  it('are closed: every point ends two pieces', () => {
    const ends = new Map<string, number>();
    for (const [x1, y1, x2, y2] of outline(density, n, n, levelOf(density, 0.9999))) {
      for (const key of [`${x1.toFixed(6)},${y1.toFixed(6)}`, `${x2.toFixed(6)},${y2.toFixed(6)}`]) {
        ends.set(key, (ends.get(key) ?? 0) + 1);
      }
    }
    for (const count of ends.values()) expect(count % 2).toBe(0);
  });
  it('are not moved by smoothing', () => {
    const sum = (values: readonly number[]): number => values.reduce((a, b) => a + b, 0);
    expect(sum(smoothed(density, n, n))).toBeCloseTo(sum(density), 1);
  });
});

describe('the newest part of a prediction', () => {
  const prediction = readPrediction(recording['prediction']);
  const output = prediction.outputs[0] as (typeof prediction.outputs)[number];
  it('has a nice length and its own rows', () => {
    const length = windowLength(prediction);
    expect([10, 20, 50]).toContain(length);
    const window = signalWindow(prediction, output, length);
    const last = prediction.time[prediction.time.length - 1] as number;
    expect(window.time[0]).toBeGreaterThanOrEqual(last - length);
    expect(window.time[window.time.length - 1]).toBe(last);
    expect(window.isStandardized).toBe(true);
    for (const column of [window.measured, window.mean, window.sampleLower, window.modelUpper, window.residual]) {
      expect(column).toHaveLength(window.time.length);
    }
    // measured = predicted + residual, where the residual is in σ
    const k = window.time.length - 1;
    const sigma = ((window.measured[k] as number) - (window.mean[k] as number)) / (window.residual[k] as number);
    expect(sigma).toBeCloseTo(0.01, 3);
  });
  it('is of the last run', () => {
    const runs = { ...prediction, run: prediction.time.map((_, i) => (i < 390 ? 0 : 1)) };
    expect(signalWindow(runs, output, Infinity).time).toHaveLength(prediction.time.length - 390);
  });
  it('has gaps where there is no sample, and no band where the noise is not known', () => {
    const gappy = { ...output, measuredRows: [0, 2], measured: [1, NaN], sampleQuantiles: [], standardizedResidual: [] };
    const window = signalWindow(prediction, gappy, Infinity);
    expect(window.measured.slice(0, 3)).toEqual([1, null, null]);
    expect(window.sampleLower).toEqual([]);
    expect(window.isStandardized).toBe(false);
  });
});

describe('addresses', () => {
  it('name a session, or two', () => {
    expect(readRoute('')).toEqual({ session: null, other: null });
    expect(readRoute('#/monday')).toEqual({ session: 'monday', other: null });
    expect(readRoute('#/monday/with/tuesday')).toEqual({ session: 'monday', other: 'tuesday' });
    expect(readRoute('#/monday/with/monday').other).toBeNull();
    expect(readRoute('#/<script>').session).toBeNull();
  });
});
