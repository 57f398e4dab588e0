// Two sessions side by side: do they agree?

import type { Parameter } from '../api/messages';
import { SessionMonitor } from '../state/session_monitor';
import { type Comparison, compare } from '../text/comparison';
import { measured, withUnit } from '../text/number';
import { shownOf } from '../text/shown';
import { type View, h, setText } from './dom';
import { whiskers } from './whiskers';

const INTERVAL_MS = 500;

function estimateText(parameter: Parameter | null): string {
  if (!parameter) return '–';
  const shown = shownOf(parameter);
  const { value, deviation, power } = measured(shown.value, shown.deviation);
  return withUnit(`${value} ± ${deviation}${power}`, parameter.unit);
}

const row = ({ name, first, second, words, tone }: Comparison): HTMLElement =>
  h('tr', {},
    h('th', { scope: 'row' }, name),
    h('td', {}, estimateText(first)), h('td', {}, estimateText(second)),
    h('td.picture', {}, whiskers([first, second]) as unknown as Node),
    h(`td.words.${tone}`, {}, words));

export class ComparisonView implements View {
  readonly element: HTMLElement;
  private readonly other: SessionMonitor;
  private readonly body = h('tbody');
  private readonly note = h('p.note', {}, 'The other session is being read.');
  private drawn = 0;
  private timer: ReturnType<typeof setTimeout> | null = null;
  private first: readonly Parameter[] = [];

  constructor(id: string, otherId: string, onClose: () => void) {
    this.other = new SessionMonitor(otherId, { onChange: () => this.request() });
    this.element = h('section.card.comparison', { 'aria-label': `Comparison of ${id} and ${otherId}` },
      h('div.card-head', {},
        h('h2', {}, `${id} compared with ${otherId}`),
        h('button', { type: 'button', onclick: onClose }, 'End comparison')),
      h('div.table-scroll', { tabindex: '0', role: 'group', 'aria-label': 'Table of the comparison' },
        h('table', {},
          h('thead', {}, h('tr', {},
            h('th', { scope: 'col' }, 'Parameter'), h('th.first', { scope: 'col' }, id),
            h('th.second', { scope: 'col' }, otherId), h('th', { scope: 'col' }, '95 % intervals'),
            h('th', { scope: 'col' }, 'In words'))),
          this.body)),
      this.note);
    this.other.start();
  }

  update(parameters: readonly Parameter[]): void {
    this.first = parameters;
    this.request();
  }

  dispose(): void {
    this.other.stop();
    if (this.timer !== null) clearTimeout(this.timer);
  }

  private request(): void {
    if (this.timer !== null) return;
    this.timer = setTimeout(() => {
      this.timer = null;
      this.draw();
    }, Math.max(0, this.drawn + INTERVAL_MS - performance.now()));
  }

  private draw(): void {
    this.drawn = performance.now();
    const { estimate, connection, id } = this.other;
    setText(this.note, this.state(connection.kind, estimate !== null, id));
    if (estimate) this.body.replaceChildren(...compare(this.first, estimate.parameters).map(row));
  }

  private state(kind: SessionMonitor['connection']['kind'], hasEstimate: boolean, id: string): string {
    switch (kind) {
      case 'gone': return `There is no session ${id} (any more).`;
      case 'lost': return `The stream of ${id} is lost; trying again.`;
      case 'token': case 'refused': return `The token may not see ${id}.`;
      case 'connecting': return 'The other session is being read.';
      case 'open': return hasEstimate ? '' : `${id} has no estimate yet.`;
    }
  }
}
