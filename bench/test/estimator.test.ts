import { expect, test } from "vitest";
import { choices, filterOf, noiseOf } from "../src/estimator";
import { History } from "../src/history";

const T = 1e-3;

function moved(at: (tick: number) => number, a: number, ticks: number): History {
  const history = new History([1e9], ticks, T, a);
  const counts = [Int32Array.from({ length: ticks }, (_, k) => Math.round(1e9 * at(k)))];
  history.add({ first: 0, late: 0, counts, command: new Float64Array(ticks) });
  return history;
}

test("of a constant speed the velocity is that, after the filter has settled", () => {
  const history = moved((k) => 0.5 * k * T, 0.9, 400);
  expect(history.rate(0, 0)).toBeCloseTo(0.5, 5);
  expect(history.rate(0, 399)).toBe(0); // it begins at rest, as the law does
  expect(history.rate(0, 398)).toBeCloseTo(0.1 * 0.5, 5);
});

test("of a constant acceleration the velocity is late by what is said", () => {
  for (const a of [0, 0.5, 0.9]) {
    const history = moved((k) => (k * T) ** 2 / 2, a, 600), now = 599 * T;
    expect(now - history.rate(0, 0)).toBeCloseTo(filterOf(a, T).late, 6);
  }
});

test("a sine at the cutoff keeps the share of its velocity that the filter's transfer function leaves it", () => {
  const a = 0.95, w = 2 * Math.PI * filterOf(a, T).cutoff!, ticks = 4000;
  const history = moved((k) => 0.1 * Math.sin(w * k * T), a, ticks);
  const most = Math.max(...Array.from({ length: 1000 }, (_, k) => Math.abs(history.rate(0, k))));
  const size = Math.hypot(1 - a * Math.cos(w * T), a * Math.sin(w * T)); // |1 - a exp(-i w T)|
  const exact = ((1 - a) / size) * (2 / T) * Math.sin((w * T) / 2) * 0.1;
  expect(most / exact).toBeGreaterThan(0.99);
  expect(most / exact).toBeLessThan(1.001);
  expect(exact / (0.1 * w)).toBeCloseTo(Math.SQRT1_2, 2); // half of the power
});

test("rounding to counts gives the noise that is said", () => {
  const step = 1e-4, a = 0.8, ticks = 20_000, history = new History([1 / step], ticks, T, a);
  let place = 0, seed = 1; // steps of many counts, so that rounding is white
  const counts = [new Int32Array(ticks)], exact = new Float64Array(ticks);
  for (let k = 0; k < ticks; k++) {
    seed = (seed * 16807) % 2147483647;
    place += step * (20 * (seed / 2147483647) - 10);
    exact[k] = place;
    counts[0]![k] = Math.round(place / step);
  }
  history.add({ first: 0, late: 0, counts, command: new Float64Array(ticks) });
  let v = 0, power = 0;
  for (let k = 1; k < ticks; k++) {
    v = a * v + ((1 - a) * (exact[k]! - exact[k - 1]!)) / T;
    power += (history.rate(0, ticks - 1 - k) - v) ** 2 / ticks;
  }
  expect(Math.sqrt(power) / noiseOf(a, T, step)).toBeCloseTo(1, 1);
});

test("what was lost has no velocity, and the filter acts is among those that may be chosen", () => {
  const history = new History([1], 20, T, 0.5), frame = { late: 0, counts: [Int32Array.of(1, 2)], command: new Float64Array(2) };
  history.add({ ...frame, first: 0 });
  history.add({ ...frame, first: 5 });
  expect([0, 1, 2, 5].map((back) => history.rate(0, back))).toEqual([0.5 / T, 0, NaN, 0.5 / T]);
  expect(choices(0.7, T).map((filter) => filter.memory)).toEqual([0, 0.5, 0.7, 0.8, 0.9, 0.95]);
});
