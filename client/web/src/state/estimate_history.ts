// How the estimates of one session came about, as its strips show it: bounded, whatever comes.

import type { Estimate, HistoryPoint } from '../api/messages';
import { ThinnedTable } from './thinned_table';

const CAPACITY = 1024;
const MAX_TICKS = 200;

// The daemon has kept all estimates if there are fewer than these, and thins them if there are 512.
const THINNED = 256;

// The table's columns: the batch, by which rows are thinned, time and samples, then those of each
// parameter.
const SEQUENCE = 0;
const TIME = 1;
const SAMPLES = 2;
const FIRST = 3;
const PER_PARAMETER = 4;

export interface Series {
  x: ArrayLike<number>;
  mean: ArrayLike<number>;
  stdDev: ArrayLike<number>;
  lower: ArrayLike<number>;
  upper: ArrayLike<number>;
}

interface Row {
  time: number;
  samples: number;
  sequence: number;
  reexpansions: number;
  parameters: { name: string; mean: number; stdDev: number; lower95: number; upper95: number }[];
}

export class EstimateHistory {
  private readonly table = new ThinnedTable(CAPACITY, FIRST);
  private names: string[] = [];
  private last: Row | null = null;
  private ticks: { time: number; samples: number }[] = [];
  private ticked: Row | null = null;  // the newest row ever added; ticks outlive what is loaded again

  // Whether times begin again, as they do with each run: x is then the number of samples.
  hasRuns = false;

  get length(): number {
    return this.table.length;
  }

  // Begins anew with what the daemon has kept. What comes then is kept no more densely: in time it
  // would crowd out the beginning.
  load(points: readonly HistoryPoint[]): void {
    this.clear();
    for (const point of points) this.add(point);
    if (points.length >= THINNED) this.table.thinAsSoFar();
  }

  clear(): void {
    this.table.clear();
    this.names.length = 0;
    while (this.table.width > FIRST) this.table.removeColumn(FIRST);
    this.last = null;
    this.hasRuns = false;
  }

  // Adds an estimate, unless it is older than the last one.
  append(estimate: Estimate): void {
    if (this.last !== null && estimate.sequence < this.last.sequence) return;
    this.add({ ...estimate, reexpansions: estimate.expansion.reexpansions });
  }

  // Forgets the ticks as well.
  restart(): void {
    this.clear();
    this.ticks = [];
    this.ticked = null;
  }

  // The history of one parameter; null if there is none.
  series(name: string): Series | null {
    const index = this.names.indexOf(name);
    if (index < 0) return null;
    const at = FIRST + index * PER_PARAMETER;
    return {
      x: this.table.column(this.hasRuns ? SAMPLES : TIME),
      mean: this.table.column(at),
      stdDev: this.table.column(at + 1),
      lower: this.table.column(at + 2),
      upper: this.table.column(at + 3),
    };
  }

  // Where the expansion moved.
  reexpansionTicks(): number[] {
    return this.ticks.map((tick) => (this.hasRuns ? tick.samples : tick.time));
  }

  private add(row: Row): void {
    this.tick(row);
    const isSame = this.last !== null && row.samples === this.last.samples && row.sequence === this.last.sequence;
    this.useColumnsOf(row);
    const numbers = new Array<number>(this.table.width).fill(NaN);
    numbers[SEQUENCE] = row.sequence;
    numbers[TIME] = row.time;
    numbers[SAMPLES] = row.samples;
    for (const parameter of row.parameters) {
      const at = FIRST + this.names.indexOf(parameter.name) * PER_PARAMETER;
      numbers[at] = parameter.mean;
      numbers[at + 1] = parameter.stdDev;
      numbers[at + 2] = parameter.lower95;
      numbers[at + 3] = parameter.upper95;
    }
    if (this.last !== null && row.time < this.last.time) this.hasRuns = true;
    if (isSame) this.table.replaceLast(numbers);
    else this.table.append(numbers);
    this.last = row;
  }

  private tick(row: Row): void {
    if (this.ticked !== null && row.sequence < this.ticked.sequence) return;
    if (this.ticked !== null && row.reexpansions > this.ticked.reexpansions) {
      this.ticks.push({ time: row.time, samples: row.samples });
      if (this.ticks.length > MAX_TICKS) this.ticks.splice(0, this.ticks.length - MAX_TICKS);
    }
    this.ticked = row;
  }

  // Parameters of each run come and go: columns are those of the present ones.
  private useColumnsOf(row: Row): void {
    const present = new Set(row.parameters.map(({ name }) => name));
    for (let i = this.names.length - 1; i >= 0; --i) {
      if (present.has(this.names[i] as string)) continue;
      this.names.splice(i, 1);
      for (let k = 0; k < PER_PARAMETER; ++k) this.table.removeColumn(FIRST + i * PER_PARAMETER);
    }
    for (const name of present) {
      if (this.names.includes(name)) continue;
      this.names.push(name);
      for (let k = 0; k < PER_PARAMETER; ++k) this.table.addColumn();
    }
  }
}
