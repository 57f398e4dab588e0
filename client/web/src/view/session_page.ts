// One session, live.

import { SessionMonitor } from '../state/session_monitor';
import { isBehind } from '../state/session_state';
import { explain } from '../text/diagnostics';
import { recordTime, whole } from '../text/number';
import { priorInterval } from '../text/prior';
import { type Status, statusOf } from '../text/status';
import { TERMS } from '../text/terms';
import { AlarmsView } from './alarms';
import { ComparisonView } from './comparison';
import { ComputationView } from './computation';
import { type View, announce, h, setAttribute, setShown, setText } from './dom';
import { PosteriorView } from './posterior';
import { PresentView } from './present';
import { PrintSheet } from './print_sheet';
import { LIST_ADDRESS, addressOf } from './route';
import { SignalsView } from './signals';
import { Strip } from './strip';
import { toolbar } from './toolbar';
import { term } from './tooltip';

const legend = (): HTMLElement =>
  h('p.legend', {},
    h('span.key.line', {}, 'estimate'), h('span.key.band', {}, term('95 % interval', TERMS.interval)),
    h('span.key.ghost', {}, term('prior', TERMS.prior)), h('span.key.tick', {}, term('re-expansion', TERMS.reexpansion)));

// A quarter of a second is as fast as numbers can be read.
const DRAW_INTERVAL_MS = 250;

// With more parameters than these, strips are lower and stand side by side.
const FEW = 4;

export class SessionPage implements View {
  readonly element: HTMLElement;
  private readonly monitor: SessionMonitor;
  private readonly chip = h('span.chip');
  private readonly detail = h('span.status-detail');
  private readonly retry = h('button', { type: 'button', hidden: true }, 'Try now');
  private readonly progress = h('p.progress');
  private readonly frozenNote = h('p.frozen', { role: 'status', hidden: true });
  private readonly wait = h('section.card.wait', { hidden: true });
  private readonly body = h('div.panels', { hidden: true });
  private readonly strips = h('section.strips', { 'aria-label': 'Parameters' });
  private readonly alarms = new AlarmsView();
  private readonly signals: SignalsView;
  private readonly posterior: PosteriorView;
  private readonly computation = new ComputationView();
  private readonly present = new PresentView();
  private readonly comparison: ComparisonView | null;
  private readonly sheet = new PrintSheet(() => ({
    session: this.monitor.session, estimate: this.monitor.estimate, version: this.computation.version,
  }));
  private byName = new Map<string, Strip>();
  private isFrozen = false;
  private isWhole = false;
  private frozenCount = 0;
  private timer: ReturnType<typeof setTimeout> | null = null;
  private drawnAt = 0;
  private drawnCount = -1;
  private label = '';
  private readonly clock = setInterval(() => this.showStatus(), 1000);
  private readonly onVisible = (): void => this.refresh();

  constructor(private readonly id: string, other: string | null, private readonly onTokenNeeded: (reason: string) => void) {
    this.monitor = new SessionMonitor(id, {
      onChange: () => this.request(),
      onAlarms: (codes) => announce(`Warning: ${codes.map((code) => explain(code).title).join('; ')}`),
    });
    this.signals = new SignalsView(this.monitor.name);
    this.posterior = new PosteriorView(this.monitor.name);
    this.comparison = other ? new ComparisonView(id, other, () => { location.hash = addressOf(id); }) : null;
    this.retry.addEventListener('click', () => this.tryNow());
    this.element = h('div.session', {}, this.sheet.element, this.head(), this.frozenNote, this.wait, this.body);
    this.body.append(this.alarms.element);
    if (this.comparison) this.body.append(this.comparison.element);
    this.body.append(
      h('div', {}, legend(), this.strips), this.present.element, this.signals.element,
      h('div.pair', {}, this.posterior.element, h('div.panels', {}, this.posterior.words, this.computation.element)),
      this.sheet.problem);
    document.addEventListener('visibilitychange', this.onVisible);
    this.monitor.start();
    this.showStatus();
  }

  dispose(): void {
    clearInterval(this.clock);
    document.removeEventListener('visibilitychange', this.onVisible);
    if (this.timer !== null) clearTimeout(this.timer);
    this.monitor.stop();
    for (const view of [...this.byName.values(), this.alarms, this.signals, this.posterior, this.computation, this.sheet]) view.dispose();
    this.comparison?.dispose();
  }

  private head(): HTMLElement {
    return h('header.session-head', {},
      h('div.title', {},
        h('a.back', { href: LIST_ADDRESS }, '‹ Sessions'),
        h('h1', {}, this.id),
        h('div.status', {}, this.chip, this.detail, this.retry)),
      this.progress,
      toolbar(this.id, {
        onFreeze: (isFrozen) => this.freeze(isFrozen),
        onWhole: (isWhole) => {
          this.isWhole = isWhole;
          for (const strip of this.byName.values()) strip.setWhole(isWhole);
        },
        estimate: () => this.monitor.estimate,
      }));
  }

  private tryNow(): void {
    const { kind } = this.monitor.connection;
    if (kind === 'token' || kind === 'refused') this.onTokenNeeded('');
    else this.monitor.retryNow();
  }

  private freeze(isFrozen: boolean): void {
    this.isFrozen = this.signals.isFrozen = this.posterior.isFrozen = isFrozen;
    this.frozenCount = this.monitor.estimateCount;
    this.refresh();
  }

  // Draws everything again, such as what was left out while nobody could see it.
  private refresh(): void {
    this.drawnCount = -1;
    this.request();
  }

  // Draws soon: many changes make one picture.
  private request(): void {
    if (this.timer !== null) return;
    const wait = Math.max(0, this.drawnAt + DRAW_INTERVAL_MS - performance.now());
    this.timer = setTimeout(() => {
      this.timer = null;
      this.draw();
    }, wait);
  }

  private draw(): void {
    this.drawnAt = performance.now();
    const { connection } = this.monitor;
    if (connection.kind === 'token') {
      this.onTokenNeeded(connection.reason);
      return;
    }
    this.showStatus();
    this.showFrozen();
    if (this.isFrozen) return;
    this.showPanels();
  }

  private showStatus(): void {
    const status = statusOf(this.monitor);
    setText(this.chip, status.label);
    setAttribute(this.chip, 'class', `chip ${status.tone}`);
    setText(this.detail, status.detail);
    setShown(this.retry, status.hasRetry);
    setAttribute(document.body, 'data-status', status.label);
    if (this.label !== '' && this.label !== status.label) announce(`${this.id}: ${status.label}. ${status.detail}`);
    this.label = status.label;
    this.showWait(status);
  }

  private showFrozen(): void {
    setShown(this.frozenNote, this.isFrozen);
    if (!this.isFrozen) return;
    const newer = this.monitor.estimateCount - this.frozenCount;
    const count = newer === 0 ? 'no new estimates' : `${whole(newer)} new ${newer === 1 ? 'estimate' : 'estimates'}`;
    setText(this.frozenNote, `Frozen: ${count} since then. The session itself goes on.`);
  }

  // What there is to see before the first estimate.
  private showWait(status: Status): void {
    const { estimate, connection } = this.monitor;
    setShown(this.wait, estimate === null);
    setShown(this.body, estimate !== null);
    if (estimate !== null) return;
    const text = [status.label, status.detail].join('\n');
    if (this.wait.dataset['text'] === text) return;
    this.wait.dataset['text'] = text;
    const isGone = connection.kind === 'gone';
    this.wait.replaceChildren(
      h('h2', {}, isGone ? `There is no session ${this.id}` : status.label),
      h('p', {}, isGone ? 'It has been deleted, or never was.' : status.detail || 'One moment.'),
      isGone ? h('p', {}, h('a', { href: LIST_ADDRESS }, 'All sessions')) : '');
  }

  private showPanels(): void {
    const { estimate, session } = this.monitor;
    if (!estimate) return;
    this.computation.update(session, estimate);
    this.alarms.update(this.monitor.alarms);
    this.signals.update(estimate, isBehind(session));
    this.posterior.update(estimate, isBehind(session));
    if (this.drawnCount === this.monitor.estimateCount) return;
    this.drawnCount = this.monitor.estimateCount;
    const run = session && session.lastRun > 0 ? ` of run ${session.lastRun}` : '';
    setText(this.progress, `t = ${recordTime(estimate.time)}${run} · ${whole(estimate.samples)} samples`);
    document.title = `${this.id} · polyest`;
    this.drawStrips();
    this.present.update(estimate);
    this.comparison?.update(estimate.parameters);
  }

  private drawStrips(): void {
    const { estimate, history, session } = this.monitor;
    if (!estimate) return;
    const names = estimate.parameters.map(({ name }) => name);
    if (names.join('\n') !== [...this.byName.keys()].join('\n')) this.rebuildStrips(names);
    for (const parameter of estimate.parameters) {
      const prior = priorInterval(session?.problem ?? null, parameter);
      this.byName.get(parameter.name)?.update({ parameter, prior, history });
    }
  }

  private rebuildStrips(names: readonly string[]): void {
    for (const strip of this.byName.values()) strip.dispose();
    const isDense = names.length > FEW;
    this.strips.classList.toggle('dense', isDense);
    this.byName = new Map(names.map((name) => [name, new Strip(name, isDense ? 110 : 150)]));
    for (const strip of this.byName.values()) strip.setWhole(this.isWhole);
    this.strips.replaceChildren(...[...this.byName.values()].map(({ element }) => element));
  }
}
