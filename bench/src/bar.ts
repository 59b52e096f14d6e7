// What is there on every screen: rig, state, buttons, STOP, who operates, why it is stopped.

import { byId, say } from "./dom";
import type { Phase } from "./protocol";
import { ANOTHER, type Session } from "./session";
import { significant } from "./words";

const WORD: Record<Phase, string> = { idle: "Idle", starting: "Starting", running: "Running", stopped: "STOPPED", ended: "Ended" };
const LOST = "The connection to the bench is lost, and this page cannot stop the rig: use the rig's own switch. The page connects again by itself.";

/** A phone watches and stops; as in bench.css. */
export const isPhone = (): boolean => matchMedia("(max-width: 699px) and (pointer: coarse)").matches;
const WATCHING = "Watching. You can stop the rig; a phone cannot steer it.";

/** Locks a button without taking it from the keyboard; a locked button says why when it is pressed. */
export function lock(button: HTMLElement, why: string): void {
  button.setAttribute("aria-disabled", `${why !== ""}`);
  button.dataset["why"] = why;
}

export function message(sentence: string): void {
  byId("message").hidden = sentence === "";
  say(byId("message-text"), sentence);
}

export class Bar {
  constructor(private readonly session: Session, actions: { start: () => void; tap: () => void }) {
    const press = (id: string, act: () => void) =>
      byId(id).addEventListener("click", ({ currentTarget }) => {
        const why = (currentTarget as HTMLElement).dataset["why"];
        if (why) message(why);
        else act();
      });
    press("start", actions.start);
    press("tap", actions.tap);
    press("end", () => session.steer({ do: "end" }));
    press("rearm", () => session.steer({ do: "rearm" }));
    press("control", () => (session.state?.operator === "you" ? session.release() : session.steer({ do: "operate" })));
    byId("from").addEventListener("change", () => this.show());
    byId("stop").addEventListener("click", () => session.stop());
    byId("dismiss").addEventListener("click", () => message(""));
    // Before anything else on the page can take the key.
    addEventListener("keydown", (event) => { if (event.key === "Escape") session.stop(); }, { capture: true });
  }

  scene(): void {
    const { scene } = this.session, badge = byId("kind");
    if (!scene) return;
    say(byId("rig-name"), scene.title);
    badge.hidden = false;
    badge.className = `badge ${scene.kind.toLowerCase()}`;
    say(badge, scene.kind);
    byId("tap").hidden = scene.kind !== "TWIN";
    byId("from").hidden = byId("record-motions").hidden = scene.kind !== "TWIN" || Math.abs(scene.point.at(-1)! - Math.PI) > 1e-6;
    say(byId("rate"), `at ${significant(1 / scene.period / (scene.period < 1e-3 ? 1000 : 1), 3)} ${scene.period < 1e-3 ? "kHz" : "Hz"}`);
    document.title = `${scene.title}: bench`;
  }

  show(): void {
    const { session } = this, { state, connected, unsteerable } = session;
    const phase = connected ? state?.state : undefined, ended = phase === "idle" || phase === "ended";
    byId("state").dataset["state"] = phase ?? "lost";
    say(byId("state"), phase ? WORD[phase] : "Not connected");
    say(byId("late"), `${state?.late ?? 0}`);
    for (const note of document.querySelectorAll<HTMLElement>(".writing")) note.hidden = !state?.writing;
    const from = byId<HTMLSelectElement>("from");
    const why = from.value === "hanging" ? (state?.hanging ?? "") : "";
    from.disabled = phase === "starting" || phase === "running";
    if (from.disabled && state) from.value = state.from;
    lock(byId("start"), unsteerable || (ended ? why : phase === "stopped" ? "The rig is stopped; rearm it first." : "The rig runs already."));
    for (const id of ["end", "tap"]) lock(byId(id), unsteerable || (phase === "running" ? "" : "The rig does not run; start it first."));
    lock(byId("rearm"), unsteerable);
    const operator = state?.operator ?? "nobody";
    const words = { you: "You operate.", another: `Watching. ${ANOTHER}`, nobody: "Nobody operates; whoever starts does." };
    say(byId("operator"), !connected ? "" : isPhone() ? WATCHING : words[operator]);
    byId("control").hidden = !connected || operator === "another";
    say(byId("control"), operator === "you" ? "Give up control" : "Take control");
    byId("latch").hidden = connected && phase !== "stopped";
    byId("rearm").hidden = !connected;
    say(byId("latch-why"), !connected ? LOST : phase === "stopped" ? state?.why || `Stopped: ${state?.faults.join("; ")}.` : "");
  }

  clock(): void {
    const { session } = this;
    say(byId("clock"), `${(Math.max(0, session.history.last) * (session.scene?.period ?? 0)).toFixed(1)} s`);
  }
}
