// Puts traces that answer in the place of still pictures: one cursor and one span of time for all panels of a run.
// Expects uPlot, and in each figure a <script type="application/json" class="traces"> of report/interactive/traces.py.
"use strict";

const TRACES = [];

(() => {
  const bytes = (text) => Uint8Array.from(atob(text), (c) => c.charCodeAt(0)).buffer;
  const unpack = (packed) =>
    packed && Array.from(new Int16Array(bytes(packed.levels)), (k) => (k === -32768 ? null : packed.middle + packed.scale * k));
  const abscissa = (run) => {
    if (run.t) return Array.from(new Float64Array(bytes(run.t)));
    let row = 0;
    return Array.from(new Uint16Array(bytes(run.ahead)), (n) => run.start + run.step * (row += n));
  };
  const plus = (a, b, sign = 1) => a.map((v, i) => (v === null || b[i] === null ? null : v + sign * b[i]));
  const negative = (a) => a.map((v) => (v === null ? null : -v));
  const shown = (v) => (v === null || v === undefined ? "–" : String(Number(v.toPrecision(5))).replace("-", "\u2212"));
  const count = (n) => n.toLocaleString("en");
  const element = (tag, attributes, ...children) => {
    const e = document.createElement(tag);
    for (const k in attributes) e.setAttribute(k, attributes[k]);
    e.append(...children);
    return e;
  };
  const INK = ["--ink", "#14201f"], SOFT = ["--ink-2", "#485654"], RULE = ["--line", "#d9dedd"];
  const OWN = [["--q0", "#0067a8"], ["--q1", "#b84a00"], ["--q2", "#8a3a86"], ["--q3", "#6b6a00"]];
  const MODELS = [INK, ["--effort", "#00735a"], ["--sim", "#5a3f9e"], OWN[3], OWN[0]];
  const DASHES = [[], [7, 3], [2, 2], [8, 3, 2, 3], [12, 4]];
  const FONT = "13px system-ui, sans-serif", LEFT = 64;

  class Traces {
    constructor(figure, run) {
      Object.assign(this, { figure, run, t: abscissa(run), plots: [], lines: [], heads: [], key: `traces-${TRACES.length}` });
      const button = (text, act) => {
        const b = element("button", { type: "button" }, text);
        b.addEventListener("click", act);
        return b;
      };
      this.time = element("span", { class: "at" });
      this.heard = element("p", { class: "heard", role: "status" });
      this.box = element("div", { class: "panels", tabindex: "0", role: "group", "aria-label":
        `${run.name}: left and right move the cursor, plus and minus zoom, Home shows everything` });
      const tools = element("div", { class: "tools" }, button("Zoom in", () => this.zoom(0.5)),
        button("Zoom out", () => this.zoom(2)), button("Everything", () => this.span()), this.time);
      const drawn = this.t.length < run.of
        ? `the ${count(this.t.length)} of ${count(run.of)} samples that are least or greatest in their stretch`
        : `all ${count(run.of)} samples`;
      const hint = `Drag to zoom, double-click for everything; arrow keys move the cursor. Drawn: ${drawn}.`;
      figure.classList.add("answering");
      figure.querySelector(".still").after(element("div", { class: "moving" }, tools, this.box,
        element("p", { class: "hint" }, hint), this.heard));
      run.panels.forEach((panel, i) => this.panel(panel, i === run.panels.length - 1));
      this.box.addEventListener("keydown", (event) => this.pressed(event));
      new ResizeObserver(() => this.plots.forEach((u) => u.setSize({ width: this.box.clientWidth, height: u.height }))).observe(this.box);
      matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => this.plots.forEach((u) => u.redraw()));
      this.tell(null);
    }

    colour([name, otherwise]) {
      return getComputedStyle(this.figure).getPropertyValue(name).trim() || otherwise;
    }

    // What was measured with what models say of it, and below what they leave over.
    panel(panel, last) {
      const measured = unpack(panel.measured), own = OWN[panel.colour % 4], guess = unpack(panel.guess);
      const upper = { lines: [], bands: [] }, lower = { lines: [], bands: [] };
      const band = (at, low, high) => {
        at.lines.push({ values: high }, { values: low });
        at.bands.push({ series: [at.lines.length - 1, at.lines.length], fill: () => `${this.colour(SOFT)}40` });
      };
      const models = panel.models.map((m, i) => {
        const given = unpack(m.values), half = unpack(m.band), values = measured ? plus(measured, given, -1) : given;
        if (half) {
          band(upper, plus(values, half, -1), plus(values, half));
          band(lower, negative(half), half);
        }
        const colour = measured ? MODELS[i % 5] : [own, ...MODELS][i % 6];
        return { name: m.name, values, left: given, colour, dash: DASHES[i % 5] };
      });
      if (measured) upper.lines.push({ name: "measured", values: measured, colour: own, width: 5, faint: true });
      if (guess) upper.lines.push({ name: "initial guesses", values: guess, colour: SOFT, width: 1.5, dash: [2, 3], broken: true });
      for (const m of models) upper.lines.push({ ...m, width: 1.4, broken: true });
      const beside = measured && models.length > 0;
      this.plot(`${panel.name}`, panel.unit, upper, { height: 180, follow: measured, log: panel.logarithmic, last: last && !beside });
      if (!beside) return;
      models.forEach((m, i) => lower.lines.push({ name: models.length > 1 ? m.name : "measured \u2212 model", values: m.left,
        colour: i ? m.colour : own, dash: models.length > 1 ? m.dash : [], width: 1, broken: true }));
      this.plot(`residual of ${panel.name}`, panel.unit, lower, { height: 100, follow: measured, left: true, last });
    }

    plot(title, unit, { lines, bands }, { height, follow, left, log, last }) {
      const values = [], head = element("p", { class: "head" }, element("strong", {}, unit ? `${title} [${unit}]` : title));
      for (const line of lines.filter((l) => l.name)) {
        const value = element("span", { class: "reading" }), key = element("canvas", { width: 48, height: 12, "aria-hidden": "true" });
        head.append(" ", element("span", { class: "key" }, key, `${line.name} `, value));
        values.push({ line, value, key });
      }
      this.heads.push(...values);
      const at = element("div", { class: "panel" });
      this.box.append(head, at);
      const axis = { font: FONT, labelFont: FONT, stroke: () => this.colour(SOFT), ticks: { show: false },
        grid: { stroke: () => this.colour(RULE), width: 1 } };
      const u = new uPlot({
        width: this.box.clientWidth || 600, height: height + (last ? 44 : 8), padding: [6, 12, 0, 0], legend: { show: false },
        scales: { x: { time: false }, y: { distr: log ? 3 : 1, range: log ? undefined : (plot, low, high) => this.range(plot, low, high, follow, left) } },
        axes: [
          { ...axis, size: last ? 24 : 8, ...(last ? { label: this.run.unit ? `${this.run.axis} [${this.run.unit}]` : this.run.axis, labelSize: 20, labelGap: 0, gap: 2 } : { values: () => [] }) },
          { ...axis, size: LEFT, gap: 6, space: height > 100 ? 34 : 20, values: (_, splits) => splits.map((v) => (v === null ? "" : shown(v))) },
        ],
        series: [{}, ...lines.map((line) => ({
          label: line.name || "band", width: line.width ?? 0, dash: line.dash, points: { show: false }, spanGaps: false,
          stroke: () => (line.colour ? this.colour(line.colour) + (line.faint ? "70" : "") : "transparent"),
          ...(line.broken && this.run.restarts ? { gaps: (...place) => this.gaps(...place) } : {}),
        }))],
        bands,
        cursor: { sync: { key: this.key, setSeries: false, scales: ["x", null] }, drag: { x: true, y: false, setScale: true },
          points: { show: (plot, i) => Boolean(lines[i - 1]?.name), size: 7, width: 2 }, y: false },
        hooks: {
          setScale: [(plot, scale) => scale === "x" && this.follow(plot)],
          setCursor: [(plot) => this.tell(plot.cursor.idx ?? null)],
          draw: [() => values.forEach(({ line, key }) => this.sample(line, key))],
        },
      }, [this.t, ...lines.map((line) => line.values)], at);
      this.plots.push(u);
    }

    // A sample of the line beside its name.
    sample(line, key) {
      const c = key.getContext("2d");
      c.clearRect(0, 0, 48, 12);
      c.setLineDash((line.dash ?? []).map((d) => 2 * d));
      c.lineWidth = 2 * line.width;
      c.strokeStyle = this.colour(line.colour) + (line.faint ? "70" : "");
      c.beginPath();
      c.moveTo(0, 6);
      c.lineTo(48, 6);
      c.stroke();
    }

    // A model that ran away must not flatten what was measured.
    range(plot, low, high, follow, left) {
      if (!(low <= high)) return [-1, 1];
      if (follow) {
        const [first, after] = plot.series[0].idxs, seen = follow.slice(first, after + 1).filter((v) => v !== null);
        if (seen.length) {
          const [a, b] = [seen.reduce((x, y) => Math.min(x, y)), seen.reduce((x, y) => Math.max(x, y))], room = b - a || Math.abs(b) || 1e-9;
          [low, high] = left ? [Math.max(low, -room), Math.min(high, room)] : [Math.max(low, a - room), Math.min(high, b + room)];
        }
      }
      const room = 0.06 * (high - low) || Math.abs(high) * 0.1 || 1;
      return [low - room, high + room];
    }

    // Where a prediction was restarted its line is broken.
    gaps(plot, series, first, after) {
      const found = [], window = (i) => Math.floor((this.t[i] - this.t[0]) / this.run.restarts + 1e-9);
      for (let i = first + 1; i <= after; i++)
        if (window(i) !== window(i - 1)) found.push([plot.valToPos(this.t[i - 1], "x", true), plot.valToPos(this.t[i], "x", true)]);
      return found;
    }

    follow(plot) {
      const { min, max } = plot.scales.x;
      for (const other of this.plots)
        if (other !== plot && (other.scales.x.min !== min || other.scales.x.max !== max)) other.setScale("x", { min, max });
    }

    span(min = this.t[0], max = this.t.at(-1)) {
      const [first, last] = [this.t[0], this.t.at(-1)], wide = Math.min(max - min, last - first);
      const from = Math.min(Math.max(min, first), last - wide);
      this.plots[0].setScale("x", { min: from, max: from + wide });
    }

    zoom(factor) {
      const { min, max } = this.plots[0].scales.x, at = this.index === null ? (min + max) / 2 : this.t[this.index];
      const wide = Math.max((max - min) * factor, (this.t.at(-1) - this.t[0]) / this.t.length);
      const middle = Math.min(Math.max(at, min), max), share = (middle - min) / (max - min);
      this.span(middle - share * wide, middle + (1 - share) * wide);
    }

    pressed(event) {
      const { min, max } = this.plots[0].scales.x, far = event.shiftKey ? 10 : 1;
      const moves = { ArrowLeft: -far, ArrowRight: far };
      if (event.key in moves) this.move(moves[event.key]);
      else if (event.key === "+" || event.key === "=") this.zoom(0.5);
      else if (event.key === "-") this.zoom(2);
      else if (event.key === "PageDown") this.span(max, 2 * max - min);
      else if (event.key === "PageUp") this.span(2 * min - max, min);
      else if (event.key === "Home") this.span();
      else return;
      event.preventDefault();
    }

    // The cursor goes on by so many samples, and takes the view along.
    move(samples) {
      const { min, max } = this.plots[0].scales.x;
      const first = this.t.findIndex((v) => v >= min);
      const i = Math.min(Math.max(this.index === null ? first : this.index + samples, 0), this.t.length - 1), at = this.t[i];
      if (at < min || at > max) this.span(at - (max - min) / 2, at + (max - min) / 2);
      queueMicrotask(() => {
        for (const u of this.plots) u.setCursor({ left: u.valToPos(at, "x"), top: 1 }, false);
        this.tell(i);
        this.heard.textContent = `${this.run.axis} ${shown(at)} ${this.run.unit}: `
          + this.heads.map(({ line }) => `${line.name} ${shown(line.values[i])}`).join(", ");
      });
    }

    tell(index) {
      this.index = index;
      this.time.textContent = index === null ? "" : `${this.run.axis} ${shown(this.t[index])} ${this.run.unit}`;
      for (const { line, value } of this.heads) value.textContent = index === null ? "" : shown(line.values[index]);
    }
  }

  const begin = (figure) => TRACES.push(new Traces(figure, JSON.parse(figure.querySelector("script.traces").textContent)));
  const seen = new IntersectionObserver((entries) => {
    for (const { isIntersecting, target } of entries)
      if (isIntersecting) {
        seen.unobserve(target);
        begin(target);
      }
  }, { rootMargin: "400px" });
  document.querySelectorAll("figure:has(script.traces)").forEach((figure) => seen.observe(figure));
})();
