// The last seconds of a run: coordinates in radians or metres, their velocities as the law has them and the command, by tick;
// what a slow line lost is NaN.

import type { Frame } from "./protocol";

export class History {
  /** Last tick that came, or -1. */
  last = -1;
  readonly columns: Float64Array[];

  private readonly rates: Float64Array[];

  /** `memory` is that of the filter that gives velocities from differences over a period; without one they stay NaN. */
  constructor(private readonly perUnit: number[], readonly ticks: number, private readonly period = 1, private readonly memory: number | null = null) {
    this.columns = [...perUnit, 1].map(() => new Float64Array(ticks).fill(NaN));
    this.rates = perUnit.map(() => new Float64Array(ticks).fill(NaN));
  }

  add(frame: Frame): void {
    const n = frame.command.length, { ticks, columns } = this;
    if (n === 0) return;
    if (frame.first <= this.last) this.clear(); // another run
    const lost = Math.min(ticks, this.last < 0 ? 0 : frame.first - this.last - 1);
    for (let k = frame.first - lost; k < frame.first; k++) for (const c of [...columns, ...this.rates]) c[k % ticks] = NaN;
    for (let i = 0; i < n; i++) {
      const place = (frame.first + i) % ticks;
      this.perUnit.forEach((per, c) => (columns[c]![place] = frame.counts[c]![i]! / per));
      columns.at(-1)![place] = frame.command[i]!;
      this.filter(frame.first + i);
    }
    this.last = frame.first + n - 1;
  }

  /** v[k] = a v[k-1] + (1 - a) (y[k] - y[k-1]) / T, from rest at the first reading, as the law begins. */
  private filter(tick: number): void {
    const { memory: a, period, ticks } = this;
    if (a === null) return;
    this.rates.forEach((rate, c) => {
      const y = this.columns[c]!, now = tick % ticks, before = (tick + ticks - 1) % ticks, last = tick ? rate[before]! : NaN;
      const moved = y[now]! - (tick ? y[before]! : NaN);
      rate[now] = Number.isNaN(moved) ? 0 : a * (last || 0) + ((1 - a) * moved) / period;
    });
  }

  clear(): void {
    this.last = -1;
    for (const column of [...this.columns, ...this.rates]) column.fill(NaN);
  }

  /** Value of a column `back` ticks before the last; NaN where there is none. */
  ago(column: number, back: number): number {
    const tick = this.last - back;
    return tick < 0 || back >= this.ticks ? NaN : this.columns[column]![tick % this.ticks]!;
  }

  /** Velocity of a coordinate as the law has it, `back` ticks before the last; NaN where there is none. */
  rate(coordinate: number, back: number): number {
    const tick = this.last - back;
    return tick < 0 || back >= this.ticks ? NaN : this.rates[coordinate]![tick % this.ticks]!;
  }

  fastest(coordinate: number): number {
    return this.rates[coordinate]!.reduce((most, v) => (Math.abs(v) > most ? Math.abs(v) : most), 0);
  }

  /** Largest distance of a column from a value. */
  farthest(column: number, from: number): number {
    return this.columns[column]!.reduce((most, v) => (Math.abs(v - from) > most ? Math.abs(v - from) : most), 0);
  }
}
