// A cursor for charts: mouse, touch and arrow keys read the values of report/interactive/charts.py.
"use strict";

(() => {
  const shown = (v) => (v === null || v === undefined ? "–" : String(Number(v.toPrecision(4))).replace("-", "\u2212"));

  class Cursor {
    constructor(figure, chart) {
      Object.assign(this, { chart, still: figure.querySelector(".still"), index: null });
      this.stops = chart.plane ? this.points() : this.abscissae();
      if (!this.stops.length) return;
      this.said = document.createElement("p");
      this.said.className = "chart-reading";
      this.said.setAttribute("aria-hidden", "true");
      this.said.textContent = "Values: point at the picture, or move with the arrow keys.";
      this.still.after(this.said);
      const role = { role: "slider", tabindex: "0", "aria-valuemin": 1, "aria-valuemax": this.stops.length, "aria-valuenow": 1, "aria-valuetext": "no point chosen" };
      for (const k in role) this.still.setAttribute(k, role[k]);
      this.still.classList.add("read");
      const at = (e) => this.near(e);
      this.still.addEventListener("pointermove", at);
      this.still.addEventListener("pointerdown", at);
      this.still.addEventListener("keydown", (e) => this.pressed(e));
      new ResizeObserver(() => this.mark()).observe(this.still);
    }

    // Where curves are read: at the points where there are such, else at all samples.
    abscissae() {
      const lines = this.chart.panels.flatMap((p) => p.lines), marked = lines.filter((l) => l.marks);
      return [...new Set((marked.length ? marked : lines).flatMap((l) => l.x))].filter((v) => v !== null).sort((a, b) => a - b);
    }

    points() {
      return this.chart.panels.flatMap((p, panel) => p.lines.flatMap((line) =>
        line.x.map((x, i) => ({ panel, line, i, x, y: line.y[i] })).filter((s) => s.x !== null && s.y !== null)));
    }

    // The drawing that is seen, and the axes of each of its panels.
    seen() {
      const svg = [...this.still.querySelectorAll("svg")].find((s) => s.getBoundingClientRect().width > 0);
      if (!svg) return null;
      const areas = [...svg.querySelectorAll(".panel")].map((p) => p.dataset.area.split(" ").map(Number));
      return { svg, areas, scale: svg.viewBox.baseVal.width / svg.getBoundingClientRect().width };
    }

    share(v, [low, high], logarithmic) {
      return logarithmic ? Math.log(v / low) / Math.log(high / low) : (v - low) / (high - low);
    }

    place(x, y, i, areas) {
      const [left, top, wide, high] = areas[i], { span, logarithmic, panels } = this.chart;
      return [left + wide * this.share(x, span, logarithmic), top + high * (1 - this.share(y, panels[i].span, panels[i].logarithmic))];
    }

    near(event) {
      const seen = this.seen();
      if (!seen) return;
      const box = seen.svg.getBoundingClientRect(), [x, y] = [(event.clientX - box.left) * seen.scale, (event.clientY - box.top) * seen.scale];
      const far = this.chart.plane
        ? (s) => { const [a, b] = this.place(s.x, s.y, s.panel, seen.areas); return Math.hypot(a - x, b - y); }
        : (s) => Math.abs(seen.areas[0][0] + seen.areas[0][2] * this.share(s, this.chart.span, this.chart.logarithmic) - x);
      let best = 0, least = Infinity;
      this.stops.forEach((s, i) => { const d = far(s); if (d < least) [best, least] = [i, d]; });
      this.go(best);
    }

    pressed(event) {
      const now = this.index ?? -1, last = this.stops.length - 1, below = this.chart.plane === "cells" ? Math.sqrt(last + 1) : -1;
      const to = { ArrowLeft: now - 1, ArrowDown: now + below, ArrowRight: now + 1, ArrowUp: now - below, PageUp: now + 10, PageDown: now - 10, Home: 0, End: last }[event.key];
      if (to === undefined) return;
      event.preventDefault();
      this.go(Math.min(Math.max(to, 0), last));
    }

    go(index) {
      if (index === this.index) return;
      this.index = index;
      const text = this.chart.plane ? this.pole(this.stops[index]) : this.row(this.stops[index]);
      this.said.textContent = text;
      this.said.style.minHeight = `${this.said.offsetHeight}px`;  // what stands below keeps its place
      this.still.setAttribute("aria-valuenow", index + 1);
      this.still.setAttribute("aria-valuetext", text);
      this.mark();
    }

    // A point's own value; of a curve what lies between its samples.
    value(line, x) {
      if (line.marks) return line.y[line.x.indexOf(x)];
      const k = line.x.findIndex((v) => v >= x);
      if (k < 0 || line.x[k] === null) return null;
      if (line.x[k] === x || k === 0) return line.x[k] === x ? line.y[k] : null;
      const [a, b] = [line.x[k - 1], line.x[k]], [c, d] = [line.y[k - 1], line.y[k]];
      return c === null || d === null ? null : c + ((d - c) * (x - a)) / (b - a);
    }

    row(x) {
      const { chart, unit, panels } = this.chart;
      const values = panels.map((p) => {
        const known = p.lines.map((l) => [l, this.value(l, x)]).filter(([, v]) => v !== null && v !== undefined);
        return known.length ? `${p.title} ${known.map(([l, v]) => `${p.lines.length > 1 ? `${l.name} ` : ""}${shown(v)}`).join(", ")}${p.unit ? ` ${p.unit}` : ""}` : "";
      });
      return `${chart} ${shown(x)}${unit ? ` ${unit}` : ""}: ${values.filter(Boolean).join("; ")}`;
    }

    pole({ line, i, x, y }) {
      if (this.chart.plane === "cells") return `${this.chart.chart} of ${line.name} and ${line.notes[i]}`;
      const size = Math.hypot(x, y), pair = Math.abs(y) > 1e-9 * size;
      const what = pair ? `${shown(x)} ± ${shown(Math.abs(y))} i 1/s, natural frequency ${shown(size)} rad/s, damping ratio ${shown(-x / size)}` : `${shown(x)} 1/s`;
      return `${line.name || "point"}: ${what}${line.notes ? `, ${line.notes[i]}` : ""}`;
    }

    mark() {
      for (const old of this.still.querySelectorAll(".cursor")) old.remove();
      const seen = this.index === null ? null : this.seen();
      if (!seen) return;
      const stop = this.stops[this.index], SVG = seen.svg.namespaceURI, group = document.createElementNS(SVG, "g");
      group.setAttribute("class", "cursor");
      const add = (tag, attributes) => {
        const e = document.createElementNS(SVG, tag);
        for (const k in attributes) e.setAttribute(k, attributes[k]);
        group.append(e);
      };
      const ring = (x, y, i) => {
        const [cx, cy] = this.place(x, y, i, seen.areas), [left, top, wide, high] = seen.areas[i];
        if (this.chart.plane === "cells") {
          const n = stop.line.x.length, [w, h] = [wide / n, high / n];
          add("rect", { x: cx - w / 2, y: cy - h / 2, width: w, height: h });
        } else if (cx >= left - 1 && cx <= left + wide + 1 && cy >= top - 1 && cy <= top + high + 1) add("circle", { cx, cy, r: this.chart.plane ? 9 : 4.5 });
      };
      if (this.chart.plane) ring(stop.x, stop.y, stop.panel);
      else {
        const [left, top, wide] = seen.areas[0], x = left + wide * this.share(stop, this.chart.span, this.chart.logarithmic);
        const [, below, , high] = seen.areas.at(-1);
        add("path", { d: `M${x} ${top}V${below + high}` });
        this.chart.panels.forEach((p, i) => p.lines.forEach((l) => { const v = this.value(l, stop); if (v !== null && v !== undefined) ring(stop, v, i); }));
      }
      seen.svg.append(group);
    }
  }

  document.querySelectorAll("figure:has(script.chart):not(:has(.read))").forEach((figure) => new Cursor(figure, JSON.parse(figure.querySelector("script.chart").textContent)));
})();
