import { expect, test } from "vitest";
import { decodeClass, summed, told } from "../src/classroom";

// Written from the description of the format, byte by byte, not by the page's own reader.
const frame = (late: number, students: [state: number, operated: number, away: number, seconds: number][]): ArrayBuffer => {
  const little = (value: number, size: number) => Array.from({ length: size }, (_, i) => Math.floor(value / 256 ** i) & 255);
  const bytes = [...little(students.length, 2), ...little(late, 4)];
  for (const [state, operated, away, seconds] of students) bytes.push(state, operated, ...little(away < 0 ? away + 65536 : away, 2), ...little(seconds, 2));
  return new Uint8Array(bytes).buffer;
};

test("a frame of a class gives back what was put into it", () => {
  const { late, students } = decodeClass(frame(70_000, [[2, 1, -523, 12], [5, 0, 524, 65535], [0, 0, 0, 0]]));
  expect(late).toBe(70_000);
  expect(students).toEqual([
    { state: "running", operated: true, away: -0.523, seconds: 12 },
    { state: "fell", operated: false, away: 0.524, seconds: 65535 },
    { state: "idle", operated: false, away: 0, seconds: 0 },
  ]);
});

test("a frame that is cut, or tells of no state, is refused", () => {
  expect(() => decodeClass(frame(0, [[2, 1, 0, 0]]).slice(0, 11))).toThrow(RangeError);
  expect(() => decodeClass(frame(0, [[9, 1, 0, 0]]))).toThrow(RangeError);
});

test("everybody is counted once", () => {
  const { students } = decodeClass(frame(0, [[2, 1, 0, 3], [5, 1, 0, 3], [0, 0, 0, 0], [1, 1, 0, 0], [4, 1, 0, 9], [3, 1, 0, 1], [6, 1, 0, 7]]));
  expect(summed(students)).toBe("1 upright, 1 recording, 1 fell, 1 stopped, 3 idle");
  expect(students.map(told)).toEqual(["upright for 3 s", "fell at 3 s", "nobody yet", "starting", "ended at 9 s", "stopped at 1 s", "recording for 7 s"]);
});
