"""Is it good enough for a loop? How well the pole is known by which the rig falls, and how many rigs would stand."""

from __future__ import annotations

from upright.basis import NOT_SUPPORTED, in_percent
from upright.identification.inference.verdict.evidence import LOOP, Evidence
from upright.identification.model.fit import Judgement
from upright.quantities import figures

NARROW, SOME = 0.1, 0.3
"""Half an interval of the growth rate upright, relative to it, within which a loop can be designed, or perhaps."""

SURE, LIKELY = 0.99, 0.9
"""Shares of the rigs within the intervals that a loop has to hold."""


def enough_for_a_loop(evidence: Evidence, *, supported: bool) -> Judgement:
    """The answer; `supported` says that the model predicts, so that a share of rigs means something."""
    s = evidence.standing
    if evidence.lost:
        return Judgement(question=LOOP, answer="not tested", headline="Not evaluated: the fit failed.")
    if s is None and evidence.unseen:
        return Judgement(
            question=LOOP, answer="not tested",
            headline="Not evaluated: the poles rest on numbers that these data cannot see.",
        )  # fmt: skip
    if s is None:
        return Judgement(
            question=LOOP, answer="not asked",
            headline="No equilibrium of this plant is unstable, or no drive acts on it.",
        )  # fmt: skip
    if s.growth.rests_on:
        on = s.growth.rests_on
        return Judgement(
            question=LOOP, answer="not tested",
            headline=f"{s.at.capitalize()}, the fastest pole is not known: it rests on {', '.join(on)} (assumed).",
            advice=f"Measure {'it' if len(on) == 1 else 'them'} before a loop is designed.", rests_on=on,
        )  # fmt: skip
    grows, digits = s.growth, figures(s.growth.value, s.growth.stderr)
    value, low, high = (f"{v:#.{digits}g}".rstrip(".") for v in (grows.value, *grows.interval))
    where = f"{s.at}, the fastest pole is {value} 1/s ({low} to {high})"
    if not evidence.driven:
        return Judgement(
            question=LOOP, answer="not tested",
            headline=f"{where[0].upper()}{where[1:]}; no fitted run was driven, so what the drive does, "
            "and adds where it was off, is not known.",
            advice="Add a run in which the drive acts, and identify again.",
        )  # fmt: skip
    half = (s.growth.interval[1] - s.growth.interval[0]) / 2 / s.growth.value
    held = f"a loop with poles as fast as that stabilises {in_percent(s.share)} of the rigs within the intervals"
    if not supported:
        held = (
            f"how many of the rigs within the intervals a loop with poles as fast as that stabilises is {NOT_SUPPORTED}"
        )
    answer = "no"
    if half <= NARROW and s.share >= SURE:
        answer = "yes"
    elif half <= SOME and s.share >= LIKELY:
        answer = "in part"
    doubted = any(not a for a in (evidence.converged, not evidence.interrupted))
    return Judgement(
        question=LOOP, answer="no" if doubted else answer,
        headline=f"{where[0].upper()}{where[1:]}; {held}.",
        advice="" if answer == "yes" else "Narrow the numbers above before a loop is closed.",
        reasons=("To first order, and without friction that differs by the day: `upright regulate` runs such rigs.",),
    )  # fmt: skip
