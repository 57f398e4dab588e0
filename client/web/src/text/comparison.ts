// Says in words whether two sessions agree about their parameters.

import type { Parameter } from '../api/messages';
import { significant } from './number';
import { shownOf } from './shown';

export interface Comparison {
  name: string;
  first: Parameter | null;
  second: Parameter | null;
  words: string;
  tone: 'good' | 'weak' | 'bad' | 'none';
}

// Standard deviations of the difference up to which chance explains it, and up to which it still may.
const LIKELY = 2;
const POSSIBLE = 3;

function judge(first: Parameter, second: Parameter): Pick<Comparison, 'words' | 'tone'> {
  if (first.unit !== second.unit) return { words: 'Their units differ.', tone: 'none' };
  if (first.verdict === 'NOT_IDENTIFIED' || second.verdict === 'NOT_IDENTIFIED') {
    return { words: 'Not determined in both.', tone: 'none' };
  }
  const [a, b] = [shownOf(first), shownOf(second)];
  const ratio = Math.abs(a.value - b.value) / Math.hypot(a.deviation, b.deviation);
  if (Number.isNaN(ratio)) return { words: 'Cannot be compared.', tone: 'none' };
  const size = `${significant(ratio, 2)} standard deviations apart`;
  if (ratio <= LIKELY) return { words: `They agree: ${size}.`, tone: 'good' };
  if (ratio <= POSSIBLE) return { words: `They may differ: ${size}, seldom by chance.`, tone: 'weak' };
  return { words: `They differ: ${size}.`, tone: 'bad' };
}

// Compares parameters of the same name, in the order of the first session; then those of the second
// alone.
export function compare(first: readonly Parameter[], second: readonly Parameter[]): Comparison[] {
  const byName = new Map(second.map((parameter) => [parameter.name, parameter]));
  const pairs = first.map((parameter): Comparison => {
    const other = byName.get(parameter.name) ?? null;
    const judged = other ? judge(parameter, other) : { words: 'In the first only.', tone: 'none' as const };
    return { name: parameter.name, first: parameter, second: other, ...judged };
  });
  const names = new Set(first.map(({ name }) => name));
  const alone = second.filter(({ name }) => !names.has(name))
    .map((parameter): Comparison => ({ name: parameter.name, first: null, second: parameter, words: 'In the second only.', tone: 'none' }));
  return [...pairs, ...alone];
}
