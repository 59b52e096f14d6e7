// A class: everybody's state at a glance for the instructor, and the list of names for the students.

import { byId, make, say } from "./dom";
import { Connection } from "./socket";
import { DEGREE } from "./words";

export interface ClassFacts {
  instructor: boolean;
  /** Of the coordinate that is held: "rad", or "m". */
  unit: string;
}

const STATES = ["idle", "starting", "running", "stopped", "ended", "fell", "records"] as const;
export type Seen = (typeof STATES)[number];

export interface StudentState {
  state: Seen;
  operated: boolean;
  /** How far from what is held [rad or m]. */
  away: number;
  seconds: number;
}

const HEAD = 6, EACH = 6; // bytes

export function decodeClass(buffer: ArrayBuffer): { late: number; students: StudentState[] } {
  const view = new DataView(buffer), count = view.getUint16(0, true);
  if (buffer.byteLength !== HEAD + EACH * count) throw new RangeError(`a frame of ${count} students has ${HEAD + EACH * count} bytes, got ${buffer.byteLength}`);
  const students = Array.from({ length: count }, (_, i) => {
    const at = HEAD + EACH * i, state = STATES[view.getUint8(at)];
    if (!state) throw new RangeError(`there is no state ${view.getUint8(at)}`);
    return { state, operated: view.getUint8(at + 1) !== 0, away: view.getInt16(at + 2, true) / 1000, seconds: view.getUint16(at + 4, true) };
  });
  return { late: view.getUint32(2, true), students };
}

/** What a student's twin does, in words. */
export function told({ state, operated, seconds }: StudentState): string {
  if (state === "idle") return operated ? "idle" : "nobody yet";
  if (state === "starting") return "starting";
  if (state === "records") return `recording for ${seconds} s`;
  return state === "running" ? `upright for ${seconds} s` : `${state} at ${seconds} s`;
}

const SHOWN: readonly Seen[] = ["running", "records", "fell", "stopped", "idle"];
const COUNTED: Partial<Record<Seen, string>> = { running: "upright", records: "recording", fell: "fell", stopped: "stopped", idle: "idle" };

/** How many there are of each: "12 upright, 2 fell, 1 stopped, 45 idle". */
export function summed(students: StudentState[]): string {
  const as = (state: Seen): Seen => (state === "starting" || state === "ended" ? "idle" : state);
  return SHOWN.map((state) => [students.filter((one) => as(one.state) === state).length, COUNTED[state]] as const)
    .filter(([count]) => count > 0).map(([count, word]) => `${count} ${word}`).join(", ");
}

const drawn = (): SVGElement => {
  const svg = RigDrawing.make("svg", { viewBox: "-20 -20 40 40", "aria-hidden": "true" });
  RigDrawing.make("path", { class: "ground", d: "M-16 0H16" }, svg);
  RigDrawing.make("path", { class: "rod", d: "M0 0V-17" }, svg);
  return svg;
};

class Tile {
  readonly link: HTMLAnchorElement;
  private readonly text = make("span", { class: "state", "data-state": "idle" }, "nobody yet");
  private readonly svg = drawn();

  constructor(name: string, title: string, private readonly turns: boolean) {
    this.link = make("a", { href: `#/${encodeURIComponent(name)}/run` }, this.svg, make("b", {}, title), this.text);
  }

  show(seen: StudentState): void {
    say(this.text, told(seen));
    this.text.dataset["state"] = this.link.dataset["state"] = seen.state;
    const shift = Math.max(-12, Math.min(12, 200 * seen.away)), turn = seen.state === "fell" ? Math.sign(seen.away || 1) * 90 : seen.away * DEGREE;
    const pose = seen.state === "idle" ? "rotate(180)" : seen.state === "records" && this.turns ? `rotate(${180 - turn})` : this.turns ? `rotate(${-turn})` : `translate(${shift} 0)`;
    this.svg.querySelector(".rod")!.setAttribute("transform", pose);
  }
}

/** Shows the class in the place of a rig. */
export function classroom(all: { name: string; title: string }[], facts: ClassFacts): void {
  addEventListener("hashchange", () => location.reload());
  history.replaceState(null, "", "#/class");
  document.title = "Class";
  document.body.classList.add("of-class");
  const tiles = all.map((rig) => new Tile(rig.name, rig.title, facts.unit === "rad"));
  const list = make("ul", { class: facts.instructor ? "students" : "names" }, ...all.map((rig, i) =>
    make("li", {}, facts.instructor ? tiles[i]!.link : make("a", { href: `#/${encodeURIComponent(rig.name)}/run` }, rig.title))));
  const main = make("main", {}, make("section", { id: "students", tabindex: "0", "aria-label": "Students" }, list));
  const summary = make("span", { id: "summary", role: "status" }), late = make("b", {}, "0");
  const heading = make("h1", {}, facts.instructor ? `Class of ${all.length}` : "Who are you?");
  if (!facts.instructor) {
    document.body.replaceChildren(make("header", { class: "bar" }, heading, make("span", {}, "Choose your name: your pendulum has numbers of its own.")), main);
    return;
  }
  const stop = make("button", { id: "stop", type: "button" }, "STOP ALL ", make("kbd", { "aria-hidden": "true" }, "Esc"));
  const notice = make("p", { id: "message-text" });
  document.body.replaceChildren(
    make("header", { class: "bar" }, heading, summary, make("p", { class: "clock" }, "late ticks ", late), stop),
    make("section", { class: "notices", "aria-label": "Notices" }, make("div", { id: "message", class: "notice", role: "alert", hidden: "" }, notice)),
    main,
  );
  const message = (sentence: string) => {
    byId("message").hidden = sentence === "";
    say(notice, sentence);
  };
  const url = `${location.protocol === "https:" ? "wss" : "ws"}://${location.host}/class`;
  const connection = new Connection(() => url, {
    received: (received) => received.type === "error" && message(received.sentence),
    frame: (bytes) => {
      const seen = decodeClass(bytes);
      message("");
      say(summary, summed(seen.students));
      say(late, `${seen.late}`);
      seen.students.forEach((one, i) => tiles[i]?.show(one));
    },
    lost: () => message("The connection to the bench is lost, and this page stops nobody; it connects again by itself."),
  });
  const all_stop = () => {
    if (!connection.send({ do: "stop" })) message("STOP could not be sent: there is no connection. It is sent as soon as there is one again.");
  };
  stop.addEventListener("click", all_stop);
  addEventListener("keydown", (event) => { if (event.key === "Escape") all_stop(); }, { capture: true });
}
