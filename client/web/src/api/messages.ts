// The daemon's messages as the page uses them, read from their JSON: proto/polyest/v1 describes
// every field. JSON leaves out default values, writes 64-bit integers as strings, and numbers that
// are not finite as "NaN" or "Infinity".

export type Json = { [key: string]: unknown };

export type Verdict = 'IDENTIFIED' | 'WEAK' | 'NOT_IDENTIFIED' | 'UNKNOWN';

export interface Parameter {
  name: string;
  unit: string;
  map: number;
  stdDev: number;
  mean: number;
  lower95: number;
  upper95: number;
  posteriorStdDev: number;
  priorMean: number;
  priorStdDev: number;
  contraction: number;
  verdict: Verdict;
}

export interface Channel {
  output: string;
  samples: number;
  chiSquared: number;
  noiseStdDev: number;
  lag1Correlation: number;
  effectiveSamples: number;
  outliers: number;
}

export interface Direction {
  information: number;
  coefficients: { parameter: string; value: number }[];
  verdict: Verdict;
}

export interface TradeOff {
  first: string;
  second: string;
  combination: string;
  relativeStdDev: number;
  firstAlone: number;
  secondAlone: number;
}

export interface Diagnostic {
  code: string;
  message: string;
}

export interface Expansion {
  order: number;
  terms: number;
  points: number;
  residualToNoise: number;
  reexpansions: number;
  trajectories: number;
}

export interface Estimate {
  parameters: Parameter[];
  covariance: number[];
  channels: Channel[];
  directions: Direction[];
  tradeOffs: TradeOff[];
  diagnostics: Diagnostic[];
  expansion: Expansion;
  filtered: { name: string; unit: string; mean: number; stdDev: number }[];
  time: number;
  samples: number;
  sequence: number;
}

export interface HistoryPoint {
  time: number;
  samples: number;
  sequence: number;
  parameters: { name: string; mean: number; stdDev: number; lower95: number; upper95: number; verdict: Verdict }[];
  warnings: string[];  // codes of diagnostics, each once
  reexpansions: number;
}

export interface Activity {
  loaded: boolean;
  hasWriter: boolean;
  watcherCount: number;
  batchCount: number;
  estimateCount: number;
  computeTimeS: number;
  realTimeFactor: number;
  idleTimeS: number;
  unprocessedBatchCount: number;
}

export interface Session {
  name: string;  // sessions/{id}
  id: string;
  createTime: string;
  lastSequence: number;
  sampleCount: number;
  lastTimeS: number;
  lastRun: number;
  problem: Json | null;  // left out in lists
  activity: Activity;
}

export interface DaemonStatus {
  version: string;
  durable: boolean;
  sessionCount: number;
  waitingTaskCount: number;
  uptimeS: number;
  memoryBytes: number;
}

export interface PredictedOutput {
  output: string;
  unit: string;
  mean: number[];
  quantiles: number[];        // row-major, times × probabilities
  sampleQuantiles: number[];  // likewise; empty where there is no noise to add
  measuredRows: number[];
  measured: number[];
  residual: number[];
  standardizedResidual: number[];
  score: { sampleCount: number; coverage95: number; rootMeanSquare: number; autocorrelation: number[] } | null;
}

export interface Prediction {
  run: number[];
  time: number[];
  probabilities: number[];
  outputs: PredictedOutput[];
  drawCount: number;
  rowCount: number;
  sequence: number;
  diagnostics: Diagnostic[];
}

export interface Posterior {
  parameters: { name: string; unit: string; mean: number; quantiles: number[]; value: number[]; density: number[] }[];
  joints: { first: string; second: string; firstValue: number[]; secondValue: number[]; density: number[] }[];
  drawCount: number;
  effectiveSampleSize: number;
  time: number;
  sequence: number;
  diagnostics: Diagnostic[];
}

const asObject = (value: unknown): Json =>
  typeof value === 'object' && value !== null && !Array.isArray(value) ? (value as Json) : {};
const asList = (value: unknown): unknown[] => (Array.isArray(value) ? value : []);
const asText = (value: unknown): string => (typeof value === 'string' ? value : '');

// A number that is left out is 0; one that cannot be read is NaN, which the page shows as a dash.
function asNumber(value: unknown): number {
  if (value === undefined || value === null) return 0;
  return typeof value === 'number' ? value : Number(value);
}

const asNumbers = (value: unknown): number[] => asList(value).map(asNumber);

function asVerdict(value: unknown): Verdict {
  return value === 'IDENTIFIED' || value === 'WEAK' || value === 'NOT_IDENTIFIED' ? value : 'UNKNOWN';
}

function readParameter(value: unknown): Parameter {
  const json = asObject(value);
  return {
    name: asText(json['name']),
    unit: asText(json['unit']),
    map: asNumber(json['map']),
    stdDev: asNumber(json['stdDev']),
    mean: asNumber(json['mean']),
    lower95: asNumber(json['lower95']),
    upper95: asNumber(json['upper95']),
    posteriorStdDev: asNumber(json['posteriorStdDev']),
    priorMean: asNumber(json['priorMean']),
    priorStdDev: asNumber(json['priorStdDev']),
    contraction: asNumber(json['contraction']),
    verdict: asVerdict(json['verdict']),
  };
}

function readChannel(value: unknown): Channel {
  const json = asObject(value);
  return {
    output: asText(json['output']),
    samples: asNumber(json['samples']),
    chiSquared: asNumber(json['chiSquared']),
    noiseStdDev: asNumber(json['noiseStdDev']),
    lag1Correlation: asNumber(json['lag1Correlation']),
    effectiveSamples: asNumber(json['effectiveSamples']),
    outliers: asNumber(json['outliers']),
  };
}

function readDirection(value: unknown): Direction {
  const json = asObject(value);
  const coefficients = asList(json['coefficients']).map((entry) => {
    const coefficient = asObject(entry);
    return { parameter: asText(coefficient['parameter']), value: asNumber(coefficient['value']) };
  });
  return { information: asNumber(json['information']), coefficients, verdict: asVerdict(json['verdict']) };
}

function readTradeOff(value: unknown): TradeOff {
  const json = asObject(value);
  return {
    first: asText(json['first']),
    second: asText(json['second']),
    combination: asText(json['combination']),
    relativeStdDev: asNumber(json['relativeStdDev']),
    firstAlone: asNumber(json['firstAlone']),
    secondAlone: asNumber(json['secondAlone']),
  };
}

const readDiagnostics = (value: unknown): Diagnostic[] =>
  asList(value).map((entry) => {
    const json = asObject(entry);
    return { code: asText(json['code']), message: asText(json['message']) };
  });

export function readEstimate(value: unknown): Estimate {
  const json = asObject(value);
  const expansion = asObject(json['expansion']);
  return {
    parameters: asList(json['parameters']).map(readParameter),
    covariance: asNumbers(json['covariance']),
    channels: asList(json['channels']).map(readChannel),
    directions: asList(json['directions']).map(readDirection),
    tradeOffs: asList(json['tradeOffs']).map(readTradeOff),
    diagnostics: readDiagnostics(json['diagnostics']),
    expansion: {
      order: asNumber(expansion['order']),
      terms: asNumber(expansion['terms']),
      points: asNumber(expansion['points']),
      residualToNoise: asNumber(expansion['residualToNoise']),
      reexpansions: asNumber(expansion['reexpansions']),
      trajectories: asNumber(expansion['trajectories']),
    },
    filtered: asList(json['filtered']).map(readParameter),
    time: asNumber(json['time']),
    samples: asNumber(json['samples']),
    sequence: asNumber(json['sequence']),
  };
}

function readHistoryPoint(value: unknown): HistoryPoint {
  const json = asObject(value);
  const parameters = asList(json['parameters']).map((entry) => {
    const { name, mean, stdDev, lower95, upper95, verdict } = readParameter(entry);
    return { name, mean, stdDev, lower95, upper95, verdict };
  });
  return {
    time: asNumber(json['timeS']),
    samples: asNumber(json['sampleCount']),
    sequence: asNumber(json['sequence']),
    parameters,
    warnings: asList(json['warnings']).map(asText),
    reexpansions: asNumber(json['reexpansionCount']),
  };
}

// Reads a GetHistoryResponse.
export const readHistory = (value: unknown): HistoryPoint[] =>
  asList(asObject(asObject(value)['history'])['points']).map(readHistoryPoint);

export function readSession(value: unknown): Session {
  const json = asObject(value);
  const activity = asObject(json['activity']);
  const name = asText(json['name']);
  return {
    name,
    id: name.replace(/^sessions\//, ''),
    createTime: asText(json['createTime']),
    lastSequence: asNumber(json['lastSequence']),
    sampleCount: asNumber(json['sampleCount']),
    lastTimeS: asNumber(json['lastTimeS']),
    lastRun: asNumber(json['lastRun']),
    problem: json['problem'] === undefined ? null : asObject(json['problem']),
    activity: {
      loaded: activity['loaded'] === true,
      hasWriter: activity['hasWriter'] === true,
      watcherCount: asNumber(activity['watcherCount']),
      batchCount: asNumber(activity['batchCount']),
      estimateCount: asNumber(activity['estimateCount']),
      computeTimeS: asNumber(activity['computeTimeS']),
      realTimeFactor: asNumber(activity['realTimeFactor']),
      idleTimeS: asNumber(activity['idleTimeS']),
      unprocessedBatchCount: asNumber(activity['unprocessedBatchCount']),
    },
  };
}

// Reads a ListSessionsResponse.
export function readSessionPage(value: unknown): { sessions: Session[]; nextPageToken: string } {
  const json = asObject(value);
  return { sessions: asList(json['sessions']).map(readSession), nextPageToken: asText(json['nextPageToken']) };
}

export function readDaemonStatus(value: unknown): DaemonStatus {
  const json = asObject(value);
  return {
    version: asText(json['version']),
    durable: json['durable'] === true,
    sessionCount: asNumber(json['sessionCount']),
    waitingTaskCount: asNumber(json['waitingTaskCount']),
    uptimeS: asNumber(json['uptimeS']),
    memoryBytes: asNumber(json['memoryBytes']),
  };
}

function readPredictedOutput(value: unknown): PredictedOutput {
  const json = asObject(value);
  const score = json['score'] === undefined ? null : asObject(json['score']);
  return {
    output: asText(json['output']),
    unit: asText(json['unit']),
    mean: asNumbers(json['mean']),
    quantiles: asNumbers(json['quantiles']),
    sampleQuantiles: asNumbers(json['sampleQuantiles']),
    measuredRows: asNumbers(json['measuredRows']),
    measured: asNumbers(json['measured']),
    residual: asNumbers(json['residual']),
    standardizedResidual: asNumbers(json['standardizedResidual']),
    score: score && {
      sampleCount: asNumber(score['sampleCount']),
      coverage95: asNumber(score['coverage95']),
      rootMeanSquare: asNumber(score['rootMeanSquare']),
      autocorrelation: asNumbers(score['autocorrelation']),
    },
  };
}

export function readPrediction(value: unknown): Prediction {
  const json = asObject(value);
  return {
    run: asNumbers(json['run']),
    time: asNumbers(json['timeS']),
    probabilities: asNumbers(json['probabilities']),
    outputs: asList(json['outputs']).map(readPredictedOutput),
    drawCount: asNumber(json['drawCount']),
    rowCount: asNumber(json['rowCount']),
    sequence: asNumber(json['sequence']),
    diagnostics: readDiagnostics(json['diagnostics']),
  };
}

export function readPosterior(value: unknown): Posterior {
  const json = asObject(value);
  return {
    parameters: asList(json['parameters']).map((entry) => {
      const marginal = asObject(entry);
      return {
        name: asText(marginal['name']),
        unit: asText(marginal['unit']),
        mean: asNumber(marginal['mean']),
        quantiles: asNumbers(marginal['quantiles']),
        value: asNumbers(marginal['value']),
        density: asNumbers(marginal['density']),
      };
    }),
    joints: asList(json['joints']).map((entry) => {
      const joint = asObject(entry);
      return {
        first: asText(joint['first']),
        second: asText(joint['second']),
        firstValue: asNumbers(joint['firstValue']),
        secondValue: asNumbers(joint['secondValue']),
        density: asNumbers(joint['density']),
      };
    }),
    drawCount: asNumber(json['drawCount']),
    effectiveSampleSize: asNumber(json['effectiveSampleSize']),
    time: asNumber(json['timeS']),
    sequence: asNumber(json['sequence']),
    diagnostics: readDiagnostics(json['diagnostics']),
  };
}

// Reads one WatchSessionResponse that has an estimate; null for one that has none.
export function readWatchEvent(value: unknown): Estimate | null {
  const json = asObject(value);
  return json['estimate'] === undefined ? null : readEstimate(json['estimate']);
}
