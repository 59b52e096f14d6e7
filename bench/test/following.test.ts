import { expect, test } from "vitest";
import { Followed, type FollowedWave, figures, linearAnswer, overshoot, sampled, valueAt, window } from "../src/following";

test("a sine and a square wave are what they are called, at every tick", () => {
  expect(valueAt({ shape: "sine", value: 2, period: 4 }, 1000, 1e-3)).toBeCloseTo(2, 12);
  expect(valueAt({ shape: "sine", value: 2, period: 4 }, 3000, 1e-3)).toBeCloseTo(-2, 12);
  const square = Array.from({ length: 40 }, (_, k) => valueAt({ shape: "square", value: 3, period: 0.02 }, k, 1e-3));
  expect(square).toEqual([1, -1, 1, -1].flatMap((side) => Array<number>(10).fill(3 * side)));
  expect([0, 999].map((k) => valueAt({ shape: "step", value: -1, period: 0 }, k, 1e-3))).toEqual([-1, -1]);
  expect([window({ shape: "sine", value: 1, period: 2 }, 1e-3), window({ shape: "step", value: 1, period: 0 }, 1e-3)]).toEqual([2000, 1000]);
});

test("an oscillator that is sampled turns by its angle, and a held force moves it as its closed form says", () => {
  const w = 27, T = 0.01, { F, G } = sampled([[0, 1], [-w * w, 0]], [0, 1], T);
  expect(F[0]![0]).toBeCloseTo(Math.cos(w * T), 12);
  expect(F[0]![1]).toBeCloseTo(Math.sin(w * T) / w, 12);
  expect(G[0]).toBeCloseTo((1 - Math.cos(w * T)) / w ** 2, 12);
  expect(G[1]).toBeCloseTo(Math.sin(w * T) / w, 12);
});

// An integrator x' = v, v' = u under u = k_pf r - K x with speeds from a difference: s^2 + k_v s + k.
const T = 1e-3, k = 25, kv = 6;
const law = { A: [[0]], B: [[1, 0]], C: [[kv / T]], D: [[-k - kv / T, k]], begin: [[1]] };
const loop = { A: [[0, 1], [0, 0]], B: [0, 1], law, period: T, limit: Infinity, delay: 0 };
const answer = (limit = Infinity) => linearAnswer({ ...loop, limit }, new Float64Array(6000).fill(2), [0, 0]);

test("a step overshoots a second order loop by exp(-pi z / sqrt(1 - z^2)) and ends where it is to end", () => {
  const rows = answer(), z = kv / (2 * Math.sqrt(k));
  const { beyond, wrong } = overshoot(0, 2, (i) => rows[i]![0]!, rows.length);
  expect(beyond).toBeCloseTo(Math.exp((-Math.PI * z) / Math.sqrt(1 - z * z)), 2);
  expect(wrong).toBe(0);
  expect(rows.at(-1)![0]).toBeCloseTo(2, 5);
  expect(rows[0]![2]).toBe(2 * k);
});

test("a command stops at its limit, and the answer is the parabola of a constant force until it leaves it", () => {
  const rows = answer(5), first = rows.findIndex((row) => row[2]! < 5);
  expect(first).toBeGreaterThan(300);
  expect(rows[first - 1]![0]).toBeCloseTo(2.5 * ((first - 1) * T) ** 2, 9);
});

test("begun at rest at its reference nothing moves", () => {
  const rows = linearAnswer(loop, new Float64Array(500).fill(0.3), [0.3, 0]);
  expect(Math.max(...rows.map((row) => Math.abs(row[0]! - 0.3)))).toBeLessThan(1e-12);
  expect(Math.max(...rows.map((row) => Math.abs(row[2]!)))).toBeLessThan(1e-9);
});

test("of a sine that is a quarter late the error is root two of its amplitude", () => {
  const n = 1000, error = figures(n, n, (i) => Math.sin((2 * Math.PI * i) / n), (i) => Math.cos((2 * Math.PI * i) / n))!;
  expect(error.rms).toBeCloseTo(1, 12);
  expect(error.peak).toBeCloseTo(Math.SQRT2, 4);
});

test("what was asked for at a tick is the wave of that time, and before the first nobody knows", () => {
  const followed = new Followed(), wave: FollowedWave = { shape: "step", value: 2, period: 0, tick: 10, about: [0.5, 1] };
  followed.take(wave);
  followed.take(wave); // told again, as with every change of gains
  followed.take({ ...wave, shape: "sine", value: 1, period: 4, tick: 20 });
  expect([9, 10, 19].map((tick) => followed.at(tick, 1, 0))).toEqual([NaN, 2.5, 2.5]);
  expect([20, 21, 23].map((tick) => followed.at(tick, 1, 1))).toEqual([1, 2, expect.closeTo(0, 12)]);
  expect(followed.before).toEqual(wave);
  followed.take({ ...wave, tick: 3 }); // of another run
  expect(followed.before).toBeUndefined();
  followed.take(undefined);
  expect(followed.now).toBeUndefined();
});

test("nothing is said of a period that is not whole or of which samples were lost", () => {
  expect(figures(99, 100, () => 0, () => 0)).toBeUndefined();
  expect(figures(100, 100, (i) => (i === 50 ? NaN : 0), () => 0)).toBeUndefined();
});

test("an answer that goes the wrong way first is said to", () => {
  const path = [1.1, 1.2, 1.3, 0, -1.3, -1]; // dry friction held it beside its reference
  const { beyond, wrong } = overshoot(1, -1, (i) => path[i]!, path.length);
  expect(beyond).toBeCloseTo(0.15, 12);
  expect(wrong).toBeCloseTo(0.1, 12);
});
