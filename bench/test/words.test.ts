import { expect, test } from "vitest";
import { rangeFor, short, signed, significant, symbol } from "../src/words";

test("nothing has no sign, and a minus is a minus", () => {
  expect(signed(-0.04, 1)).toBe("0.0");
  expect(signed(-1.25, 2)).toBe("−1.25");
});

test("digits are significant ones and no number has an exponent", () => {
  expect([0.0123456, 5, 1234.5, -14.2, 0].map((v) => significant(v))).toEqual(["0.0123", "5.00", "1235", "−14.2", "0.00"]);
});

test("a range holds its value, in steps of 1-2-5, and angles go on in half turns", () => {
  expect([0, 5, 5.1, 19, 51, 100, 200].map((v) => rangeFor(v, 5, "deg"))).toEqual([5, 5, 10, 20, 90, 180, 360]);
  expect([0.3, 1.01, 2, 30].map((v) => rangeFor(v, 0.1, "cm"))).toEqual([0.5, 2, 2, 50]);
});

test("a coordinate is named by what it measures", () => {
  expect(short("angle of the pendulum, 0 hanging")).toBe("pendulum");
  expect(short("position of cart 1")).toBe("cart 1");
  expect(short("position")).toBe("position");
  expect(["theta", "theta_1", "x_2", "x"].map(symbol)).toEqual(["θ", "θ₁", "x₂", "x"]);
});
