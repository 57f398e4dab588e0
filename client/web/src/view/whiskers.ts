// Two estimates of one parameter as dots with their 95 % intervals, on one scale.

import type { Parameter } from '../api/messages';
import { shownOf } from '../text/shown';

const NS = 'http://www.w3.org/2000/svg';
const WIDTH = 240;
const ROW = 16;

function svg(name: string, attributes: Record<string, string | number>): SVGElement {
  const element = document.createElementNS(NS, name);
  for (const [key, value] of Object.entries(attributes)) element.setAttribute(key, String(value));
  return element;
}

export function whiskers(parameters: readonly (Parameter | null)[]): SVGElement {
  const ends = parameters.flatMap((each) => (each ? [each.lower95, each.upper95, shownOf(each).value] : [])).filter(Number.isFinite);
  const picture = svg('svg', { viewBox: `0 0 ${WIDTH} ${ROW * parameters.length}`, class: 'whiskers', 'aria-hidden': 'true' });
  if (ends.length === 0) return picture;
  const [low, high] = [Math.min(...ends), Math.max(...ends)];
  const scale = high > low ? (WIDTH - 16) / (high - low) : 0;
  const at = (value: number): number => (scale > 0 ? 8 + (value - low) * scale : WIDTH / 2);
  parameters.forEach((each, i) => {
    if (!each || ![each.lower95, each.upper95, shownOf(each).value].every(Number.isFinite)) return;
    const y = ROW * (i + 0.5);
    const which = i === 0 ? 'first' : 'second';
    picture.append(
      svg('line', { x1: at(each.lower95), x2: at(each.upper95), y1: y, y2: y, class: which }),
      svg('circle', { cx: at(shownOf(each).value), cy: y, r: 5, class: which }));
  });
  return picture;
}
