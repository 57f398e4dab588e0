// Chooses which values a strip shows: all that the prior allows at first, then less and less, so
// that the present band is always wide enough to be seen.

import type { Interval } from '../text/prior';

// The least share of the height that the present 95 % band takes.
const LEAST_SHARE = 0.12;

// The values that any band so far or the prior reaches.
function everything(prior: Interval, lower: ArrayLike<number>, upper: ArrayLike<number>): Interval {
  let [low, high] = [prior.lower, prior.upper];
  for (let i = 0; i < lower.length; ++i) {
    if ((lower[i] as number) < low) low = lower[i] as number;
    if ((upper[i] as number) > high) high = upper[i] as number;
  }
  return { lower: low, upper: high };
}

// Returns the range of the strip's axis, from `lower` to `upper` of the bands over time, the newest
// last. `isWhole`: whether to show all that the prior allows.
export function stripRange(
  prior: Interval, lower: ArrayLike<number>, upper: ArrayLike<number>, isWhole: boolean,
): [number, number] {
  const all = everything(prior, lower, upper);
  const margin = 0.06 * (all.upper - all.lower);
  let low = all.lower - margin;
  let high = all.upper + margin;
  const newest = { lower: lower[lower.length - 1] ?? NaN, upper: upper[upper.length - 1] ?? NaN };
  const width = newest.upper - newest.lower;
  if (!isWhole && width > 0) {
    const half = width / LEAST_SHARE / 2;
    const centre = (newest.lower + newest.upper) / 2;
    low = Math.max(low, centre - half);
    high = Math.min(high, centre + half);
  }
  if (!(high > low)) {
    const spread = Math.abs(low) > 0 ? 0.01 * Math.abs(low) : 1;
    return Number.isFinite(low) ? [low - spread, low + spread] : [0, 1];
  }
  return [low, high];
}
