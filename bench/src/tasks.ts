// The tasks of the guide: what is asked before anything moves, what is then done, and why the answer is what it is.
// Texts have names in braces, which the guide fills in from the rig; no answer stands here.

export type Answer = "hanging" | "unstable" | "release" | "sets" | "tap" | "direction" | "overshoot";

export interface Task {
  answer: Answer;
  part: string;
  /** What the rig must have. */
  needs: "pendulum" | "sets" | "reference";
  ask: string;
  /** Unit of a number; what may be chosen otherwise. */
  unit?: string;
  choices?: string[];
  /** Relative error of a number up to which it is called close. */
  close: number;
  do: string;
  why: string;
  source: string;
}

const HANG = "1 Identify it hanging", HOLD = "2 Hold it upright", FOLLOW = "3 Let it follow";

export const TASKS: Task[] = [
  {
    answer: "hanging", part: HANG, needs: "pendulum", unit: "rad/s", close: 0.1,
    ask: "The pendulum hangs, and its {driven} is free to move. At which natural frequency does it swing?",
    do: "Nothing has moved yet. The screen Identify measures the rig where it hangs and nothing can fall; what the model is based on stands on the screen Design.",
    why: "{frequency}",
    source: "{hangingsource}; without friction.",
  },
  {
    answer: "unstable", part: HANG, needs: "pendulum", unit: "1/s", close: 0.1,
    ask: "The same rig, turned upright: one pole lies right of the imaginary axis. How far?",
    do: "Compare it with the frequency before: a rig that was identified hanging is known upright.",
    why: "Upright, gravity changes its sign: s² = −ω² becomes s² = +ω². Friction moves the pole a little to the left.",
    source: "Paper, eqs. (1) and (2) with errata 1 and 2: the same numbers, another equilibrium.",
  },
  {
    answer: "release", part: HOLD, needs: "pendulum", unit: "{unit}", close: 0.25,
    ask: "Somebody lets go {tilt} from upright. How large is the largest command of the first two seconds? The drive gives {limit} at most.",
    do: "On the screen Run, let \"start\" be {tilt} and press Start.",
    why: "u = −K x on the first sample: the gain on the angle times {tilt}. What the differences of the encoder counts add comes on top.",
    source: "Paper, section on regulation (fig. 6): encoders, numerical differentiation, saturation.",
  },
  {
    answer: "sets", part: HOLD, needs: "sets", choices: ["set 1", "set 2", "set 3", "set 4"], close: 0,
    ask: "The paper prints four sets of poles (Table 1). After a tap of {speed}, which of them needs the largest command?",
    do: "Start, then apply each set, wait until it is calm, and tap.",
    why: "p(s) p(−s) = a(s) a(−s) + N(s)/R: the four sets lie on one LQR locus, and R, the price of the command, is halved from set to set.",
    source: "Paper, Table 1; that its sets lie on one locus was found from the printed numbers (upright reproduce).",
  },
  {
    answer: "tap", part: HOLD, needs: "pendulum", unit: "{speedunit}", close: 0.25,
    ask: "A tap makes the pendulum faster at once. Up to which tap is it caught? The supervisor stops it at {lean} from upright.",
    do: "On the screen Run, start, and tap harder each time (the field \"tap\"), until it falls. Wait until it is calm in between.",
    why: "Until the {driven} is under it, gravity makes the pendulum faster still, by e^(p t) with the unstable pole p, and the drive's limit bounds how soon that is. Found by trial on the twin in this page.",
    source: "Nonlinear model, paper's eq. (3) with erratum 3, with limit and dry friction.",
  },
  {
    answer: "direction", part: FOLLOW, needs: "reference", choices: ["towards the reference", "away from it"], close: 0,
    ask: "The reference of the {tracked} steps by {step}. Where does the {tracked} move first?",
    do: "On the screen Track, look at the predicted answer to this step.",
    why: "{zero}",
    source: "{zerosource}",
  },
  {
    answer: "overshoot", part: FOLLOW, needs: "reference", unit: "%", close: 0.3,
    ask: "How far beyond the step of {step} does the {tracked} go, in percent of the step?",
    do: "Start, wait until it is calm, then follow the step on the screen Track.",
    why: "The poles of the loop are where K puts them, its zeros stay where the rig has them; k_pf makes the static gain 1.",
    source: "Paper, section on tracking: Ackermann's gains and a prefilter k_pf. Poles that act: {poles}.",
  },
];
