// Messages for tests, as JSON of the daemon and as the page reads them.

import { readFileSync } from 'node:fs';

import { type Estimate, type HistoryPoint, type Parameter, readEstimate } from '../../src/api/messages';

// Recorded from polyestd: client/examples/oscillator.
export const recording = JSON.parse(
  readFileSync(new URL('../fake/recording.json', import.meta.url), 'utf8')) as Record<string, never>;

export function parameter(name: string, changes: Partial<Parameter> = {}): Parameter {
  return {
    name, unit: 'N/m', map: 10, stdDev: 1, mean: 10, posteriorStdDev: 1.01, lower95: 8, upper95: 12, priorMean: 9, priorStdDev: 5,
    contraction: 0.2, verdict: 'IDENTIFIED', ...changes,
  };
}

export function estimate(changes: Partial<Estimate> = {}): Estimate {
  return { ...readEstimate({}), parameters: [parameter('k')], ...changes };
}

// A point of the history as the daemon keeps it of an estimate.
export const pointOf = (of: Estimate): HistoryPoint => ({
  time: of.time, samples: of.samples, sequence: of.sequence, parameters: of.parameters,
  warnings: of.diagnostics.map(({ code }) => code), reexpansions: of.expansion.reexpansions,
});
