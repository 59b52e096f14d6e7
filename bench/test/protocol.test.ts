import { expect, test } from "vitest";
import { History } from "../src/history";
import { decode } from "../src/protocol";

// Written from the description of the format, byte by byte, not by the page's own reader.
function frame(first: number, counts: number[][], commands: number[], scale: number, late = 0): ArrayBuffer {
  const bytes: number[] = [];
  const little = (value: number, size: number) => {
    for (let i = 0; i < size; i++) bytes.push(Math.floor(value / 256 ** i) & 255);
  };
  const signed = (value: number, size: number) => little(value < 0 ? value + 256 ** size : value, size);
  little(first, 4);
  little(commands.length, 2);
  bytes.push(counts.length, late);
  for (const column of counts) {
    signed(column[0]!, 4);
    for (const count of column) signed(count - column[0]!, 2);
  }
  bytes.push(...new Uint8Array(new Float32Array([scale]).buffer));
  for (const command of commands) signed(Math.round(command / scale), 2);
  return new Uint8Array(bytes).buffer;
}

test("a frame gives back the counts and the command that were put into it", () => {
  const counts = [[-70_000, -70_001, -37_300], [16_000, 16_000, 16_002]], commands = [-5, 0.25, 4.75];
  const read = decode(frame(4_000_000_000, counts, commands, 0.25, 7));
  expect(read.first).toBe(4_000_000_000);
  expect(read.late).toBe(7);
  expect(read.counts.map((c) => [...c])).toEqual(counts);
  expect([...read.command]).toEqual(commands);
});

test("a frame of another length is refused", () => {
  const whole = frame(0, [[1, 2]], [0, 1], 0.5);
  expect(() => decode(whole.slice(0, -1))).toThrow(RangeError);
  expect(() => decode(whole.slice(0, 4))).toThrow(RangeError);
});

test("counts are radians by the encoder's counts in a radian, and the newest stands at the end", () => {
  const history = new History([8000 / Math.PI], 100);
  history.add(decode(frame(10, [[0, 4000, 8000]], [1, 2, 3], 1)));
  expect(history.ago(0, 0)).toBeCloseTo(Math.PI, 12);
  expect(history.ago(0, 1)).toBeCloseTo(Math.PI / 2, 12);
  expect(history.ago(1, 2)).toBe(1);
  expect(history.ago(0, 3)).toBeNaN();
  expect(history.farthest(0, Math.PI)).toBeCloseTo(Math.PI, 12);
});

test("ticks that a slow line lost stay empty, and older ones keep their place", () => {
  const history = new History([1], 50);
  history.add(decode(frame(0, [[5, 6]], [0, 0], 1)));
  history.add(decode(frame(4, [[7]], [0], 1)));
  expect([4, 3, 2, 1, 0].map((back) => history.ago(0, back))).toEqual([5, 6, NaN, NaN, 7]);
});

test("a run that begins again shows nothing of the one before", () => {
  const history = new History([1], 50);
  history.add(decode(frame(0, [[5, 6, 7]], [0, 0, 0], 1)));
  history.add(decode(frame(0, [[9]], [0], 1)));
  expect(history.last).toBe(0);
  expect(history.ago(0, 0)).toBe(9);
  expect(history.farthest(0, 0)).toBe(9);
});
