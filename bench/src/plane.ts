// The plane of closed-loop poles: crosses that are dragged or moved by keys, rings for the poles of the rig alone.

import { type Group, dragged, polesOf, within } from "./poles";
import { signed } from "./words";

const draw = (tag: string, attributes: Record<string, string | number>, parent: Element) => RigDrawing.make(tag, attributes, parent);
const WIDE = 1.15, HIGH = 1.2; // of the plane, in lengths of its fastest pole, where either just fits
const NEAR = 10; // px from the real axis within which a pair is real

export const spoken = ({ single, frequency, ratio }: Group): string =>
  single
    ? `real pole at ${signed(-frequency, 1)} per second`
    : `natural frequency ${frequency.toFixed(1)} rad/s, damping ratio ${ratio.toFixed(2)}`;

export class Plane {
  private readonly marks: { heads: SVGElement[]; name: SVGElement }[] = [];
  private readonly behind: SVGElement;
  private readonly line: SVGElement;
  private locus: Complex[][] = [];
  private scale = 1;
  private origin: [number, number] = [0, 0];

  /** `groups` are changed in place, and `changed` is called after. */
  constructor(
    private readonly svg: SVGSVGElement, private groups: Group[], private readonly open: Complex[],
    readonly fastest: number, private readonly changed: () => void,
  ) {
    svg.replaceChildren();
    this.behind = draw("g", {}, svg);
    this.line = draw("path", { class: "locus" }, svg);
    groups.forEach((_, k) => this.marks.push(this.mark(k)));
    new ResizeObserver(() => this.resize()).observe(svg);
    this.resize();
  }

  /** How far from the real axis a pole is certain to be seen [1/s]. */
  get highest(): number {
    return 0.46 * HIGH * this.fastest;
  }

  show(groups: Group[]): void {
    this.groups = groups;
    this.groups.forEach((group, k) => {
      const { heads, name } = this.marks[k]!;
      polesOf(group).forEach((pole, i) => heads[i]!.setAttribute("transform", this.move(pole)));
      const [re, im] = polesOf(group)[0]!;
      name.setAttribute("transform", this.move([re, im]));
      const handle = heads[0]!;
      handle.setAttribute("aria-valuenow", group.frequency.toFixed(2));
      handle.setAttribute("aria-valuetext", spoken(group));
    });
  }

  /** Draws branches behind the poles. */
  track(locus: Complex[][]): void {
    this.locus = locus;
    const place = ([re, im]: Complex) => `${this.origin[0] + re * this.scale} ${this.origin[1] - im * this.scale}`;
    this.line.setAttribute("d", locus.map((branch) => `M${branch.map(place).join("L")}`).join(""));
  }

  private move([re, im]: Complex): string {
    return `translate(${this.origin[0] + re * this.scale} ${this.origin[1] - im * this.scale})`;
  }

  private mark(k: number): { heads: SVGElement[]; name: SVGElement } {
    const single = this.groups[k]!.single, label = single ? "real pole" : `pole pair ${k + 1}`;
    const heads = (single ? [0] : [1, 0]).map((which) => {
      const about = which ? { "aria-hidden": "true" } : {
        tabindex: 0, role: "slider", "aria-label": label, "aria-valuemin": 0, "aria-valuemax": this.fastest,
      };
      const head = draw("g", { class: "pole", ...about }, this.svg);
      draw("circle", { r: 16, class: "halo" }, head);
      draw("path", { d: "M-7-7 7 7M7-7-7 7" }, head);
      head.addEventListener("pointerdown", (event) => this.drag(head, k, which, event));
      return head;
    }).reverse();
    heads[0]!.addEventListener("keydown", (event) => this.key(k, event));
    const name = draw("text", { x: 12, y: -10, class: "name", "aria-hidden": "true" }, this.svg);
    name.textContent = `${k + 1}`;
    return { heads, name };
  }

  private put(k: number, group: Group): void {
    this.groups[k] = within(group, this.fastest);
    this.changed();
  }

  private drag(head: SVGElement, k: number, which: number, start: PointerEvent): void {
    start.preventDefault();
    head.setPointerCapture(start.pointerId);
    this.marks[k]!.heads[0]!.focus();
    const move = ({ clientX, clientY }: PointerEvent) => {
      const box = this.svg.getBoundingClientRect();
      const re = (clientX - box.left - this.origin[0]) / this.scale, im = (this.origin[1] + box.top - clientY) / this.scale;
      this.put(k, dragged(this.groups[k]!, which, [re, im], NEAR / this.scale));
    };
    const end = () => head.removeEventListener("pointermove", move);
    head.addEventListener("pointermove", move);
    head.addEventListener("pointerup", end, { once: true });
    head.addEventListener("pointercancel", end, { once: true });
  }

  private key(k: number, event: KeyboardEvent): void {
    const step = { ArrowLeft: [0.2, 0], ArrowRight: [-0.2, 0], ArrowUp: [0, -0.02], ArrowDown: [0, 0.02] }[event.key];
    if (!step) return;
    event.preventDefault();
    const far = event.shiftKey ? 5 : 1, group = this.groups[k]!;
    this.put(k, { ...group, frequency: group.frequency + far * step[0]!, ratio: group.ratio + far * step[1]! });
  }

  private resize(): void {
    const width = this.svg.clientWidth, height = this.svg.clientHeight;
    if (!width || !height) return;
    this.scale = Math.min(width / (WIDE * this.fastest), height / (HIGH * this.fastest));
    this.origin = [width - 0.12 * this.fastest * this.scale, height / 2];
    this.svg.setAttribute("viewBox", `0 0 ${width} ${height}`);
    this.grid(width, height);
    this.track(this.locus);
    this.show(this.groups);
  }

  private grid(width: number, height: number): void {
    const g = this.behind, [x0, y0] = this.origin, { scale, fastest } = this;
    const every = [1, 2, 5, 10, 20, 50, 100].find((s) => fastest / s < 7) ?? 200;
    const text = (x: number, y: number, words: string, anchor = "middle") => {
      draw("text", { x, y, "text-anchor": anchor }, g).textContent = words;
    };
    g.replaceChildren();
    draw("rect", { x: x0, y: 0, width: width - x0, height, class: "unstable" }, g);
    for (let v = every; v * scale < x0 - 12; v += every) {
      draw("path", { class: "grid", d: `M${x0 - v * scale} 0V${height}` }, g);
      text(x0 - v * scale, y0 + 18, signed(-v, 0));
    }
    for (let v = every; v * scale < y0 - 8; v += every)
      for (const s of [-1, 1]) {
        draw("path", { class: "grid", d: `M0 ${y0 + s * v * scale}H${width}` }, g);
        text(x0 - 6, y0 + s * v * scale - 4, `${signed(-s * v, 0)} i`, "end");
      }
    for (const ratio of [0.5, 0.8]) {
      const slope = Math.sqrt(1 - ratio * ratio) / ratio, far = Math.min(x0, y0 / slope);
      for (const s of [-1, 1]) draw("path", { class: "ray", d: `M${x0} ${y0}l${-far} ${s * far * slope}` }, g);
      const high = Math.min(y0 - 14, x0 * slope * 0.9) * (ratio === 0.5 ? 1 : 0.6); // apart, on a phone too
      text(x0 - high / slope - 8, y0 - high, ratio === 0.5 ? "damping ratio 0.5" : `${ratio}`, "end");
    }
    draw("path", { class: "axis", d: `M0 ${y0}H${width}M${x0} 0V${height}` }, g);
    for (const [re, im] of this.open)
      if (re < width / scale) draw("circle", { cx: x0 + re * scale, cy: y0 - im * scale, r: 5, class: "open" }, g);
  }
}

