"""What is said of experiment 2: verdict, a sentence for every pole set, and the numbers for other programs."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from upright.control import Rig, Score
from upright.control.preflight import FELT, WORDS
from upright.lab.regulation_2.run import Attempt, Regulation
from upright.report.symbols import plain


def verdict(done: Regulation) -> str:
    """Which set to take, and whether things came as told."""
    best = done.best
    share = best.before.words["regulates"]
    sure = f"{round(share * done.wish.draws)} of {done.wish.draws} rigs that the identification allows regulate with it"
    head = f"{'Take' if share >= 0.5 else 'None is to be trusted with this start; best is'} {best.name}: {sure}."
    if done.truth is None:
        return head + " Nothing was run: this is what the model says."
    as_told = [a for a in done.attempts if a.word == a.before.word]
    if len(as_told) == len(done.attempts):
        return (
            f"{head} All {len(done.attempts)} runs came as told." if len(done.attempts) > 1 else f"{head} So it came."
        )
    others = ", ".join(f"{a.name} ({a.word}, told {100 * a.before.words[a.word]:.0f} %)" for a in done.attempts
                       if a not in as_told)  # fmt: skip
    return f"{head} {len(as_told)} of {len(done.attempts)} runs came as most of those rigs did; not so {others}."


def detail(done: Regulation) -> str:
    """How far that can be trusted."""
    spread = (
        f"The {done.wish.draws} rigs were drawn from the fit's covariance, dry friction as it may be on the day, and "
        "started as a hand does it."
        if done.uncertain
        else "The fit tells of no uncertainty, so only dry friction and the hand vary: the chances are too sure."
    )
    return spread + (" Stopped by Ctrl-C before every set was run." if done.interrupted else "")


def sentence(done: Regulation, a: Attempt) -> str:
    """One pole set: what was told, and what came."""
    b, rig = a.before, done.rig
    reach = (
        f"it recovers tilts up to {math.degrees(b.tilt):.0f}° and taps up to {b.push:.1f} rad/s"
        if b.margins is not None
        else "the sampled loop is not stable"
    )
    told = (
        f"{a.name[:1].upper()}{a.name[1:]}: told to be held with a chance of {100 * b.chance:.0f} %"
        f" ({_shares(a)}); {reach}; the command was to peak at {b.score.effort_peak:.2g} of {rig.limit:g} {rig.unit}."
    )
    if a.score is None:
        return told
    return f"{told} {_came(done, a.score)}"


def _shares(a: Attempt) -> str:
    return ", ".join(f"{w} {100 * a.before.words[w]:.0f} %" for w in WORDS if a.before.words[w] > 0)


def _came(done: Regulation, s: Score) -> str:
    rig = done.rig
    driven = plain(rig.plant.inputs[0].on)
    if not s.held and s.fell < s.ran_out:
        return f"It fell after {s.fell:.2g} s."
    if not s.held:
        return f"It was too weak: {driven} came to the end of its travel after {s.ran_out:.2g} s."
    if math.isinf(s.settled):
        return f"It was too weak: dry friction kept the pendulum swinging by {math.degrees(s.final[-1]):.2g}°."
    full = f", {1e3 * s.at_limit:.0f} ms of it at the limit" if s.at_limit > FELT else ""
    still = f"swings on by {shown(rig, 0, s.final[0])}" if s.final[0] > 2 * rig.quantum[0] else "comes to rest"
    return (
        f"It settled in {s.settled:.2g} s with a peak of {s.effort_peak:.2g} {rig.unit}{full}; {driven} went "
        f"{shown(rig, 0, s.peaks[0])} and {still}."
    )


def shown(rig: Rig, i: int, value: float) -> str:
    """A coordinate's deviation in degrees or centimetres."""
    if rig.plant.coordinates[i].unit == "rad":
        return f"{math.degrees(value):.2g}°" if math.degrees(value) < 99.5 else f"{math.degrees(value):.0f}°"
    return f"{100 * value:.2g} cm"


def numbers(done: Regulation) -> dict[str, Any]:
    """The same for another program: SI, finite."""
    return {
        "rig": done.rig.name,
        "seed": None if done.truth is None else done.truth.seed,
        "start": dict(zip(done.rig.plant.state_names(), done.task.start, strict=True)),
        "limit": done.rig.limit,
        "command_unit": done.rig.unit,
        "recommended": done.best.name,
        "as_told": sum(a.word == a.before.word for a in done.attempts) if done.truth is not None else None,
        "sets": {a.name: _set(a) for a in done.attempts},
        "velocities": {
            w.name: {"noise": w.noise, "change_per_sample": w.restless, **_scored(w.score)} for w in done.ways
        },
    }


def _set(a: Attempt) -> dict[str, Any]:
    b, m = a.before, a.before.margins
    return {
        "poles": [[p.real, p.imag] for p in np.asarray(a.placement.asked).tolist()],
        "K": a.placement.K[0].tolist(),
        "before": {
            "word": b.word, "words": dict(b.words), "chance": b.chance, "tilt": b.tilt, "push": b.push,
            "command_noise": b.noise,
            "margins": None if m is None else {
                k: _finite(getattr(m, k)) for k in ("least_gain", "most_gain", "phase", "delay", "modulus")
            },
            **_scored(b.score),
        },
        "after": None if a.score is None else {"word": a.word, **_scored(a.score)},
    }  # fmt: skip


def _scored(s: Score) -> dict[str, Any]:
    out = {n: _finite(v) if np.ndim(v) == 0 else v.tolist() for n, v in vars(s).items()}
    return {**out, "held": s.held}


def _finite(value: float) -> float | None:
    return float(value) if math.isfinite(value) else None
