// Screen Identify: a log, its fit as it goes, what it came to.

import { lock } from "./bar";
import { drawChart } from "./chart";
import { type Curve, drawCurves } from "./curves";
import { byId, italic, make, say } from "./dom";
import { ReportFrame } from "./frame";
import { Recording } from "./recording";
import type { Session } from "./session";
import { Weighing } from "./weighing";
import { short, shownUnit, signed, symbol } from "./words";

interface Log {
  id: string;
  /** Whether this rig was logged here; else somebody brought it. */
  own: boolean;
  name: string;
  seconds: number;
  /** Seconds since 1970, of a run. */
  started?: number;
  rows?: number;
  columns?: string[];
}

interface Fitted {
  id: string;
  log: string;
  of: string;
  name: string;
  since: number;
  verdict: string;
}

interface Identified {
  logs: Log[];
  /** `looks` counts the pictures of what it has come to. */
  now: { id: string; name: string; step: string; seconds: number; looks: number } | null;
  failed: string;
  fits: Fitted[];
}

interface Drawn {
  run: string; role: "fit" | "predict"; signal: string; unit: string; meaning: string; fit: string; from: number;
  ahead: number; measured: Curve; predicted: Curve;
}

/** What a fit that goes on has come to: simulations with the percent explained of each signal, the best curves. */
interface Picture {
  id: string;
  explained: [number, Record<string, number>][];
  curves?: Drawn[];
}

interface Facts {
  verdict: string;
  sound: boolean;
  interrupted: boolean;
  warnings: string[];
  windows: string[];
  rests: string[];
  plant: string;
  assessments: { question: string; state: string; tone: string; why: string }[];
  /** Numbers that nobody measured, and that were taken to be so. */
  assumed: { name: string; meaning: string; value: string }[];
  parameters: { symbol: string; meaning: string; value: string; interval: string; unit: string; status: string; tone: string }[];
  curves: Drawn[];
}

const SOON = 500, LATER = 3000, LARGEST = 20; // ms, MB
const RUNS = "The rig runs already.";
const UNSENT = "The log could not be sent: there is no connection to the bench.";

/** Name of a parameter as it is printed, what stands behind the first low line below it. */
function printed(name: string): (Node | string)[] {
  if (name.includes(".")) return [name.split(".").at(-1)!];
  const [stem = "", ...below] = name.split("_");
  return below.length ? [italic(symbol(stem)), make("sub", {}, below.join(" "))] : [italic(symbol(stem))];
}

const when = (seconds: number): string => new Date(1000 * seconds).toLocaleString("en-GB", { dateStyle: "medium", timeStyle: "medium" });
const sentence = (text: string): string => text[0]!.toUpperCase() + text.slice(1);

export class Identify {
  private readonly address: string;
  private identified: Identified | undefined;
  private facts: Facts | undefined;
  private picture: Picture | undefined;
  /** Fit that is shown, the one that is on its way, and the log that is to be chosen once it is listed. */
  private shown = "";
  private opening = "";
  private wanted = "";
  private timer = 0;
  /** The look that goes on, and whether there is to be another one after it. */
  private looks: Promise<void> | undefined;
  private stale = false;
  private busy = "";
  private readonly frame: ReportFrame;
  private readonly recording: Recording;
  private readonly weighing: Weighing;
  /** Whether a recording is shown, and not a fit; undefined until it is known whether there is one. */
  private recorded: boolean | undefined;
  /** Whether a weighing is shown. */
  private weighed = false;

  /** `chosen`: another fit is shown. */
  constructor(private readonly session: Session, record: () => void, private readonly chosen: () => void) {
    this.address = `/api/rigs/${encodeURIComponent(session.name)}`;
    this.recording = new Recording(this.address, (file) => session.file(`/rigs/${encodeURIComponent(session.name)}/runs/${file}`));
    this.weighing = new Weighing(this.address);
    const press = (id: string, act: () => void) =>
      byId(id).addEventListener("click", ({ currentTarget }) => {
        const why = (currentTarget as HTMLElement).dataset["why"];
        if (why) this.say(why);
        else act();
      });
    press("fit-begin", () => void this.begin());
    press("fit-interrupt", () => void this.order("DELETE", "fits"));
    press("fit-report", () => this.frame.show(this.file("html")));
    press("fit-motions", record);
    for (const from of ["sweep", "step"] as const) press(`record-${from}`, () => session.steer({ do: "start", from }));
    press("weigh", () => void this.weigh());
    press("fit-again", () => void this.again());
    byId("fit-log").addEventListener("change", () => this.about());
    byId("fit-file").addEventListener("change", ({ currentTarget }) => {
      const input = currentTarget as HTMLInputElement, file = input.files?.[0];
      if (file) void this.bring(file).finally(() => (input.value = ""));
    });
    byId("fit-list").addEventListener("change", () => {
      if (this.session.unreadable) return this.say(this.session.unreadable);
      this.recorded = this.weighed = false;
      void this.open(byId<HTMLSelectElement>("fit-list").value);
    });
    this.frame = new ReportFrame(byId("fit-frame"), () => session.stop());
    const redraw = () => {
      this.draw();
      this.recording.draw();
      this.weighing.draw();
    };
    addEventListener("resize", redraw);
    matchMedia("(prefers-color-scheme: dark)").addEventListener("change", redraw);
  }

  get visible(): boolean {
    return !byId("identify").hidden;
  }

  /** Whether a sweep or a step runs. */
  private get records(): boolean {
    const { state, from } = this.session.state ?? {};
    return (from === "sweep" || from === "step") && (state === "starting" || state === "running");
  }

  /** What is known now; again soon while a fit goes on, and now and then while the screen is looked at. */
  show(): Promise<void> {
    this.stale = true;
    return (this.looks ??= this.lookOn());
  }

  /** One look after the other: an older answer must not come to stand where a newer one did. */
  private async lookOn(): Promise<void> {
    clearTimeout(this.timer);
    try {
      while (this.stale) {
        this.stale = false;
        await this.lookOnce();
      }
    } finally {
      this.looks = undefined;
    }
    if (this.visible) this.timer = window.setTimeout(() => void this.show(), this.identified?.now || this.records || !this.recording.over || (this.weighed && !this.weighing.over) ? SOON : LATER);
  }

  private async lookOnce(): Promise<void> {
    const answer = await fetch(`${this.address}/fits`).catch(() => undefined);
    const before = this.identified;
    if (this.records) [this.recorded, this.weighed] = [true, false];
    if (this.weighed) await this.weighing.look();
    if (this.recorded === undefined || this.records || !this.recording.over) {
      const there = await this.recording.look();
      this.recorded ??= there; // a fit may have been chosen meanwhile
    }
    if (answer?.ok) {
      this.identified = (await answer.json()) as Identified;
      this.lists(before);
      const { now, failed, fits } = this.identified;
      if (now && now.looks !== (before?.now?.id === now.id ? before.now.looks : 0)) await this.look();
      if (before?.now && !now) await this.ended(failed, fits[0]);
      else if (!this.shown && !this.opening && fits[0] && !this.session.unreadable) await this.open(fits[0].id);
    }
    this.state();
  }

  /** What may be pressed now. */
  state(): void {
    const { session, identified, busy } = this, now = identified?.now, chosen = byId<HTMLSelectElement>("fit-log").value;
    lock(byId("fit-begin"), session.unsteerable || busy || (now ? "A log is being identified." : chosen ? "" : session.state?.writing ? "The report of the last run is being written; then it can be identified." : "There is no log yet: record one, or bring one."));
    byId("no-logs").hidden = !identified || identified.logs.length > 0 || session.state?.writing === true;
    byId("fit-record").hidden = session.scene?.kind !== "TWIN";
    for (const id of ["fit-motions", "record-sweep", "record-step"]) lock(byId(id), session.unsteerable || ({ stopped: "The rig is stopped; rearm it first.", starting: RUNS, running: RUNS } as Record<string, string>)[session.state?.state ?? ""] || "");
    byId("fit-interrupt").hidden = !now;
    byId("fit-begin").hidden = !!now;
    lock(byId("fit-interrupt"), session.unsteerable);
    lock(byId("weigh"), session.unsteerable || (this.weighed && !this.weighing.over ? "It is being weighed." : ""));
    lock(byId("fit-again"), session.unsteerable || busy || (now ? "A log is being identified." : ""));
    byId<HTMLInputElement>("fit-file").disabled = session.unsteerable !== "" || busy !== "";
    byId("fit-going").hidden = !now;
    byId("fit-live").hidden = !now || this.picture?.id !== now.id;
    byId("weigh-live").hidden = !this.weighed || !!now || !this.weighing.there;
    const unseen = byId("record-live").hidden;
    byId("record-live").hidden = !this.recorded || !!now || !byId("weigh-live").hidden;
    if (unseen && !byId("record-live").hidden) this.recording.draw(); // what is hidden has no size to be drawn in
    byId("fit-result").hidden = byId("fit-curves").hidden = !this.facts || !byId("fit-live").hidden || !byId("record-live").hidden || !byId("weigh-live").hidden;
    if (byId("fit-result").hidden) byId<HTMLSelectElement>("fit-list").value = ""; // so that the last one can be chosen, too
    if (now) {
      say(byId("fit-step"), `${now.step}, ${now.seconds.toFixed(0)} s`);
      this.say(`Identifying ${now.name}.`);
    }
  }

  /** What the fit that goes on has come to. */
  private async look(): Promise<void> {
    const answer = await fetch(`${this.address}/fits/now`).catch(() => undefined);
    if (!answer?.ok) return;
    const before = this.picture, picture = (await answer.json()) as Picture | null, last = picture?.explained.at(-1);
    if (!picture || !last) return;
    this.picture = picture;
    this.state();
    const shares = Object.entries(last[1]).map(([signal, percent]) => `${symbol(signal)} ${signed(percent, 0)} %`).join(", ");
    say(byId("fit-live-says"), `After ${last[0].toLocaleString("en-GB")} simulations the latest step explains ${shares}.`);
    const known = (of: Picture | undefined) => of && JSON.stringify([of.id, of.curves?.map((curve) => curve.signal)]);
    if (known(before) !== known(picture)) byId("fit-live-pictures").replaceChildren(...(picture.curves ?? []).map((curve) => this.pictured(curve)));
    this.draw();
  }

  /** Address of a file of a fit, the one that is shown unless another is meant. */
  private file(ending: string, id = this.shown): string {
    return this.session.file(`/rigs/${encodeURIComponent(this.session.name)}/fits/${id}.${ending}`);
  }

  private say(text: string): void {
    say(byId("fit-status"), text);
  }

  private async ended(failed: string, newest: Fitted | undefined): Promise<void> {
    if (!failed && newest && !this.session.unreadable) await this.open(newest.id); // what is said to be written is what stands there
    this.say(failed || "The fit is written.");
  }

  private lists(before: Identified | undefined): void {
    const { logs, fits } = this.identified!;
    if (JSON.stringify(before?.logs) !== JSON.stringify(logs)) {
      const select = byId<HTMLSelectElement>("fit-log"), chosen = this.wanted || select.value;
      const group = (label: string, own: boolean) => {
        const options = logs.filter((log) => log.own === own).map((log) => make("option", { value: log.id }, own ? `${sentence(log.name)} of ${when(log.started!)}, ${log.seconds.toFixed(1)} s` : log.name));
        return options.length ? [make("optgroup", { label }, ...options)] : [];
      };
      select.replaceChildren(...group("Runs of this rig", true), ...group("Brought", false));
      const fresh = before && logs.find((log) => log.own && !before.logs.some((old) => old.own && old.id === log.id));
      if (fresh || logs.some((log) => log.id === chosen)) select.value = fresh?.id ?? chosen;
      this.wanted = "";
      select.disabled = logs.length === 0;
      this.about();
    }
    if (JSON.stringify(before?.fits) !== JSON.stringify(fits)) {
      byId("fit-list").replaceChildren(...fits.map((fit) => make("option", { value: fit.id }, `${sentence(fit.name)}, fitted ${when(fit.since)}`)));
      byId<HTMLSelectElement>("fit-list").value = this.shown;
      byId("fits").hidden = fits.length === 0;
    }
  }

  private about(): void {
    const log = this.identified?.logs.find((each) => each.id === byId<HTMLSelectElement>("fit-log").value);
    byId("fit-kind").hidden = !log || log.own;
    const rows = log?.rows === undefined ? "" : `${log.rows.toLocaleString("en-GB")} rows in ${log.seconds.toPrecision(3)} s: ${log.columns!.join(", ")}.`;
    say(byId("fit-about"), !log ? "" : log.own ? "The bench knows this rig: what a scale and a ruler tell of it is given, the rest is estimated." : rows);
    this.state();
  }

  private async order(method: string, what: string, body?: BodyInit): Promise<Response | undefined> {
    const headers = { "x-bench-me": this.session.scene?.you ?? "" };
    const answer = await fetch(`${this.address}/${what}`, { method, headers, ...(body === undefined ? {} : { body }) }).catch(() => undefined);
    if (!answer) this.say(UNSENT);
    else if (!answer.ok) this.say(await answer.text());
    return answer?.ok ? answer : undefined;
  }

  private async bring(file: File): Promise<void> {
    if (file.size > LARGEST << 20) return this.say(`${file.name} has more than ${LARGEST} MB; cut it, or use upright identify on it.`);
    this.busy = "A log is being read.";
    this.say(`Reading ${file.name}.`);
    this.state();
    const answer = await this.order("POST", `logs?name=${encodeURIComponent(file.name)}`, file);
    this.busy = "";
    if (answer) {
      const log = (await answer.json()) as Log;
      this.wanted = log.id;
      this.say(`${log.name} is there.`);
    }
    await this.show();
  }

  private async weigh(): Promise<void> {
    if (!(await this.order("POST", "weighing"))) return;
    this.weighed = true;
    this.weighing.begin();
    await this.show();
  }

  private async begin(): Promise<void> {
    const log = byId<HTMLSelectElement>("fit-log").value, own = byId("fit-kind").hidden;
    const of = own ? "rig" : byId<HTMLSelectElement>("fit-of").value;
    if (!(await this.order("POST", "fits", JSON.stringify({ log, of })))) return;
    this.recorded = this.weighed = false;
    await this.show();
  }

  /** The log of the fit that is shown once more, with what was measured meanwhile. */
  private async again(): Promise<void> {
    const fit = this.identified?.fits.find((each) => each.id === this.shown), known: Record<string, string> = {};
    for (const input of byId("fit-assumed").querySelectorAll("input")) if (input.value.trim()) known[input.name] = input.value.trim();
    if (!fit) return;
    if (!Object.keys(known).length) return this.say("Type what you measured first, with its unit.");
    if (await this.order("POST", "fits", JSON.stringify({ log: fit.log, of: fit.of, known }))) await this.show();
  }

  private async open(id: string): Promise<void> {
    this.opening = id;
    const answer = await fetch(this.file("json", id)).catch(() => undefined);
    const facts = answer?.ok ? ((await answer.json()) as Facts) : undefined;
    if (this.opening !== id) return; // another one was chosen meanwhile
    this.opening = "";
    if (!facts) return;
    this.facts = facts;
    this.shown = id;
    byId<HTMLSelectElement>("fit-list").value = id;
    byId("fit-report-panel").hidden = true;
    this.build(this.facts);
  }

  private build(facts: Facts): void {
    this.state();
    const [headline = "", ...rest] = facts.verdict.split(/(?<=\.) (?=[A-Z])/);
    say(byId("fit-verdict"), headline);
    byId("fit-verdict").className = `share ${facts.sound ? "sound" : "unsound"}`;
    say(byId("fit-more"), rest.join(" "));
    byId("fit-questions").replaceChildren(...facts.assessments.map((a) => make("li", {}, make("span", { class: `badge ${a.tone}` }, a.state), ` ${a.question} `, make("span", { class: "why" }, a.why))));
    byId("fit-rows").replaceChildren(...facts.parameters.map((p) => make("tr", {},
      make("th", { scope: "row" }, make("span", { class: "name" }, ...printed(p.symbol)), " ", make("span", { class: "meaning" }, p.meaning)),
      make("td", { class: "number" }, `${p.value} ${p.unit}`, make("span", { class: "meaning" }, p.interval)),
      make("td", {}, make("span", { class: `badge ${p.tone}` }, p.status)))));
    byId("fit-rests").replaceChildren(...[...facts.rests, ...facts.warnings, ...facts.windows].map((text) => make("li", {}, text)));
    byId("fit-measure").hidden = facts.assumed.length === 0;
    byId("fit-assumed").replaceChildren(...facts.assumed.map(({ name, meaning, value }) => make("label", { class: "field" },
      make("span", {}, ...printed(name), ` ${meaning}`), make("input", { type: "text", name, maxlength: "60", placeholder: value }))));
    byId("fit-use").dataset["fit"] = this.shown;
    this.chosen();
    byId<HTMLAnchorElement>("fit-file-link").href = this.file("fit");
    byId("fit-pictures").replaceChildren(...facts.curves.map((curve) => {
      const how = curve.ahead ? `, ${curve.ahead} s ahead` : "";
      return this.pictured(curve, `, ${curve.role === "fit" ? "fitted" : "predicted"}${how}: ${curve.fit}`, `; ${curve.fit} explained`);
    }));
    byId("fit-tested").hidden = !facts.curves.some((curve) => curve.role === "predict");
    this.draw();
  }

  private pictured({ unit, meaning, signal }: Drawn, how = "", explained = ""): HTMLElement {
    const name = short(meaning), title = make("h3", {}, italic(symbol(signal)), ` ${name} `, make("span", { class: "unit" }, `[${shownUnit(unit).unit}]${how}`));
    return make("div", { class: "curve" }, title, make("canvas", { role: "img", "aria-label": `${name}, measured and by the model${explained}` }));
  }

  private draw(): void {
    if (!this.visible) return;
    const drawn = (where: string, curves: Drawn[]) => document.querySelectorAll<HTMLCanvasElement>(`#${where} canvas`).forEach((canvas, k) => {
      const curve = curves[k];
      if (curve) drawCurves(canvas, { ...curve, from: curve.role === "predict" ? curve.from : 0, scale: shownUnit(curve.unit).scale, colour: `--q${k % 4}` });
    });
    if (this.facts) drawn("fit-pictures", this.facts.curves);
    const { explained, curves } = this.picture ?? { explained: [] };
    if (!explained.length) return;
    drawn("fit-live-pictures", curves ?? []);
    const most = explained.at(-1)![0], signals = Object.keys(explained.at(-1)![1]);
    drawChart(byId<HTMLCanvasElement>("fit-live-share"), {
      x: { low: 0, high: most, unit: "" }, y: { low: 0, high: 100, unit: "%" },
      lines: signals.map((signal, k) => ({
        x: explained.map(([count]) => count), y: explained.map(([, percents]) => Math.max(0, percents[signal] ?? NaN)),
        colour: `--q${k % 4}`, dashes: k % 2 ? [6, 3] : [], name: symbol(signal),
      })),
    });
  }

  /** Draws what could not be drawn while it was hidden. */
  opened(): void {
    this.draw();
    this.recording.draw();
    this.weighing.draw();
    void this.show();
  }
}
