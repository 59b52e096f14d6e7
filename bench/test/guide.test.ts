import { expect, test } from "vitest";
import { largest } from "../src/foresight";
import { compared } from "../src/guide";
import { TASKS } from "../src/tasks";

test("the largest value up to which something holds is enclosed to its halvings", () => {
  expect(Math.abs(largest((v) => v * v <= 2, 20, 40) - Math.SQRT2)).toBeLessThan(1e-10);
  expect(largest(() => true, 20, 12)).toBe(20);
  expect(largest((v) => v <= 0, 20, 12)).toBe(0);
});

test("a prediction is called what it is beside the model", () => {
  expect(compared(8, 8, "rad/s", 0.1)).toContain("close, 0 % off");
  expect(compared(8.7, 8, "rad/s", 0.1)).toContain("close, 9 % off");
  expect(compared(4, 8, "rad/s", 0.1)).toBe("You said 4.00 rad/s; the model has 8.00 rad/s: too small, 50 % off.");
  expect(compared(-8, 8, "V", 0.1)).toContain("too small, 200 % off");
  expect(compared(800, 8, "V", 0.1)).toContain("too large, far off");
  expect(compared(0, 0, "%", 0.1)).toBe("You said 0.00 %; the model has 0.00 %: close.");
  expect(compared(5, 0, "%", 0.1)).toBe("You said 5.00 %; the model has 0.00 %: too large.");
});

test("no task gives its answer away: its texts have no number that a rig could have", () => {
  for (const task of TASKS) expect(task.ask.replace(/Table 1/, "")).not.toMatch(/\d/);
  expect(new Set(TASKS.map((task) => task.answer)).size).toBe(TASKS.length);
});
