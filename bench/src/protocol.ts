// What the page and the server say to each other over a rig's socket.

import type { FollowedWave, LawNumbers, Shape } from "./following";

export type Phase = "idle" | "starting" | "running" | "stopped" | "ended";

export interface Coordinate {
  name: string;
  unit: string;
  meaning: string;
  /** Encoder counts in a radian or a metre. */
  per_unit: number;
}

export interface Scene {
  type: "scene";
  name: string;
  title: string;
  kind: "TWIN" | "HARDWARE";
  coordinates: Coordinate[];
  command: { unit: string; limit: number; step: number };
  period: number;
  travel: number | null;
  /** Index of the coordinate that is driven. */
  moved: number;
  /** Readings about which the law holds the rig, and what the coordinates are where all readings are 0. */
  point: number[];
  zero: number[];
  poles: Complex[];
  K: number[];
  basis: { level: string; sentence: string };
  /** Which fit of the bench describes it, and of which log that is; "" where its own RIG.toml does. */
  model: { fit: string; of: string };
  /** How the rig was used when the bench last ran, and what to request to have it so again, where it is not. */
  last_use: { sentence: string; offer: { fit?: string; memory?: number } | null } | null;
  /** Of the filter that gives the law its velocities, 0 for plain differences; null where it has others. */
  memory: number | null;
  /** Why no page can move it by itself; "" where one can. */
  still: string;
  follows: boolean;
  /** Where the law follows a reference: index of the coordinate that is looked at, and what predicts its answer. */
  tracked?: number;
  linear?: { A: number[][]; B: number[]; delay: number };
  law?: LawNumbers;
  reference?: FollowedWave;
  /** How far from upright the supervisor lets it go. */
  lean: number | null;
  /** Of the model: frequency hanging [rad/s], unstable pole and zero [1/s]; the sets of poles that the paper prints. */
  facts: { hanging?: number; unstable?: number; zero: number | null; sets: Complex[][] };
  you: string;
}

export interface State {
  type: "state";
  state: Phase;
  why: string;
  operator: "you" | "another" | "nobody";
  tick: number;
  late: number;
  faults: string[];
  verdict: string;
  /** Why it cannot be swung up from where it hangs; "" where it can. */
  hanging: string;
  /** Where the run, or the last one, began. */
  from: "held" | "hanging" | "motions" | "sweep" | "step";
  /** Whether the report of a run is being written. */
  writing: boolean;
}

export type ServerMessage =
  | Scene
  | State
  | { type: "error"; sentence: string }
  | { type: "applied"; poles: Complex[]; K: number[]; at_tick: number };

export type ClientRequest =
  | { do: "operate" | "release" | "stop" | "end" | "rearm" }
  | { do: "start"; seconds?: number; start?: number[]; from?: State["from"]; accept?: string }
  | { do: "tap"; coordinate: string; speed: number }
  | { do: "poles"; poles: Complex[]; confirm?: boolean }
  | { do: "reference"; value: number; shape?: Shape; period?: number };

/** Samples of consecutive ticks. */
export interface Frame {
  first: number;
  late: number;
  /** Per encoder. */
  counts: Int32Array[];
  command: Float64Array;
}

export function decode(buffer: ArrayBuffer): Frame {
  const view = new DataView(buffer), first = view.getUint32(0, true), n = view.getUint16(4, true);
  const channels = view.getUint8(6), late = view.getUint8(7), bytes = 8 + (channels + 1) * (4 + 2 * n);
  if (buffer.byteLength !== bytes) throw new RangeError(`a frame of ${n} samples has ${bytes} bytes, got ${buffer.byteLength}`);
  let at = 8;
  const steps = () => {
    const values = Int32Array.from({ length: n }, (_, i) => view.getInt16(at + 2 * i, true));
    at += 2 * n;
    return values;
  };
  const counts = Array.from({ length: channels }, () => {
    const base = view.getInt32(at, true);
    at += 4;
    return steps().map((step) => base + step);
  });
  const scale = view.getFloat32(at, true);
  at += 4;
  return { first, late, counts, command: Float64Array.from(steps(), (step) => step * scale) };
}
