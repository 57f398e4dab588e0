// A table of numbers that grows for ever in bounded memory. The first number of a row is its place,
// which increases from row to row. When the table is full, every second row goes, and from then on
// new rows are kept only as far apart as the others are on average. The newest row is always there,
// until the next replaces it.

const PLACE = 0;

export class ThinnedTable {
  private columns: Float64Array[];
  private stored = 0;       // rows, with the newest one
  private distance = 0;     // of the places of rows that are kept
  private isProvisional = false;  // the last row makes room for the next one

  // `capacity`: the most rows, even and at least 4. `width`: columns, with that of the places.
  constructor(readonly capacity: number, width: number) {
    this.columns = Array.from({ length: width }, () => new Float64Array(capacity));
  }

  get length(): number {
    return this.stored;
  }

  get width(): number {
    return this.columns.length;
  }

  // Appends a row of `width` numbers.
  append(row: readonly number[]): void {
    if (this.isProvisional) this.stored -= 1;
    if (this.stored === this.capacity) this.halve();
    this.columns.forEach((column, i) => {
      column[this.stored] = row[i] ?? NaN;
    });
    this.stored += 1;
    this.judgeNewest();
  }

  // Replaces the newest row, if there is one, by another of the same place.
  replaceLast(row: readonly number[]): void {
    if (this.stored === 0) return;
    this.columns.forEach((column, i) => {
      column[this.stored - 1] = row[i] ?? NaN;
    });
  }

  // Keeps new rows as far apart as those so far: these have been thinned already.
  thinAsSoFar(): void {
    this.distance = this.meanDistance(this.stored - 1);
    this.judgeNewest();
  }

  // Adds a column, of NaN in the rows so far.
  addColumn(): void {
    this.columns.push(new Float64Array(this.capacity).fill(NaN));
  }

  removeColumn(index: number): void {
    this.columns.splice(index, 1);
  }

  // The rows so far of one column: a view, valid until the next change.
  column(index: number): Float64Array {
    return (this.columns[index] as Float64Array).subarray(0, this.stored);
  }

  clear(): void {
    this.stored = this.distance = 0;
    this.isProvisional = false;
  }

  private place(row: number): number {
    return this.columns[PLACE]?.[row] ?? NaN;
  }

  // The mean distance of the first `count` rows; 0 if there is none.
  private meanDistance(count: number): number {
    return count < 2 ? 0 : (this.place(count - 1) - this.place(0)) / (count - 1);
  }

  // Notes whether the newest row is too near to the one before it to be kept.
  private judgeNewest(): void {
    const last = this.stored - 1;
    this.isProvisional = last > 0 && this.place(last) - this.place(last - 1) < this.distance;
  }

  private halve(): void {
    const kept = this.stored >> 1;
    for (const column of this.columns) {
      for (let i = 0; i < kept; ++i) column[i] = column[2 * i] as number;
    }
    this.stored = kept;
    this.distance = this.meanDistance(kept);
  }
}
