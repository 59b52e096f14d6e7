// Poles as a person speaks of them: pairs by natural frequency and damping ratio, and a real pole that is left over.

/** Two poles of s^2 + 2 ratio frequency s + frequency^2, real above a ratio of 1; or one real pole at -frequency. */
export interface Group {
  single: boolean;
  frequency: number;
  ratio: number;
}

export const LEAST = { frequency: 0.5, ratio: 0.05 };
export const MOST_RATIO = 3;
// Two equal poles are as ill conditioned to place as they are to draw.
const APART = 1e-3;
// Relative step of a root below which it is found; with a root that is double it is never reached.
const SETTLED = 1e-15;

export function grouped(poles: Complex[]): Group[] {
  const pairs = poles.filter(([, im]) => im > 0).map(([re, im]) => pair(Math.hypot(re, im), -re / Math.hypot(re, im)));
  const real = poles.filter(([, im]) => im === 0).map(([re]) => -re).sort((a, b) => a - b);
  while (real.length > 1) {
    const [slow, fast] = real.splice(0, 2) as [number, number];
    pairs.push(ofReal(slow, fast));
  }
  return [...pairs, ...real.map((a) => ({ single: true, frequency: a, ratio: 1 }))];
}

export const pair = (frequency: number, ratio: number): Group => ({ single: false, frequency, ratio });

export function ofReal(a: number, b: number): Group {
  const frequency = Math.sqrt(a * b);
  return pair(frequency, (a + b) / 2 / frequency);
}

export function polesOf(group: Group): Complex[] {
  const { single, frequency: w, ratio: z } = group;
  if (single) return [[-w, 0]];
  if (z < 1) return [[-z * w, w * Math.sqrt(1 - z * z)], [-z * w, -w * Math.sqrt(1 - z * z)]];
  const apart = w * Math.sqrt(z * z - 1);
  return [[-z * w + apart, 0], [-z * w - apart, 0]];
}

/** The nearest group whose two poles are apart. */
export function clear(group: Group): Group {
  const near = !group.single && Math.abs(group.ratio - 1) < APART;
  return near ? { ...group, ratio: group.ratio < 1 ? 1 - APART : 1 + APART } : group;
}

/** The nearest group that may be asked for: no pole is further from the origin than the fastest. */
export function within(group: Group, fastest: number): Group {
  const between = (x: number, low: number, high: number) => Math.min(Math.max(x, low), high);
  const { ratio } = clear({ ...group, ratio: between(group.ratio, LEAST.ratio, MOST_RATIO) });
  const spread = ratio > 1 && !group.single ? ratio + Math.sqrt(ratio * ratio - 1) : 1;
  return { ...group, ratio, frequency: between(group.frequency, LEAST.frequency, fastest / spread) };
}

/** A group after its pole `which` (0, 1) is dragged to a place; off the real axis by more than `near` it is complex. */
export function dragged(group: Group, which: number, [re, im]: Complex, near: number): Group {
  const left = Math.min(re, -LEAST.frequency / 10);
  if (group.single) return { ...group, frequency: -left };
  if (Math.abs(im) > near) return pair(Math.hypot(left, im), -left / Math.hypot(left, im));
  const other = group.ratio < 1 ? left : polesOf(group)[1 - which]![0];
  return ofReal(-left, -other);
}

/** (s I - A)^-1 = sum M_k s^(n - k) / p(s), k from 1, p highest power first (Faddeev and LeVerrier). */
export function resolvent(A: number[][]): { p: number[]; M: number[][][] } {
  const n = A.length, p = [1], all: number[][][] = [];
  let M = A.map((row) => row.map(() => 0));
  for (let k = 1; k <= n; k++) {
    M = M.map((row, i) => row.map((v, j) => v + (i === j ? p[k - 1]! : 0)));
    all.push(M);
    M = A.map((row) => M[0]!.map((_, j) => row.reduce((sum, a, i) => sum + a * M[i]![j]!, 0)));
    p.push(-M.reduce((sum, row, i) => sum + row[i]!, 0) / k);
  }
  return { p, M: all };
}

/** Coefficients of the characteristic polynomial, highest power first. */
export const characteristic = (A: number[][]): number[] => resolvent(A).p;

/** Roots of a polynomial with leading coefficient 1 (Durand and Kerner). */
export function roots(p: number[]): Complex[] {
  const times = ([a, b]: Complex, [c, d]: Complex): Complex => [a * c - b * d, a * d + b * c];
  const over = (a: Complex, [c, d]: Complex): Complex => times(a, [c / (c * c + d * d), -d / (c * c + d * d)]);
  const radius = 1 + Math.max(...p.slice(1).map(Math.abs)), n = p.length - 1;
  const all = Array.from({ length: n }, (_, i): Complex => {
    const angle = (2 * Math.PI * (i + 0.25)) / n;
    return [radius ** (1 / 2) * Math.cos(angle), radius ** (1 / 2) * Math.sin(angle)];
  });
  for (let step = 0, moved = 1; step < 200 && moved > SETTLED; step++) {
    moved = 0;
    all.forEach((z, i) => {
      const value = p.reduce<Complex>((sum, c) => { const [a, b] = times(sum, z); return [a + c, b]; }, [0, 0]);
      const apart = all.reduce<Complex>((product, w, j) => (j === i ? product : times(product, [z[0] - w[0], z[1] - w[1]])), [1, 0]);
      const [a, b] = over(value, apart);
      if (!Number.isFinite(a + b)) return;
      all[i] = [z[0] - a, z[1] - b];
      moved = Math.max(moved, Math.hypot(a, b) / (Math.hypot(...all[i]!) || 1));
    });
  }
  return all;
}

/** Root mean square of the command that rounding to encoder counts causes by itself, through the law alone. */
export function noise(numbers: Record<string, number>, states: number, resolution: number[]): number {
  const of = (name: string) => numbers[name] ?? 0;
  let power = 0;
  resolution.forEach((r, channel) => {
    let z = Array.from({ length: states }, (_, i) => of(`lB${i}_${channel}`));
    let sum = of(`lD0_${channel}`) ** 2;
    for (let k = 0; k < 20_000; k++) {
      const u = z.reduce((s, x, i) => s + of(`lC0_${i}`) * x, 0);
      sum += u * u;
      if (u * u < 1e-12 * sum) break;
      z = z.map((_, i) => z.reduce((s, x, j) => s + of(`lA${i}_${j}`) * x, 0));
    }
    power += (r * r / 12) * sum;
  });
  return Math.sqrt(power);
}
