// The posterior in pictures: each parameter on its own, and each pair together.

import type { Posterior } from '../api/messages';
import { alike, unitText } from '../text/number';
import { levelOf, outline, smoothed } from './contours';
import { h } from './dom';
import { THEME_EVENT, colour } from './theme';

// More than these are too small to see; the daemon gives pairs of the first eight.
const MAX_PARAMETERS = 6;
const MARGIN = { left: 62, right: 12, top: 22, bottom: 40 };
const GAP = 8;
const PROBABILITIES = [0.95, 0.68];

interface Frame {
  x: number;
  y: number;
  size: number;
}

type Range = [number, number];

function rangeOf(values: readonly number[]): Range {
  const [first, last] = [values[0] ?? 0, values[values.length - 1] ?? 1];
  const half = values.length > 1 ? (last - first) / (values.length - 1) / 2 : 0.5;
  return [first - half, last + half];
}

export class CornerPlot {
  readonly element = h('div.corner', { role: 'img', 'aria-label': 'Posterior, not computed yet' });
  private readonly canvas = h('canvas');
  private readonly resizing = new ResizeObserver(() => this.draw());
  private readonly onTheme = (): void => this.draw();
  private posterior: Posterior | null = null;

  constructor() {
    this.element.append(this.canvas);
    this.resizing.observe(this.element);
    document.addEventListener(THEME_EVENT, this.onTheme);
  }

  // Returns how many of the parameters are in the picture.
  update(posterior: Posterior): number {
    this.posterior = posterior;
    const names = this.parameters().map(({ name }) => name);
    this.element.setAttribute('aria-label', `Posterior of ${names.join(', ')}, each alone and in pairs`);
    this.draw();
    return names.length;
  }

  dispose(): void {
    this.resizing.disconnect();
    document.removeEventListener(THEME_EVENT, this.onTheme);
  }

  private parameters(): Posterior['parameters'] {
    return (this.posterior?.parameters ?? []).slice(0, MAX_PARAMETERS);
  }

  private draw(): void {
    const parameters = this.parameters();
    const width = Math.min(this.element.clientWidth, 720);
    const context = this.canvas.getContext('2d');
    if (width < 60 || parameters.length === 0 || !context) return;
    const n = parameters.length;
    const size = Math.min(230, (width - MARGIN.left - MARGIN.right - (n - 1) * GAP) / n);
    const total = n * size + (n - 1) * GAP;
    const [wide, high] = [MARGIN.left + total + MARGIN.right, MARGIN.top + total + MARGIN.bottom];
    this.canvas.width = Math.round(wide * devicePixelRatio);
    this.canvas.height = Math.round(high * devicePixelRatio);
    this.canvas.style.width = `${wide}px`;
    this.canvas.style.height = `${high}px`;
    context.setTransform(devicePixelRatio, 0, 0, devicePixelRatio, 0, 0);
    context.clearRect(0, 0, wide, high);
    const frame = (column: number, row: number): Frame =>
      ({ x: MARGIN.left + column * (size + GAP), y: MARGIN.top + row * (size + GAP), size });
    for (let row = 0; row < n; ++row) {
      for (let column = 0; column <= row; ++column) {
        if (row === column) this.drawMarginal(context, frame(column, row), row);
        else this.drawJoint(context, frame(column, row), column, row);
      }
    }
    this.drawLabels(context, frame, n);
  }

  private drawMarginal(context: CanvasRenderingContext2D, { x, y, size }: Frame, index: number): void {
    const { density } = this.parameters()[index] as Posterior['parameters'][number];
    const largest = Math.max(...density, 0);
    if (largest > 0) {
      const step = size / density.length;
      context.beginPath();
      context.moveTo(x, y + size);
      density.forEach((value, i) => context.lineTo(x + (i + 0.5) * step, y + size - 0.92 * size * (value / largest)));
      context.lineTo(x + size, y + size);
      context.closePath();
      context.fillStyle = colour('--band');
      context.fill();
      context.strokeStyle = colour('--accent');
      context.lineWidth = 2;
      context.stroke();
    }
    this.drawFrame(context, { x, y, size });
  }

  private drawJoint(context: CanvasRenderingContext2D, frame: Frame, column: number, row: number): void {
    const [first, second] = [this.parameters()[column]?.name, this.parameters()[row]?.name];
    const joint = this.posterior?.joints.find((each) => each.first === first && each.second === second);
    if (joint) {
      const [columns, rows] = [joint.firstValue.length, joint.secondValue.length];
      const [stepX, stepY] = [frame.size / columns, frame.size / rows];
      const density = smoothed(joint.density, columns, rows);
      this.drawCells(context, frame, density, columns, rows);
      context.save();
      context.beginPath();
      context.rect(frame.x, frame.y, frame.size, frame.size);
      context.clip();
      context.strokeStyle = colour('--accent');
      context.lineWidth = 1.75;
      for (const probability of PROBABILITIES) {
        context.beginPath();
        for (const [x1, y1, x2, y2] of outline(density, columns, rows, levelOf(density, probability))) {
          context.moveTo(frame.x + (x1 + 0.5) * stepX, frame.y + frame.size - (y1 + 0.5) * stepY);
          context.lineTo(frame.x + (x2 + 0.5) * stepX, frame.y + frame.size - (y2 + 0.5) * stepY);
        }
        context.stroke();
      }
      context.restore();
    }
    this.drawFrame(context, frame);
  }

  // Shades cells by their density, as one picture with a pixel for each: cells that are drawn side by
  // side show their seams on paper.
  private drawCells(
    context: CanvasRenderingContext2D, { x, y, size }: Frame, density: readonly number[], columns: number, rows: number,
  ): void {
    const cells = h('canvas', { width: String(columns), height: String(rows) });
    const picture = cells.getContext('2d');
    const largest = Math.max(...density);
    if (!picture || !(largest > 0)) return;
    picture.fillStyle = colour('--accent');
    density.forEach((value, k) => {
      const share = value / largest;
      if (share < 0.01) return;
      picture.globalAlpha = 0.42 * share;
      picture.fillRect(Math.floor(k / rows), rows - 1 - (k % rows), 1, 1);
    });
    context.drawImage(cells, x, y, size, size);
  }

  private drawFrame(context: CanvasRenderingContext2D, { x, y, size }: Frame): void {
    context.strokeStyle = colour('--line');
    context.lineWidth = 1;
    context.strokeRect(x + 0.5, y + 0.5, size - 1, size - 1);
  }

  private drawLabels(context: CanvasRenderingContext2D, frame: (column: number, row: number) => Frame, n: number): void {
    context.font = '12px system-ui, sans-serif';
    this.parameters().forEach(({ name, unit, value }, i) => {
      const range = rangeOf(value);
      const ends = alike([range[0] + 0.12 * (range[1] - range[0]), range[1] - 0.12 * (range[1] - range[0])], (range[1] - range[0]) / 6);
      const bottom = frame(i, n - 1);
      const own = frame(i, i);
      context.fillStyle = colour('--ink');
      context.textAlign = 'left';
      context.fillText(unitText(unit) === '' ? name : `${name} in ${unitText(unit)}`, own.x + 2, own.y - 7);
      context.fillStyle = colour('--ink-2');
      context.textAlign = 'center';
      if (bottom.size >= 110) {
        ends.forEach((text, k) => context.fillText(text, bottom.x + bottom.size * (k === 0 ? 0.2 : 0.8), bottom.y + bottom.size + 17));
      }
      if (i === 0) return;
      const left = frame(0, i);
      context.textAlign = 'right';
      ends.forEach((text, k) => context.fillText(text, left.x - 6, left.y + left.size * (k === 0 ? 0.88 : 0.12) + 4));
    });
  }
}
