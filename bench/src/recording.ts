// A sweep or a step that the rig records: its Bode points as they are measured, or its answer as it comes.

import { type Line, drawChart } from "./chart";
import { type Curve, drawCurves } from "./curves";
import { byId, italic, make, say } from "./dom";
import { short, shownUnit, signed, significant, symbol } from "./words";

interface Point {
  omega: number;
  /** null where a coordinate did not move. */
  dB: (number | null)[];
  deg: (number | null)[];
  dB_error: (number | null)[];
  deg_error: (number | null)[];
  settled: boolean;
}

export interface Recorded {
  kind: "sweep" | "step";
  over: boolean;
  /** Name of the run that it was; "" until it is over. */
  run: string;
  command: string;
  seconds: number;
  time: number;
  /** Samples that were not read in time. */
  lost: number;
  /** Why its file was not stored; "" where it was. */
  why: string;
  outputs: { name: string; unit: string; meaning: string }[];
  planned?: number[];
  /** Modes near which there is no sine [rad/s], and how long one would take to settle [s]; null where it never does. */
  gaps?: [number, number | null][];
  line?: { omega: number[]; dB: number[][]; deg: number[][] };
  points?: Point[];
  measured?: Curve[];
  predicted?: Curve[];
  reading?: { omega: number; omega_error: number; zeta: number; zeta_error: number } | null;
  modes?: Partial<Record<"free" | "held", [number, number]>>;
}

const DEGREES = 90, LEAST = 1.5; // a phase axis is written in these steps; room above and below gains [dB]

/** Range and marks of an axis that holds some values, in whole steps. */
export function stepped(values: number[], step: number, room = 0): { low: number; high: number; at: number[] } {
  const whole = (value: number, round: (v: number) => number) => round(value / step) * step || 0;
  const low = whole(Math.min(...values) - room, Math.floor), high = Math.max(low + step, whole(Math.max(...values) + room, Math.ceil));
  return { low, high, at: Array.from({ length: Math.round((high - low) / step) + 1 }, (_, i) => low + i * step) };
}

/** A value with half the width of its interval, to the digits that this leaves. */
export function within(value: number | null, half: number | null): string {
  if (value === null) return "none";
  if (half === null) return signed(value, 1);
  const digits = half > 0 ? Math.max(0, Math.min(4, 1 - Math.floor(Math.log10(half)))) : 3;
  return `${signed(value, digits)} ± ${signed(half, digits)}`;
}

/** Why there is no sine near some modes; "" where there is none without. */
export function gapWords(gaps: [number, number | null][]): string {
  return gaps.map(([omega, seconds]) => ` None is planned within 10 % of the mode at ${significant(omega, 3)} rad/s: it would ${seconds === null ? "never settle" : `take ${seconds.toFixed(0)} s to settle`}, and a weaker one is lost in dry friction.`).join("");
}

export class Recording {
  private recorded: Recorded | undefined;
  private built = "";

  constructor(private readonly address: string, private readonly file: (name: string) => string) {}

  /** What is recorded so far; whether there is anything. */
  async look(): Promise<boolean> {
    const answer = await fetch(`${this.address}/recording`).catch(() => undefined);
    const recorded = answer?.ok ? ((await answer.json()) as Recorded | null) : null;
    if (!recorded) return this.recorded !== undefined;
    this.recorded = recorded;
    const { kind, outputs, line, measured } = this.recorded, now = JSON.stringify([kind, outputs, !!line, !!measured]);
    if (now !== this.built) this.build();
    this.built = now;
    this.words();
    this.draw();
    return true;
  }

  get over(): boolean {
    return this.recorded?.over ?? true;
  }

  private build(): void {
    const { kind, outputs, command } = this.recorded!, sweep = kind === "sweep";
    say(byId("record-title"), sweep ? "Frequency response, sine by sine" : "Step response");
    byId("record-sines").hidden = byId("record-unsettled").hidden = !sweep;
    byId("record-read").hidden = sweep;
    say(byId("record-model"), sweep ? "model, without dry friction" : "model");
    const head = (output: Recorded["outputs"][number]) => [italic(symbol(output.name)), ` ${short(output.meaning)} `];
    byId("record-pictures").replaceChildren(...outputs.map((output) => {
      const name = short(output.meaning), shown = sweep ? output.unit : shownUnit(output.unit).unit;
      const canvas = (what: string) => make("canvas", { role: "img", "aria-label": `${what} of the ${name}, measured and by the model` });
      return sweep
        ? make("div", { class: "bode" }, make("h3", {}, ...head(output), make("span", { class: "unit" }, `gain [dB, 1 ${shown}/${command}]`)), canvas("Gain"), make("h3", {}, make("span", { class: "unit" }, "phase [deg]")), canvas("Phase"))
        : make("div", { class: "curve" }, make("h3", {}, ...head(output), make("span", { class: "unit" }, `[${shown}]`)), canvas("Step response"));
    }));
    byId("record-head").replaceChildren(make("th", { scope: "col" }, "rad/s"), ...outputs.flatMap((output) => [
      make("th", { scope: "col", class: "number" }, italic(symbol(output.name)), " dB"), make("th", { scope: "col", class: "number" }, italic(symbol(output.name)), " deg"),
    ]));
  }

  private words(): void {
    const { kind, over, run, time, lost, why, seconds, planned, gaps, points, reading, modes } = this.recorded!, link = byId<HTMLAnchorElement>("record-file");
    const done = `${time.toFixed(0)} s of ${seconds.toFixed(0)} s`, unsettled = points?.filter((point) => !point.settled).length ?? 0;
    const measured = `${points?.length ?? 0} of ${planned?.length ?? 0} sines measured`;
    const late = unsettled ? ` ${unsettled === 1 ? "One has" : `${unsettled} have`} not settled, and count for less.` : "";
    say(byId("record-says"), (kind === "sweep" ? `${measured}, ${done}.${gapWords(gaps ?? [])}` : `${done}.`) + (over && kind === "sweep" ? late : "") + (over && run ? " It is kept as a run, and can be identified." : "") + (why ? ` ${why}` : ""));
    link.hidden = !over || !run || !!why || !points?.length;
    link.href = this.file(`${run}.frequency.csv`);
    byId("record-points").replaceChildren(...(points ?? []).map((point) => make("tr", {}, make("th", { scope: "row" }, significant(point.omega, 3)),
      ...point.dB.flatMap((dB, k) => [dB, point.deg[k] ?? null].map((value, i) => make("td", { class: "number" }, within(value, (i ? point.deg_error : point.dB_error)[k] ?? null)))))));
    if (kind !== "step") return;
    const rows: [string, string, string][] = reading
      ? [["measured swing", within(reading.omega, reading.omega_error), within(reading.zeta, reading.zeta_error)]]
      : [["measured swing", lost ? "samples were lost; record it again" : over ? "too few turning points" : "waiting for four turning points", ""]];
    for (const [how, [omega, zeta]] of Object.entries(modes ?? {})) rows.push([modes!.held ? `model, driven body ${how}` : "model", significant(omega, 4), significant(zeta, 2)]);
    byId("record-reading").replaceChildren(...rows.map(([name, omega, zeta]) => make("tr", {}, make("th", { scope: "row" }, name), make("td", { class: "number" }, omega), make("td", { class: "number" }, zeta))));
  }

  draw(): void {
    const { outputs, line, points, measured, predicted } = this.recorded ?? {};
    if (!outputs) return;
    const canvases = document.querySelectorAll<HTMLCanvasElement>("#record-pictures canvas");
    if (line) outputs.forEach((_, k) => (["dB", "deg"] as const).forEach((what, i) => {
      const model = line[what][k]!, known = points ?? [], y = known.flatMap((point) => point[what][k] ?? []), colour = `--q${k % 4}`;
      const range = stepped([...model, ...y], what === "dB" ? 20 : DEGREES, what === "dB" ? LEAST : 5);
      const some = (settled: boolean): Line => {
        const those = known.filter((point) => point.settled === settled && point[what][k] !== null);
        return { x: those.map((point) => point.omega), y: those.map((point) => point[what][k]!), error: those.map((point) => point[`${what}_error`][k] ?? 0), colour, points: settled ? "filled" : "hollow" };
      };
      drawChart(canvases[2 * k + i]!, {
        x: { low: line.omega[0]!, high: line.omega.at(-1)!, unit: "rad/s", log: true }, y: { ...range, unit: "" },
        lines: [{ x: line.omega, y: model, colour: "--ink", dashes: [6, 3], thick: 1.2 }, some(true), some(false)],
      });
    }));
    if (measured && predicted) outputs.forEach(({ unit }, k) => {
      const came = measured[k]!, all = predicted[k]!;
      // the whole time from the beginning on, so that nothing moves but what is new
      const padded: Curve = [[...came[0], all[0].at(-1)!], [...came[1], null]];
      if (came[0].length) drawCurves(canvases[k]!, { measured: padded, predicted: all, from: 0, scale: shownUnit(unit).scale, colour: `--q${k % 4}` });
    });
  }
}
