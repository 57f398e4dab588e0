// Cuts the newest seconds out of a prediction of the whole record.

import type { PredictedOutput, Prediction } from '../api/messages';

export interface SignalWindow {
  time: number[];
  measured: (number | null)[];
  mean: (number | null)[];
  modelLower: (number | null)[];   // 95 % of the model
  modelUpper: (number | null)[];
  sampleLower: (number | null)[];  // 95 % of new samples; empty where the noise is not known
  sampleUpper: (number | null)[];
  residual: (number | null)[];     // in σ, or in the output's unit where σ is not known
  isStandardized: boolean;
}

const finite = (value: number | undefined): number | null =>
  value !== undefined && Number.isFinite(value) ? value : null;

// The first row of the last run.
function lastRunStart(prediction: Prediction): number {
  const { run } = prediction;
  if (run.length === 0) return 0;
  return run.indexOf(run[run.length - 1] as number);
}

// Rows at equal steps that a window of a nice length should have.
const ROWS_WANTED = 150;
const NICE = [1, 2, 5];

// Returns a length of the newest part, s, that shows single oscillations and samples; it depends on
// the interval between rows only, so that it does not change while rows come.
export function windowLength(prediction: Prediction): number {
  const start = lastRunStart(prediction);
  const { time } = prediction;
  const count = time.length - start;
  if (count < 2) return 1;
  const span = (time[time.length - 1] as number) - (time[start] as number);
  const wanted = (span / (count - 1)) * ROWS_WANTED;
  if (!(wanted > 0)) return 1;
  const power = 10 ** Math.floor(Math.log10(wanted));
  const nice = NICE.map((each) => each * power).filter((each) => each <= wanted * 1.0001);
  return nice[nice.length - 1] ?? power;
}

// Returns the rows of the last run in its newest `seconds`.
export function signalWindow(prediction: Prediction, output: PredictedOutput, seconds: number): SignalWindow {
  const { time, probabilities } = prediction;
  const runStart = lastRunStart(prediction);
  const from = (time[time.length - 1] ?? 0) - seconds;
  let first = runStart;
  while (first < time.length && (time[first] as number) < from) ++first;
  const width = probabilities.length;
  const column = (values: readonly number[], index: number): (number | null)[] =>
    values.length < time.length * width
      ? []
      : time.slice(first).map((_, i) => finite(values[(first + i) * width + index]));
  const rows = (values: readonly number[]): (number | null)[] => {
    const placed = new Array<number | null>(time.length - first).fill(null);
    output.measuredRows.forEach((row, k) => {
      if (row >= first && row < time.length) placed[row - first] = finite(values[k]);
    });
    return placed;
  };
  const isStandardized = output.standardizedResidual.length > 0;
  return {
    time: time.slice(first),
    measured: rows(output.measured),
    mean: time.slice(first).map((_, i) => finite(output.mean[first + i])),
    modelLower: column(output.quantiles, 0),
    modelUpper: column(output.quantiles, width - 1),
    sampleLower: column(output.sampleQuantiles, 0),
    sampleUpper: column(output.sampleQuantiles, width - 1),
    residual: rows(isStandardized ? output.standardizedResidual : output.residual),
    isStandardized,
  };
}
