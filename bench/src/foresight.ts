// What the model answers to the tasks of the guide; nothing of it is written down anywhere.

import type { Session } from "./session";
import type { Answer } from "./tasks";
import type { Track } from "./track";

/** Tap between the sets [rad/s or m/s], and the step that is followed [deg or cm]. */
export const TAP = 0.8, STEP = { deg: 30, cm: 1 };
const RELEASE = 2, AFTER = 1, CAUGHT = 3; // seconds that are looked at
export const SECONDS = { release: RELEASE, sets: AFTER, tap: CAUGHT };
const FASTEST = 20, HALVINGS = 12;

/** The largest value up to which something holds, which holds at 0 and up to one value. */
export function largest(holds: (value: number) => boolean, most: number, halvings: number): number {
  if (holds(most)) return most;
  let low = 0, high = most;
  for (let i = 0; i < halvings; i++) {
    const middle = (low + high) / 2;
    if (holds(middle)) low = middle;
    else high = middle;
  }
  return low;
}

export class Foresight {
  private twin: Twin | undefined;

  constructor(private readonly session: Session, private readonly track: Track) {}

  /** A number, or one for each choice; undefined while the twin in the page is not there. */
  of(answer: Answer, moving: boolean, tilt: number, step: number): number[] | undefined {
    const { facts } = this.session.scene!;
    if (answer === "hanging") return facts.hanging === undefined ? undefined : [facts.hanging];
    if (answer === "unstable") return facts.unstable === undefined ? undefined : [facts.unstable];
    if (answer === "direction" || answer === "overshoot") {
      const { beyond, wrong } = this.track.foresee(step);
      return answer === "overshoot" ? [100 * beyond] : wrong > 0.005 ? [0, 1] : [1, 0];
    }
    if (!moving) return undefined;
    if (answer === "release") return [this.peak(this.run(DATA.K, tilt, 0, RELEASE))];
    if (answer === "sets") return facts.sets.map((set) => this.peak(this.run(ackermann(DATA.A, DATA.B, set), 0, TAP, AFTER)));
    return [largest((speed) => this.caught(speed), FASTEST, HALVINGS)];
  }

  /** Rows after it is let go at a tilt, and tapped. */
  private run(gains: number[], tilt: number, speed: number, seconds: number): Float64Array[] {
    const twin = (this.twin ??= new Twin(DATA)), n = DATA.coordinates.length;
    twin.gains = gains;
    twin.set({ holding: true });
    twin.restart(DATA.start.map((_, i) => (i === 2 * n - 2 ? tilt : 0)));
    if (speed) {
      twin.advance(1); // what has begun can be pushed
      twin.push(n - 1, speed);
    }
    return twin.advance(Math.round(seconds / DATA.period));
  }

  private peak(rows: Float64Array[]): number {
    return rows.reduce((most, row) => Math.max(most, Math.abs(row.at(-1)!)), 0);
  }

  private caught(speed: number): boolean {
    const rows = this.run(this.session.scene!.K, 0, speed, CAUGHT), { lean, travel, moved } = this.session.scene!, n = DATA.coordinates.length;
    const within = (row: Float64Array, i: number, most: number | null | undefined) => Math.abs(row[2 * i]! - DATA.point[i]!) <= (most ?? Infinity);
    return rows.every((row) => within(row, n - 1, lean) && within(row, moved, travel));
  }
}
