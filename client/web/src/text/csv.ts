// Estimates as comma-separated values (RFC 4180), with all digits.

import type { Estimate, HistoryPoint } from '../api/messages';

const unitText = (unit: string): string => (unit === '1' ? '' : unit);

// A spreadsheet would compute a text that begins like a formula.
function cell(value: string | number): string {
  if (typeof value === 'number') return Number.isFinite(value) ? String(value) : '';
  const text = /^[=+\-@\t\r]/.test(value) ? `'${value}` : value;
  return /[",\r\n]/.test(text) ? `"${text.replace(/"/g, '""')}"` : text;
}

const table = (rows: readonly (string | number)[][]): string =>
  rows.map((row) => `${row.map(cell).join(',')}\r\n`).join('');

export function estimateCsv(estimate: Estimate): string {
  const head = ['parameter', 'unit', 'estimate', 'std_dev', 'mean', 'posterior_std_dev', 'lower95', 'upper95', 'prior_mean', 'prior_std_dev', 'verdict', 'time_s', 'samples'];
  const rows = estimate.parameters.map((p) => [
    p.name, unitText(p.unit), p.map, p.stdDev, p.mean, p.posteriorStdDev, p.lower95, p.upper95, p.priorMean, p.priorStdDev, p.verdict,
    estimate.time, estimate.samples,
  ]);
  return table([head, ...rows]);
}

// One row for each estimate kept; a parameter that an estimate lacks leaves its cells empty.
export function historyCsv(points: readonly HistoryPoint[], units: ReadonlyMap<string, string>): string {
  const names = [...new Set(points.flatMap(({ parameters }) => parameters.map(({ name }) => name)))];
  const title = (name: string, what: string): string => {
    const unit = unitText(units.get(name) ?? '');
    return unit === '' ? `${name} ${what}` : `${name} ${what} [${unit}]`;
  };
  const head = ['time [s]', 'samples', 'batch', ...names.flatMap((name) =>
    [title(name, 'mean'), title(name, 'sd'), title(name, 'lower95'), title(name, 'upper95')])];
  const rows = points.map((point): (string | number)[] => {
    const byName = new Map(point.parameters.map((each) => [each.name, each]));
    return [point.time, point.samples, point.sequence, ...names.flatMap((name): (string | number)[] => {
      const each = byName.get(name);
      return each ? [each.mean, each.stdDev, each.lower95, each.upper95] : ['', '', '', ''];
    })];
  });
  return table([head, ...rows]);
}
