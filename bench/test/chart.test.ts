import { expect, test } from "vitest";
import { decades } from "../src/chart";

test("a logarithmic axis has powers of ten with twice and five times them, and powers alone where they are many", () => {
  const close = (found: number[], wanted: number[]) => {
    expect(found.length).toBe(wanted.length);
    found.forEach((v, k) => expect(v / wanted[k]!).toBeCloseTo(1, 9));
  };
  close(decades(3, 35), [5, 10, 20]);
  close(decades(0.09, 1), [0.1, 0.2, 0.5, 1]);
  close(decades(1e-4, 10), [1e-4, 1e-3, 1e-2, 0.1, 1, 10]);
});
