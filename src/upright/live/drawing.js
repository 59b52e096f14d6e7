// Draws a rig from its outline: what each coordinate moves in its own colour; a ghost is pale and has no joints.
"use strict";

class RigDrawing {
  // `positions` are coordinates that the picture must have room for.
  static view(outline, positions) {
    const points = positions.flatMap((q) => outline(q)).flatMap(([, p]) => p), DEG = 180 / Math.PI;
    const flat = points.every(([, y]) => Math.abs(y) < 1e-12);
    const [a, e] = flat ? [0, 0] : [25 / DEG, 20 / DEG];
    const project = ([x, y, z]) => [
      x * Math.cos(a) + y * Math.sin(a),
      -(z * Math.cos(e) + (y * Math.cos(a) - x * Math.sin(a)) * Math.sin(e)),
    ];
    const far = points.reduce((most, p) => Math.max(most, Math.hypot(...p)), 0);
    const height = points.reduce((most, p) => Math.max(most, Math.abs(p[2])), far / 2);
    return { project, box: [-far * 1.1, -height * 1.15, far * 2.2, height * 2.3] };
  }

  static make(tag, attributes, parent) {
    const e = document.createElementNS("http://www.w3.org/2000/svg", tag);
    for (const k in attributes) e.setAttribute(k, attributes[k]);
    parent?.append(e);
    return e;
  }

  constructor(parent, outline, names, view, ghost = false) {
    Object.assign(this, { outline, view });
    const unit = view.box[2] / 100, make = RigDrawing.make;
    const colour = (name) => (names.includes(name) ? `var(--q${names.indexOf(name) % 4})` : "var(--line-strong)");
    const group = make("g", ghost ? { opacity: 0.38 } : {}, parent), wide = ghost ? 1.9 : 1;
    this.lines = outline(names.map(() => 0)).map(([name, points]) => {
      if (ghost && !name) return {};
      const line = make("polyline", {
        fill: points.length > 4 && name && !ghost ? "var(--raised)" : "none", stroke: colour(name), "stroke-width": unit * (name ? 1.8 * wide : 0.7),
        "stroke-linecap": "round", "stroke-linejoin": "round", "stroke-dasharray": name || points.length < 4 ? "none" : `${unit * 2} ${unit * 2}`,
      }, group);
      if (ghost || !name || points.length > 2) return { line };
      return { line, joint: make("circle", { r: unit * 1.5, fill: "var(--paper)", stroke: "var(--ink)", "stroke-width": unit * 0.6 }, group) };
    });
    this.weight = make("circle", { r: unit * 2.4 * Math.sqrt(wide), fill: colour(names.at(-1)) }, group);
  }

  draw(q) {
    const at = (c, [a, b]) => { c.setAttribute("cx", a); c.setAttribute("cy", b); };
    this.outline(q).forEach(([, points], i) => {
      const flat = points.map((p) => this.view.project(p)), { line, joint } = this.lines[i];
      line?.setAttribute("points", flat.map((p) => p.map((v) => v.toPrecision(5)).join(",")).join(" "));
      if (joint) at(joint, flat[0]);
      at(this.weight, flat[flat.length - 1]);
    });
  }
}
