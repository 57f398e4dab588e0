// The autocorrelation of the residuals: a bar for each lag, between the lines of chance.

import uPlot from 'uplot';

import { significant } from '../text/number';
import { COMMON, Chart, type ChartOptions, axis, plotted, valueAxis } from './chart';
import type { View } from './dom';
import { colour } from './theme';

export class AutocorrelationView implements View {
  readonly element: HTMLElement;
  private readonly chart: Chart;
  private values: number[] = [];
  private limit = 0;

  constructor() {
    this.chart = new Chart('Autocorrelation of the residuals', 150, () => this.options(), (i) => this.read(i));
    this.element = this.chart.element;
  }

  update(values: number[], samples: number): void {
    this.values = values;
    this.limit = samples > 0 ? 2 / Math.sqrt(samples) : 0;
    this.chart.setData([values.map((_, i) => i + 1), plotted(values)] as never);
    const beyond = values.filter((value) => Math.abs(value) > this.limit).length;
    this.chart.setLabel(
      `Autocorrelation of the residuals: ${beyond} of ${values.length} lags beyond what chance explains in 95 of 100 cases`);
  }

  dispose(): void {
    this.chart.dispose();
  }

  private read(index: number): string {
    const value = this.values[index];
    return value === undefined ? '' : `${index + 1} ${index === 0 ? 'sample' : 'samples'} apart:  ${significant(value, 2)}`;
  }

  private options(): ChartOptions {
    const bars = uPlot.paths.bars?.({ size: [0.6, 14] });
    const range = (_plot: unknown, low: number | null, high: number | null): [number, number] => {
      const reach = Math.min(1, Math.max(0.2, 1.5 * this.limit, 1.15 * Math.abs(low ?? 0), 1.15 * Math.abs(high ?? 0)));
      return [-reach, reach];
    };
    return {
      ...COMMON,
      scales: { x: { time: false, range: () => [0, this.values.length + 1] }, y: { range } },
      axes: [axis({ size: 22, space: 40 }), valueAxis({ space: 26 })],
      series: [{}, { ...(bars ? { paths: bars } : {}), fill: colour('--accent'), stroke: colour('--accent'), width: 0, points: { show: false } }],
      hooks: { draw: [(plot) => this.drawLimits(plot)] },
    };
  }

  private drawLimits(plot: uPlot): void {
    const { ctx, bbox } = plot;
    ctx.save();
    ctx.strokeStyle = colour('--ink-2');
    ctx.lineWidth = devicePixelRatio;
    ctx.setLineDash([5 * devicePixelRatio, 4 * devicePixelRatio]);
    for (const level of [this.limit, -this.limit]) {
      const y = plot.valToPos(level, 'y', true);
      ctx.beginPath();
      ctx.moveTo(bbox.left, y);
      ctx.lineTo(bbox.left + bbox.width, y);
      ctx.stroke();
    }
    ctx.restore();
  }
}
