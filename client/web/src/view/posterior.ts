// Which values are probable together, in pictures and in words.

import * as client from '../api/client';
import { CallError } from '../api/errors';
import type { Estimate, Posterior } from '../api/messages';
import { PacedJob } from '../state/paced_job';
import { recordTime } from '../text/number';
import { WAITS } from '../text/status';
import { TERMS } from '../text/terms';
import { tradeOffSentences } from '../text/trade_offs';
import { CornerPlot } from './corner';
import { type View, card, h, setShown, setText } from './dom';
import { term } from './tooltip';

const INTERVAL_MS = 5_000;
const RETRY_MS = 5_000;

export class PosteriorView implements View {
  readonly element: HTMLElement;
  isFrozen = false;  // an answer that is still to come is then left out
  private notBefore = 0;  // after a failure, when to ask again
  readonly words: HTMLElement;  // the same in words, a card of its own
  private readonly job: PacedJob;
  private readonly corner = new CornerPlot();
  private readonly follow = h('input', { type: 'checkbox', checked: true });
  private readonly now = h('button', { type: 'button' }, 'Draw now');
  private readonly problem = h('p.trouble', { hidden: true, role: 'alert' });
  private readonly note = h('p.note', {}, 'The first picture is being computed.');
  private readonly busy = h('p.quiet-text', { hidden: true }, WAITS);
  private readonly sentences = h('ul.sentences');
  private posterior: Posterior | null = null;
  private said = '';

  constructor(private readonly session: string) {
    this.job = new PacedJob(INTERVAL_MS, (stop) => this.fetch(stop));
    this.now.addEventListener('click', () => this.job.requestNow());
    this.element = card(term('What is probable together', TERMS.corner),
      h('div.choices', {}, h('label.check', {}, this.follow, 'Follow the estimate'), this.now),
      this.problem, this.busy, this.corner.element, this.note);
    this.words = card('What trades off', this.sentences);
  }

  // Asks for a picture when one is due, unless the daemon has more urgent things to compute.
  update(estimate: Estimate, isBehind: boolean): void {
    this.say(estimate);
    setShown(this.busy, isBehind);
    if (isBehind || performance.now() < this.notBefore) return;
    const isNew = this.posterior === null || estimate.sequence !== this.posterior.sequence;
    if (this.follow.checked && isNew) this.job.request();
  }

  dispose(): void {
    this.job.dispose();
    this.corner.dispose();
  }

  private say(estimate: Estimate): void {
    const sentences = tradeOffSentences(estimate);
    const key = JSON.stringify(sentences);
    if (key === this.said) return;
    this.said = key;
    this.sentences.replaceChildren(...sentences.map(({ text, weight }) => h(`li.${weight}`, {}, text)));
  }

  private async fetch(stop: AbortSignal): Promise<void> {
    if (document.hidden) return;
    try {
      const posterior = await client.computePosterior(this.session, stop);
      if (this.isFrozen && this.posterior) return;
      this.posterior = posterior;
      const drawn = this.corner.update(posterior);
      const all = posterior.parameters.length;
      setText(this.note, `At t = ${recordTime(posterior.time)}${drawn < all ? `; the first ${drawn} of ${all} parameters` : ''}.`);
      setShown(this.problem, false);
    } catch (thrown) {
      if (stop.aborted) return;
      this.notBefore = performance.now() + RETRY_MS;
      setText(this.problem, `No new picture: ${thrown instanceof CallError ? thrown.message : String(thrown)}`);
      setShown(this.problem, true);
    }
  }
}
