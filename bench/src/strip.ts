// A strip chart on a canvas: a line, its grid, its limits.

import { surface } from "./surface";
import { rangeFor, significant } from "./words";

export interface Strip {
  /** Values from -range to range are shown, and those of -tick and tick are written. */
  range: number;
  tick: number;
  /** Custom property of the line's colour. */
  colour: string;
  count: number;
  at: (k: number) => number;
  /** A second line, thin, behind the first: what it is to be. */
  also?: (k: number) => number;
  /** Labels of the time axis, from left to right. */
  times: string[];
  limit?: number;
}

const LEFT = 52, BELOW = 20, TOP = 8, CLOSE = 64; // px

export function drawStrip(canvas: HTMLCanvasElement, strip: Strip): void {
  const on = surface(canvas);
  if (!on) return;
  const { c, width, height, tone } = on;
  const { range, tick, limit, count } = strip, right = width - 6;
  const x = (k: number) => LEFT + ((right - LEFT) * k) / Math.max(1, count - 1);
  const y = (v: number) => TOP + ((height - BELOW - TOP) * (1 - Math.max(-1, Math.min(1, v / range)))) / 2;
  const level = (v: number) => { c.moveTo(LEFT, y(v)); c.lineTo(width, y(v)); };
  c.fillStyle = tone("--ink-2");
  c.lineWidth = 1;
  c.textAlign = "right";
  for (const v of [-tick, 0, tick]) {
    c.strokeStyle = tone(v ? "--line" : "--line-strong");
    c.beginPath();
    level(v);
    c.stroke();
    c.fillText(v ? significant(v, tick % 1 ? 2 : 1) : "0", LEFT - 6, y(v) + 4.5);
  }
  strip.times.forEach((time, i) => {
    const last = strip.times.length - 1;
    if ((right - LEFT) / last < CLOSE && i % last) return; // a phone has room for the first and the last
    c.textAlign = i === 0 ? "left" : i === last ? "right" : "center";
    c.fillText(time, LEFT + ((right - LEFT) * i) / last, height - 4);
  });
  if (limit !== undefined && limit <= range) {
    c.strokeStyle = tone("--care");
    c.setLineDash([5, 4]);
    c.beginPath();
    level(limit);
    level(-limit);
    c.stroke();
    c.setLineDash([]);
  }
  // More samples than pixels: the least and the largest of each pixel say all that can be seen.
  const each = Math.max(1, Math.floor(count / (right - LEFT)));
  const line = (at: (k: number) => number, name: string, thick: number) => {
    let drawing = false;
    const point = (k: number, v: number) => {
      if (drawing) c.lineTo(x(k), y(v));
      else c.moveTo(x(k), y(v));
      drawing = true;
    };
    c.strokeStyle = tone(name);
    c.lineWidth = thick;
    c.lineJoin = "round";
    c.beginPath();
    for (let k = 0; k < count; k += each) {
      let low = Infinity, high = -Infinity;
      for (let i = k; i < Math.min(count, k + each); i++) {
        const v = at(i);
        if (v < low) low = v;
        if (v > high) high = v;
      }
      if (low > high) {
        drawing = false; // nothing came
        continue;
      }
      point(k, low);
      if (high > low) point(k, high);
    }
    c.stroke();
  };
  if (strip.also) line(strip.also, "--ink", 1.2);
  line(strip.at, strip.colour, 1.8);
}

/** Scale of values about zero. */
export function about(most: number, least: number, unit: string): { range: number; tick: number } {
  const range = rangeFor(most, least, unit);
  return { range, tick: range };
}

/** Scale of a command with its limit; one that stays far below it is drawn larger. */
export const limited = (limit: number, most: number): { range: number; tick: number; limit: number } =>
  most > limit / 4 ? { range: 1.15 * limit, tick: limit, limit } : { ...about(most, limit / 50, ""), limit };
