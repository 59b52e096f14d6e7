// Screen Design: drag the poles, see what becomes of the rigs that the fit allows, apply.

import { Answers } from "./answers";
import { lock, message } from "./bar";
import { byId, field, make, say } from "./dom";
import { Plane, spoken } from "./plane";
import { type Group, LEAST, MOST_RATIO, characteristic, grouped, noise, polesOf, roots, within } from "./poles";
import { Regulator, branches, prices } from "./regulator";
import type { Session } from "./session";
import { about, drawStrip, limited } from "./strip";
import { DEGREE, OTHERS, modelName, short, shownUnit, signed, significant, symbol } from "./words";

const ORDER: Fate[] = ["stands", "saturates", "falls"];
const NAME: Record<Fate, string> = { stands: "stabilised", saturates: "stabilised with saturation", falls: "lost" };
const ENOUGH = 0.95, AHEAD = 2; // share of rigs; seconds of the prediction
const COSTLY: Record<string, [driven: number, other: number]> = { rad: [30 / DEGREE, 15 / DEGREE], m: [0.1, 0.05] }; // at which deviation, at a price of 1, a coordinate costs what a full command does
const SAME = 1e-6; // of two sets of poles [1/s]
const WIDE = 14, TALL = 17; // of a small pendulum

const svg = (tag: string, attributes: Record<string, string | number>, parent?: Element) => RigDrawing.make(tag, attributes, parent);

/** A small pendulum: upright, upright below a bar, or lying. */
function stick(fate: Fate, x: number, y: number, parent: Element): void {
  const g = svg("g", { class: `fate ${fate}`, transform: `translate(${x} ${y})` }, parent);
  svg("path", { d: fate === "falls" ? "M0 3H6" : fate === "saturates" ? "M0 5V-4M-3.5-6.5H3.5" : "M0 5V-5" }, g);
  svg("circle", { cx: 0, cy: fate === "falls" ? 3 : 5, r: 1.7 }, g);
}

export class Design {
  private groups: Group[] = [];
  private applied = "";
  private plane: Plane | undefined;
  private rows: HTMLInputElement[][] = [];
  private places: HTMLElement[] = [];
  private readonly twin = new Twin(DATA);
  private readonly answers: Answers;
  private settings = { friction: 1, delay: DATA.delay };
  private share: number | undefined;
  private confirming = false;
  /** Pressed before the rigs had run with these poles. */
  private pressed = false;
  private predicted: Float64Array[] = [];
  private fates: Fate[] = [];
  private regulator!: Regulator;
  /** Of the command where the poles are the regulator's; undefined where they were set by hand. */
  private price: number | undefined;
  private readonly costly = DATA.coordinates.map(({ unit }, i) => (COSTLY[unit] ?? [1, 1])[i === DATA.moved ? 0 : 1]);

  constructor(private readonly session: Session) {
    this.answers = new Answers(session.name, (fates, ms) => this.answered(fates, ms));
    this.sliders();
    this.weights();
    byId<HTMLInputElement>("lqr-slider").addEventListener("input", ({ target }) => this.slide(10 ** -(target as HTMLInputElement).valueAsNumber));
    for (const fate of ORDER) {
      const picture = svg("svg", { viewBox: "-7 -8 14 16", "aria-hidden": "true" });
      stick(fate, 0, 0, picture);
      byId("key").append(make("li", {}, picture, NAME[fate], " ", make("b", { id: `count-${fate}` })));
    }
    byId("apply").addEventListener("click", () => this.apply());
    byId("cancel").addEventListener("click", () => this.confirm(false));
    new ResizeObserver(() => this.charts()).observe(byId("predicted-last"));
    new ResizeObserver(() => this.sticks()).observe(byId("fates"));
    say(byId("lanes"), `${DATA.lanes} rigs that the ${modelName(session.scene!.model)} allows`);
    say(byId("lanes-note"), `each let go and run for ${significant(DATA.seconds)} s, the same draw at every move`);
  }

  /** Takes over the poles that act, where they are others than before. */
  scene(): void {
    const { poles } = this.session.scene!, now = JSON.stringify(poles);
    if (now === this.applied) return;
    this.applied = now;
    const before = this.poles(), same = before.length === poles.length && poles.every(([re, im]) => before.some(([a, b]) => Math.hypot(re - a, im - b) < SAME * (1 + Math.hypot(a, b))));
    if (!same) {
      this.groups = grouped(poles);
      this.price = undefined;
    }
    const fastest = 5 * Math.ceil((1.6 * Math.max(...poles.map(([re, im]) => Math.hypot(re, im)), 6)) / 5);
    this.table(fastest);
    this.plane = new Plane(byId<SVGSVGElement>("plane"), this.groups, roots(characteristic(DATA.A)), fastest, () => this.byHand());
    this.locus();
    this.moved();
  }

  /** The regulator for what the states cost, and where its poles may go. */
  private locus(): void {
    const { A, B, command } = DATA, plane = this.plane!;
    this.regulator = new Regulator({ A, B, limit: command.limit, deviations: this.costly.flatMap((most) => [most, Infinity]) });
    const offered = prices(this.regulator, Math.min(plane.fastest, 1 / DATA.period), plane.highest), slider = byId<HTMLInputElement>("lqr-slider");
    plane.track(branches(this.regulator, offered));
    const at = offered.map((price) => -Math.log10(price));
    slider.disabled = !at.length;
    slider.min = `${(at[0] ?? 0).toFixed(1)}`;
    slider.max = `${(at.at(-1) ?? 0).toFixed(1)}`;
    slider.step = "0.05";
    const size = (poles: Complex[]) => Math.max(...poles.map(([re, im]) => Math.hypot(re, im))), now = size(this.poles());
    const off = (price: number) => Math.abs(size(this.regulator.poles(price)) - now);
    const price = this.price ?? offered.reduce((best, each) => (off(each) < off(best) ? each : best), offered[0] ?? 1);
    slider.value = `${-Math.log10(price)}`;
  }

  private slide(price: number): void {
    this.price = price;
    this.groups.splice(0, Infinity, ...this.regulator.groups(price)); // the plane has the same list
    this.moved();
  }

  private byHand(): void {
    this.price = undefined;
    this.moved();
  }

  /** Fields of what the states cost, and why the poles lie where they do. */
  private weights(): void {
    const { coordinates } = DATA;
    byId("lqr-weights").replaceChildren(...coordinates.map(({ name, unit }, i) => {
      const shown = shownUnit(unit);
      return field(`${symbol(name)} costs 1 at`, shown.unit, Number((this.costly[i]! * shown.scale).toPrecision(6)), [0.1, 1000, 0.1], (value) => {
        this.costly[i] = value / shown.scale;
        this.locus();
        if (this.price) this.slide(this.price);
        else this.moved();
      }).row;
    }));
    say(byId("lqr-why"), "The poles are the stable roots of a(s) a(−s) + Σ (u_max / x_max)² b(s) b(−s) / ρ = 0, with a(s) of the model and b(s) from the command to each state that costs. A dear command leaves stable poles where they are and mirrors the unstable one; a cheap one is fast.");
    say(byId("lqr-source"), "Kalman 1964, “When is a linear control system optimal?”; what a state costs: Bryson and Ho 1975. The linear model knows no delay, dry friction or limit; what those change, the rigs beside it show.");
  }

  private cost(): void {
    const { coordinates, command } = DATA, { price } = this, slider = byId("lqr-slider");
    const terms = coordinates.map(({ name, unit }, i) => `(${symbol(name)} / ${significant(this.costly[i]! * shownUnit(unit).scale)} ${shownUnit(unit).unit})²`);
    say(byId("lqr-cost"), `u = −K x with the least ∫ ${terms.join(" + ")} + ρ (u / ${significant(command.limit)} ${command.unit})² dt; speeds cost nothing.`);
    const words = price === undefined ? "set by hand" : `ρ = ${significant(price, 2)}`;
    say(byId("lqr-price"), words);
    slider.setAttribute("aria-valuetext", price === undefined ? words : `price of the command ${significant(price, 2)}, ${this.groups.map(spoken).join("; ")}`);
  }

  private table(fastest: number): void {
    this.places = [];
    this.rows = [];
    byId("pairs").replaceChildren(...this.groups.map((group, k) => {
      const change = (part: Partial<Group>) => {
        this.groups[k] = within({ ...this.groups[k]!, ...part }, fastest);
        this.byHand();
      };
      const name = group.single ? "real pole" : `pair ${k + 1}`;
      const frequency = field("", "", group.frequency, [LEAST.frequency, fastest, 0.1], (value) => change({ frequency: value })).input;
      const ratio = field("", "", group.ratio, [LEAST.ratio, MOST_RATIO, 0.01], (value) => change({ ratio: value })).input;
      frequency.setAttribute("aria-label", `natural frequency of ${name}, rad/s`);
      ratio.setAttribute("aria-label", `damping ratio of ${name}`);
      const place = make("td");
      this.places.push(place);
      this.rows.push(group.single ? [frequency] : [frequency, ratio]);
      return make("tr", {}, make("th", { scope: "row" }, name), make("td", {}, frequency), make("td", {}, group.single ? "" : ratio), place);
    }));
  }

  private sliders(): void {
    const add = (label: string, [least, most, step]: [number, number, number], value: number, words: (v: number) => string, change: (v: number) => void) => {
      const input = make("input", { type: "range", min: `${least}`, max: `${most}`, step: `${step}`, value: `${value}` });
      const output = make("output", {}, words(value));
      input.addEventListener("input", () => {
        say(output, words(input.valueAsNumber));
        change(input.valueAsNumber);
        this.moved();
      });
      byId("sliders").append(make("label", {}, label, output, input));
    };
    add("dry friction", [0, 5, 0.1], 1, (v) => `× ${v.toFixed(1)}`, (v) => (this.settings.friction = v));
    add("delay", [0, 30, 0.1], DATA.delay * 1e3, (v) => `${v.toFixed(1)} ms`, (v) => (this.settings.delay = v / 1e3));
  }

  private poles(): Complex[] {
    return this.groups.flatMap(polesOf);
  }

  private moved(): void {
    this.confirm(false);
    this.cost();
    this.plane?.show(this.groups);
    this.groups.forEach((group, k) => {
      const [frequency, ratio] = this.rows[k]!, poles = polesOf(group);
      frequency!.value = group.frequency.toFixed(1);
      if (ratio) ratio.value = group.ratio.toFixed(2);
      const [[re, im]] = poles as [Complex];
      say(this.places[k]!, im ? `${signed(re, 2)} ± ${im.toFixed(2)} i` : poles.map(([a]) => signed(a, 2)).join(", "));
    });
    this.twin.set({ holding: true, ...this.settings });
    this.twin.place(this.poles());
    this.twin.restart();
    this.predicted = this.twin.advance(Math.round(AHEAD / DATA.period));
    this.charts();
    void this.answers.ask({ ...this.twin.settings, holding: true }, this.twin.gains);
    byId("share").setAttribute("aria-busy", "true");
  }

  private answered(fates: Fate[], milliseconds: number): void {
    this.fates = fates;
    const counts = ORDER.map((fate) => fates.filter((f) => f === fate).length), of = fates.length;
    const held = of - counts[2]!;
    this.share = held / of;
    say(byId("share"), `${held} of ${of} rigs are stabilised${counts[1] ? `, ${counts[1]} of them with saturation` : ""}.`);
    ORDER.forEach((fate, i) => say(byId(`count-${fate}`), `${counts[i]}`));
    byId("fates").setAttribute("aria-label", byId("share").textContent!);
    this.sticks();
    this.before(milliseconds);
    this.gate();
    byId("share").setAttribute("aria-busy", `${this.answers.open}`);
    if (this.pressed && !this.answers.open) this.apply();
  }

  private sticks(): void {
    const cells = byId("fates"), { clientWidth: width, clientHeight: height } = cells;
    if (!width || !height || !this.fates.length) return;
    const across = Math.ceil(Math.sqrt((this.fates.length * width * TALL) / height / WIDE)), down = Math.ceil(this.fates.length / across);
    cells.replaceChildren();
    cells.setAttribute("viewBox", `0 0 ${across * WIDE} ${down * TALL}`);
    ORDER.flatMap((fate) => this.fates.filter((f) => f === fate)).forEach((fate, i) =>
      stick(fate, ((i % across) + 0.5) * WIDE, (Math.floor(i / across) + 0.5) * TALL + 0.5, cells));
  }

  private before(milliseconds: number): void {
    const { coordinates, command, point } = DATA, K = this.twin.gains, n = coordinates.length;
    const most = (column: number, zero: number) => this.predicted.reduce((m, row) => Math.max(m, Math.abs(row[column]! - zero)), 0);
    const arm = shownUnit(coordinates[0]!.unit);
    const rms = noise(law(DATA.estimator, K), DATA.estimator.A.length, DATA.resolution);
    const [power, small] = command.unit.length === 1 ? [1e3, `m${command.unit}`] : [1e3, `10⁻³ ${command.unit}`];
    const rows: [string, string][] = [
      ["rigs that are stabilised", `${(100 * this.share!).toFixed(0)} %`],
      ["largest command", `${significant(most(2 * n, 0))} of ${significant(command.limit)} ${command.unit}`],
      ["command noise, rms", `${significant(power * rms)} ${small}`],
      [`largest ${short(coordinates[0]!.meaning)} movement`, `${significant(arm.scale * most(0, point[0]!), 2)} ${arm.unit}`],
      ...coordinates.map(({ name }, i): [string, string] => [`gains on ${symbol(name)}, its rate`, `${significant(K[2 * i]!)}, ${significant(K[2 * i + 1]!)}`]),
      ["answered in", `${milliseconds.toFixed(0)} ms`],
    ];
    byId("before").replaceChildren(...rows.map(([what, value]) => make("tr", {}, make("th", { scope: "row" }, what), make("td", { class: "number" }, value))));
  }

  private charts(): void {
    const n = DATA.coordinates.length, { name, unit, meaning } = DATA.coordinates[n - 1]!, shown = shownUnit(unit), rows = this.predicted;
    if (!rows.length) return;
    const one = (id: string, label: string, colour: string, at: (k: number) => number, scale: ReturnType<typeof about> & { limit?: number }) => {
      byId(id).setAttribute("aria-label", label);
      drawStrip(byId<HTMLCanvasElement>(id), { ...scale, colour, count: rows.length, at, times: ["0 s", "1 s", "2 s"] });
    };
    const last = (k: number) => (rows[k]![2 * n - 2]! - DATA.point[n - 1]!) * shown.scale;
    const most = rows.reduce((m, _, k) => Math.max(m, Math.abs(last(k))), 0);
    byId("predicted-title").replaceChildren("Predicted release ", make("span", { class: "unit" }, `${symbol(name)} [${shown.unit}], command [${DATA.command.unit}]`));
    one("predicted-last", `predicted ${short(meaning)}, two seconds`, `--q${(n - 1) % 4}`, last, about(most, 5, shown.unit));
    one("predicted-command", "predicted command, two seconds", "--effort", (k) => rows[k]![2 * n]!, limited(DATA.command.limit, rows.reduce((m, row) => Math.max(m, Math.abs(row[2 * n]!)), 0)));
  }

  /** Whether the poles may be applied, and why not. */
  gate(): void {
    const { scene, unsteerable } = this.session, badge = byId("gate-badge");
    if (!scene || this.share === undefined) return;
    const few = this.share < ENOUGH, { level, sentence } = scene.basis;
    const idle = this.session.state?.state !== "running" ? "Start the rig to apply: gains are changed while it runs." : "";
    const from = this.session.state?.from ?? "held", swing = from === "held" ? "" : `While ${OTHERS[from]}, poles stay as they are. Start held upright to change them.`;
    const why = unsteerable || idle || swing || (few ? "Apply is locked: fewer than 95 % of the rigs are stabilised. Slow the fast poles down, or give them more damping." : "");
    badge.className = `badge ${few || level === "not trusted" ? "no" : level === "trusted" ? "ok" : "care"}`;
    say(badge, few ? "not supported" : level);
    say(byId("gate"), why || (this.confirming ? "This moves a real rig. Stand clear, one hand at its switch." : sentence || "At least 95 % of the rigs are stabilised."));
    lock(byId("apply"), why);
    say(byId("apply"), this.confirming ? "Confirm: apply to HARDWARE" : `Apply to the ${scene.kind === "TWIN" ? "twin" : "hardware"}`);
    byId("cancel").hidden = !this.confirming;
  }

  private confirm(on: boolean): void {
    this.confirming = on;
    this.pressed = false;
    this.gate();
  }

  private apply(): void {
    const why = byId("apply").dataset["why"], hardware = this.session.scene?.kind === "HARDWARE";
    this.pressed = this.answers.open; // what is applied is what was judged
    if (this.pressed) return;
    if (why) message(why);
    else if (hardware && !this.confirming) this.confirm(true);
    else {
      this.session.steer({ do: "poles", poles: this.poles(), ...(hardware ? { confirm: true } : {}) });
      this.confirm(false);
    }
  }
}

