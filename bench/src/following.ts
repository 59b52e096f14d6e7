// What a law makes of a reference: the wave itself, the answer that a model predicts, and how far both are apart.

export type Shape = "step" | "square" | "sine";

export interface Wave {
  shape: Shape;
  /** Of a step, or of a wave to either side [rad or m]. */
  value: number;
  /** Of a wave [s]. */
  period: number;
}

/** A wave that a loop follows since a tick, about where it was switched on. */
export interface FollowedWave extends Wave {
  tick: number;
  about: number[];
}

/** What was followed in a run, as far as this page was told. */
export class Followed {
  private all: FollowedWave[] = [];

  /** Takes what is followed now; without a wave, or with an earlier one, another run has begun. */
  take(wave: FollowedWave | undefined): void {
    const last = this.now;
    if (!wave || (last && wave.tick < last.tick)) this.all = [];
    if (wave && wave.tick !== this.now?.tick) this.all = [...this.all.slice(-100), wave];
  }

  get now(): FollowedWave | undefined {
    return this.all.at(-1);
  }

  get before(): FollowedWave | undefined {
    return this.all.at(-2);
  }

  /** Reading of a coordinate that was asked for at a tick; NaN where that is not known. */
  at(tick: number, dt: number, coordinate: number): number {
    let i = this.all.length - 1;
    while (i >= 0 && this.all[i]!.tick > tick) i--;
    const wave = this.all[i];
    return wave ? wave.about[coordinate]! + valueAt(wave, tick - wave.tick, dt) : NaN;
  }
}

/** Matrices of a law, and its memories at the start by readings. */
export type LawNumbers = Record<"A" | "B" | "C" | "D" | "begin", number[][]>;

/** What a linear prediction takes: the model [1/s], the law, the period of both, the drive's limit and delay. */
export interface LinearLoop {
  A: number[][];
  B: number[];
  law: LawNumbers;
  period: number;
  limit: number;
  delay: number;
}

/** Value of a wave so many ticks after it began, as realtime/reference.py has it. */
export function valueAt({ shape, value, period }: Wave, tick: number, dt: number): number {
  if (shape === "sine") return value * Math.sin((2 * Math.PI * tick * dt) / period);
  if (shape === "square" && Math.floor(tick / Math.max(1, Math.round(period / dt / 2))) % 2) return -value;
  return value;
}

/** Ticks of a whole period; for a step the last second. */
export const window = ({ shape, period }: Wave, dt: number): number => Math.round((shape === "step" ? 1 : period) / dt);

/** exp([A B; 0 0] T): what a command that is held does within T. */
export function sampled(A: number[][], B: number[], T: number): { F: number[][]; G: number[] } {
  const n = B.length, halvings = 10, M = [...A.map((row, i) => [...row, B[i]!]), Array<number>(n + 1).fill(0)].map((row) => row.map((v) => (v * T) / 2 ** halvings));
  const times = (X: number[][], Y: number[][]) => X.map((row) => Y[0]!.map((_, j) => row.reduce((sum, x, k) => sum + x * Y[k]![j]!, 0)));
  const one = M.map((row, i) => row.map((_, j) => +(i === j)));
  let term = one, E = one;
  for (let k = 1; k < 10; k++) {
    term = times(term, M).map((row) => row.map((v) => v / k));
    E = E.map((row, i) => row.map((v, j) => v + term[i]![j]!));
  }
  for (let k = 0; k < halvings; k++) E = times(E, E);
  return { F: E.slice(0, n).map((row) => row.slice(0, n)), G: E.slice(0, n).map((row) => row[n]!) };
}

/** Rows of coordinate, velocity, ..., command of the linear loop from a state at rest, as deviations; the command is limited. */
export function linearAnswer(loop: LinearLoop, reference: Float64Array, start: number[]): Float64Array[] {
  const { law, limit } = loop, { F, G } = sampled(loop.A, loop.B, loop.period), n = start.length;
  const dot = (row: number[], ...v: number[][]) => { let sum = 0, k = 0; for (const part of v) for (const x of part) sum += row[k++]! * x; return sum; };
  const shown = (x: number[]) => x.filter((_, i) => i % 2 === 0);
  let x = start, z = law.begin.map((row) => dot(row, shown(x)));
  const late = Array<number>(Math.round(loop.delay / loop.period)).fill(0);
  return Array.from(reference, (r) => {
    const y = [...shown(x), r], asked = dot(law.C[0] ?? [], z) + dot(law.D[0]!, y);
    const u = Math.max(-limit, Math.min(limit, asked)), row = Float64Array.of(...x, u);
    z = law.A.map((a, i) => dot(a, z) + dot(law.B[i]!, y));
    late.push(u);
    const felt = late.shift()!;
    x = Array.from({ length: n }, (_, i) => dot(F[i]!, x) + G[i]! * felt);
    return row;
  });
}

export interface Figures {
  /** Distance of the answer from the reference over the last ticks. */
  rms: number;
  peak: number;
}

/** Of the last `ticks` of `count`; undefined where not all of them are known. */
export function figures(count: number, ticks: number, answer: (k: number) => number, reference: (k: number) => number): Figures | undefined {
  if (count < ticks || ticks < 1) return undefined;
  let power = 0, peak = 0;
  for (let k = count - ticks; k < count; k++) {
    const error = answer(k) - reference(k);
    power += error * error;
    peak = Math.max(peak, Math.abs(error));
  }
  return Number.isFinite(power) ? { rms: Math.sqrt(power / ticks), peak } : undefined;
}

/** How far an answer to a step goes beyond it, and from where it was at first the wrong way, as shares of the step. */
export function overshoot(from: number, to: number, answer: (k: number) => number, count: number): { beyond: number; wrong: number } {
  let most = 0, least = 0;
  for (let k = 0; k < count; k++) {
    most = Math.max(most, (answer(k) - from) / (to - from));
    least = Math.min(least, (answer(k) - answer(0)) / (to - from));
  }
  return { beyond: Math.max(0, most - 1), wrong: Math.abs(least) };
}
