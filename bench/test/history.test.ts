import { expect, test } from "vitest";
import { History } from "../src/history";

const frame = (first: number, n: number) => ({
  first, late: 0, counts: [Int32Array.from({ length: n }, (_, i) => 10 * (first + i))], command: Float64Array.from({ length: n }, (_, i) => first + i),
});

test("of frames that follow on each other every sample is held, however long nobody looks", () => {
  const history = new History([10], 1000);
  for (let tick = 1; tick < 5000; tick += 23) history.add(frame(tick, 23));
  for (let back = 0; back < 1000; back++) {
    expect(history.ago(0, back)).toBe(history.last - back);
    expect(history.ago(1, back)).toBe(history.last - back);
  }
  expect(history.ago(0, 1000)).toBeNaN();
});

test("ticks that a slow line lost are gaps, and nothing stands for them", () => {
  const history = new History([10], 100);
  history.add(frame(1, 50));
  history.add(frame(61, 10));
  expect(history.ago(0, 9)).toBe(61);
  for (let back = 10; back < 20; back++) expect(history.ago(0, back)).toBeNaN();
  expect(history.ago(0, 20)).toBe(50);
});
