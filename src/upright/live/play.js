// Draws a Twin and lets a person push it, drag its poles and change its settings. Expects DATA, OUTLINE and the mark-up of play.html.
"use strict";

(() => {
  const twin = new Twin(DATA), $ = (id) => document.getElementById(id), n = twin.n;
  const DEG = 180 / Math.PI, last = n - 1;
  const make = RigDrawing.make;
  const shown = (x, unit) => (unit === "rad" ? `${(x * DEG).toFixed(1)}°` : `${(x * 100).toFixed(1)} cm`).replace("-", "\u2212");

  // --- the rig ---------------------------------------------------------------------------------------------------
  const view = RigDrawing.view(OUTLINE, [DATA.start.filter((_, i) => i % 2 === 0), DATA.coordinates.map(() => 0)]);
  const drawing = $("rig");
  drawing.setAttribute("viewBox", view.box.join(" "));
  drawing.replaceChildren();
  const rig = new RigDrawing(drawing, OUTLINE, DATA.coordinates.map((c) => c.name), view);
  const draw = () => rig.draw(twin.state().filter((_, i) => i % 2 === 0));

  // --- what happened: the last ten seconds ------------------------------------------------------------------------
  const SECONDS = 10, traces = $("traces"), history = [];
  const strips = [...DATA.coordinates.map((c) => ({ name: c.name, unit: c.unit === "rad" ? "deg" : "cm",
    scale: c.unit === "rad" ? DEG : 100, least: c.unit === "rad" ? 5 : 1 })),
    { name: "command", unit: DATA.command.unit, scale: 1, least: DATA.command.limit / 10 }];
  const nice = (x) => [1, 2, 5, 10].map((m) => m * 10 ** Math.floor(Math.log10(x))).find((m) => m >= x * 0.999);
  const drawTraces = () => {
    const c = traces.getContext("2d"), dense = devicePixelRatio || 1;
    const [w, h] = [traces.clientWidth, traces.clientHeight];
    if (traces.width !== Math.round(w * dense)) [traces.width, traces.height] = [Math.round(w * dense), Math.round(h * dense)];
    c.setTransform(dense, 0, 0, dense, 0, 0);
    c.clearRect(0, 0, w, h);
    const style = getComputedStyle(document.documentElement), of = (v) => style.getPropertyValue(v).trim();
    c.font = "13px system-ui, sans-serif";
    const left = 52, each = h / strips.length, now = twin.k * DATA.period;
    strips.forEach((s, i) => {
      const zero = i < n ? DATA.point[i] : 0, column = i < n ? 2 * i : 2 * n;
      const values = history.map((r) => (r.row[column] - zero) * s.scale);
      let most = s.least;
      for (const v of values) most = Math.max(most, Math.abs(v));
      const range = nice(most), y = (v) => each * (i + 0.56) - (v / range) * each * 0.36;
      c.strokeStyle = of("--line");
      c.lineWidth = 1;
      c.beginPath();
      for (const v of [-range, 0, range]) { c.moveTo(left, y(v)); c.lineTo(w, y(v)); }
      c.stroke();
      c.fillStyle = of("--ink-2");
      c.textAlign = "right";
      for (const v of [-range, 0, range]) c.fillText(String(v).replace("-", "\u2212"), left - 6, y(v) + 4);
      c.textAlign = "left";
      c.fillText(`${GREEK[s.name] ?? s.name} [${s.unit}]`, left + 4, each * i + 15);
      if (i === n) {
        c.strokeStyle = of("--care");
        c.setLineDash([5, 4]);
        c.beginPath();
        for (const v of [-1, 1]) { const l = y(v * twin.settings.limit); if (Math.abs(twin.settings.limit) <= range) { c.moveTo(left, l); c.lineTo(w, l); } }
        c.stroke();
        c.setLineDash([]);
      }
      c.strokeStyle = of(i < n ? `--q${i % 4}` : "--effort");
      c.lineWidth = 1.6;
      c.beginPath();
      history.forEach((r, k) => {
        const x = w - ((now - r.t) / SECONDS) * (w - left), v = y(values[k]);
        k ? c.lineTo(x, v) : c.moveTo(x, v);
      });
      c.stroke();
    });
  };
  const GREEK = { theta: "θ", psi: "ψ", alpha: "α" };

  // --- poles -----------------------------------------------------------------------------------------------------
  const plane = $("plane"), list = $("poles");
  const fastest = Math.max(...DATA.poles.map(([re, im]) => Math.hypot(re, im)), 6);
  const reach = { left: -1.35 * fastest, right: 0.3 * fastest, high: 0.75 * fastest };
  const W = 320, H = 220, px = (re) => ((re - reach.left) / (reach.right - reach.left)) * W;
  const py = (im) => H / 2 - (im / reach.high) * (H / 2);
  plane.setAttribute("viewBox", `0 0 ${W} ${H}`);
  plane.replaceChildren();
  make("rect", { x: px(0), y: 0, width: W - px(0), height: H, fill: "var(--tint)" }, plane);
  make("line", { x1: 0, x2: W, y1: py(0), y2: py(0), stroke: "var(--line-strong)" }, plane);
  make("line", { x1: px(0), x2: px(0), y1: 0, y2: H, stroke: "var(--line-strong)" }, plane);
  for (let v = 5 * Math.ceil(reach.left / 5); v < reach.right; v += Math.max(5, 5 * Math.round(fastest / 25))) {
    if (!v) continue;
    make("line", { x1: px(v), x2: px(v), y1: py(0) - 3, y2: py(0) + 3, stroke: "var(--line-strong)" }, plane);
    const t = make("text", { x: px(v), y: py(0) + 17, "text-anchor": "middle", fill: "var(--ink-2)", "font-size": 12 }, plane);
    t.textContent = String(v).replace("-", "\u2212");
  }
  const said = ([re, im]) => im
    ? `pole pair, frequency ${Math.hypot(re, im).toFixed(1)} rad/s, damping ratio ${(-re / Math.hypot(re, im)).toFixed(2)}`
    : `real pole at ${re.toFixed(1)} per second`;
  const upper = () => twin.poles.filter(([, im]) => im >= 0);
  const moved = (k, re, im) => {
    const heads = upper().map((z) => [...z]);
    heads[k] = [Math.min(Math.max(re, reach.left), -0.2), heads[k][1] ? Math.min(Math.max(im, 0.05), reach.high) : 0];
    const all = heads.flatMap(([a, b]) => (b ? [[a, b], [a, -b]] : [[a, 0]]));
    twin.place(all);
    drawPoles();
    answer();
  };
  const marks = [];
  const drawPoles = () => {
    upper().forEach((z, k) => {
      const mark = (marks[k] ??= newMark(k, z));
      mark.heads.forEach((g, i) => g.setAttribute("transform", `translate(${px(z[0])} ${py(i ? -z[1] : z[1])})`));
      mark.heads[0].setAttribute("aria-label", said(z));
      mark.heads[0].setAttribute("aria-valuenow", (z[1] ? Math.hypot(...z) : -z[0]).toFixed(2));
      mark.heads[0].setAttribute("aria-valuetext", said(z));
      mark.inputs.forEach((input, i) => {
        if (document.activeElement !== input)
          input.value = (z[1] ? [Math.hypot(...z), -z[0] / Math.hypot(...z)][i] : -z[0]).toFixed(i ? 2 : 1);
      });
    });
  };
  const newMark = (k, z) => {
    const heads = (z[1] ? [0, 1] : [0]).map((i) => {
      const g = make("g", i ? { "aria-hidden": "true" } : { tabindex: 0, role: "slider", class: "pole" }, plane);
      make("circle", { r: 14, fill: "transparent" }, g);
      make("path", { d: "M-6-6 6 6M6-6-6 6", stroke: "var(--ink)", "stroke-width": 2.2, "stroke-linecap": "round" }, g);
      g.addEventListener("pointerdown", (e) => {
        e.preventDefault();
        g.setPointerCapture(e.pointerId);
        const drag = (m) => {
          const b = plane.getBoundingClientRect();
          const re = reach.left + ((m.clientX - b.left) / b.width) * (reach.right - reach.left);
          moved(k, re, Math.abs(0.5 - (m.clientY - b.top) / b.height) * 2 * reach.high);
        };
        g.addEventListener("pointermove", drag);
        const end = () => g.removeEventListener("pointermove", drag);
        g.addEventListener("pointerup", end, { once: true });
        g.addEventListener("pointercancel", end, { once: true });
      });
      return g;
    });
    heads[0].addEventListener("keydown", (e) => {
      const step = { ArrowLeft: [-0.2, 0], ArrowRight: [0.2, 0], ArrowUp: [0, 0.2], ArrowDown: [0, -0.2] }[e.key];
      if (!step) return;
      e.preventDefault();
      e.stopPropagation();
      const [re, im] = upper()[k];
      moved(k, re + step[0], im + step[1]);
    });
    const row = document.createElement("p"), inputs = [];
    const field = (label, unit, change) => {
      const l = document.createElement("label"), input = document.createElement("input");
      Object.assign(input, { type: "number", step: label === "damping ratio" ? "0.05" : "0.5", min: "0.05" });
      input.addEventListener("change", () => { if (+input.value > 0) change(+input.value); });
      l.append(`${label} `, input, unit ? ` ${unit}` : "");
      row.append(l);
      inputs.push(input);
    };
    if (z[1]) {
      const pair = () => { const [re, im] = upper()[k], w = Math.hypot(re, im); return [w, -re / w]; };
      const set = (w, d) => moved(k, -w * Math.min(d, 0.999), w * Math.sqrt(1 - Math.min(d, 0.999) ** 2));
      field("pair: frequency", "rad/s", (w) => set(w, pair()[1]));
      field("damping ratio", "", (d) => set(pair()[0], d));
    } else field("real pole: −", "1/s", (v) => moved(k, -v, 0));
    list.append(row);
    return { heads, inputs };
  };

  // --- the rigs that the fit allows --------------------------------------------------------------------------------
  const cells = $("rigs"), WORD = { stands: "stabilised", saturates: "stabilised with saturation", falls: "lost" };
  const ORDER = ["stands", "saturates", "falls"];
  const blocks = Math.ceil(DATA.lanes / DATA.many.width), { max, min, ceil } = Math;
  // Blocks of rigs are shared among workers; where a browser refuses them the page itself answers.
  const alone = () => {
    const here = new Ensemble(DATA);
    return [{ words: (...asked) => Promise.resolve(here.words(...asked)) }];
  };
  let hands;
  try {
    const source = $("script").textContent.split("/* the page begins */")[0];
    const work = "\nconst ensemble = new Ensemble(DATA);\nonmessage = ({ data }) => postMessage(ensemble.words(...data));";
    const url = URL.createObjectURL(new Blob([source, work], { type: "text/javascript" }));
    hands = Array.from({ length: max(1, min(4, navigator.hardwareConcurrency || 1)) }, () => {
      const worker = new Worker(url);
      return {
        words: (...asked) => new Promise((resolve, reject) => {
          worker.onmessage = (e) => resolve(e.data);
          worker.onerror = reject;
          worker.postMessage(asked);
        }),
      };
    });
  } catch {
    hands = alone();
  }
  const tell = (words) => {
    const counts = ORDER.map((w) => words.filter((v) => v === w).length), of = words.length;
    const parts = ORDER.map((w, i) => `${counts[i]} ${WORD[w]}`).filter((_, i) => counts[i]);
    $("share").textContent = `${DATA.said}${of - counts[2]} of ${of} rigs are stabilised${parts.length > 1 ? `: ${parts.join(", ")}` : ""}.`;
    cells.replaceChildren();
    cells.setAttribute("aria-label", $("share").textContent);
    const per = 25;
    cells.setAttribute("viewBox", `0 0 ${per * 12} ${ceil(of / per) * 16}`);
    ORDER.flatMap((w, i) => Array(counts[i]).fill(w)).forEach((w, i) => {
      const g = make("g", { transform: `translate(${(i % per) * 12 + 6} ${Math.floor(i / per) * 16 + 8})`, class: w }, cells);
      make("path", { d: w === "falls" ? "M0 4H6" : "M0 5V-5", "stroke-width": 2, "stroke-linecap": "round" }, g);
      if (w === "saturates") make("path", { d: "M-3.5-6.5H3.5", "stroke-width": 1.6 }, g);
      make("circle", { cx: 0, cy: w === "falls" ? 4 : 5, r: 1.6 }, g);
    });
  };
  let busy = false, again = false;
  const answer = async () => {
    if (busy) {
      again = true;
      return;
    }
    busy = true;
    const start = performance.now();
    const shared = () => {
      const each = ceil(blocks / hands.length);
      return Promise.all(hands.map((hand, i) =>
        hand.words(twin.settings, twin.gains, min(blocks, i * each), min(blocks, (i + 1) * each))));
    };
    const parts = await shared().catch(() => {
      hands = alone();
      return shared();
    });
    window.upright.answered.push(performance.now() - start);
    tell(parts.flat());
    busy = false;
    if (again) {
      again = false;
      answer();
    }
  };
  // --- controls ------------------------------------------------------------------------------------------------------
  const sliders = {
    friction: [(v) => ({ friction: v }), (v) => `× ${v.toFixed(1)}`],
    delay: [(v) => ({ delay: v / 1000 }), (v) => `${v.toFixed(1)} ms`],
    limit: [(v) => ({ limit: v }), (v) => `${v.toFixed(1)} ${DATA.command.unit}`],
    counts: [(v) => ({ counts: 2 ** v }), (v) => (v > 0 ? `${2 ** v} times coarser` : "as identified")],
  };
  const initial = { friction: 1, delay: DATA.delay * 1000, limit: DATA.command.limit, counts: 0 };
  for (const name in sliders) {
    const input = $(name), out = $(`${name}-value`), [change, text] = sliders[name];
    if (name === "limit") Object.assign(input, { max: 2 * DATA.command.limit, min: DATA.command.limit / 20, step: DATA.command.limit / 40 });
    input.value = initial[name];
    out.textContent = text(initial[name]);
    input.addEventListener("input", () => {
      twin.set(change(+input.value));
      out.textContent = text(+input.value);
      answer();
    });
  }
  let playing = !matchMedia("(prefers-reduced-motion: reduce)").matches;
  const SPEED = DATA.coordinates[last].unit === "rad" ? 1.0 : 0.3;
  const status = () => {
    const x = twin.state(), where = DATA.coordinates.map((c, i) => `${GREEK[c.name] ?? c.name} ${shown(x[2 * i] - (twin.settings.holding ? DATA.point[i] : 0), c.unit)}`);
    return `${twin.lost ? `${twin.lost} The drive is off. ` : twin.settings.holding ? "" : "The drive is off. "}${where.join(", ")}`;
  };
  const act = {
    left: () => twin.push(last, -SPEED), right: () => twin.push(last, SPEED),
    arm: () => twin.push(0, DATA.coordinates[0].unit === "rad" ? 1.5 : 0.3),
    stand: () => { twin.set({ holding: true }); twin.restart(); history.length = 0; },
    hang: () => { twin.set({ holding: false }); twin.restart(DATA.start.map((_, i) => (i === 2 * last ? 0.9 : 0)), DATA.start.map(() => 0)); history.length = 0; },
    play: () => { playing = !playing; $("play").textContent = playing ? "Pause" : "Play"; },
  };
  for (const name in act) $(name)?.addEventListener("click", act[name]);
  if (n < 2) $("arm").remove();
  $("play").textContent = playing ? "Pause" : "Play";
  addEventListener("keydown", (e) => {
    if (/INPUT|BUTTON|SUMMARY|A/.test(e.target.tagName)) return;
    const name = { ArrowLeft: "left", ArrowRight: "right", " ": "play", u: "stand", h: "hang" }[e.key];
    if (name) { e.preventDefault(); act[name](); }
  });
  drawing.addEventListener("pointerdown", (e) => {
    const b = drawing.getBoundingClientRect();
    twin.push(last, (e.clientX < b.left + b.width / 2 ? 1 : -1) * SPEED);
  });

  let before = 0, owed = 0, frames = 0;
  const frame = (now) => {
    if (before && playing) {
      owed += Math.min((now - before) / 1000, 0.1) / DATA.period;
      const some = Math.floor(owed);
      owed -= some;
      const rows = twin.advance(some), every = Math.max(1, Math.round(0.01 / DATA.period));
      rows.forEach((row, i) => {
        const k = twin.k - rows.length + i;
        if (k % every === 0) history.push({ t: k * DATA.period, row });
      });
      while (history.length && history[0].t < twin.k * DATA.period - SECONDS) history.shift();
      draw();
      drawTraces();
      if (frames % 12 === 0) $("status").textContent = status();
    }
    before = now;
    window.upright.frames = ++frames;
    requestAnimationFrame(frame);
  };
  window.upright = { twin, act, frames: 0, answered: [], answer };
  document.documentElement.classList.add("alive");
  if (parent !== window) document.documentElement.classList.add("framed");
  drawPoles();
  draw();
  answer();
  drawTraces();
  requestAnimationFrame(frame);
})();
