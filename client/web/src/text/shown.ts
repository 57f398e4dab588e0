// Which number stands for a parameter: the one that `polyest estimate` prints. As a rule it is the most
// probable value with the standard deviation of the curvature there. It is the mean of the distribution,
// with its standard deviation, where the most probable value would mislead: where the data say less than
// the prior, and where the distribution is twice as wide as the curvature says, as with several pieces.

import type { Parameter } from '../api/messages';

export interface Shown {
  value: number;
  deviation: number;
  isMean: boolean;
}

export function shownOf({ map, stdDev, mean, posteriorStdDev, verdict }: Parameter): Shown {
  const isMean = posteriorStdDev > 0 && (verdict === 'NOT_IDENTIFIED' || posteriorStdDev >= 2 * stdDev);
  return isMean ? { value: mean, deviation: posteriorStdDev, isMean } : { value: map, deviation: stdDev, isMean };
}
