// A table of numbers that grows for ever in bounded memory. Rows are kept evenly: when the table is
// full, every second one goes, and from then on only every second new one stays. The newest row is
// always there, until the next replaces it.

export class ThinnedTable {
  private columns: Float64Array[];
  private stored = 0;       // rows, with the newest one
  private appended = 0;     // rows ever
  private stride = 1;
  private isProvisional = false;  // the last row makes room for the next one

  // `capacity`: the most rows, even and at least 4.
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
    this.isProvisional = this.appended % this.stride !== 0;
    this.appended += 1;
  }

  // Replaces the newest row, if there is one.
  replaceLast(row: readonly number[]): void {
    if (this.stored === 0) return;
    this.columns.forEach((column, i) => {
      column[this.stored - 1] = row[i] ?? NaN;
    });
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
    this.stored = this.appended = 0;
    this.stride = 1;
    this.isProvisional = false;
  }

  private halve(): void {
    const kept = this.stored >> 1;
    for (const column of this.columns) {
      for (let i = 0; i < kept; ++i) column[i] = column[2 * i] as number;
    }
    this.stored = kept;
    this.stride *= 2;
  }
}
