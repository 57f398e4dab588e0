// Outlines of a density on a grid: the regions of highest density that hold a given probability.

// Returns the density at whose level the region above it holds `probability` of the whole.
export function levelOf(density: readonly number[], probability: number): number {
  const sorted = density.filter((value) => value > 0).sort((a, b) => b - a);
  const total = sorted.reduce((sum, value) => sum + value, 0);
  let held = 0;
  for (const value of sorted) {
    held += value;
    if (held >= probability * total) return value;
  }
  return 0;
}

// Takes the roughness of counted draws out of a density: binomial weights over a cell and its
// neighbours, in both directions. The sum stays the same but for what lies at the edges.
export function smoothed(density: readonly number[], columns: number, rows: number): number[] {
  const at = (i: number, j: number): number =>
    i < 0 || j < 0 || i >= columns || j >= rows ? 0 : density[i * rows + j] as number;
  const weights = [0.25, 0.5, 0.25];
  return density.map((_, k) => {
    const [i, j] = [Math.floor(k / rows), k % rows];
    let sum = 0;
    for (let a = -1; a <= 1; ++a) {
      for (let b = -1; b <= 1; ++b) sum += (weights[a + 1] as number) * (weights[b + 1] as number) * at(i + a, j + b);
    }
    return sum;
  });
}

export type Segment = [number, number, number, number];  // x₁, y₁, x₂, y₂ in cells

// Returns the pieces of the outline at `level` by marching squares. `density`: row-major,
// columns × rows, the first index along x. Outside the grid the density is 0.
export function outline(density: readonly number[], columns: number, rows: number, level: number): Segment[] {
  const at = (i: number, j: number): number =>
    i < 0 || j < 0 || i >= columns || j >= rows ? 0 : density[i * rows + j] as number;
  const segments: Segment[] = [];
  for (let i = -1; i < columns; ++i) {
    for (let j = -1; j < rows; ++j) {
      square([at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)], i, j, level, segments);
    }
  }
  return segments;
}

// Corners in the order (i, j), (i + 1, j), (i + 1, j + 1), (i, j + 1).
function square(
  corners: [number, number, number, number], i: number, j: number, level: number, segments: Segment[],
): void {
  const crossings: [number, number][] = [];
  const place: [number, number][] = [[i, j], [i + 1, j], [i + 1, j + 1], [i, j + 1]];
  for (let k = 0; k < 4; ++k) {
    const next = (k + 1) % 4;
    const [a, b] = [corners[k] as number, corners[next] as number];
    if ((a >= level) === (b >= level)) continue;
    const share = (level - a) / (b - a);
    const [from, to] = [place[k] as [number, number], place[next] as [number, number]];
    crossings.push([from[0] + share * (to[0] - from[0]), from[1] + share * (to[1] - from[1])]);
  }
  for (let k = 0; k + 1 < crossings.length; k += 2) {
    const [from, to] = [crossings[k] as [number, number], crossings[k + 1] as [number, number]];
    segments.push([...from, ...to]);
  }
}
