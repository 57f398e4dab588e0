// Says in words which parameters the data cannot tell apart.

import type { Direction, Estimate, TradeOff } from '../api/messages';
import { significant } from './number';

export interface Sentence {
  text: string;
  weight: 'good' | 'weak' | 'bad';
}

// Coefficients of a direction below this share of its largest one are not mentioned.
const SMALL = 0.15;
const MAX_SENTENCES = 8;
const STRONG = 0.9;

const percent = (ratio: number): string => `${significant(100 * ratio, 2)} %`;

const ofTradeOff = (tradeOff: TradeOff): Sentence => ({
  text: `${tradeOff.combination} is known to ${percent(tradeOff.relativeStdDev)}, but alone ` +
    `${tradeOff.first} only to ${percent(tradeOff.firstAlone)} and ` +
    `${tradeOff.second} only to ${percent(tradeOff.secondAlone)}.`,
  weight: 'bad',
});

function list(names: readonly string[]): string {
  if (names.length < 2) return names.join('');
  return `${names.slice(0, -1).join(', ')} and ${names[names.length - 1]}`;
}

// The coefficients that matter, the largest first.
function largeParts({ coefficients }: Direction): Direction['coefficients'] {
  const largest = Math.max(...coefficients.map(({ value }) => Math.abs(value)), 0);
  return coefficients.filter(({ value }) => Math.abs(value) >= SMALL * largest)
    .sort((a, b) => Math.abs(b.value) - Math.abs(a.value));
}

// What moves along a direction: "k and m rise together", "k rises while c falls".
function motion(direction: Direction): { subject: string; isSingle: boolean } {
  const parts = largeParts(direction);
  const sign = Math.sign(parts[0]?.value ?? 1);
  const rising = parts.filter(({ value }) => value * sign > 0).map(({ parameter }) => parameter);
  const falling = parts.filter(({ value }) => value * sign < 0).map(({ parameter }) => parameter);
  const rise = `${list(rising)} ${rising.length > 1 ? 'rise together' : 'rises'}`;
  const fall = `${list(falling)} ${falling.length > 1 ? 'fall' : 'falls'}`;
  return { subject: falling.length > 0 ? `${rise} while ${fall}` : rise, isSingle: parts.length < 2 };
}

function ofDirection(direction: Direction): Sentence | null {
  if (direction.verdict === 'IDENTIFIED' || direction.coefficients.length === 0) return null;
  const { subject, isSingle } = motion(direction);
  const change = direction.verdict === 'NOT_IDENTIFIED' ? 'hardly change' : 'change only a little';
  const name = direction.coefficients.reduce((a, b) => (Math.abs(b.value) > Math.abs(a.value) ? b : a)).parameter;
  const text = isSingle
    ? `The measurements ${change} with ${name}.`
    : `If ${subject}, the measurements ${change}: the data cannot tell these apart.`;
  return { text, weight: direction.verdict === 'NOT_IDENTIFIED' ? 'bad' : 'weak' };
}

// Pairs whose errors go together, but for those of which a direction has said so already.
function correlations(estimate: Estimate): Sentence[] {
  const said = estimate.directions.filter(({ verdict }) => verdict !== 'IDENTIFIED')
    .map((direction) => new Set(largeParts(direction).map(({ parameter }) => parameter)));
  const { parameters, covariance } = estimate;
  const n = parameters.length;
  const sentences: Sentence[] = [];
  if (covariance.length !== n * n) return sentences;
  const at = (i: number, j: number): number => covariance[i * n + j] as number;
  for (let i = 0; i < n; ++i) {
    for (let j = i + 1; j < n; ++j) {
      const r = at(i, j) / Math.sqrt(at(i, i) * at(j, j));
      if (!(Math.abs(r) >= STRONG)) continue;
      const [a, b] = [parameters[i]?.name, parameters[j]?.name];
      if (said.some((names) => names.has(a ?? '') && names.has(b ?? ''))) continue;
      const way = r > 0 ? 'too large as well' : 'too small';
      sentences.push({ text: `If ${a} is too large, ${b} is ${way} (correlation ${significant(r, 2)}).`, weight: 'weak' });
    }
  }
  return sentences;
}

// Never empty: where nothing trades off, one sentence says so.
export function tradeOffSentences(estimate: Estimate): Sentence[] {
  const directions = [...estimate.directions].reverse().map(ofDirection);
  const sentences = [
    ...estimate.tradeOffs.map(ofTradeOff),
    ...directions.filter((sentence): sentence is Sentence => sentence !== null),
    ...correlations(estimate),
  ].slice(0, MAX_SENTENCES);
  if (sentences.length > 0) return sentences;
  return [{
    text: estimate.parameters.length > 1
      ? 'The data determine every combination of the parameters: none makes up for another.'
      : 'There is one parameter only: nothing can trade off.',
    weight: 'good',
  }];
}
