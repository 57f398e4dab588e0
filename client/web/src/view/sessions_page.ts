// The list of all sessions, with what each is doing.

import { Code } from '../api/errors';
import type { Session } from '../api/messages';
import { SessionList } from '../state/session_list';
import { STATE_WORDS, stateOf } from '../state/session_state';
import { recordTime, significant, times, whole } from '../text/number';
import { type View, h, setShown, setText } from './dom';
import { term } from './tooltip';
import { addressOf } from './route';
import { TERMS } from '../text/terms';

const PAGE_SIZE = 15;

function created(session: Session): string {
  const date = new Date(session.createTime);
  return Number.isNaN(date.getTime()) ? '–' : date.toLocaleString(undefined, { dateStyle: 'medium', timeStyle: 'short' });
}

function speed({ activity }: Session): string {
  if (!(activity.realTimeFactor > 0)) return '–';
  return activity.realTimeFactor >= 1 ? `${times(activity.realTimeFactor)} ×` : `${significant(activity.realTimeFactor, 2)} ×`;
}

function row(session: Session): HTMLElement {
  const state = stateOf(session);
  const { label, meaning } = STATE_WORDS[state];
  return h('tr', {},
    h('th', { scope: 'row' }, h('a', { href: addressOf(session.id) }, session.id)),
    h('td', {}, h(`span.state.${state}`, { title: meaning }, label)),
    h('td.number', { 'data-label': 'Samples' }, whole(session.sampleCount)),
    h('td.number', { 'data-label': 'Record' }, session.lastSequence > 0 ? recordTime(session.lastTimeS) : '–'),
    h('td.number', { 'data-label': 'Speed' }, speed(session)),
    h('td.number', { 'data-label': 'Batches waiting' }, whole(session.activity.unprocessedBatchCount)),
    h('td', { 'data-label': 'Created' }, created(session)));
}

export class SessionsPage implements View {
  readonly element: HTMLElement;
  private readonly list: SessionList;
  private readonly search = h('input', { type: 'search', id: 'search', autocomplete: 'off', spellcheck: 'false' });
  private readonly summary = h('p.summary', { role: 'status' }, 'The sessions are being read.');
  private readonly trouble = h('p.trouble', { role: 'alert', hidden: true });
  private readonly body = h('tbody');
  private readonly table: HTMLElement;
  private readonly empty = h('div.empty', { hidden: true });
  private readonly range = h('span', { 'aria-live': 'polite' });
  private readonly previous = h('button', { type: 'button' }, 'Previous');
  private readonly next = h('button', { type: 'button' }, 'Next');
  private readonly pages: HTMLElement;
  private page = 0;
  private drawn = '';

  constructor(private readonly onTokenNeeded: (reason: string) => void) {
    this.list = new SessionList(() => this.update());
    this.search.addEventListener('input', () => this.turn(0));
    this.previous.addEventListener('click', () => this.turn(this.page - 1));
    this.next.addEventListener('click', () => this.turn(this.page + 1));
    this.table = h('table.sessions', {},
      h('thead', {}, h('tr', {},
        h('th', { scope: 'col' }, 'Session'), h('th', { scope: 'col' }, 'State'),
        h('th.number', { scope: 'col' }, 'Samples'), h('th.number', { scope: 'col' }, 'Record'),
        h('th.number', { scope: 'col' }, term('Speed', TERMS.realTime)),
        h('th.number', { scope: 'col' }, term('Batches waiting', TERMS.unprocessed)),
        h('th', { scope: 'col' }, 'Created'))),
      this.body);
    this.pages = h('nav.pages', { 'aria-label': 'Pages of the list' }, this.previous, this.range, this.next);
    this.element = h('section.card.list', {},
      h('div.card-head', {}, h('h1', {}, 'Sessions'),
        h('div.search', {}, h('label', { for: 'search' }, 'Search'), this.search)),
      this.summary, this.trouble, this.table, this.empty, this.pages);
    this.table.hidden = this.pages.hidden = true;
    this.list.start();
  }

  dispose(): void {
    this.list.stop();
  }

  private turn(page: number): void {
    this.page = page;
    this.update();
  }

  private update(): void {
    const { error, sessions } = this.list;
    if (error && (error.code === Code.UNAUTHENTICATED)) {
      this.onTokenNeeded(error.message);
      return;
    }
    setText(this.trouble, error ? `The list cannot be read now: ${error.message}. Trying again.` : '');
    setShown(this.trouble, error !== null);
    if (sessions) this.show(sessions);
    else if (error) setText(this.summary, '');
  }

  private show(sessions: readonly Session[]): void {
    const words = this.search.value.toLowerCase().split(/\s+/).filter((word) => word !== '');
    // Those that measure come first: they are what is looked for.
    const isActive = (session: Session): number => Number(session.activity.hasWriter);
    const ordered = [...sessions].sort((a, b) => isActive(b) - isActive(a));
    const found = ordered.filter((session) => {
      const text = `${session.id} ${STATE_WORDS[stateOf(session)].label}`.toLowerCase();
      return words.every((word) => text.includes(word));
    });
    this.page = Math.max(0, Math.min(this.page, Math.ceil(found.length / PAGE_SIZE) - 1));
    const shown = found.slice(this.page * PAGE_SIZE, (this.page + 1) * PAGE_SIZE);
    this.summarize(sessions, found.length);
    this.drawRows(shown);
    this.table.hidden = found.length === 0;
    this.pages.hidden = found.length <= PAGE_SIZE;
    this.previous.disabled = this.page === 0;
    this.next.disabled = (this.page + 1) * PAGE_SIZE >= found.length;
    const first = this.page * PAGE_SIZE + 1;
    setText(this.range, `${first}–${first + shown.length - 1} of ${whole(found.length)}`);
  }

  private summarize(sessions: readonly Session[], found: number): void {
    const measuring = sessions.filter((session) => session.activity.hasWriter).length;
    const count = `${whole(sessions.length)} ${sessions.length === 1 ? 'session' : 'sessions'}`;
    const cut = this.list.isCut ? ' or more; the first are listed' : '';
    setText(this.summary, sessions.length === 0 ? '' : `${count}${cut}, ${measuring === 0 ? 'none' : whole(measuring)} measuring now.`);
    setShown(this.empty, found === 0);
    if (found > 0) return;
    this.empty.replaceChildren(...(sessions.length > 0
      ? [h('p', {}, 'No session has this name or state.')]
      : [h('p', {}, 'There are no sessions yet. One begins with the first measurements:'),
         h('pre', {}, 'polyest stream problem.json data.csv --server HOST:PORT --session monday')]));
  }

  // Rows that have not changed stay, so that neither focus nor selection is lost.
  private drawRows(shown: readonly Session[]): void {
    const key = JSON.stringify(shown.map((session) => ({ ...session, activity: { ...session.activity, idleTimeS: 0 } })));
    if (key === this.drawn) return;
    this.drawn = key;
    const focused = this.body.contains(document.activeElement) ? document.activeElement?.textContent : null;
    this.body.replaceChildren(...shown.map(row));
    if (focused === null || focused === undefined) return;
    [...this.body.querySelectorAll('a')].find((link) => link.textContent === focused)?.focus();
  }
}
