import { expect, test } from "vitest";
import { characteristic, dragged, grouped, noise, ofReal, pair, polesOf, roots, within } from "../src/poles";

const sorted = (poles: Complex[]) => poles.map(([re, im]) => [re.toFixed(9), im.toFixed(9)].join()).sort();

test("a pair has the product and the sum of its polynomial's coefficients", () => {
  for (const ratio of [0.05, 0.6, 0.999, 1.36, 3]) {
    const [[a, b], [c, d]] = polesOf(pair(7, ratio)) as [Complex, Complex];
    expect(a + c).toBeCloseTo(-2 * ratio * 7, 9);
    expect(a * c - b * d).toBeCloseTo(49, 9);
    expect(b + d).toBe(0);
  }
});

test("grouping loses no pole: complex pairs, real pairs and one that is left over", () => {
  const poles: Complex[] = [[-4, 2], [-4, -2], [-16, 0], [-3, 0], [-9, 0]];
  const groups = grouped(poles);
  expect(groups.map((g) => g.single)).toEqual([false, false, true]);
  expect(sorted(groups.flatMap(polesOf))).toEqual(sorted(poles));
});

test("a pole that is dragged is where the pointer is, and its partner is its mirror image", () => {
  const at: Complex = [-5, 3];
  expect(sorted(polesOf(dragged(pair(9, 0.3), 0, at, 0.1)))).toEqual(sorted([[-5, 3], [-5, -3]]));
  expect(sorted(polesOf(dragged(pair(9, 0.3), 1, [-5, -3], 0.1)))).toEqual(sorted([[-5, 3], [-5, -3]]));
});

test("of two real poles only the one that is dragged moves, until it leaves the axis", () => {
  const real = ofReal(3, 16);
  expect(sorted(polesOf(dragged(real, 0, [-5, 0.05], 0.1)))).toEqual(sorted([[-5, 0], [-16, 0]]));
  expect(sorted(polesOf(dragged(real, 1, [-5, 0], 0.1)))).toEqual(sorted([[-5, 0], [-3, 0]]));
  expect(dragged(real, 0, [-6, 8], 0.1)).toEqual(pair(10, 0.6));
});

test("no pole can be dragged into the unstable half, and none beyond the fastest", () => {
  for (const place of [[4, 3], [4, 0], [-900, 900]] as Complex[]) {
    const poles = polesOf(within(dragged(pair(9, 0.3), 0, place, 0.1), 25));
    expect(poles.every(([re]) => re < 0)).toBe(true);
    expect(Math.hypot(...poles[0]!)).toBeLessThan(25 + 1e-9);
  }
  expect(polesOf(within(ofReal(3, 400), 25)).every(([re]) => re >= -25 - 1e-9)).toBe(true);
});

test("the roots of the characteristic polynomial are the poles of a companion matrix", () => {
  const A = [[0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1], [-100, -140, -44, -14]]; // (s^2 + 2 s + 10)(s^2 + 12 s + 10)
  const p = characteristic(A);
  expect(p.map((c) => Math.round(c * 1e9) / 1e9)).toEqual([1, 14, 44, 140, 100]);
  const expected: Complex[] = [[-1, 3], [-1, -3], [-6 - Math.sqrt(26), 0], [-6 + Math.sqrt(26), 0]];
  const rounded = roots(p).map(([re, im]): Complex => [re, Math.abs(im) < 1e-9 ? 0 : im]);
  expect(sorted(rounded)).toEqual(sorted(expected));
});

test("a plain difference over one period carries the rounding of two readings", () => {
  // u = (y - y_before) / T: each reading is off by resolution / sqrt(12), independently
  const T = 0.01, resolution = 1e-3, numbers = { lA0_0: 0, lB0_0: 1, lC0_0: -1 / T, lD0_0: 1 / T };
  expect(noise(numbers, 1, [resolution])).toBeCloseTo((Math.SQRT2 / T) * (resolution / Math.sqrt(12)), 12);
});
