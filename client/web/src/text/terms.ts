// Explains the words that not every test engineer uses every day.

export const TERMS = {
  sd: 'One standard deviation: if all assumptions hold, the true value is within ± one of it in two of three cases, and within ± two in 95 of 100.',
  mean: 'The mean of all that the data allow: a most probable value would mislead here. Go by the 95 % interval.',
  interval: 'The true value is between these two in 95 of 100 cases, if model and noise are as the problem says.',
  prior: 'What was known of the parameter before the test, as the problem file says it.',
  narrower: 'How many times smaller the standard deviation is than before the test.',
  band: 'Shaded: where 95 of 100 new samples are expected, with the noise. Darker: the model alone.',
  residual: 'Measured minus predicted, divided by the spread that is expected of a sample. 95 of 100 should be between −2 and 2.',
  autocorrelation: 'Whether an error says something about the next ones. Bars beyond the dashed lines, at several places, say yes: then the model lacks something, or the sensor drifts.',
  effective: 'How many independent samples would tell as much. Far fewer than samples: the errors hang together.',
  chi: 'Mean squared residual in units of the noise. About 1 when model and noise are right.',
  lag1: 'Correlation of each residual with the next. About 0 when model and noise are right.',
  coverage: 'Samples within the 95 % band. About 95 % when model and noise are right.',
  corner: 'Which values are probable together: the outline holds 95 %, the inner one 68 % of the probability. On the diagonal, each parameter on its own.',
  realTime: 'Seconds of measurements ÷ seconds computed for them. Above 1 the daemon keeps up with the rig.',
  unprocessed: 'Batches that are stored safely but not computed yet.',
  reexpansion: 'The computation was moved to where the parameters are now known to be, and made finer there. Marked by ticks at the bottom of the strips since this page was opened.',
  order: 'Degree of the polynomials that stand for the model, and how many runs of the model they rest on.',
  residualToNoise: 'How far these polynomials are from the model itself, in units of the noise. Small beside 1: trust it.',
  print: 'Prints what the page shows now on A4, or saves it as PDF: estimates, warnings, fit, residuals and the problem. The command polyest report --session makes a file that has every output.',
  durable: 'Whether measurements that were acknowledged survive a restart of the daemon.',
} as const;

export type Term = keyof typeof TERMS;
