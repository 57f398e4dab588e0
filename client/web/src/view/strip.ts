// The strip of one parameter: its estimate, large; what is known of it in words; and how its 95 %
// band has shrunk out of the prior.

import type uPlot from 'uplot';

import type { Parameter } from '../api/messages';
import type { EstimateHistory, Series } from '../state/estimate_history';
import { alike, measured, recordTime, significant, times, unitText, whole, withUnit } from '../text/number';
import type { Interval } from '../text/prior';
import { shownOf } from '../text/shown';
import { TERMS } from '../text/terms';
import { verdictWords } from '../text/verdicts';
import { COMMON, Chart, type ChartOptions, axis, plotted, timeAxis, valueAxis } from './chart';
import { type View, h, setAttribute, setShown, setText } from './dom';
import { stripRange } from './strip_range';
import { colour } from './theme';
import { explainTerm, term } from './tooltip';

export interface StripState {
  parameter: Parameter;
  prior: Interval;
  history: EstimateHistory;
}

// What is drawn: copies, which stay as they are while the page is frozen.
interface Drawn {
  x: number[];
  mean: number[];
  stdDev: number[];
  lower: number[];
  upper: number[];
}

function copy({ x, mean, stdDev, lower, upper }: Series): Drawn {
  return { x: Array.from(x), mean: Array.from(mean), stdDev: Array.from(stdDev), lower: Array.from(lower), upper: Array.from(upper) };
}

export class Strip implements View {
  readonly element: HTMLElement;
  private readonly value = h('span.value');
  private readonly deviation = term('', TERMS.sd);
  private readonly unit = h('span.unit');
  private readonly kind = term('mean', TERMS.mean);
  private readonly verdict = term('', '');
  private readonly interval = h('span');
  private readonly before = h('span');
  private readonly chart: Chart;
  private range: [number, number] = [0, 1];
  private state: StripState | null = null;
  private drawn: Drawn | null = null;
  private isWhole = false;
  private hasBeginning = false;  // whether the chart's first point is the prior

  constructor(readonly name: string, height: number) {
    this.chart = new Chart(name, height, () => this.options(), (index) => this.read(index));
    this.verdict.classList.add('verdict');
    this.deviation.classList.add('deviation');
    this.element = h(
      'article.strip', { 'aria-label': `Parameter ${name}` },
      h('div.numbers', {},
        h('div.strip-head', {}, h('h3', {}, name), this.verdict),
        h('p.estimate', {}, this.value, ' ', this.unit, ' ', this.kind),
        h('p.spread', {}, this.deviation, h('span.interval', {}, term('95 %', TERMS.interval), ' ', this.interval)),
        h('p.detail', {}, this.before)),
      this.chart.element);
  }

  update(state: StripState): void {
    this.state = state;
    this.updateNumbers(state);
    this.updateChart(state);
  }

  // Whether the axis shows all that the prior allows.
  setWhole(isWhole: boolean): void {
    this.isWhole = isWhole;
    if (this.drawn && this.state) this.draw(this.drawn, this.state.prior);
  }

  dispose(): void {
    this.chart.dispose();
  }

  private updateNumbers({ parameter, prior }: StripState): void {
    const shown = shownOf(parameter);
    const { value, deviation, power } = measured(shown.value, shown.deviation);
    setText(this.value, value);
    setShown(this.kind, shown.isMean);
    setText(this.deviation, `± ${deviation}${power}`);
    setText(this.unit, `${power === '' ? '' : `${power} `}${unitText(parameter.unit)}`);
    const [lower, upper] = alike([parameter.lower95, parameter.upper95], shown.deviation) as [string, string];
    setText(this.interval, `${lower} … ${upper}`);
    const [from, to] = [prior.lower, prior.upper].map((each) => significant(each, 3)) as [string, string];
    setText(this.before, `Before: ${withUnit(`${from} … ${to}`, parameter.unit)}${this.narrowing(parameter)}`);
    const words = verdictWords(parameter.verdict);
    setText(this.verdict, `${words.mark} ${words.words}`);
    explainTerm(this.verdict, words.meaning);
    setAttribute(this.element, 'data-verdict', parameter.verdict);
  }

  private narrowing(parameter: Parameter): string {
    const ratio = parameter.priorStdDev / shownOf(parameter).deviation;
    return ratio > 1.1 ? ` · now ${times(ratio)} × narrower` : '';
  }

  private updateChart({ parameter, prior, history }: StripState): void {
    const series = history.series(this.name);
    if (!series || series.x.length === 0) return;
    this.drawn = copy(series);
    this.draw(this.drawn, prior);
    const shown = shownOf(parameter);
    const { value, deviation, power } = measured(shown.value, shown.deviation);
    this.chart.setLabel(
      `How ${this.name} came about over ${history.hasRuns ? 'the samples' : 'the time of the record'}: now ` +
      withUnit(`${value} ± ${deviation}${power}`, parameter.unit));
  }

  private draw({ x, mean, lower, upper }: Drawn, prior: Interval): void {
    this.range = stripRange(prior, lower, upper, this.isWhole);
    // Before the first sample there is the prior alone: the band begins with it.
    this.hasBeginning = (x[0] as number) > 0;
    const from = (value: number | null, values: (number | null)[]): (number | null)[] =>
      this.hasBeginning ? [value, ...values] : values;
    this.chart.setData([
      from(0, x) as number[], from(null, plotted(mean)),
      from(prior.lower, plotted(lower)), from(prior.upper, plotted(upper)),
    ]);
  }

  private read(place: number): string {
    const { drawn, state } = this;
    const index = place - (this.hasBeginning ? 1 : 0);
    if (!drawn || !state || index < 0 || index >= drawn.x.length) return '';
    const at = state.history.hasRuns ? `${whole(drawn.x[index] as number)} samples` : recordTime(drawn.x[index] as number);
    const deviation = drawn.stdDev[index] as number;
    const [mean, lower, upper] = alike(
      [drawn.mean, drawn.lower, drawn.upper].map((each) => each[index] as number), deviation);
    return `${at}:  ${withUnit(mean as string, state.parameter.unit)}  (${lower} … ${upper})`;
  }

  private options(): ChartOptions {
    const accent = colour('--accent');
    const edge = { stroke: colour('--band-edge'), width: 1, points: { show: false } };
    return {
      ...COMMON,
      cursor: { ...COMMON.cursor, sync: { key: 'strips' } },
      scales: { x: { time: false }, y: { range: () => this.range } },
      axes: [this.state?.history.hasRuns ? axis({ size: 24, space: 70 }) : timeAxis(), valueAxis({ space: 22 })],
      series: [{}, { stroke: accent, width: 2.25, points: { show: false } }, edge, edge],
      bands: [{ series: [3, 2], fill: colour('--band') }],
      hooks: { drawClear: [(plot) => this.drawPrior(plot)], draw: [(plot) => this.drawTicks(plot)] },
    };
  }

  // The prior's ghost: where the parameter could be before the test.
  private drawPrior(plot: uPlot): void {
    if (!this.state) return;
    const { ctx, bbox } = plot;
    const clamp = (y: number): number => Math.max(bbox.top, Math.min(bbox.top + bbox.height, y));
    const top = clamp(plot.valToPos(this.state.prior.upper, 'y', true));
    const bottom = clamp(plot.valToPos(this.state.prior.lower, 'y', true));
    ctx.save();
    ctx.fillStyle = colour('--ghost');
    ctx.fillRect(bbox.left, top, bbox.width, bottom - top);
    ctx.restore();
  }

  // Where the expansion moved: small triangles on the axis.
  private drawTicks(plot: uPlot): void {
    const ticks = this.state?.history.reexpansionTicks() ?? [];
    if (ticks.length === 0) return;
    const { ctx, bbox } = plot;
    const size = 5 * devicePixelRatio;
    const base = bbox.top + bbox.height;
    ctx.save();
    ctx.fillStyle = colour('--tick');
    for (const x of ticks) {
      const at = plot.valToPos(x, 'x', true);
      if (!(at >= bbox.left && at <= bbox.left + bbox.width)) continue;
      ctx.beginPath();
      ctx.moveTo(at - size, base);
      ctx.lineTo(at + size, base);
      ctx.lineTo(at, base - 1.6 * size);
      ctx.fill();
    }
    ctx.restore();
  }
}
