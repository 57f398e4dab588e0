// A uPlot chart that fits its place, follows light and dark, and draws only while it is seen.

import uPlot from 'uplot';
import 'uplot/dist/uPlot.min.css';

import { significant } from '../text/number';
import { h, setText } from './dom';
import { THEME_EVENT, colour } from './theme';

export type ChartData = uPlot.AlignedData;
export type ChartOptions = Omit<uPlot.Options, 'width' | 'height'>;

export class Chart {
  readonly element: HTMLElement;
  private readonly place = h('div.plot');
  private readonly readout = h('div.readout', { 'aria-hidden': 'true' });
  private plot: uPlot | null = null;
  private data: ChartData;
  private isSeen = false;
  private isStale = false;
  private isDrawn = false;  // whether there has been anything to see
  private readonly resizing = new ResizeObserver(() => this.resize());
  private readonly seeing = new IntersectionObserver((entries) => this.see(entries), { rootMargin: '300px' });
  private readonly onTheme = (): void => this.rebuild();

  // `options` is called again when colours change. `height`: px. `read` says in words what is at an
  // index of x. The label names the picture for those who do not see it.
  constructor(
    label: string,
    private readonly height: number,
    private readonly options: () => ChartOptions,
    private readonly read: (index: number) => string = () => '',
  ) {
    this.data = [[]];
    this.element = h('div.chart', { role: 'img', 'aria-label': label }, this.place, this.readout);
    this.place.style.height = `${height}px`;
    this.resizing.observe(this.place);
    this.seeing.observe(this.place);
    document.addEventListener(THEME_EVENT, this.onTheme);
  }

  setData(data: ChartData): void {
    this.data = data;
    this.isStale = true;
    if (this.isSeen || !this.isDrawn) this.drawIfStale();
  }

  // Draws anew because something other than the data has changed.
  rebuild(): void {
    this.plot?.destroy();
    this.plot = null;
    this.resize();
  }

  setLabel(label: string): void {
    if (this.element.getAttribute('aria-label') !== label) this.element.setAttribute('aria-label', label);
  }

  dispose(): void {
    this.resizing.disconnect();
    this.seeing.disconnect();
    document.removeEventListener(THEME_EVENT, this.onTheme);
    this.plot?.destroy();
    this.plot = null;
  }

  private see(entries: IntersectionObserverEntry[]): void {
    this.isSeen = entries[entries.length - 1]?.isIntersecting ?? false;
    if (this.isSeen) this.drawIfStale();
  }

  private drawIfStale(): void {
    if (!this.plot || !this.isStale) return;
    this.isStale = false;
    this.isDrawn = true;
    this.plot.setData(this.data);
  }

  private resize(): void {
    const width = Math.floor(this.place.clientWidth);
    if (width === 0) return;
    if (this.plot) {
      if (this.plot.width !== width) this.plot.setSize({ width, height: this.height });
      return;
    }
    const options = this.options();
    const hooks = { ...options.hooks, setCursor: [(plot: uPlot) => this.onCursor(plot)] };
    this.plot = new uPlot({ ...options, hooks, width, height: this.height }, this.data, this.place);
    this.isStale = false;
  }

  private onCursor(plot: uPlot): void {
    const index = plot.cursor.idx;
    setText(this.readout, index === null || index === undefined ? '' : this.read(index));
  }
}

// What all charts have in common.
export const COMMON = {
  legend: { show: false },
  cursor: { y: false, points: { show: false }, drag: { x: false, y: false } },
  padding: [8, 20, 0, 0] as uPlot.Padding,
} satisfies Partial<ChartOptions>;

const FONT = '12px system-ui, sans-serif';
const tick = (value: number): string => significant(value, 12).replace(/(\.\d*?)0+$/, '$1').replace(/\.$/, '');

// Ticks with no more digits than tell them apart.
function tickTexts(splits: readonly (number | null)[]): string[] {
  const numbers = splits.map((value) => value ?? NaN);
  const step = Math.abs((numbers[1] ?? 0) - (numbers[0] ?? 0));
  const largest = Math.max(...numbers.map(Math.abs).filter(Number.isFinite), 0);
  if (!(step > 0) || largest === 0) return numbers.map((value) => (Number.isNaN(value) ? '' : tick(value)));
  const digits = Math.max(1, Math.ceil(Math.log10(largest / step) - 1e-9) + 1);
  return numbers.map((value) => (Number.isNaN(value) ? '' : tick(Number(value.toPrecision(Math.min(15, digits + 1))))));
}

export function axis(options: Partial<uPlot.Axis> = {}): uPlot.Axis {
  return {
    font: FONT,
    stroke: colour('--ink-2'),
    grid: { stroke: colour('--line'), width: 1 },
    ticks: { show: false },
    values: (_plot, splits) => tickTexts(splits),
    ...options,
  };
}

// The axis of times of the record.
export const timeAxis = (options: Partial<uPlot.Axis> = {}): uPlot.Axis =>
  axis({ size: 24, space: 70, values: (_plot, splits) => tickTexts(splits).map((text) => (text === '' ? '' : `${text} s`)), ...options });

// The axis of values, wide enough for its ticks.
export const valueAxis = (options: Partial<uPlot.Axis> = {}): uPlot.Axis =>
  axis({
    space: 36,
    size: (_plot, values) => 14 + 7 * Math.max(3, ...(values ?? []).map((text) => (text ?? '').length)),
    ...options,
  });

// Numbers as uPlot takes them: those that are not finite are gaps.
export const plotted = (values: ArrayLike<number>): (number | null)[] =>
  Array.from(values, (value) => (Number.isFinite(value) ? value : null));
