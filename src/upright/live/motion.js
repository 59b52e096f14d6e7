// Plays a run: the rig as measured, as simulated, or both over each other, at the time that a person chooses. Expects RUN, OUTLINE and the mark-up of motion.html.
"use strict";

(() => {
  const $ = (id) => document.getElementById(id), DEG = 180 / Math.PI, names = RUN.coordinates.map((c) => c.name);
  const unpack = ({ middle, scale, levels }) =>
    Float64Array.from(new Int16Array(Uint8Array.from(atob(levels), (c) => c.charCodeAt(0)).buffer), (k) => middle + scale * k);
  const nothing = new Float64Array(RUN.frames), one = (packed) => (packed ? unpack(packed) : nothing);
  const simulated = RUN.coordinates.map((c) => one(c.simulated ?? c.measured));
  const measured = RUN.coordinates.map((c) => one(c.measured ?? c.simulated));
  const both = ["measured", "simulated"].every((kind) => RUN.coordinates.some((c) => c[kind]));
  const frames = RUN.frames, seconds = (frames - 1) * RUN.step;
  const at = (columns, k) => columns.map((c) => c[k]);
  const few = Array.from({ length: 60 }, (_, i) => Math.floor((i * (frames - 1)) / 59));
  const view = RigDrawing.view(OUTLINE, [names.map(() => 0), ...few.flatMap((k) => [at(measured, k), at(simulated, k)])]);
  const drawing = $("rig");
  drawing.setAttribute("viewBox", view.box.join(" "));
  drawing.replaceChildren();
  const ghost = both && new RigDrawing(drawing, OUTLINE, names, view, true), rig = new RigDrawing(drawing, OUTLINE, names, view);
  const shown = (x, unit) => (unit === "rad" ? `${(x * DEG).toFixed(1)}°` : `${(x * 100).toFixed(2)} cm`).replace("-", "\u2212");
  const state = { time: 0, playing: false, speed: 1, before: 0 };

  const show = () => {
    const k = Math.min(frames - 1, Math.round(state.time / RUN.step));
    if (both) ghost.draw(at(measured, k));
    rig.draw(at(simulated, k));
    $("time").textContent = `${(RUN.start + k * RUN.step).toFixed(2)} s`;
    $("scrub").value = k;
    $("scrub").setAttribute("aria-valuetext", $("time").textContent);
    for (const line of document.querySelectorAll("line.now")) {
      line.setAttribute("x1", (1000 * k) / (frames - 1));
      line.setAttribute("x2", (1000 * k) / (frames - 1));
    }
    RUN.coordinates.forEach((c, i) => {
      const values = [["measured", measured], ["simulated", simulated]].filter(([kind]) => c[kind]);
      if (values.length) $(`value-${i}`).textContent = values.map(([kind, of]) => `${kind} ${shown(of[i][k], c.unit)}`).join(", ");
    });
    window.motion.frame = k;
  };
  const play = (on) => {
    if (on && state.time >= seconds) state.time = 0;
    [state.playing, state.before] = [on, 0];
    $("play").textContent = on ? "Pause" : "Play";
    if (on) requestAnimationFrame(step);
  };
  const step = (now) => {
    if (!state.playing) return;
    if (state.before) state.time = Math.min(seconds, state.time + (state.speed * (now - state.before)) / 1000);
    state.before = now;
    show();
    if (state.time >= seconds) play(false);
    else requestAnimationFrame(step);
  };
  const seek = (k) => {
    state.time = Math.min(Math.max(k, 0), frames - 1) * RUN.step;
    show();
  };
  $("play").addEventListener("click", () => play(!state.playing));
  $("slow").addEventListener("click", () => {
    state.speed = state.speed === 1 ? 0.25 : 1;
    $("slow").setAttribute("aria-pressed", state.speed !== 1);
  });
  $("scrub").addEventListener("input", (event) => seek(Number(event.target.value)));
  for (const strip of document.querySelectorAll("svg.strip"))
    for (const kind of ["pointerdown", "pointermove"])
      strip.addEventListener(kind, (event) => {
        if (kind === "pointermove" && !event.buttons) return;
        const box = strip.getBoundingClientRect();
        seek(Math.round(((event.clientX - box.left) / box.width) * (frames - 1)));
      });
  document.documentElement.classList.add("alive");
  window.motion = { frame: 0, measured, simulated, state, seek, play };
  show();
})();
