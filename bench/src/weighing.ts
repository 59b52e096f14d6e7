// The first body of the rig weighed with added masses, simulated: its swings by what was added, and the line through them.

import { drawChart } from "./chart";
import { span } from "./curves";
import { byId, italic, make, say } from "./dom";
import { symbol } from "./words";

interface Weighed {
  over: boolean;
  failed?: string;
  unit?: string;
  bare?: string;
  pieces?: number[];
  loadings?: number;
  points?: { added: number; y: number | null; error: number | null }[];
  line?: { k: number; bare: number };
  numbers?: { symbol: string; meaning: string; value: string; half: string; unit: string }[];
  verdict?: string;
}

const ERRORS = 1.96, MILLI = 1e3; // standard errors in an error bar; of what is shown in thousandths

export class Weighing {
  private weighed: Weighed | undefined;

  constructor(private readonly address: string) {}

  get over(): boolean {
    return this.weighed?.over ?? true;
  }

  get there(): boolean {
    return this.weighed !== undefined;
  }

  begin(): void {
    this.weighed = { over: false };
  }

  /** What there is so far. */
  async look(): Promise<void> {
    const answer = await fetch(`${this.address}/weighing`).catch(() => undefined);
    const weighed = answer?.ok ? ((await answer.json()) as Weighed | null) : null;
    if (!weighed) return;
    this.weighed = weighed;
    const { failed, loadings, pieces, verdict, numbers, unit, over } = weighed;
    say(byId("weigh-says"), failed || (over ? verdict : "") || (loadings ? `${loadings} of ${pieces!.length} loadings stepped.` : "The body is stepped without masses."));
    say(byId("weigh-axis"), unit ? `1/ω² [10⁻³ s²] of each swing, against what was added [${this.small ? "10⁻³ " : ""}${unit.replace("^2", "²")}]` : "");
    byId("weigh-rows").replaceChildren(...(numbers ?? []).map((row) => make("tr", {},
      make("th", { scope: "row" }, italic(symbol(row.symbol)), ` ${row.meaning}`), make("td", { class: "number" }, `${row.value} ± ${row.half} ${row.unit}`))));
    this.draw();
  }

  /** Whether inertias are shown in thousandths. */
  private get small(): boolean {
    return (this.weighed?.pieces?.at(-1) ?? 1) < 0.1;
  }

  draw(): void {
    const { pieces, line } = this.weighed ?? {}, points = (this.weighed?.points ?? []).flatMap(({ y, ...point }) => (y === null ? [] : [{ ...point, y }]));
    if (!points.length || !pieces || !line?.k) return;
    const scale = this.small ? MILLI : 1, most = pieces.at(-1)!, at = (added: number) => (MILLI * (line.bare + added)) / line.k;
    const [low, high] = span([...points.map(({ y }) => MILLI * y), at(0), at(most)], []);
    drawChart(byId<HTMLCanvasElement>("weigh-line"), {
      x: { low: -0.05 * most * scale, high: 1.1 * most * scale, unit: "" }, y: { low, high, unit: "" },
      lines: [
        { x: [0, most * scale], y: [at(0), at(most)], colour: "--ink", dashes: [6, 3], thick: 1.2 },
        { x: points.map(({ added }) => added * scale), y: points.map(({ y }) => MILLI * y), error: points.map(({ error }) => ERRORS * MILLI * (error ?? 0)), colour: "--q0", points: "hollow" },
      ],
    });
  }
}
