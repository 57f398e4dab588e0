// Which number stands for a parameter. As a rule it is the most probable value with the standard
// deviation of the curvature there, as `polyest estimate` prints it. Where the distribution is not
// bell-shaped, or the data say less than the prior, a most probable value would mislead: then it is
// the mean of the distribution, with its standard deviation.

import type { Parameter } from '../api/messages';

// The ratio of both standard deviations beyond which NON_GAUSSIAN is raised.
const BELL = 1.2;

export interface Shown {
  value: number;
  deviation: number;
  isMean: boolean;
}

export function shownOf({ map, stdDev, mean, posteriorStdDev, verdict }: Parameter): Shown {
  const ratio = posteriorStdDev / stdDev;
  // The daemon gives the distribution's deviation for both where the curvature's contradicts it.
  const replaced = stdDev === posteriorStdDev;
  const isMean = posteriorStdDev > 0
    && (ratio > BELL || ratio < 1 / BELL || replaced || verdict === 'NOT_IDENTIFIED');
  return isMean ? { value: mean, deviation: posteriorStdDev, isMean } : { value: map, deviation: stdDev, isMean };
}
