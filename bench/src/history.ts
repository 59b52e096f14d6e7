// The last seconds of a run: coordinates in radians or metres and the command, by tick; what a slow line lost is NaN.

import type { Frame } from "./protocol";

export class History {
  /** Last tick that came, or -1. */
  last = -1;
  readonly columns: Float64Array[];

  constructor(private readonly perUnit: number[], readonly ticks: number) {
    this.columns = [...perUnit, 1].map(() => new Float64Array(ticks).fill(NaN));
  }

  add(frame: Frame): void {
    const n = frame.command.length, { ticks, columns } = this;
    if (n === 0) return;
    if (frame.first <= this.last) this.clear(); // another run
    const lost = Math.min(ticks, this.last < 0 ? 0 : frame.first - this.last - 1);
    for (let k = frame.first - lost; k < frame.first; k++) for (const c of columns) c[k % ticks] = NaN;
    for (let i = 0; i < n; i++) {
      const place = (frame.first + i) % ticks;
      this.perUnit.forEach((per, c) => (columns[c]![place] = frame.counts[c]![i]! / per));
      columns.at(-1)![place] = frame.command[i]!;
    }
    this.last = frame.first + n - 1;
  }

  clear(): void {
    this.last = -1;
    for (const column of this.columns) column.fill(NaN);
  }

  /** Value of a column `back` ticks before the last; NaN where there is none. */
  ago(column: number, back: number): number {
    const tick = this.last - back;
    return tick < 0 || back >= this.ticks ? NaN : this.columns[column]![tick % this.ticks]!;
  }

  /** Largest distance of a column from a value. */
  farthest(column: number, from: number): number {
    return this.columns[column]!.reduce((most, v) => (Math.abs(v - from) > most ? Math.abs(v - from) : most), 0);
  }
}
