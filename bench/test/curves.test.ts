import { expect, test } from "vitest";
import { marks, span } from "../src/curves";

test("marks lie within their range, in steps of 1-2-5, with as many digits as tell them apart", () => {
  expect(marks(-31, 72, 4)).toEqual({ at: [0, 50], digits: 0 });
  expect(marks(0.5, 18.5, 5).at).toEqual([5, 10, 15]);
  const { at, digits } = marks(-0.013, 0.021, 4);
  expect(at.map((v) => v.toFixed(digits))).toEqual(["-0.01", "0.00", "0.01", "0.02"]);
  expect(marks(2, 2, 4).at).toEqual([2]);
});

test("a model that runs away does not flatten what was measured, and one that misses a little is seen whole", () => {
  const [low, high] = span([-1, 1], [-1, 1e9]);
  expect(high).toBeLessThan(5);
  expect(low).toBeGreaterThan(-2);
  expect(span([-1, 1], [-1.5, 1.2])[0]).toBeLessThan(-1.5);
  const [from, to] = span([3, 3], [3, 3]);
  expect(to).toBeGreaterThan(from);
});
