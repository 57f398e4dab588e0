// What only the printed page has: where and when it was made, and the problem.

import type { Estimate, Session } from '../api/messages';
import { recordTime, whole } from '../text/number';
import { problemText } from '../text/problem';
import { type View, card, h, setShown, setText } from './dom';
import { facts } from './facts';
import { PRINT_EVENT } from './printing';

export interface Printed {
  session: Session | null;
  estimate: Estimate | null;
  version: string;  // of the daemon; empty while it is not known
}

export class PrintSheet implements View {
  readonly element: HTMLElement;  // stands at the top
  readonly problem: HTMLElement;  // stands at the end
  private readonly facts = facts();
  private readonly text = h('pre.problem');
  private readonly onPrint = (): void => this.fill();

  constructor(private readonly printed: () => Printed) {
    this.element = h('section.paper', {}, h('p.kind', {}, 'polyest: report of a session'), this.facts.element);
    this.problem = card('Problem', this.text);
    this.problem.classList.add('paper');
    document.addEventListener(PRINT_EVENT, this.onPrint);
  }

  dispose(): void {
    document.removeEventListener(PRINT_EVENT, this.onPrint);
  }

  private fill(): void {
    const { session, estimate, version } = this.printed();
    const created = session?.createTime ? new Date(session.createTime) : null;
    this.facts.set([
      { label: 'Printed', explanation: '', text: clock(new Date()) },
      { label: 'Session created', explanation: '', text: created ? clock(created) : '–' },
      { label: 'Last sample', explanation: '', text: estimate ? `t = ${recordTime(estimate.time)}` : '–' },
      { label: 'Samples', explanation: '', text: estimate ? whole(estimate.samples) : '–' },
      { label: 'Daemon', explanation: '', text: version === '' ? '–' : `polyestd ${version}` },
      { label: 'Address', explanation: '', text: `${location.host}${location.pathname}${location.hash}` },
    ]);
    setText(this.text, session?.problem ? problemText(session.problem) : '');
    setShown(this.problem, Boolean(session?.problem));
  }
}

// Date and time with the zone, in an order that no country reads differently.
function clock(at: Date): string {
  const two = (value: number): string => String(value).padStart(2, '0');
  const minutes = -at.getTimezoneOffset();
  const zone = `UTC${minutes < 0 ? '−' : '+'}${two(Math.floor(Math.abs(minutes) / 60))}:${two(Math.abs(minutes) % 60)}`;
  return `${at.getFullYear()}-${two(at.getMonth() + 1)}-${two(at.getDate())} ${two(at.getHours())}:${two(at.getMinutes())} ${zone}`;
}
