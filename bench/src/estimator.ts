// The velocities that a law has of its encoders: how they are filtered, how late and how noisy that is.

const MEMORIES = [0, 0.5, 0.8, 0.9, 0.95];

export interface Filter {
  memory: number;
  /** Frequency at which a slow oscillation is damped to half its power [Hz], undefined without a filter; delay of slow motions [s]. */
  cutoff: number | undefined;
  late: number;
}

/** v[k] = a v[k-1] + (1 - a) (y[k] - y[k-1]) / T: the pole z = a is s = ln(a) / T. */
export function filterOf(memory: number, period: number): Filter {
  const cutoff = memory > 0 ? -Math.log(memory) / (2 * Math.PI * period) : undefined;
  return { memory, cutoff, late: period * (0.5 + memory / (1 - memory)) };
}

/** Standard deviation of a velocity from the rounding of its encoder to steps, white with variance step^2 / 12 (Widrow). */
export const noiseOf = (memory: number, period: number, step: number): number => (step * (1 - memory)) / (period * Math.sqrt(6 * (1 + memory)));

/** Filters that may be chosen, with the one that acts. */
export const choices = (now: number, period: number): Filter[] =>
  [...new Set([...MEMORIES, now])].sort((a, b) => a - b).map((memory) => filterOf(memory, period));
