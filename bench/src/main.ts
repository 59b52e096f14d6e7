// The bench: one rig on several screens, and what is there on each of them.

import { Bar, isPhone, message } from "./bar";
import { type ClassFacts, classroom } from "./classroom";
import { Design } from "./design";
import { byId, make } from "./dom";
import { Guide } from "./guide";
import { Identify } from "./identify";
import { Model } from "./model";
import { Run } from "./run";
import { Runs } from "./runs";
import { Session } from "./session";
import { Track } from "./track";

interface Listed {
  name: string;
  title: string;
}

const SCREENS = ["run", "identify", "design", "track", "runs"] as const;
type Screen = (typeof SCREENS)[number];

const AGAIN = 1000; // ms

interface Listing {
  rigs: Listed[];
  class?: ClassFacts;
}

async function rigs(): Promise<Listing> {
  for (;;) {
    const answer = await fetch("/api/rigs").catch(() => undefined);
    if (answer?.ok) return (await answer.json()) as Listing;
    await new Promise((resolve) => setTimeout(resolve, AGAIN));
  }
}

/** Loads the rig's drawing and kernel; why it has none, or "". */
function unknown(rig: string): Promise<string> {
  const src = `/rigs/${encodeURIComponent(rig)}/twin.js`;
  return new Promise((resolve) => {
    const script = make("script", { src });
    script.onload = () => resolve("");
    script.onerror = () => void fetch(src).then((answer) => answer.text(), () => "").then((why) => resolve(why || "there is no drawing"));
    document.head.append(script);
  });
}

const place = (): string[] => location.hash.split("/").slice(1).map(decodeURIComponent);

async function bench(): Promise<void> {
  const { rigs: all, class: ofClass } = await rigs(), known = all.find((rig) => rig.name === place()[0]);
  if (ofClass && !known) return classroom(all, ofClass);
  document.body.classList.toggle("in-class", ofClass !== undefined);
  if (ofClass) for (const from of ["hanging", "motions"]) document.querySelector(`#from option[value=${from}]`)?.remove();
  document.body.classList.toggle("instructs", ofClass?.instructor === true);
  const name = (known ?? all[0])?.name;
  if (!name) return message("This bench has no rig; start it with a RIG.toml.");
  // The rig's kernel is compiled at the first request: what stops the rig does not wait for it.
  let moving = false, drawing = false, design: Design | undefined, built = "", wanted = place()[1];
  const scene = () => {
    if (!session.scene) return;
    if (!drawing) void (session.scene.still ? Promise.resolve(session.scene.still) : unknown(name)).then((why) => {
      moving = why === "";
      run.note = why;
      scene();
    });
    drawing = true;
    bar.scene();
    model.show();
    const { coordinates, point, kind } = session.scene, now = JSON.stringify([coordinates, point, kind, moving]);
    if (now === built) run.law();
    else run.build(moving);
    built = now;
    if (moving) {
      design ??= new Design(session);
      design.scene();
    }
    track.scene(moving);
    offer("design", moving);
    offer("track", session.scene.tracked !== undefined);
    guide.scene(moving);
    bar.show();
  };
  const session: Session = new Session(name, {
    scene,
    state: (before) => {
      const state = session.state;
      if (state?.state === "ended" && before && !before.verdict && state.verdict) message(state.verdict);
      const news = before?.state !== state?.state || before?.verdict !== state?.verdict || before?.writing !== state?.writing || before?.operator !== state?.operator;
      if (news) void runs.show();
      if (before?.state !== "starting" && state?.state === "starting") session.history.clear();
      bar.show();
      model.show();
      run.state();
      design?.gate();
      track.gate();
      if (identify.visible) {
        if (news) void identify.show();
        else identify.state();
      }
    },
    message,
    steered: (request) => guide.steered(request),
  });
  const run = new Run(session), runs = new Runs(session), track = new Track(session);
  const identify = new Identify(session, () => {
    byId<HTMLSelectElement>("from").value = "motions";
    run.start();
  }, () => model.show());
  const model = new Model(session);
  const bar = new Bar(session, { start: () => run.start(), tap: () => run.tap() });
  const show = (asked: string | undefined) => {
    const screen: Screen = (!isPhone() && SCREENS.find((s) => s === asked && !byId(`tab-${s}`).hidden)) || "run";
    for (const s of SCREENS) {
      byId(s).hidden = s !== screen;
      byId(`tab-${s}`).setAttribute("aria-selected", `${s === screen}`);
      byId(`tab-${s}`).tabIndex = s === screen ? 0 : -1;
    }
    history.replaceState(null, "", `#/${encodeURIComponent(name)}/${screen}`);
    if (screen === "runs") void runs.show();
    if (screen === "track") track.shown();
    if (screen === "identify") identify.opened();
  };
  /** Shows the tab of a screen that this rig has; the screen itself where the address asked for it. */
  const offer = (screen: Screen, there: boolean) => {
    byId(`tab-${screen}`).hidden = !there;
    if (there && wanted === screen) show(wanted);
    if (there && wanted === screen) wanted = undefined;
  };
  const guide = new Guide(session, track, (screen) => { wanted = undefined; show(screen); });
  const tabs = () => SCREENS.filter((s) => !byId(`tab-${s}`).hidden);
  for (const screen of SCREENS) byId(`tab-${screen}`).addEventListener("click", () => { wanted = undefined; show(screen); });
  byId("tab-run").parentElement!.addEventListener("keydown", (event) => {
    const step = { ArrowRight: 1, ArrowLeft: -1 }[event.key], now = tabs().findIndex((s) => !byId(s).hidden);
    if (!step) return;
    const next = tabs().at((now + step) % tabs().length)!;
    show(next);
    byId(`tab-${next}`).focus();
  });
  if (ofClass) {
    byId("rigs").hidden = false;
    byId("rigs").append(make("a", { href: "#/class" }, ofClass.instructor ? "All students" : "Not you? All names"));
  } else if (all.length > 1) {
    byId("rigs").hidden = false;
    byId("rigs").append(...all.map((rig) => make("a", { href: `#/${encodeURIComponent(rig.name)}/run`, ...(rig.name === name ? { "aria-current": "page" } : {}) }, rig.title)));
  }
  addEventListener("hashchange", () => (place()[0] === name ? show(place()[1]) : location.reload()));
  show(wanted);
  const frame = () => {
    if (!byId("run").hidden) run.draw();
    if (!byId("track").hidden) track.draw();
    bar.clock();
    guide.look();
    requestAnimationFrame(frame);
  };
  requestAnimationFrame(frame);
}

void bench();
