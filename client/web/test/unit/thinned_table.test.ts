import { describe, expect, it } from 'vitest';

import { ThinnedTable } from '../../src/state/thinned_table';

const rows = (table: ThinnedTable): number[] => Array.from(table.column(0));

describe('ThinnedTable', () => {
  it('keeps everything while there is room', () => {
    const table = new ThinnedTable(8, 1);
    for (let k = 0; k < 8; ++k) table.append([k]);
    expect(rows(table)).toEqual([0, 1, 2, 3, 4, 5, 6, 7]);
  });

  it('always has the first and the newest row, in order, within its capacity', () => {
    const table = new ThinnedTable(8, 1);
    for (let k = 0; k < 1000; ++k) {
      table.append([k]);
      const kept = rows(table);
      expect(kept.length).toBeLessThanOrEqual(8);
      expect(kept[0]).toBe(0);
      expect(kept[kept.length - 1]).toBe(k);
      expect([...kept].sort((a, b) => a - b)).toEqual(kept);
    }
  });

  it('keeps rows evenly: but for the newest, all steps are the same power of two', () => {
    const table = new ThinnedTable(64, 1);
    for (let k = 0; k < 12_345; ++k) table.append([k]);
    const kept = rows(table).slice(0, -1);
    const steps = new Set(kept.slice(1).map((value, i) => value - (kept[i] as number)));
    expect(steps).toEqual(new Set([256]));  // the least one of which 12,345 rows fit into 64
    expect(table.length).toBeGreaterThanOrEqual(32);
  });

  it('holds a million rows in the memory of its capacity', () => {
    const table = new ThinnedTable(1024, 5);
    for (let k = 0; k < 1_000_000; ++k) table.append([k, 1, 2, 3, 4]);
    expect(table.length).toBeLessThanOrEqual(1024);
    expect(table.column(4).buffer.byteLength).toBe(1024 * 8);
    expect(rows(table)[table.length - 1]).toBe(999_999);
  });

  it('replaces the newest row, and adds and removes columns', () => {
    const table = new ThinnedTable(4, 2);
    table.append([1, 10]);
    table.append([2, 20]);
    table.replaceLast([2, 30]);
    table.addColumn();
    table.append([4, 40, 400]);
    expect(Array.from(table.column(1))).toEqual([10, 30, 40]);
    expect(Array.from(table.column(2))).toEqual([NaN, NaN, 400]);
    table.removeColumn(1);
    expect(Array.from(table.column(1))).toEqual([NaN, NaN, 400]);
  });

  it('goes on with rows that have been thinned as far apart as they are', () => {
    const table = new ThinnedTable(64, 1);
    for (let k = 0; k < 40; ++k) table.append([100 * k]);
    table.append([3930]);  // the newest, off the others' grid
    table.thinAsSoFar();
    for (let k = 3931; k < 6000; ++k) table.append([k]);
    const kept = rows(table);
    expect(kept.slice(0, -1)).toEqual(Array.from({ length: 60 }, (_, k) => 100 * k));
    expect(kept[kept.length - 1]).toBe(5999);
  });

  it('keeps rows evenly by their places, also where they come in steps', () => {
    const table = new ThinnedTable(64, 1);
    for (let k = 0; k < 10_000; k += 5) table.append([k]);
    const kept = rows(table).slice(0, -1);
    expect(new Set(kept.slice(1).map((value, i) => value - (kept[i] as number)))).toEqual(new Set([5 * 32]));
  });
});
