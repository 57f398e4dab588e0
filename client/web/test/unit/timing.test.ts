import { afterEach, beforeEach, describe, expect, it, vi } from 'vitest';

import { Backoff, pause } from '../../src/state/backoff';
import { PacedJob } from '../../src/state/paced_job';

beforeEach(() => { vi.useFakeTimers(); });
afterEach(() => { vi.useRealTimers(); });

describe('Backoff', () => {
  it('doubles up to 20 s and begins anew', () => {
    const backoff = new Backoff(() => 0.5);
    expect(Array.from({ length: 8 }, () => backoff.next())).toEqual([500, 1000, 2000, 4000, 8000, 16_000, 20_000, 20_000]);
    backoff.reset();
    expect(backoff.next()).toBe(500);
  });
  it('varies by a quarter', () => {
    expect(new Backoff(() => 0).next()).toBe(375);
    expect(new Backoff(() => 1).next()).toBe(625);
  });
  it('pauses until it is stopped', async () => {
    const stop = new AbortController();
    const done = vi.fn();
    void pause(1000, stop.signal).then(done);
    await vi.advanceTimersByTimeAsync(900);
    expect(done).not.toHaveBeenCalled();
    stop.abort();
    await vi.advanceTimersByTimeAsync(0);
    expect(done).toHaveBeenCalled();
  });
});

describe('PacedJob', () => {
  const job = (tookMs: number, intervalMs = 1000) => {
    let running = 0;
    let most = 0;
    const begins: number[] = [];
    const paced = new PacedJob(intervalMs, async () => {
      begins.push(Date.now());
      most = Math.max(most, ++running);
      await new Promise((resolve) => { setTimeout(resolve, tookMs); });
      running -= 1;
    }, () => Date.now());
    return { paced, begins, most: () => most };
  };

  it('makes one run of many requests', async () => {
    const { paced, begins, most } = job(10);
    for (let k = 0; k < 299; ++k) {
      paced.request();
      await vi.advanceTimersByTimeAsync(10);
    }
    expect(begins.length).toBe(3);
    expect(most()).toBe(1);
  });

  it('rests ten times as long as the work took', async () => {
    const { paced, begins } = job(500);
    for (let k = 0; k < 1099; ++k) {
      paced.request();
      await vi.advanceTimersByTimeAsync(10);
    }
    expect((begins[1] as number) - (begins[0] as number)).toBeGreaterThanOrEqual(5500);
    expect(begins.length).toBe(2);
  });

  it('runs at once when it is told to, and not at all after its end', async () => {
    const { paced, begins } = job(10, 60_000);
    paced.request();
    await vi.advanceTimersByTimeAsync(50);
    paced.requestNow();
    await vi.advanceTimersByTimeAsync(50);
    expect(begins.length).toBe(2);
    paced.dispose();
    paced.requestNow();
    await vi.advanceTimersByTimeAsync(100_000);
    expect(begins.length).toBe(2);
  });
});
