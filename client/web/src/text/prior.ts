// The central 95 % of a parameter's prior: from the problem where its form is plain, else from the
// prior's mean and standard deviation.

import type { Json, Parameter } from '../api/messages';

const Z = 1.959964;

export interface Interval {
  lower: number;
  upper: number;
}

// The standard deviation of the logarithm of a population's spread, and its median in the unit that the
// prior gives it.
const SPREAD_DEVIATION = 1;
const SPREAD_MEDIAN = 0.5;

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
    const sigma = deviationOfLogarithm(lognormal);
    return ofLogarithm(Math.log(numberAt(lognormal, 'mean')) - sigma ** 2 / 2, sigma);
  }
  return null;
}

const ofLogarithm = (mu: number, sigma: number): Interval => ({ lower: Math.exp(mu - Z * sigma), upper: Math.exp(mu + Z * sigma) });

const deviationOfLogarithm = (lognormal: Json): number =>
  Math.sqrt(Math.log1p((numberAt(lognormal, 'stdDev') / numberAt(lognormal, 'mean')) ** 2));

// The spread of the runs' values, lognormal: in the unit of the parameter for a normal prior, of its
// logarithm for a lognormal one, and else of normal scores.
function ofSpread(population: Json): Interval {
  const { normal, lognormal } = population;
  let unit = 1;
  if (isObject(normal)) unit = numberAt(normal, 'stdDev');
  else if (isObject(lognormal)) unit = deviationOfLogarithm(lognormal);
  return ofLogarithm(Math.log(SPREAD_MEDIAN * unit), SPREAD_DEVIATION);
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
  const entries = Array.isArray(uncertain) ? uncertain.filter(isObject) : [];
  const named = (name: string): Json | undefined => entries.find((each) => each['name'] === name);
  const ofPopulation = (what: RegExp): Json | undefined => {
    const found = what.test(parameter.name) ? named(parameter.name.replace(what, '')) : undefined;
    return found?.['population'] === true ? found : undefined;
  };
  const spread = ofPopulation(/\.spread$/);
  // The name as it is: "K[1]" may be a parameter, and "x_0[1]" x_0 of run 1. A median has the prior stated.
  const entry = named(parameter.name) ?? named(parameter.name.replace(/\[\d+\]$/, '')) ?? ofPopulation(/\.median$/);
  const exact = entry ? fromPrior(entry) : spread ? ofSpread(spread) : fromBounds(problem, parameter.name);
  if (isFinite(exact)) return exact;
  const bounds = entry ? boundsOf(entry) : { lower: -Infinity, upper: Infinity };
  const { priorMean, priorStdDev } = parameter;
  return {
    lower: Math.max(bounds.lower, priorMean - Z * priorStdDev),
    upper: Math.min(bounds.upper, priorMean + Z * priorStdDev),
  };
}
