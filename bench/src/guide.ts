// The guide: one task after the other, predicted before anything moves, then done, then compared.

import { lock, message } from "./bar";
import { byId, make, say } from "./dom";
import { Foresight, SECONDS, STEP, TAP } from "./foresight";
import { grouped } from "./poles";
import { spoken } from "./plane";
import type { ClientRequest } from "./protocol";
import type { Session } from "./session";
import { type Answer, TASKS, type Task } from "./tasks";
import type { Track } from "./track";
import { DEGREE, short, shownUnit, significant } from "./words";

const TILT = { rad: 3 / DEGREE, m: 0.003 };
const EVERY = 10; // frames between two looks at what is measured

/** What survives a reload. */
interface Kept {
  open: boolean;
  at: number;
  /** What the student predicted: a number, or the place of a choice. */
  said: Partial<Record<Answer, number>>;
  measured: Partial<Record<Answer, number[]>>;
}

/** How far a prediction is from what the model says, in words. */
export function compared(said: number, answer: number, unit: string, close: number): string {
  const off = answer ? Math.abs(said - answer) / Math.abs(answer) : Infinity, far = off < 9.995 ? `${(100 * off).toFixed(0)} % off` : "far off";
  const verdict = said === answer || off <= close ? "close" : said < answer ? "too small" : "too large";
  return `You said ${significant(said)} ${unit}; the model has ${significant(answer)} ${unit}: ${verdict}${Number.isFinite(off) ? `, ${far}` : ""}.`;
}

export class Guide {
  private kept: Kept;
  private tasks: Task[] = [];
  private known = "";
  private moving = false;
  private shown = "";
  private answer: number[] | undefined;
  private frames = 0;
  /** The tap whose answer is looked at, and the tick of the newest sample when it was asked for. */
  private tapped: { speed: number; tick: number } | undefined;
  private readonly foresight: Foresight;

  constructor(private readonly session: Session, private readonly track: Track, private readonly show: (screen: string) => void) {
    this.foresight = new Foresight(session, track);
    this.kept = { open: false, at: 0, said: {}, measured: {}, ...(JSON.parse(sessionStorage.getItem(this.place) ?? "{}") as Partial<Kept>) };
    byId("guide-toggle").addEventListener("click", () => {
      this.kept.open = !this.kept.open;
      this.keep();
      this.draw();
      if (this.kept.open) byId("guide-title").focus();
    });
    byId("guide-form").addEventListener("submit", (event) => {
      event.preventDefault();
      this.predict();
    });
    const move = (id: string, by: number) => byId(id).addEventListener("click", () => {
      const why = byId(id).dataset["why"];
      if (why) return message(why);
      this.kept.at += by;
      this.keep();
      this.draw();
      byId("guide-title").focus();
    });
    move("guide-back", -1);
    move("guide-next", 1);
  }

  private get place(): string {
    return `upright-bench-guide-${this.session.name}`;
  }

  private keep(): void {
    sessionStorage.setItem(this.place, JSON.stringify(this.kept));
  }

  /** Takes over what the rig is, and which of the tasks it has. */
  scene(moving: boolean): void {
    const { facts, tracked, K, law } = this.session.scene!, now = JSON.stringify([facts, K, law, moving]);
    if (now === this.known) return;
    this.known = now;
    this.moving = moving;
    const has = { pendulum: facts.hanging !== undefined, sets: facts.sets.length > 0, reference: tracked !== undefined };
    this.tasks = TASKS.filter((task) => has[task.needs]);
    byId("guide-toggle").hidden = !this.tasks.length;
    this.draw(true);
  }

  private get task(): Task | undefined {
    return this.tasks[Math.min(this.kept.at, this.tasks.length - 1)];
  }

  private get tilt(): number {
    return TILT[this.session.scene!.coordinates.at(-1)!.unit as "rad" | "m"];
  }

  /** The step that is followed [rad or m]. */
  private get step(): number {
    const { coordinates, tracked } = this.session.scene!, { unit, scale } = shownUnit(coordinates[tracked!]!.unit);
    return STEP[unit as "deg" | "cm"] / scale;
  }

  /** A text with what the rig has in the place of each name in braces. */
  private filled(text: string): string {
    const { coordinates, command, moved, tracked, lean, facts, poles } = this.session.scene!, last = coordinates.at(-1)!, angle = coordinates[moved]!.unit === "rad";
    const of = (value: number, unit: string) => { const shown = shownUnit(unit); return `${significant(value * shown.scale, 2)} ${shown.unit}`; };
    const follows = tracked === undefined ? undefined : coordinates[tracked];
    const words: Record<string, () => string> = {
      driven: () => short(coordinates[moved]!.meaning), tracked: () => short(follows!.meaning), unit: () => command.unit,
      tilt: () => of(this.tilt, last.unit), limit: () => `${significant(command.limit)} ${command.unit}`, speed: () => `${TAP} ${last.unit}/s`, speedunit: () => `${last.unit}/s`,
      step: () => of(this.step, follows!.unit), lean: () => (lean ? of(lean, last.unit) : "no angle"),
      frequency: () => (angle ? "ω² = J m_p g l_cg / D₂, with J = J_d + m_p r² + J_a and D₂ = J_A J − (m_p l_cg r)²: faster than with the arm held, since the arm gives way." : "ω² = (m_c + m_p) m_p g l_cg / D, with D = J_A (m_c + m_p) − (m_p l_cg)²: faster than with the cart held, since the cart gives way."),
      hangingsource: () => (angle ? "Paper, eq. (1) with erratum 1 (the minus in D₂)" : "Paper, appendix, the model that hangs"),
      poles: () => grouped(poles).map((group) => spoken(group)).join("; "),
      zero: () => (facts.zero ? `From command to ${short(follows!.meaning)} there is a zero at +${significant(facts.zero)} 1/s, right of the axis, where s² = m_p g l_cg / J_A: to lean the pendulum one way, what carries it first goes the other way.` : "From command to the far body there is no zero right of the axis: a spring pulls it only where the near body goes."),
      zerosource: () => (facts.zero ? (angle ? "Paper, eq. (2) with errata 1 and 2; the numerator of ψ/T, J_A s² − m_p g l_cg." : "Paper, appendix; the numerator of x/F, J_A s² − m_p g l_cg.") : "Two inertias and a spring: θ₂/T = k/(s² (J₁ J₂ s² + (J₁ + J₂) k)), without damping."),
    };
    return text.replace(/\{(\w+)\}/g, (whole, name: string) => words[name]?.() ?? whole);
  }

  /** What a student gave: a number, or the place of a choice. */
  private predict(): void {
    const task = this.task!, input = byId("guide-answer").querySelector<HTMLInputElement>(task.choices ? "input:checked" : "input"), said = input ? (task.choices ? Number(input.value) : input.valueAsNumber) : NaN;
    if (!Number.isFinite(said)) return message(task.choices ? "Choose an answer first: whoever sees the result first learns less." : "Give a number first: whoever sees the result first learns less.");
    message("");
    this.kept.said[task.answer] = said;
    this.keep();
    this.draw();
    byId("guide-compare").focus();
  }

  /** `renewed`: what the rig is or does has changed, and with it the answer. */
  draw(renewed = false): void {
    const open = this.kept.open && this.tasks.length > 0, task = this.task;
    byId("guide-toggle").setAttribute("aria-expanded", `${this.kept.open}`);
    byId("guide").hidden = !open;
    if (renewed && !open) this.shown = "";
    if (!open || !task) return;
    const said = this.kept.said[task.answer], now = JSON.stringify([task.answer, said, this.session.scene!.facts]), same = now === this.shown;
    if (same && !renewed) return;
    this.shown = now;
    const at = this.tasks.indexOf(task), last = this.tasks.length - 1;
    say(byId("guide-part"), `${task.part}: question ${at + 1} of ${last + 1}`);
    say(byId("guide-ask"), this.filled(task.ask));
    if (!same) this.field(task, said); // what is being typed or pressed keeps its place
    byId("guide-after").hidden = said === undefined;
    lock(byId("guide-back"), at ? "" : "This is the first question.");
    lock(byId("guide-next"), at === last ? "This is the last question. The paper's fourth experiment, the large free swing, needs a rig that hangs free: upright lab." : said === undefined ? "Predict first." : "");
    if (said === undefined) return;
    this.answer = this.foresight.of(task.answer, this.moving, this.tilt, task.needs === "reference" ? this.step : 0);
    say(byId("guide-compare"), this.words(task, said));
    if (!same) byId<HTMLDetailsElement>("guide-details").open = false;
    say(byId("guide-why"), this.filled(task.why));
    say(byId("guide-source"), this.filled(task.source));
    say(byId("guide-do"), this.filled(task.do));
    if (!same) this.actions(task);
    this.outcome();
  }

  private field(task: Task, said: number | undefined): void {
    const disabled: Record<string, string> = said === undefined ? {} : { disabled: "" };
    byId("guide-predict").hidden = said !== undefined;
    byId("guide-answer").replaceChildren(...(task.choices
      ? task.choices.map((choice, i) => make("label", {}, make("input", { type: "radio", name: "guide", value: `${i}`, ...(said === i ? { checked: "" } : {}), ...disabled }), ` ${choice}`))
      : [make("label", {}, "your prediction ", make("input", { type: "number", step: "any", ...(said === undefined ? {} : { value: `${said}` }), ...disabled }), ` ${this.filled(task.unit!)}`)]));
  }

  private words(task: Task, said: number): string {
    const { answer } = this;
    if (!answer) return "The twin in this page, which answers this, is still being prepared.";
    if (!task.choices) return compared(said, answer[0]!, this.filled(task.unit!), task.close);
    const right = answer.indexOf(Math.max(...answer)), unit = this.session.scene!.command.unit;
    const all = task.answer === "sets" ? ` (${answer.map((v, i) => `${i + 1}: ${significant(v)} ${unit}`).join(", ")})` : "";
    return `You said: ${task.choices[said]}. The model says${said === right ? " so too" : `: ${task.choices[right]}`}${all}.`;
  }

  private actions(task: Task): void {
    const button = (text: string, act: () => void) => {
      const made = make("button", { type: "button" }, text);
      made.addEventListener("click", act);
      return made;
    };
    const { facts, coordinates } = this.session.scene!, tap = () => this.session.steer({ do: "tap", coordinate: coordinates.at(-1)!.name, speed: TAP });
    const propose = () => { this.show("track"); this.track.propose({ shape: "step", value: this.step, period: 0 }); };
    const twin = this.session.scene!.kind === "TWIN";
    const apply = (poles: Complex[], i: number) => {
      let confirmed = twin;
      const made = button(`Apply set ${i + 1}`, () => {
        if (confirmed) this.session.steer({ do: "poles", poles, ...(twin ? {} : { confirm: true }) });
        else say(made, `Confirm: apply set ${i + 1} to HARDWARE`);
        confirmed = !confirmed || twin;
        if (!confirmed) say(made, `Apply set ${i + 1}`);
      });
      return made;
    };
    byId("guide-actions").replaceChildren(...(
      task.answer === "sets" ? [...facts.sets.map(apply), ...(twin ? [button(`Tap ${TAP}`, tap)] : [])]
      : task.needs === "reference" ? [button("Show it on Track", propose)]
      : task.answer === "release" || task.answer === "tap" ? [button("Show Run", () => this.show("run"))]
      : []));
  }

  /** Hears what this page asks of the rig. */
  steered(request: ClientRequest): void {
    if (request.do === "tap") this.tapped = { speed: Math.abs(request.speed), tick: this.session.history.last };
    if (request.do === "start") this.tapped = undefined;
  }

  /** Looks at what is measured; some times a second. */
  look(): void {
    const { session, task } = this, { history, scene, state } = session;
    if (!scene || !task || !this.kept.open || ++this.frames % EVERY) return;
    const said = this.kept.said[task.answer], n = scene.coordinates.length, dt = scene.period, now = (answer: Answer, values: number[]) => {
      if (JSON.stringify(this.kept.measured[answer]) === JSON.stringify(values)) return;
      this.kept.measured[answer] = values;
      this.keep();
      this.outcome();
    };
    if (said === undefined) return;
    const peak = (ticks: number, back: number) => { let most = 0; for (let k = back; k < back + ticks; k++) most = Math.max(most, Math.abs(history.ago(n, k)) || 0); return most; };
    if (task.answer === "release") {
      const ticks = Math.round(SECONDS.release / dt);
      if (state?.state === "running" && state.from === "held" && history.last > ticks && history.last < history.ticks) now("release", [peak(ticks, history.last - ticks)]);
    } else if (task.answer === "overshoot") {
      const step = this.track.step();
      if (step && step.seconds >= 3 && Math.abs(session.followed.now!.value - this.step) < 1e-9) now("overshoot", [100 * step.beyond]);
    } else if (this.tapped) {
      const since = history.last - this.tapped.tick, { speed } = this.tapped;
      if (task.answer === "tap" && state?.state === "stopped") {
        now("tap", [this.kept.measured.tap?.[0] ?? 0, speed]);
        this.tapped = undefined;
      } else if (state?.state === "running" && since * dt >= SECONDS[task.answer === "tap" ? "tap" : "sets"]) {
        const set = scene.facts.sets.findIndex((poles) => poles.every(([re, im]) => scene.poles.some(([a, b]) => Math.hypot(a - re, b - im) < 1e-3 * Math.hypot(re, im))));
        if (task.answer === "sets" && set >= 0) now("sets", scene.facts.sets.map((_, i) => (i === set ? peak(Math.round(SECONDS.sets / dt), since - Math.round(SECONDS.sets / dt)) : (this.kept.measured.sets?.[i] ?? 0))));
        if (task.answer === "tap") now("tap", [Math.max(speed, this.kept.measured.tap?.[0] ?? 0), ...(this.kept.measured.tap?.slice(1) ?? [])]);
        this.tapped = undefined;
      }
    }
  }

  private outcome(): void {
    const task = this.task!, values = this.kept.measured[task.answer], unit = this.session.scene!.command.unit;
    const speed = this.filled("{speedunit}");
    const text =
      task.answer === "hanging" || task.answer === "unstable" || task.answer === "direction" ? ""
      : !values ? "Not measured yet."
      : task.answer === "sets" ? `Measured: ${values.map((v, i) => `set ${i + 1} ${v ? `${significant(v)} ${unit}` : "–"}`).join(", ")}.`
      : task.answer === "tap" ? `Measured: ${values[0] ? `caught after ${significant(values[0])} ${speed}` : "none caught yet"}${values[1] ? `, fallen after ${significant(values[1])} ${speed}` : ", not fallen yet"}.`
      : `Measured: ${significant(values[0]!)} ${this.filled(task.unit!)}.`;
    say(byId("guide-measured"), text);
  }
}
