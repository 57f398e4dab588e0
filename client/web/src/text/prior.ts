// The central 95 % of a parameter's prior: from the problem where its form is plain, else from the
// prior's mean and standard deviation.

import type { Json, Parameter } from '../api/messages';

const Z = 1.959964;

export interface Interval {
  lower: number;
  upper: number;
}

const isObject = (value: unknown): value is Json => typeof value === 'object' && value !== null;
const numberAt = (json: Json, key: string): number => Number(json[key] ?? 0);

function fromPrior(entry: Json): Interval | null {
  const uniform = entry['uniform'];
  if (isObject(uniform)) {
    const [lower, upper] = [numberAt(uniform, 'lower'), numberAt(uniform, 'upper')];
    return { lower: lower + 0.025 * (upper - lower), upper: upper - 0.025 * (upper - lower) };
  }
  const lognormal = entry['lognormal'];
  if (isObject(lognormal)) {
    const [mean, stdDev] = [numberAt(lognormal, 'mean'), numberAt(lognormal, 'stdDev')];
    const variance = Math.log1p((stdDev / mean) ** 2);
    const [mu, sigma] = [Math.log(mean) - variance / 2, Math.sqrt(variance)];
    return { lower: Math.exp(mu - Z * sigma), upper: Math.exp(mu + Z * sigma) };
  }
  return null;
}

// Bounds within which the parameter lies for certain.
function boundsOf(entry: Json): Interval {
  for (const kind of ['beta', 'truncatedNormal']) {
    const prior = entry[kind];
    if (!isObject(prior)) continue;
    const at = (key: string, otherwise: number): number => (prior[key] === undefined ? otherwise : numberAt(prior, key));
    const open = kind === 'beta' ? 0 : Infinity;
    return { lower: at('lower', -open), upper: at('upper', open) };
  }
  const gamma = entry['gamma'];
  return { lower: isObject(gamma) ? numberAt(gamma, 'shift') : -Infinity, upper: Infinity };
}

// Rates of what drifts and densities of process noise that are estimated: all logarithms between
// two bounds are equally likely.
function fromBounds(problem: Json | null, name: string): Interval | null {
  const list = (key: string): Json[] => {
    const entries = problem?.[key];
    return Array.isArray(entries) ? entries.filter(isObject) : [];
  };
  const drifting = list('uncertain').find((each) => `${String(each['name'])}.drift` === name)?.['drift'];
  const walk = isObject(drifting) ? drifting['randomWalk'] : list('processNoise').find((each) => `processNoise.${String(each['state'])}` === name);
  if (!isObject(walk)) return null;
  const [lower, upper] = [Math.log(numberAt(walk, 'lower')), Math.log(numberAt(walk, 'upper'))];
  return { lower: Math.exp(lower + 0.025 * (upper - lower)), upper: Math.exp(upper - 0.025 * (upper - lower)) };
}

const isFinite = (interval: Interval | null): interval is Interval =>
  interval !== null && Number.isFinite(interval.lower) && Number.isFinite(interval.upper) && interval.upper > interval.lower;

export function priorInterval(problem: Json | null, parameter: Parameter): Interval {
  const uncertain = problem?.['uncertain'];
  const own = parameter.name.replace(/\[\d+\]$/, '');  // "x_0[1]" is x_0 of run 1
  const entry = Array.isArray(uncertain)
    ? uncertain.find((each: unknown): each is Json => isObject(each) && each['name'] === own)
    : undefined;
  const exact = entry ? fromPrior(entry) : fromBounds(problem, parameter.name);
  if (isFinite(exact)) return exact;
  const bounds = entry ? boundsOf(entry) : { lower: -Infinity, upper: Infinity };
  const { priorMean, priorStdDev } = parameter;
  return {
    lower: Math.max(bounds.lower, priorMean - Z * priorStdDev),
    upper: Math.min(bounds.upper, priorMean + Z * priorStdDev),
  };
}
