import { expect, test } from "vitest";
import { LEAST } from "../src/poles";
import { Regulator, branches, prices } from "../src/regulator";

const sorted = (poles: Complex[]) => [...poles].sort(([a, b], [c, d]) => a - c || b - d);

function expectPoles(got: Complex[], wanted: Complex[], digits: number): void {
  expect(got.length).toBe(wanted.length);
  sorted(got).forEach((pole, i) => pole.forEach((x, part) => expect(x).toBeCloseTo(sorted(wanted)[i]![part]!, digits)));
}

test("a mass under a force has poles at R^(-1/4) and 45 degrees, as Riccati's equation says in closed form", () => {
  // S = [[sqrt(2) R^(1/4), R^(1/2)], [R^(1/2), sqrt(2) R^(3/4)]] solves it for Q = diag(1, 0)
  const mass = new Regulator({ A: [[0, 1], [0, 0]], B: [0, 1], deviations: [1, Infinity], limit: 1 });
  for (const R of [16, 1, 1e-4]) {
    const w = R ** -0.25 / Math.SQRT2;
    expectPoles(mass.poles(R), [[-w, w], [-w, -w]], 9);
  }
});

test("of one state the pole is -sqrt(a^2 + b^2 q / R)", () => {
  const one = new Regulator({ A: [[3]], B: [2], deviations: [0.5], limit: 4 });
  expectPoles(one.poles(10), [[-Math.sqrt(9 + (4 * 4 * 16) / 10), 0]], 9);
});

// Poles by scipy.linalg.solve_continuous_are, for Q = diag(1/(30 deg)^2, 0, 1/(15 deg)^2, 0) and R = price/(5 V)^2.
const A = [[0, 1, 0, 0], [0, -0.264, -23.176, 0.003], [0, 0, 0, 1], [0, 0.19, 63.716, -0.008]], B = [0, 85.805, 0, -61.723];
const rotary = new Regulator({ A, B, deviations: [Math.PI / 6, Infinity, Math.PI / 12, Infinity], limit: 5 });

test("of a rotary pendulum upright they are those of Riccati's equation as scipy solves it", () => {
  for (const [price, fast, slow] of [
    [1000, [-8.153022, 2.335112], [-3.136906, 2.666036]],
    [30, [-12.490518, 10.342977], [-4.553901, 2.454063]],
    [1, [-27.241488, 26.337282], [-4.590935, 2.402386]],
  ] as [number, Complex, Complex][])
    expectPoles(rotary.poles(price), [fast, [fast[0], -fast[1]], slow, [slow[0], -slow[1]]], 5);
});

test("a command that is dear leaves the stable pole where it is, and mirrors the unstable one", () => {
  const p = new Regulator({ A: [[0, 1], [9, 0]], B: [0, 1], deviations: [1, Infinity], limit: 1 }).poles(1e12);
  expectPoles(p, [[-3, 0], [-3, 0]], 2); // poles at +-3; a double root is known to the square root of the rounding
});

test("no price that is offered has a pole too slow or too fast, and the branches lose none", () => {
  const offered = prices(rotary, 30), all = branches(rotary, offered);
  expect(offered.length).toBeGreaterThan(20);
  offered.forEach((price, i) => {
    const sizes = rotary.poles(price).map(([re, im]) => Math.hypot(re, im));
    expect(Math.min(...sizes)).toBeGreaterThanOrEqual(LEAST.frequency);
    expect(Math.max(...sizes)).toBeLessThanOrEqual(30);
    expectPoles(all.map((branch) => branch[i]!), rotary.poles(price), 12);
  });
  for (const branch of all) // no branch jumps over to another one
    branch.slice(1).forEach(([re, im], i) => expect(Math.hypot(re - branch[i]![0], im - branch[i]![1])).toBeLessThan(4));
});
