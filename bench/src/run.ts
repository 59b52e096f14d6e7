// Screen Run: the rig as it moves, its last ten seconds, the law that acts.

import { message } from "./bar";
import { byId, field, italic, make, say } from "./dom";
import { type Filter, choices, noiseOf } from "./estimator";
import { spoken } from "./plane";
import { grouped } from "./poles";
import type { State } from "./protocol";
import type { Session } from "./session";
import { about, drawStrip, limited } from "./strip";
import { short, shownUnit, signed, significant, symbol } from "./words";

const SATURATED = 1 - 1e-3, LAMP = 0.5; // part of the limit; seconds for which the lamp stays on
const TILT = 3, ASIDE = 0.3, TAP = 0.8, LONGEST = 3600; // deg, cm, rad/s or m/s, s
const IDLE = 15; // frames
const FAR = Math.PI + 0.5; // from what is held, from where on another turn of it is nearer; hanging is near to two [rad]

interface Channel {
  canvas: HTMLCanvasElement;
  reading: HTMLElement;
  /** Titles of the strip: of what is read, and of its velocity where there is one. */
  titles: HTMLElement[];
  unit: string;
  scale: number;
  zero: number;
  least: number;
  /** Turns by which what is shown is held elsewhere: a pendulum that was swung up may stand one turn on. */
  turns: number;
}

export class Run {
  private channels: Channel[] = [];
  private rig: RigDrawing | undefined;
  private lamp = make("span", { class: "lamp" }, "saturated");
  private tilt: HTMLInputElement | undefined;
  private speed: HTMLInputElement | undefined;
  private seconds: HTMLInputElement | undefined;
  private reason: HTMLInputElement | undefined;
  /** What the fields of the next start were made for. */
  private asked = "";
  /** What there is to say of the drawing. */
  note = "its drawing is being prepared";
  private drawn = -1;
  private idle = 0;

  constructor(private readonly session: Session) {
    byId("velocities").addEventListener("change", () => this.titled());
    byId("filter").addEventListener("change", ({ target }) => void this.choose(Number((target as HTMLSelectElement).value)));
    byId("drawing").addEventListener("pointerdown", ({ clientX }) => {
      const box = byId("drawing").getBoundingClientRect();
      if (this.tappable) this.tap(clientX < box.left + box.width / 2 ? 1 : -1);
    });
  }

  private get tappable(): boolean {
    const { scene, state, unsteerable } = this.session;
    return scene?.kind === "TWIN" && state?.state === "running" && state.operator === "you" && !unsteerable;
  }

  start(): void {
    const { tilt, seconds, session } = this, begin = byId<HTMLSelectElement>("from");
    const from = begin.hidden ? "held" : (begin.value as State["from"]);
    const away = tilt && DATA.away.map(() => 0);
    if (away) away[away.length - 2] = tilt.valueAsNumber / shownUnit(DATA.coordinates.at(-1)!.unit).scale;
    session.steer({ do: "start", ...(from !== "held" ? { from } : away ? { start: away } : {}), ...(seconds ? { seconds: seconds.valueAsNumber } : {}), ...(this.reason?.value ? { accept: this.reason.value } : {}) });
  }

  tap(side = 1): void {
    const coordinate = this.session.scene?.coordinates.at(-1)?.name;
    if (coordinate && this.speed) this.session.steer({ do: "tap", coordinate, speed: side * this.speed.valueAsNumber });
  }

  /** Builds what does not change while a rig runs. */
  build(known: boolean): void {
    const scene = this.session.scene!, { coordinates, command } = scene;
    byId("readings").replaceChildren();
    byId("strips").replaceChildren();
    this.channels = [...coordinates, undefined].map((coordinate, i) => {
      const colour = coordinate ? `q${i % 4}` : "effort", { unit, scale } = shownUnit(coordinate?.unit ?? command.unit);
      const held = coordinate ? scene.point[i]! + scene.zero[i]! : 0, from = !held ? "" : Math.abs(held - Math.PI) < 1e-6 ? " − π" : ` − ${significant(held)}`;
      const upright = from === " − π", name = coordinate ? short(coordinate.meaning) : "command", mark = italic(coordinate ? symbol(coordinate.name) : "u");
      mark.className = colour;
      const canvas = make("canvas", { role: "img", "aria-label": `${name}, the last ten seconds` });
      const title = make("h2", {}, mark, `${from} ${name} `, make("span", { class: "unit" }, coordinate ? `[${unit}]` : `[${unit}], limit ±${significant(command.limit)}`));
      if (!coordinate) title.append(this.lamp);
      byId("strips").append(make("div", { class: "strip" }, title, canvas));
      const reading = make("dd", { class: colour }, "–");
      byId("readings").append(make("div", {}, make("dt", {}, upright ? "from upright" : name), reading));
      const least = unit === "deg" ? 5 : 1, titles = [title];
      if (coordinate && scene.memory !== null) {
        titles.push(make("h2", { hidden: "" }, mark.cloneNode(true), ` velocity of the ${name} `, make("span", { class: "unit" }, `[${unit}/s], as the law has it`)));
        canvas.before(titles[1]!);
      }
      return { canvas, reading, titles, unit, scale, zero: coordinate ? scene.point[i]! : 0, least, turns: upright ? 0 : NaN };
    });
    if (known && !this.rig) {
      const q = DATA.start.filter((_, i) => i % 2 === 0), view = RigDrawing.view(OUTLINE, [q, q.map(() => 0)]);
      byId("drawing").setAttribute("viewBox", view.box.join(" "));
      this.rig = new RigDrawing(byId("drawing"), OUTLINE, DATA.coordinates.map((c) => c.name), view);
    }
    byId("drawing").hidden = !known;
    this.titled();
    this.estimator();
    this.settings(known);
    this.law();
  }

  /** Gains and poles that act. */
  law(): void {
    const { coordinates, K, poles, command } = this.session.scene!;
    const names = coordinates.flatMap(({ name }) => [[symbol(name)], [symbol(name), " rate"]]);
    byId("gains").replaceChildren(...K.map((gain, i) => {
      const [mark = `x${i + 1}`, rate = ""] = names[i] ?? [];
      return make("span", {}, make("span", {}, italic(mark), rate), make("b", {}, significant(gain, 4)));
    }));
    say(byId("gains-unit"), `[${command.unit} per unit of the state]`);
    byId("run-poles").replaceChildren(...grouped(poles).map((group) => {
      const words = spoken(group);
      return make("li", {}, words[0]!.toUpperCase() + words.slice(1));
    }));
  }

  /** What the law has for velocities, and which filters it may have. */
  private estimator(): void {
    const { memory, period, coordinates } = this.session.scene!, select = byId<HTMLSelectElement>("filter");
    byId("velocity-filter").hidden = memory === null;
    say(byId("velocity-words"), memory === null ? "The law has velocities of its own, which the bench does not know." : "");
    if (memory === null) return;
    const words = ({ cutoff, late }: Filter) => `${cutoff === undefined ? "plain difference" : `${significant(cutoff, 2)} Hz cutoff`}, ${significant(1e3 * late, 2)} ms late`;
    select.replaceChildren(...choices(memory, period).map((each) => make("option", { value: `${each.memory}` }, words(each))));
    select.value = `${memory}`;
    const noise = coordinates.map(({ name, unit, per_unit }) => `${significant(noiseOf(memory, period, shownUnit(unit).scale / per_unit), 2)} ${shownUnit(unit).unit}/s of ${symbol(name)}`);
    say(byId("velocity-why"), `v[k] = a v[k−1] + (1 − a) (y[k] − y[k−1]) / T, a = ${memory} and T = ${significant(1e3 * period)} ms. A low cutoff is quiet and late: v lags by T/2 + a T/(1 − a), which the poles feel, and the rounding of counts gives it an rms of q (1 − a) / (T √(6 (1 + a))), now ${noise.join(", ")}.`);
    say(byId("velocity-source"), "Paper: encoders and numerical differentiation; rounding as white noise: Widrow.");
  }

  /** What may be chosen now. */
  state(): void {
    byId<HTMLSelectElement>("filter").disabled = this.session.unsteerable !== "" || ["starting", "running"].includes(this.session.state?.state ?? "");
  }

  private async choose(memory: number): Promise<void> {
    const refused = await this.session.describe({ memory });
    if (!refused) return; // the page is loaded again
    message(refused);
    this.estimator();
  }

  private get velocities(): boolean {
    return byId<HTMLInputElement>("velocities").checked;
  }

  private titled(): void {
    for (const { titles: [place, velocity] } of this.channels) if (velocity) {
      place!.hidden = this.velocities;
      velocity.hidden = !this.velocities;
    }
    this.idle = IDLE;
  }

  /** Fields of the next start. The drawing is there some time after the page, and what was typed until then stays. */
  private settings(known: boolean): void {
    const { kind, coordinates, basis } = this.session.scene!, last = coordinates.at(-1)!, asked = JSON.stringify([kind, last, basis.level]);
    if (asked !== this.asked) this.fields();
    this.asked = asked;
    if (kind !== "TWIN" || !known || this.tilt) return;
    const { row, input } = field(`start, ${short(last.meaning)} away`, shownUnit(last.unit).unit, last.unit === "rad" ? TILT : ASIDE, last.unit === "rad" ? [-10, 10, 0.5] : [-5, 5, 0.1]);
    this.tilt = input;
    byId("next-title").after(row);
  }

  private fields(): void {
    const { kind, coordinates, basis } = this.session.scene!, rows: HTMLElement[] = [], last = coordinates.at(-1)!;
    const add = (...about: Parameters<typeof field>) => {
      const { row, input } = field(...about);
      rows.push(row);
      return input;
    };
    this.tilt = undefined;
    this.seconds = add("stop after", "s", 600, [1, LONGEST, 1]);
    if (kind === "TWIN") this.speed = add("tap", `${last.unit}/s`, TAP, [-20, 20, 0.1]);
    this.reason = basis.level === "not trusted" ? make("input", { type: "text", maxlength: "200", value: this.reason?.value ?? "" }) : undefined;
    if (this.reason) rows.push(make("label", { class: "field" }, make("span", {}, "The model is not trusted. Reason to run it all the same"), this.reason));
    byId("next").replaceChildren(byId("next-title"), ...rows);
    say(byId("next-title"), kind === "TWIN" ? "Start and tap" : "Start");
  }

  /** Draws what is new; four times a second everything, since size and colours of the page may have changed. */
  draw(): void {
    const { session, channels } = this, { history, seconds, scene } = session;
    if (!scene || (history.last === this.drawn && ++this.idle < IDLE)) return;
    this.drawn = history.last;
    this.idle = 0;
    const n = channels.length - 1, here = (c: number) => history.ago(c, 0), ticks = history.ticks;
    byId("drawing").classList.toggle("tappable", this.tappable);
    say(byId("rig-note"), this.tappable && this.rig ? `touch it left or right to tap the ${short(scene.coordinates.at(-1)!.meaning)}` : this.note);
    const q = scene.zero.map((zero, i) => zero + (Number.isFinite(here(i)) ? here(i) : 0));
    this.rig?.draw(q);
    channels.forEach((channel, c) => {
      const { canvas, reading, unit, scale, least } = channel, value = here(c), away = value - channel.zero;
      if (Math.abs(away - 2 * Math.PI * channel.turns) > FAR) channel.turns = Math.round(away / (2 * Math.PI));
      const zero = channel.zero + 2 * Math.PI * (channel.turns || 0), text = Number.isFinite(value) ? `${signed((value - zero) * scale, c < n ? 1 : 2)} ${unit}` : "–";
      say(reading, text);
      const times = Array.from({ length: 6 }, (_, i) => (i === 5 ? "now" : `\u2212${seconds - (i * seconds) / 5} s`));
      if (this.velocities && channel.titles.length > 1) return drawStrip(canvas, {
        ...about(history.fastest(c) * scale, 2 * least, `${unit}/s`), colour: `--q${c % 4}`, count: ticks, times,
        at: (k) => history.rate(c, ticks - 1 - k) * scale,
      });
      drawStrip(canvas, {
        ...(c < n ? about(history.farthest(c, zero) * scale, least, unit) : limited(scene.command.limit, history.farthest(c, 0))),
        colour: c < n ? `--q${c % 4}` : "--effort", count: ticks, at: (k) => (history.ago(c, ticks - 1 - k) - zero) * scale,
        ...(c === scene.tracked ? { also: (k) => (this.session.followed.at(history.last - (ticks - 1 - k), scene.period, c) - zero) * scale } : {}),
        times,
      });
    });
    this.lamp.classList.toggle("on", this.saturates());
  }

  private saturates(): boolean {
    const { history, scene } = this.session, command = this.channels.length - 1;
    for (let k = 0; k * scene!.period < LAMP; k++)
      if (Math.abs(history.ago(command, k)) >= scene!.command.limit * SATURATED) return true;
    return false;
  }
}
