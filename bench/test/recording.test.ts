import { expect, test } from "vitest";
import { gapWords, stepped, within } from "../src/recording";

test("an axis holds every value in whole steps, and is never without height", () => {
  expect(stepped([-170, -20], 90)).toEqual({ low: -180, high: 0, at: [-180, -90, 0] });
  expect(stepped([0, 0], 20)).toMatchObject({ low: 0, high: 20 });
  expect(stepped([-39, 19.5], 20, 1)).toMatchObject({ low: -40, high: 40 });
});

test("a value has the digits that half the width of its interval leaves", () => {
  expect(within(7.3566, 0.106)).toBe("7.36 ± 0.11");
  expect(within(-165.25, 6.2)).toBe("\u2212165.3 ± 6.2");
  expect(within(-31.8, 51)).toBe("\u221232 ± 51");
  expect([within(null, null), within(-31.84, null)]).toEqual(["none", "\u221231.8"]);
});

test("where no sine is planned near a mode, it says why", () => {
  expect(gapWords([])).toBe("");
  expect(gapWords([[7.9814, 118.3], [20, null]])).toBe(
    " None is planned within 10 % of the mode at 7.98 rad/s: it would take 118 s to settle, and a weaker one is lost in dry friction. None is planned within 10 % of the mode at 20.0 rad/s: it would never settle, and a weaker one is lost in dry friction.",
  );
});
