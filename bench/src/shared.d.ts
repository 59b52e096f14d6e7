// What the package's own classic scripts define (live/kernel.js, live/twin.js, live/drawing.js) and a rig's data.

type Complex = [re: number, im: number];
type Fate = "stands" | "saturates" | "falls";

interface TwinSettings {
  friction: number;
  delay: number;
  limit: number;
  counts: number;
  holding: boolean;
}

interface TwinData {
  coordinates: { name: string; unit: string; meaning: string }[];
  command: { unit: string; limit: number };
  point: number[];
  moved: number;
  period: number;
  resolution: number[];
  delay: number;
  start: number[];
  away: number[];
  seconds: number;
  travel: number | null;
  A: number[][];
  B: number[];
  K: number[];
  poles: Complex[];
  estimator: Record<"A" | "B" | "E" | "C" | "D" | "begin", number[][]>;
  one: { arguments: { name: string; shape?: number[] }[] };
  many: { width: number };
  lanes: number;
}

/** Polylines of a rig at coordinates: the name of what moves each ("" where nothing does) and its points. */
type Outline = (q: number[]) => [string, [number, number, number][]][];

declare const DATA: TwinData;
declare const OUTLINE: Outline;

declare function ackermann(A: number[][], B: number[], poles: Complex[]): number[];
declare function law(estimator: TwinData["estimator"], K: number[]): Record<string, number>;

declare class Twin {
  constructor(data: TwinData);
  one: { described: { parameters: string[] }; arrays: Record<"P" | "R", Float64Array> };
  settings: TwinSettings;
  gains: number[];
  lost: string;
  set(change: Partial<TwinSettings>): void;
  place(poles: Complex[]): void;
  restart(away?: number[]): void;
  push(coordinate: number, speed: number): void;
  advance(samples: number): Float64Array[];
}

declare class Ensemble {
  constructor(data: TwinData);
  words(settings: TwinSettings, gains: number[], first: number, after: number): Fate[];
}

declare class RigDrawing {
  static view(outline: Outline, positions: number[][]): { box: [number, number, number, number] };
  static make(tag: string, attributes: Record<string, string | number>, parent?: Element): SVGElement;
  constructor(parent: Element, outline: Outline, names: string[], view: object, ghost?: boolean);
  draw(q: number[]): void;
}
