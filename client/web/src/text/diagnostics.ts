// What each diagnostic means and what to do, in short. client/diagnostics.md says it in full.

export interface Explanation {
  title: string;
  meaning: string;
  remedy: string;
  severity: 'serious' | 'notice';  // serious: do not use the numbers as they are
}

const EXPLANATIONS: Record<string, Explanation> = {
  EXPANSION_INACCURATE: {
    title: 'Computation not accurate enough',
    meaning: 'The polynomials that stand for the model, or the integration of its equations, differ from the model so much that an estimate may be off by more than a quarter of its standard deviation. The uncertainty shown has been widened.',
    remedy: 'Narrow the priors as far as you know better, leave the order on "AUTO", or let the record begin earlier.',
    severity: 'serious',
  },
  NOT_CONVERGED: {
    title: 'Computation has not converged',
    meaning: 'The search for the most probable values gave up, or the chains that draw from the posterior have not mixed, so that the estimates and verdicts may be wrong.',
    remedy: 'Look at `polyest profile`: a flat or jagged cost says which parameter is the cause. Fix it, or give it a narrower prior.',
    severity: 'serious',
  },
  REPLAY_POSTPONED: {
    title: 'Limit on the work of an update reached',
    meaning: 'expansion.maxReplayRowCount keeps the record from being propagated again although the estimate needs it. Nothing is called identified until that is made up for, and what it costs in accuracy has widened the uncertainty.',
    remedy: 'Raise expansion.maxReplayRowCount as far as the time of an update allows, or narrow the priors so that the expansion moves early.',
    severity: 'serious',
  },
  POINTS_FAILED: {
    title: 'Some runs of the model failed',
    meaning: 'The model could not be integrated for some values of the unknowns, and these were left out.',
    remedy: 'Often the prior allows what the hardware does not, such as a negative stiffness: narrow it.',
    severity: 'serious',
  },
  SUSPICIOUS_DATA: {
    title: 'Data look suspicious',
    meaning: 'The data are allowed but probably not what was meant: a wrong unit or sign, a sensor that is not connected, times that do not begin at 0.',
    remedy: 'The message says what was noticed. `polyest check` gives the same warnings before a test.',
    severity: 'serious',
  },
  MODEL_MISFIT: {
    title: 'Model does not fit the measurements',
    meaning: 'The differences between measurement and model are far larger, or far smaller, than the noise that the problem gives. Where they are larger, the uncertainty has been widened.',
    remedy: 'Look at the residuals. A pattern in time is the model’s: a missing force, friction, a delay, an offset. Without a pattern the noise is not as large as stated.',
    severity: 'serious',
  },
  CORRELATED_RESIDUALS: {
    title: 'Errors hang together in time',
    meaning: 'Successive residuals are correlated although the noise is taken to be independent from sample to sample. The samples tell less than as many independent ones.',
    remedy: 'Improve the model first. If it is the sensor, give its noise "correlation": {"auto": true}.',
    severity: 'serious',
  },
  INCONSISTENT_OVER_TIME: {
    title: 'A parameter changes during the record',
    meaning: 'A parameter differs between parts of the record by more than the noise explains; the estimate is a mean over the record.',
    remedy: 'Warm-up, a loosening clamp and wear are real changes: let the parameter drift, or estimate parts of the record on their own.',
    severity: 'serious',
  },
  WINDOWS_DISAGREE: {
    title: 'Parts of the record disagree',
    meaning: 'Parts of the record disagree about the parameters by more than the noise explains, as they do where the model or the noise is not quite right. The uncertainty has been widened.',
    remedy: 'Improve the model or the noise; where disturbances act on the system itself, give its states process noise.',
    severity: 'serious',
  },
  NOISE_NOT_LEARNED: {
    title: 'Noise not known yet',
    meaning: 'The noise is of unknown size and there are too few samples to learn it from. The estimate stays near the prior.',
    remedy: 'Wait for more samples, or give the noise by numbers.',
    severity: 'notice',
  },
  NOT_IDENTIFIED: {
    title: 'Not determined by the data',
    meaning: 'The data say less about a parameter than its prior does; what is shown is the prior.',
    remedy: '`polyest explain` proposes what to measure as well, or which excitation. Or fix one of a pair that trade off.',
    severity: 'notice',
  },
  UNDERSAMPLED: {
    title: 'Samples miss what matters',
    meaning: 'The samples miss what a parameter changes, as two samples a period on zero crossings do, or may be those of a slower or faster response as well.',
    remedy: 'Sample more often, or at other times; `polyest design` finds good ones.',
    severity: 'notice',
  },
  AT_PRIOR_BOUND: {
    title: 'Estimate at the edge of its prior',
    meaning: 'The most probable value lies on a bound of the prior: the data ask for values beyond it.',
    remedy: 'If values beyond the bound are possible, widen the prior. If not, the parameter makes up for something else that is wrong.',
    severity: 'serious',
  },
  PRIOR_DATA_CONFLICT: {
    title: 'Measurements contradict the prior',
    meaning: 'What the measurements say of a parameter, or of all together, is very improbable by what was said of it before. The estimate is a compromise between the two, one of which is wrong.',
    remedy: 'Check the unit and the prior. If both are right, the parameter makes up for something else that is wrong in the model.',
    severity: 'serious',
  },
  FIXED_VALUE_CONFLICT: {
    title: 'A fixed value is wrong',
    meaning: 'The residuals ask for another value of something that the problem holds fixed: a parameter, an initial state, or a gain, a delay or an offset of a signal.',
    remedy: 'Correct the value, or make it uncertain.',
    severity: 'serious',
  },
  MULTIPLE_MINIMA: {
    title: 'Several sets of values fit',
    meaning: 'Several separate sets of values fit the data. The estimate shown is that of the most probable one.',
    remedy: 'A prior that excludes the mirror image, another output or other sample times decide between them.',
    severity: 'serious',
  },
  NON_GAUSSIAN: {
    title: 'Uncertainty is not bell-shaped',
    meaning: 'The distribution of a parameter is skewed, cut off by a bound, bent, or in pieces, so that ± one standard deviation does not describe it.',
    remedy: 'Go by the 95 % interval, and look at the picture of the posterior.',
    severity: 'notice',
  },
  REGULARIZATION_NOT_DETERMINED: {
    title: 'Weight of the prior not determined',
    meaning: 'The rule that was asked for does not choose the prior’s weight; it stays 1, as Bayes’ rule has it.',
    remedy: 'Nothing, if that is what you want. `polyest regularization` shows the whole sweep.',
    severity: 'notice',
  },
};

// Explains a code; a code that this page does not know yet speaks by its message.
export function explain(code: string): Explanation {
  return EXPLANATIONS[code] ?? {
    title: code.toLowerCase().replace(/_/g, ' ').replace(/^./, (c) => c.toUpperCase()) || 'Warning',
    meaning: 'The message says what was noticed.',
    remedy: 'See the guide “Diagnostics”.',
    severity: 'serious',
  };
}

export const knownCodes = (): string[] => Object.keys(EXPLANATIONS);
