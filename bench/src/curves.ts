// A signal as measured and as a model has it, against time, on a canvas.

import { surface } from "./surface";
import { signed } from "./words";

/** Times and values of a curve; a value is null where there is none. */
export type Curve = [number[], (number | null)[]];

export interface Curves {
  measured: Curve;
  predicted: Curve;
  /** From where on nothing was fitted [s]. */
  from: number;
  scale: number;
  /** Custom property of the measured curve's colour. */
  colour: string;
}

const LEFT = 52, BELOW = 22, TOP = 8, RIGHT = 8, ROOM = 0.06; // px; share of the span above and below

/** Marks in steps of 1, 2 or 5 within a range, about as many as wanted. */
export function marks(low: number, high: number, wanted: number): { at: number[]; digits: number } {
  if (!(high > low)) return { at: [low], digits: 2 };
  const rough = (high - low) / wanted, power = 10 ** Math.floor(Math.log10(rough));
  const step = [1, 2, 5, 10].map((m) => m * power).find((s) => s >= rough * (1 - 1e-9))!;
  const first = Math.ceil(low / step - 1e-9), last = Math.floor(high / step + 1e-9);
  const at = Array.from({ length: last - first + 1 }, (_, i) => (first + i) * step);
  return { at, digits: Math.max(0, -Math.floor(Math.log10(step) + 1e-9)) };
}

/** Least and largest of what is there; of the model no more than thrice what was measured, should it run away. */
export function span(measured: number[], predicted: number[]): [number, number] {
  const low = Math.min(...measured), high = Math.max(...measured), most = (high - low || Math.abs(high) || 1e-3);
  const lowest = Math.max(Math.min(low, ...predicted), low - most), highest = Math.min(Math.max(high, ...predicted), high + most);
  const room = (highest - lowest || most) * ROOM;
  return [lowest - room, highest + room];
}

export function drawCurves(canvas: HTMLCanvasElement, { measured, predicted, from, scale, colour }: Curves): void {
  const on = surface(canvas);
  if (!on) return;
  const { c, width, height, tone } = on;
  const scaled = ([, y]: Curve) => y.map((v) => (v === null ? null : v * scale));
  const there = (y: (number | null)[]) => y.filter((v): v is number => v !== null);
  const ys = scaled(measured), model = scaled(predicted), [low, high] = span(there(ys), there(model));
  const t0 = measured[0][0]!, t1 = measured[0].at(-1)!, right = width - RIGHT, bottom = height - BELOW;
  const x = (t: number) => LEFT + ((right - LEFT) * (t - t0)) / (t1 - t0 || 1);
  const y = (v: number) => TOP + ((bottom - TOP) * (high - v)) / (high - low);
  if (from > t0) {
    c.fillStyle = tone("--sunken");
    c.fillRect(x(from), TOP, right - x(from), bottom - TOP);
  }
  c.fillStyle = tone("--ink-2");
  c.lineWidth = 1;
  const vertical = marks(low, high, Math.max(2, (bottom - TOP) / 36)), times = marks(t0, t1, Math.max(2, (right - LEFT) / 90));
  c.textAlign = "right";
  for (const v of vertical.at) {
    c.strokeStyle = tone(v ? "--line" : "--line-strong");
    c.beginPath();
    c.moveTo(LEFT, y(v));
    c.lineTo(right, y(v));
    c.stroke();
    c.fillText(signed(v, vertical.digits), LEFT - 6, y(v) + 4.5);
  }
  c.textAlign = "center";
  for (const t of times.at) if (x(t) < right - 12) c.fillText(signed(t, times.digits), x(t), height - 6);
  c.textAlign = "right";
  c.fillText("s", right, height - 6);
  c.save();
  c.beginPath();
  c.rect(LEFT, TOP, right - LEFT, bottom - TOP);
  c.clip();
  const line = (times: number[], values: (number | null)[], stroke: string, thick: number, dashes: number[]) => {
    c.strokeStyle = stroke;
    c.lineWidth = thick;
    c.lineJoin = "round";
    c.setLineDash(dashes);
    c.beginPath();
    let drawing = false;
    values.forEach((v, k) => {
      if (v === null) drawing = false;
      else if (drawing) c.lineTo(x(times[k]!), y(v));
      else c.moveTo(x(times[k]!), y(v));
      drawing = v !== null;
    });
    c.stroke();
    c.setLineDash([]);
  };
  line(measured[0], ys, tone(colour), 3, []);
  line(predicted[0], model, tone("--ink"), 1.2, [6, 3]);
  c.restore();
}
