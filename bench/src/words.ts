// Numbers and names as a person reads them.

export const DEGREE = 180 / Math.PI;
const GREEK: Record<string, string> = { theta: "θ", psi: "ψ", alpha: "α", phi: "φ", beta: "β", gamma: "γ" };

export function symbol(name: string): string {
  const [base = "", index = ""] = name.split("_");
  return (GREEK[base] ?? base) + index.replace(/\d/g, (digit) => String.fromCharCode(0x2080 + Number(digit)));
}

/** With a true minus, and no minus before nothing. */
export function signed(value: number, digits: number): string {
  const text = value.toFixed(digits);
  return Number(text) === 0 ? text.replace("-", "") : text.replace("-", "\u2212");
}

/** To so many significant digits, never with an exponent. */
export function significant(value: number, digits = 3): string {
  const power = value === 0 ? 0 : Math.floor(Math.log10(Math.abs(value)));
  return signed(value, Math.min(6, Math.max(0, digits - 1 - power)));
}

/** The unit in which a coordinate is shown, and how many of it are one of the coordinate's own. */
export const shownUnit = (unit: string): { unit: string; scale: number } =>
  unit === "rad" ? { unit: "deg", scale: DEGREE } : unit === "m" ? { unit: "cm", scale: 100 } : { unit, scale: 1 };

/** The smallest range in steps of 1-2-5 (angles: also 90 and 180) that holds a value, never below `least`. */
export function rangeFor(value: number, least: number, unit: string): number {
  const wanted = Math.max(value, least);
  const turns = unit === "deg" ? [90, 180, 360, 720, 1440].find((r) => r >= wanted) : undefined;
  if (turns !== undefined && wanted > 50) return turns;
  const power = 10 ** Math.floor(Math.log10(wanted));
  return [1, 2, 5, 10].map((m) => m * power).find((m) => m >= wanted * (1 - 1e-9))!;
}

/** Bare name of what a coordinate measures: "arm" of "angle of the arm, positive counterclockwise". */
export function short(meaning: string): string {
  const first = meaning.split(/[,;(]/)[0]!.trim();
  return first.split(/ of (?:the )?/).at(-1)!;
}

/** What a rig is known by. */
export const modelName = ({ fit, of }: { fit: string; of: string }): string => (fit ? `fit of ${of}` : "nominal model");

/** What runs that is no law which holds, by where it began. */
export const OTHERS: Record<string, string> = {
  hanging: "a swing-up runs", motions: "first motions run", sweep: "a sweep runs", step: "a step runs",
};
