// Screen Track: a reference for the coordinate that follows, what a model makes of it, and what the rig makes of it.

import { lock, message } from "./bar";
import { byId, field, make, say } from "./dom";
import { type Figures, type Shape, type Wave, figures, linearAnswer, overshoot, valueAt, window } from "./following";
import type { Session } from "./session";
import { about, drawStrip, limited } from "./strip";
import { OTHERS, short, shownUnit, significant, symbol } from "./words";

const LONG = 0.1; // share of the time at the limit above which nothing is followed
const SECONDS = 3, LONGEST = 10; // prediction of a step, period of a wave [s]
const FARTHEST = Math.PI; // reference where the travel has no end [rad or m]
const FIGURES = 15; // frames between two figures
const FULL = 1 - 1e-6;

const clean = (degrees: number) => significant(degrees, 3);

/** The twin in the page with a reference that it follows: its kernel reads one value per sample. */
function following(samples: number): Twin {
  const withRoom = DATA.one.arguments.map((a) => (a.name === "R" ? { name: "R", shape: [samples, 1] } : a));
  return new Twin({ ...DATA, one: { ...DATA.one, arguments: withRoom } });
}

export class Track {
  private wave: Wave = { shape: "step", value: 0, period: 4 };
  private size: HTMLInputElement | undefined;
  private built = "";
  private law = "";
  private twin: Twin | undefined;
  /** Where the prediction begins, and its rows of coordinate, velocity, ..., command, as deviations from what is held. */
  private start = 0;
  private rows: Float64Array[] = [];
  private reference = new Float64Array();
  private outcome = "";
  private idle = 0;
  private drawn = -1;

  constructor(private readonly session: Session) {
    byId("shape").addEventListener("change", () => {
      this.wave.shape = byId<HTMLSelectElement>("shape").value as Shape;
      this.moved();
    });
    const press = (id: string, act: () => void) => byId(id).addEventListener("click", () => {
      const why = byId(id).dataset["why"];
      if (why) message(why);
      else act();
    });
    press("follow", () => session.steer({ do: "reference", ...this.asked() }));
    press("home", () => session.steer({ do: "reference", value: 0 }));
    new ResizeObserver(() => this.charts()).observe(byId("foreseen"));
  }

  /** It has come to be seen: what had no size is drawn. */
  shown(): void {
    this.drawn = -2;
    this.charts();
  }

  private asked(): { value: number; shape: Shape; period?: number } {
    const { shape, value, period } = this.wave;
    return shape === "step" ? { shape, value } : { shape, value, period };
  }

  /** Takes over what is known of the rig; the twin in the page predicts as soon as it is there. */
  scene(moving: boolean): void {
    const scene = this.session.scene!, { tracked, law, linear } = scene;
    if (tracked === undefined || !law || !linear) return;
    const { coordinates, travel } = scene, driven = coordinates[tracked]!, { unit, scale } = shownUnit(driven.unit);
    const built = JSON.stringify([driven, travel]), now = JSON.stringify([law, scene.reference, moving]);
    if (built !== this.built) {
      this.built = built;
      const most = 3 * Math.min(travel ?? FARTHEST, FARTHEST) * scale, usual = unit === "deg" ? 30 : Math.min(5, most / 9);
      this.wave.value = usual / scale;
      const size = field("size", unit, usual, [-most, most, unit === "deg" ? 1 : 0.1], (value) => { this.wave.value = value / scale; this.moved(); });
      const period = field("period", "s", this.wave.period, [0.5, LONGEST, 0.1], (value) => { this.wave.period = value; this.moved(); });
      size.input.id = "wave-size";
      period.input.id = "wave-period";
      this.size = size.input;
      byId("wave").replaceChildren(size.row, period.row);
      const mark = make("i", { class: `q${tracked % 4}` }, symbol(driven.name));
      byId("track-of").replaceChildren(mark, ` ${short(driven.meaning)} [${unit}]`);
    }
    if (now !== this.law) {
      this.law = now;
      if (moving) this.twin ??= following(Math.ceil((2 * LONGEST) / scene.period));
      this.moved();
    }
  }

  /** Puts a wave into the fields, as somebody would type it. */
  propose(wave: Wave): void {
    this.wave = { ...wave, period: wave.period || this.wave.period };
    byId<HTMLSelectElement>("shape").value = wave.shape;
    const { unit } = this.session.scene!.coordinates[this.session.scene!.tracked!]!;
    if (this.size) this.size.value = `${Number((wave.value * shownUnit(unit).scale).toFixed(3))}`;
    this.moved();
  }

  private moved(): void {
    const scene = this.session.scene, { wave } = this;
    if (scene?.tracked === undefined) return;
    const dt = scene.period, now = this.session.state?.state === "running" ? this.session.followed.now : undefined;
    byId("wave-period").closest("label")!.hidden = wave.shape === "step";
    // Once it is followed, the prediction stays that of the way there.
    const same = now && now.shape === wave.shape && now.value === wave.value && (wave.shape === "step" || now.period === wave.period);
    if (!same) this.start = now?.shape === "step" ? now.value : 0;
    const seconds = wave.shape === "step" ? SECONDS : 2 * wave.period, count = Math.round(seconds / dt);
    this.reference = Float64Array.from({ length: count }, (_, k) => valueAt(wave, k, dt));
    this.rows = this.predicted(this.reference, this.start);
    this.judge();
    const { lean } = scene, fallen = lean ? this.rows.findIndex((row) => Math.abs(row.at(-3)!) > lean) : -1;
    if (fallen >= 0) this.rows.length = fallen; // what the law makes of one that lies says nothing
    this.charts();
    this.table();
    this.gate();
  }

  /** What the model makes of a step from rest at 0: how far beyond it, and the wrong way first. */
  foresee(value: number): { beyond: number; wrong: number } {
    const rows = this.predicted(new Float64Array(Math.round(SECONDS / this.session.scene!.period)).fill(value), 0), column = 2 * this.session.scene!.tracked!;
    return overshoot(0, value, (k) => rows[k]![column]!, rows.length);
  }

  private predicted(reference: Float64Array, start: number): Float64Array[] {
    return this.twin ? this.ofTwin(this.twin, reference, start) : this.ofModel(reference, start);
  }

  private ofTwin(twin: Twin, reference: Float64Array, from: number): Float64Array[] {
    const { K, law, tracked } = this.session.scene!, { one } = twin, p = DATA.coordinates.length;
    const put = (name: string, value: number) => {
      const row = one.described.parameters.indexOf(name);
      if (row >= 0) one.arrays.P[row] = value;
    };
    twin.gains = K;
    twin.set({ holding: true });
    put(`lD0_${p}`, law!.D[0]![p]!);
    law!.B.forEach((row, i) => put(`lB${i}_${p}`, row[p]!));
    one.arrays.R.fill(reference.at(-1)!).set(reference);
    twin.restart(DATA.start.map((_, i) => (i === 2 * tracked! ? from : 0)));
    const { point } = DATA;
    return twin.advance(reference.length).map((row) => row.map((v, i) => (i % 2 || i === 2 * p ? v : v - point[i / 2]!)));
  }

  /** Of the linear model; a chain without springs to ground is at rest anywhere, moved as a whole. */
  private ofModel(reference: Float64Array, from: number): Float64Array[] {
    const { linear, law, period, command, coordinates, point, tracked } = this.session.scene!, whole = !point.some((q) => q !== 0);
    const start = coordinates.flatMap((_, i) => [whole || i === tracked ? from : 0, 0]);
    return linearAnswer({ ...linear!, law: law!, period, limit: command.limit }, reference, start);
  }

  private answer = (k: number): number => this.rows[k]![2 * this.session.scene!.tracked!]!;

  /** Share of the time at the limit: within a step's first second, or a wave's last period. */
  private get full(): number {
    const { rows, wave } = this, { period, command } = this.session.scene!, n = Math.min(rows.length, window(wave, period));
    const some = wave.shape === "step" ? rows.slice(0, n) : rows.slice(-n);
    return some.filter((row) => Math.abs(row.at(-1)!) >= command.limit * FULL).length / n;
  }

  /** Why the model would not follow, or "". */
  private judge(): void {
    const { tracked, travel, lean, coordinates, moved } = this.session.scene!, { unit, scale } = shownUnit(coordinates[tracked!]!.unit);
    const most = (column: number) => this.rows.reduce((m, row) => Math.max(m, Math.abs(row[column]!)), 0);
    const end = travel ?? Infinity, limit = `${clean(end * scale)} ${unit}`;
    this.outcome =
      Math.abs(this.wave.value) > end ? `The reference lies beyond the travel of ${limit} to either side.`
      : lean && most(2 * (coordinates.length - 1)) > lean ? `The ${short(coordinates.at(-1)!.meaning)} of the model falls. Take a smaller or a slower reference.`
      : most(2 * moved) > end ? `The ${short(coordinates[moved]!.meaning)} of the model leaves its travel of ${limit}. Take a smaller or a slower reference.`
      : this.full > LONG ? `The model's command is at its limit for ${(100 * this.full).toFixed(0)} % of the time, and at most ${100 * LONG} % are followed. Take a smaller or a slower reference.`
      : "";
  }

  private table(): void {
    const { rows, wave, reference } = this, { period, command } = this.session.scene!, most = rows.reduce((m, row) => Math.max(m, Math.abs(row.at(-1)!)), 0);
    const step = wave.shape === "step" && wave.value !== this.start ? overshoot(this.start, wave.value, this.answer, rows.length) : undefined;
    const found = rows.length < reference.length ? undefined : figures(rows.length, window(wave, period), this.answer, (k) => reference[k]!);
    byId("track-before").replaceChildren(...this.lines(wave, found, step, [["largest command", `${significant(most)} of ${significant(command.limit)} ${command.unit}`]])
      .map(([name, value]) => make("tr", {}, make("th", { scope: "row" }, name), make("td", { class: "number" }, value))));
    say(byId("track-model"), this.twin ? "by the twin in this page: friction, delay, encoder counts" : "by the linear model with the command's limit: no dry friction");
  }

  /** Figures in words; an error below a count of the encoder is none that anybody read. */
  private lines(wave: Wave, found: Figures | undefined, step: { beyond: number; wrong: number } | undefined, more: [string, string][] = []): [string, string][] {
    const { coordinates, tracked } = this.session.scene!, driven = coordinates[tracked!]!, { unit, scale } = shownUnit(driven.unit), count = 1 / driven.per_unit;
    const last = wave.shape === "step" ? "last second" : "last period", share = (v: number) => `${(100 * v).toFixed(0)} %`;
    const size = (v: number | undefined) => (v === undefined ? "–" : v < count ? `below one count, ${significant(count * scale, 2)} ${unit}` : `${significant(v * scale)} ${unit}`);
    return [
      [`error, rms, ${last}`, size(found?.rms)],
      [`error, peak, ${last}`, size(found?.peak)],
      ...(step ? [["overshoot", share(step.beyond)], ["first the wrong way by", share(step.wrong)]] as [string, string][] : []),
      ...more,
    ];
  }

  private charts(): void {
    const scene = this.session.scene, { rows, reference } = this;
    if (!rows.length || scene?.tracked === undefined || byId("track").hidden) return;
    const { unit, scale } = shownUnit(scene.coordinates[scene.tracked]!.unit), seconds = rows.length * scene.period;
    const times = Array.from({ length: 5 }, (_, i) => `${significant((i * seconds) / 4, 2)} s`), count = rows.length;
    const most = rows.reduce((m, _, k) => Math.max(m, Math.abs(this.answer(k)), Math.abs(reference[k]!)), 0);
    drawStrip(byId("foreseen"), {
      ...about(most * scale, unit === "deg" ? 5 : 1, unit), colour: `--q${scene.tracked % 4}`, count, times,
      at: (k) => this.answer(k) * scale, also: (k) => reference[k]! * scale,
    });
    const largest = rows.reduce((m, row) => Math.max(m, Math.abs(row.at(-1)!)), 0);
    drawStrip(byId("foreseen-command"), { ...limited(scene.command.limit, largest), colour: "--effort", count, times, at: (k) => rows[k]!.at(-1)! });
  }

  /** Whether it may be followed, and why not. */
  gate(): void {
    const { scene, state, unsteerable } = this.session, badge = byId("track-badge");
    if (scene?.tracked === undefined) return;
    const here = unsteerable || (state?.state !== "running" ? "Start the rig: a reference is followed while it runs." : state.from === "held" ? "" : `While ${OTHERS[state.from]}, no reference is followed. Start held to follow one.`);
    badge.className = `badge ${this.outcome ? "no" : "ok"}`;
    say(badge, this.outcome ? "not supported" : "within limits");
    say(byId("track-gate"), this.outcome || here || "The model follows within its limits.");
    lock(byId("follow"), this.outcome || here);
    lock(byId("home"), here);
  }

  /** Draws what is new. */
  draw(): void {
    const { scene, history, followed, seconds } = this.session;
    if (!scene || scene.tracked === undefined || (history.last === this.drawn && ++this.idle % FIGURES)) return;
    const stale = history.last === this.drawn;
    this.drawn = history.last;
    const c = scene.tracked, { unit, scale } = shownUnit(scene.coordinates[c]!.unit), ticks = history.ticks, dt = scene.period, zero = scene.point[c]!;
    const times = Array.from({ length: 6 }, (_, i) => (i === 5 ? "now" : `\u2212${seconds - (i * seconds) / 5} s`));
    const measured = (k: number) => history.ago(c, ticks - 1 - k) - zero, asked = (k: number) => followed.at(history.last - (ticks - 1 - k), dt, c) - zero;
    const most = Math.max(history.farthest(c, zero), Math.abs(followed.now?.value ?? 0)) * scale, n = scene.coordinates.length;
    drawStrip(byId("answered"), { ...about(most, unit === "deg" ? 5 : 1, unit), colour: `--q${c % 4}`, count: ticks, times, at: (k) => measured(k) * scale, also: (k) => asked(k) * scale });
    drawStrip(byId("answered-command"), { ...limited(scene.command.limit, history.farthest(n, 0)), colour: "--effort", count: ticks, times, at: (k) => history.ago(n, ticks - 1 - k) });
    if (stale || this.idle++ % FIGURES === 0) this.measured(measured, asked, scale, unit);
  }

  /** Overshoot of the last step as far as it is measured; undefined where there is none to be seen. */
  step(): { beyond: number; wrong: number; seconds: number } | undefined {
    const { history, followed, scene } = this.session, now = followed.now, c = scene?.tracked;
    if (!now || c === undefined || now.shape !== "step") return undefined;
    const since = history.last - now.tick + 1, from = (followed.before?.value ?? 0) + now.about[c]!, to = now.value + now.about[c]!;
    if (since < 2 || since > history.ticks || from === to) return undefined;
    return { ...overshoot(from, to, (k) => history.ago(c, since - 1 - k), since), seconds: since * scene!.period };
  }

  private measured(answer: (k: number) => number, asked: (k: number) => number, scale: number, unit: string): void {
    const { history, followed, scene } = this.session, now = followed.now;
    say(byId("track-now"), now ? `${now.shape}, ${significant(now.value * scale)} ${unit}${now.shape === "step" ? "" : `, ${significant(now.period, 2)} s`}` : "nothing is followed yet");
    if (!now) return byId("track-figures").replaceChildren();
    const ticks = window(now, scene!.period), there = Math.min(history.ticks, history.last - now.tick + 1);
    const found = there < ticks ? undefined : figures(history.ticks, ticks, answer, asked);
    byId("track-figures").replaceChildren(...this.lines(now, found, this.step())
      .map(([name, value]) => make("div", {}, make("dt", {}, name), make("dd", {}, value))));
  }
}
