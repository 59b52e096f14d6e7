// The linear-quadratic regulator's poles while the price of its command slides: a locus in the plane of poles.
//
// Of all gains the least integral of sum (x_i / x_i,max)^2 + price (u / u_max)^2 has the stable roots of
// a(s) a(-s) + sum (u_max / x_i,max)^2 b_i(s) b_i(-s) / price = 0 (Kalman 1964), a polynomial in w = s^2;
// a is the model's characteristic polynomial, b_i / a leads from the command to the state x_i.

import { type Group, LEAST, clear, grouped, resolvent, roots } from "./poles";

const DECADES = [-8, 8] as const, EVERY = 10; // of the price; places in a decade at which the locus is drawn
const REAL = 1e-6; // share of a pole up to which its imaginary part is rounding

export interface Weighed {
  A: number[][];
  B: number[];
  /** Of each state, the deviation that costs as much as a full command at a price of 1; Infinity costs nothing. */
  deviations: number[];
  limit: number;
}

/** p(s) p(-s) in w = s^2, highest power first, of p in s, highest power first. */
function mirrored(p: number[]): number[] {
  const n = p.length - 1, out = Array<number>(n + 1).fill(0);
  p.forEach((a, i) => p.forEach((b, j) => {
    if ((i + j) % 2 === 0) out[(i + j) / 2]! += a * b * (n - j & 1 ? -1 : 1);
  }));
  return out;
}

export class Regulator {
  private readonly free: number[];
  private readonly priced: number[];

  constructor({ A, B, deviations, limit }: Weighed) {
    const { p, M } = resolvent(A), n = B.length, sign = n % 2 ? -1 : 1;
    this.free = mirrored(p).map((c) => sign * c);
    this.priced = Array<number>(n + 1).fill(0);
    deviations.forEach((most, i) => {
      const b = M.map((m) => m[i]!.reduce((sum, x, j) => sum + x * B[j]!, 0));
      mirrored(b).forEach((c, k) => (this.priced[k + 1]! += sign * c * (limit / most) ** 2));
    });
  }

  /** Closed-loop poles [1/s]. */
  poles(price: number): Complex[] {
    const squares = roots(this.free.map((c, k) => c + this.priced[k]! / price));
    return squares.map(([re, im]): Complex => {
      const size = Math.hypot(re, im), a = Math.sqrt((size + re) / 2), b = im / 2 / a; // the root right of the axis
      return Math.abs(b) < REAL * a ? [-a, 0] : [-a, -b];
    });
  }

  groups(price: number): Group[] {
    return grouped(this.poles(price)).map(clear).sort((a, b) => a.frequency - b.frequency);
  }
}

/** Prices at which no pole is slower or faster than may be asked for, or further from the real axis than is shown, the dearest first. */
export function prices(of: Regulator, fastest: number, highest = fastest): number[] {
  const all = Array.from({ length: (DECADES[1] - DECADES[0]) * EVERY + 1 }, (_, i) => 10 ** (DECADES[1] - i / EVERY));
  return all.filter((price) => of.poles(price).every(([re, im]) => {
    const size = Math.hypot(re, im);
    return size >= LEAST.frequency && size <= fastest && Math.abs(im) <= highest;
  }));
}

/** Branches of the locus, each a row of poles that follow each other. */
export function branches(of: Regulator, at: number[]): Complex[][] {
  const out: Complex[][] = [];
  for (const price of at) {
    const left = of.poles(price);
    if (!out.length) out.push(...left.map(() => []));
    for (const branch of out) {
      const [re, im] = branch.at(-1) ?? left[0]!, far = ([x, y]: Complex) => Math.hypot(x - re, y - im);
      const next = left.reduce((best, pole, i) => (far(pole) < far(left[best]!) ? i : best), 0);
      branch.push(...left.splice(next, 1));
    }
  }
  return out;
}
