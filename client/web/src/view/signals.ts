// Measured against predicted, the newest seconds; the residuals below, and what they say.

import type uPlot from 'uplot';

import * as client from '../api/client';
import { CallError } from '../api/errors';
import type { Estimate, PredictedOutput, Prediction } from '../api/messages';
import { PacedJob } from '../state/paced_job';
import { type SignalWindow, signalWindow, windowLength } from '../state/signal_window';
import { recordTime, significant, unitText, whole, withUnit } from '../text/number';
import { TERMS } from '../text/terms';
import { AutocorrelationView } from './autocorrelation';
import { COMMON, Chart, type ChartOptions, timeAxis, valueAxis } from './chart';
import { choice, type Choice } from './choice';
import { type View, card, h, setShown, setText } from './dom';
import { facts } from './facts';
import { WAITS } from '../text/status';
import { colour } from './theme';
import { term } from './tooltip';

const DRAWS = 50;
const MAX_ROWS = 4000;
const INTERVAL_MS = 1_500;
const RETRY_MS = 5_000;

const scatter = (): { show: true; size: number; stroke: string; fill: string } =>
  ({ show: true, size: 4.5, stroke: colour('--sample'), fill: colour('--sample') });

export class SignalsView implements View {
  readonly element: HTMLElement;
  isFrozen = false;  // an answer that is still to come is then left out
  private notBefore = 0;  // after a failure, when to ask again
  private readonly job: PacedJob;
  private readonly outputs: Choice;
  private readonly lengths: Choice;
  private readonly problem = h('p.trouble', { hidden: true, role: 'alert' });
  private readonly busy = h('p.quiet-text', { hidden: true }, WAITS);
  private readonly waiting = h('p.quiet-text', {}, 'The first prediction is being computed.');
  private readonly shown = h('div', { hidden: true });
  private readonly title = h('span', {}, 'Measured and predicted');
  private readonly note = h('p.note');
  private readonly signal: Chart;
  private readonly residuals: Chart;
  private readonly autocorrelation = new AutocorrelationView();
  private readonly facts = facts();
  private prediction: Prediction | null = null;
  private estimate: Estimate | null = null;
  private window: SignalWindow | null = null;
  private output = '';
  private unit = '';
  private length: 'newest' | 'more' | 'all' = 'newest';

  constructor(private readonly session: string) {
    this.job = new PacedJob(INTERVAL_MS, (stop) => this.fetch(stop));
    this.outputs = choice('Output', (value) => this.choose(value));
    this.lengths = choice('Shown', (value) => {
      this.length = value as typeof this.length;
      this.draw();
    });
    this.signal = new Chart('Measured and predicted', 240, () => this.signalOptions(), (i) => this.read(i));
    this.residuals = new Chart('Residuals', 150, () => this.residualOptions(), (i) => this.readResidual(i));
    this.shown.append(
      this.signal.element, this.note,
      h('div.split', {},
        h('div', {}, h('h3', {}, term('Residuals', TERMS.residual)), this.residuals.element),
        h('div', {}, h('h3', {}, term('Autocorrelation', TERMS.autocorrelation), ', by samples apart'), this.autocorrelation.element)),
      this.facts.element);
    this.element = card(this.title,
      h('div.choices', {}, this.outputs.element, this.lengths.element, legend()), this.problem, this.busy, this.waiting, this.shown);
    this.element.classList.add('signals');
  }

  // Asks for a prediction when one is due, unless the daemon has more urgent things to compute.
  update(estimate: Estimate, isBehind: boolean): void {
    this.estimate = estimate;
    setShown(this.busy, isBehind);
    setShown(this.waiting, !isBehind && this.prediction === null && this.problem.hidden);
    if (isBehind || performance.now() < this.notBefore) return;
    if (this.prediction === null || estimate.sequence !== this.prediction.sequence) this.job.request();
  }

  dispose(): void {
    this.job.dispose();
    this.signal.dispose();
    this.residuals.dispose();
    this.autocorrelation.dispose();
  }

  private async fetch(stop: AbortSignal): Promise<void> {
    if (document.hidden) return;
    try {
      const prediction = await client.predict(this.session, DRAWS, MAX_ROWS, stop);
      if (this.isFrozen) return;
      this.prediction = prediction;
      setShown(this.problem, false);
      setShown(this.waiting, false);
      setShown(this.shown, true);
      this.draw();
    } catch (thrown) {
      if (stop.aborted) return;
      this.notBefore = performance.now() + RETRY_MS;
      const reason = thrown instanceof CallError ? thrown.message : String(thrown);
      setText(this.problem, `No new prediction: ${reason}`);
      setShown(this.problem, true);
      setShown(this.waiting, false);
    }
  }

  private choose(output: string): void {
    this.output = output;
    this.draw();
  }

  private draw(): void {
    const { prediction } = this;
    if (!prediction || prediction.outputs.length === 0) return;
    this.outputs.set(prediction.outputs.map(({ output }) => ({ value: output, label: output })), this.output);
    const output = prediction.outputs.find((each) => each.output === this.output) ?? prediction.outputs[0] as PredictedOutput;
    this.output = output.output;
    const isOtherUnit = this.unit !== output.unit;
    this.unit = output.unit;
    const newest = windowLength(prediction);
    this.lengths.set([
      { value: 'newest', label: `Newest ${newest} s` },
      { value: 'more', label: `${5 * newest} s` },
      { value: 'all', label: 'Whole run' },
    ], this.length);
    const seconds = { newest, more: 5 * newest, all: Infinity }[this.length];
    const window = signalWindow(prediction, output, seconds);
    const wasStandardized = this.window?.isStandardized;
    this.window = window;
    if (isOtherUnit) this.signal.rebuild();
    if (isOtherUnit || wasStandardized !== window.isStandardized) this.residuals.rebuild();
    this.drawCharts(window);
    this.describe(prediction, output);
  }

  private drawCharts(window: SignalWindow): void {
    const hasNoise = window.sampleLower.length > 0;
    this.signal.setData([
      window.time, hasNoise ? window.sampleLower : window.modelLower, hasNoise ? window.sampleUpper : window.modelUpper,
      window.modelLower, window.modelUpper, window.mean, window.measured,
    ] as never);
    this.residuals.setData([window.time, window.residual] as never);
  }

  private describe(prediction: Prediction, output: PredictedOutput): void {
    const shown = prediction.time.length;
    const thinned = shown < prediction.rowCount ? `; ${whole(shown)} of ${whole(prediction.rowCount)} rows, evenly spaced` : '';
    const last = prediction.time[prediction.time.length - 1] ?? NaN;
    setText(this.title, `Measured and predicted: ${output.output}`);
    setText(this.note, `Up to t = ${recordTime(last)}${thinned}.`);
    this.signal.setLabel(
      `${output.output}, measured and predicted, up to ${recordTime(last)}` +
      (output.score ? `; ${significant(100 * output.score.coverage95, 3)} % of the samples within the 95 % band` : ''));
    this.residuals.setLabel(`Residuals of ${output.output}; 95 of 100 should be between −2 and 2`);
    const samples = output.score?.sampleCount ?? 0;
    this.autocorrelation.update(output.score?.autocorrelation ?? [], samples);
    this.describeFit(output);
  }

  private describeFit(output: PredictedOutput): void {
    const channel = this.estimate?.channels.find((each) => each.output === output.output);
    const { score } = output;
    this.facts.set([
      { label: 'Within the 95 % band', explanation: TERMS.coverage, text: score ? `${significant(100 * score.coverage95, 3)} %` : '–' },
      { label: 'χ² per sample', explanation: TERMS.chi, text: channel && channel.samples > 0 ? significant(channel.chiSquared / channel.samples, 3) : '–' },
      { label: 'Residual, rms', explanation: 'Root mean square of measured minus predicted, over the whole record.', text: score ? withUnit(significant(score.rootMeanSquare, 3), output.unit) : '–' },
      { label: 'Noise', explanation: 'Standard deviation of the sensor’s noise, as assumed or as learned.', text: channel ? withUnit(significant(channel.noiseStdDev, 3), output.unit) : '–' },
      { label: 'Lag-1 correlation', explanation: TERMS.lag1, text: channel ? significant(channel.lag1Correlation, 2) : '–' },
      { label: 'Effective samples', explanation: TERMS.effective, text: channel ? `${whole(channel.effectiveSamples)} of ${whole(channel.samples)}` : '–' },
    ]);
  }

  private read(index: number): string {
    const { window } = this;
    if (!window || index >= window.time.length) return '';
    const [measured, mean] = [window.measured[index], window.mean[index]];
    const text = (value: number | null | undefined): string => withUnit(significant(value ?? NaN, 4), this.unit);
    return `${recordTime(window.time[index] as number)}:  measured ${text(measured)}, predicted ${text(mean)}`;
  }

  private readResidual(index: number): string {
    const { window } = this;
    if (!window || index >= window.time.length) return '';
    const value = significant(window.residual[index] ?? NaN, 3);
    return `${recordTime(window.time[index] as number)}:  ${window.isStandardized ? `${value} σ` : withUnit(value, this.unit)}`;
  }

  private signalOptions(): ChartOptions {
    const bare = { stroke: 'transparent', width: 0, points: { show: false } };
    const label = unitText(this.unit);
    return {
      ...COMMON,
      cursor: { ...COMMON.cursor, sync: { key: 'signals' } },
      scales: { x: { time: false } },
      axes: [timeAxis(), valueAxis(label === '' ? {} : { label, labelSize: 20, labelFont: '12px system-ui, sans-serif' })],
      series: [
        {}, bare, bare, bare, bare,
        { stroke: colour('--accent'), width: 1.75, points: { show: false } },
        { stroke: 'transparent', width: 0, points: scatter() },
      ],
      bands: [{ series: [2, 1], fill: colour('--band') }, { series: [4, 3], fill: colour('--band-inner') }],
    };
  }

  private residualOptions(): ChartOptions {
    const isStandardized = this.window?.isStandardized ?? true;
    const hook = (plot: uPlot): void => {
      if (isStandardized) drawTwoSigma(plot);
    };
    const range = (_plot: unknown, low: number | null, high: number | null): [number, number] => {
      const largest = Math.max(Math.abs(low ?? 0), Math.abs(high ?? 0)) * 1.1;
      const reach = isStandardized ? Math.max(3.5, largest) : largest || 1;
      return [-reach, reach];
    };
    return {
      ...COMMON,
      cursor: { ...COMMON.cursor, sync: { key: 'signals' } },
      scales: { x: { time: false }, y: { range } },
      axes: [timeAxis(), valueAxis({
        space: 26,
        ...(isStandardized ? { values: (_plot, splits) => splits.map((split) => `${String(split).replace('-', '−')}${split === 0 ? '' : ' σ'}`) } : {}),
      })],
      series: [{}, { stroke: 'transparent', width: 0, points: { ...scatter(), size: 3.5 } }],
      hooks: { drawClear: [hook] },
    };
  }
}

const legend = (): HTMLElement =>
  h('p.legend', {},
    h('span.key.dot', {}, 'measured'), h('span.key.line', {}, 'predicted'),
    h('span.key.band', {}, term('95 % of samples', TERMS.band)));

// The band between −2 σ and 2 σ.
function drawTwoSigma(plot: uPlot): void {
  const { ctx, bbox } = plot;
  const top = plot.valToPos(2, 'y', true);
  const bottom = plot.valToPos(-2, 'y', true);
  ctx.save();
  ctx.fillStyle = colour('--band');
  ctx.fillRect(bbox.left, top, bbox.width, bottom - top);
  ctx.restore();
}
