// Lines and points against linear or logarithmic axes, on a canvas.

import { marks } from "./curves";
import { surface } from "./surface";
import { signed, significant } from "./words";

export interface Axis {
  low: number;
  high: number;
  unit: string;
  /** Whether equal distances are equal ratios. */
  log?: boolean;
  /** Values that are written, where they are not in steps of 1, 2 or 5. */
  at?: number[];
}

export interface Line {
  x: number[];
  y: number[];
  /** Custom property of its colour. */
  colour: string;
  /** Points instead of a line; filled or hollow. */
  points?: "filled" | "hollow";
  /** Either side of each point. */
  error?: number[];
  dashes?: number[];
  thick?: number;
  /** Written at its end. */
  name?: string;
}

export interface Chart {
  x: Axis;
  y: Axis;
  lines: Line[];
  /** A value at which a level is drawn. */
  level?: number;
}

const LEFT = 52, BELOW = 22, TOP = 8, RIGHT = 8, DOT = 4; // px

/** Powers of ten with 1, 2 and 5 times them within a range, or powers alone where there are many. */
export function decades(low: number, high: number): number[] {
  const first = Math.floor(Math.log10(low)), last = Math.ceil(Math.log10(high)), times = last - first > 3 ? [1] : [1, 2, 5];
  return Array.from({ length: last - first + 1 }, (_, i) => times.map((m) => m * 10 ** (first + i))).flat()
    .filter((v) => v >= low * (1 - 1e-9) && v <= high * (1 + 1e-9));
}

export function drawChart(canvas: HTMLCanvasElement, { x: across, y: up, lines, level }: Chart): void {
  const on = surface(canvas);
  if (!on) return;
  const { c, width, height, tone } = on;
  const named = lines.some((line) => line.name), right = width - RIGHT - (named ? 24 : 0), bottom = height - BELOW;
  const share = ({ low, high, log }: Axis, v: number) => (log ? Math.log(v / low) / Math.log(high / low) : (v - low) / (high - low || 1));
  const x = (v: number) => LEFT + (right - LEFT) * share(across, v), y = (v: number) => bottom - (bottom - TOP) * share(up, v);
  c.lineWidth = 1;
  c.fillStyle = tone("--ink-2");
  const written = (axis: Axis, wanted: number): [number, string][] => {
    if (axis.log) return decades(axis.low, axis.high).map((v) => [v, significant(v, 1)]);
    const { at, digits } = axis.at ? { at: axis.at, digits: 0 } : marks(axis.low, axis.high, Math.max(2, wanted));
    return at.map((v) => [v, signed(v, digits)]);
  };
  const stroke = (name: string, from: [number, number], to: [number, number]) => {
    c.strokeStyle = tone(name);
    c.beginPath();
    c.moveTo(...from);
    c.lineTo(...to);
    c.stroke();
  };
  c.textAlign = "right";
  for (const [v, text] of written(up, (bottom - TOP) / 36)) {
    stroke(v ? "--line" : "--line-strong", [LEFT, y(v)], [right, y(v)]);
    c.fillText(text, LEFT - 6, y(v) + 4.5);
  }
  const end = width - c.measureText(across.unit).width - 12;
  let free = 0;
  c.textAlign = "center";
  for (const [v, text] of written(across, (right - LEFT) / 90)) {
    stroke("--line", [x(v), TOP], [x(v), bottom]);
    const half = c.measureText(text).width / 2;
    if (x(v) - half < free || x(v) + half > end) continue;
    c.fillText(text, x(v), height - 6);
    free = x(v) + half + 8;
  }
  c.textAlign = "right";
  c.fillText(across.unit, width - 4, height - 6);
  if (level !== undefined) {
    c.setLineDash([5, 4]);
    stroke("--care", [LEFT, y(level)], [right, y(level)]);
    c.setLineDash([]);
  }
  c.save();
  c.beginPath();
  c.rect(LEFT - DOT, TOP - DOT, right - LEFT + 2 * DOT, bottom - TOP + 2 * DOT);
  c.clip();
  for (const line of lines) {
    c.strokeStyle = c.fillStyle = tone(line.colour);
    c.lineWidth = line.thick ?? 1.8;
    c.lineJoin = "round";
    c.setLineDash(line.dashes ?? []);
    if (line.points) line.x.forEach((v, k) => {
      const e = line.error?.[k] ?? 0, at = line.y[k]!;
      if (!Number.isFinite(at)) return;
      c.beginPath();
      c.moveTo(x(v), y(at - e));
      c.lineTo(x(v), y(at + e));
      c.stroke();
      c.beginPath();
      c.arc(x(v), y(at), DOT, 0, 2 * Math.PI);
      c.fillStyle = tone(line.points === "filled" ? line.colour : "--paper");
      c.fill();
      c.stroke();
    });
    else {
      c.beginPath();
      let drawing = false;
      line.x.forEach((v, k) => {
        const there = Number.isFinite(line.y[k]!);
        if (there && drawing) c.lineTo(x(v), y(line.y[k]!));
        else if (there) c.moveTo(x(v), y(line.y[k]!));
        drawing = there;
      });
      c.stroke();
    }
    c.setLineDash([]);
  }
  c.restore();
  c.textAlign = "left";
  const names = lines.flatMap(({ name, colour, y: values }) => {
    const last = values.at(-1) ?? NaN;
    return name && Number.isFinite(last) ? [{ name, colour, at: y(Math.min(up.high, Math.max(up.low, last))) + 4.5 }] : [];
  }).sort((a, b) => b.at - a.at);
  let below = Infinity; // names of lines that end at one place stand above each other
  for (const { name, colour, at } of names) {
    below = Math.max(TOP + 8, Math.min(bottom, at, below - 15));
    c.fillStyle = tone(colour);
    c.fillText(name, right + 4, below);
  }
}
