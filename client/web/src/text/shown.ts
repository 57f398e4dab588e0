// Which number stands for a parameter: the one that `polyest estimate` prints. As a rule it is the most
// probable value with the standard deviation of the curvature there. Where the data say less than the
// prior, a most probable value may be any that the prior allows: then it is the mean of the distribution,
// with its standard deviation.

import type { Parameter } from '../api/messages';

export interface Shown {
  value: number;
  deviation: number;
  isMean: boolean;
}

export function shownOf({ map, stdDev, mean, posteriorStdDev, verdict }: Parameter): Shown {
  const isMean = verdict === 'NOT_IDENTIFIED' && posteriorStdDev > 0;
  return isMean ? { value: mean, deviation: posteriorStdDev, isMean } : { value: map, deviation: stdDev, isMean };
}
