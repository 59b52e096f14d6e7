"""Is a sensor reversed, or its zero upright? A reversed sign scores about -100 %, so it is looked for first.

Every convention is tried on the measured accelerations, which need no simulation.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Mapping, Sequence

from upright.identification.model.grey_box import GreyBox
from upright.identification.model.runs import Run
from upright.identification.search.starts import regress, samples_of
from upright.workers import share

CLEAR = 0.5
"""Another convention is named when it leaves less than this share of the variance that the declared one leaves."""

COARSE = 1e-3
"""Relative step of what is left at which a convention's numbers are good enough to be distinguished from another's."""

CLOSER = 0.98
"""Of two that explain nearly the same the one tried first stays; a mirror image of a free rig explains the same."""


def wrong_conventions(rig: GreyBox, runs: Sequence[Run]) -> tuple[str, ...]:
    """Sentences on signs and zeros that would explain the accelerations far better than the declared ones."""
    declared = _unexplained(rig, runs, {}, {})
    if not 0.1 < declared < math.inf:
        return ()
    measured = sorted({c for run in runs for c in run.measured if c not in run.held})
    angles = {c.name for c in rig.plant.coordinates if c.unit == "rad"}
    others: list[tuple[dict[str, float], dict[str, float]]] = []
    for signs in itertools.product((1.0, -1.0), repeat=len(measured)):
        for turned in itertools.product((0.0, math.pi), repeat=len(measured)):
            turns = {c: t for c, t in zip(measured, turned, strict=True) if t and c in angles}
            if len(turns) == sum(1 for t in turned if t) and (turns or -1.0 in signs):
                others.append((dict(zip(measured, signs, strict=True)), turns))
    best, changes = declared, ({}, {})
    for (flips, turns), left in zip(others, share(lambda o: _unexplained(rig, runs, *o), others), strict=True):
        if left < CLOSER * best:
            best, changes = left, (flips, turns)
    if best > CLEAR * min(declared, 1.0):  # what explains next to nothing is no better convention
        return ()
    flips, turns = changes
    advice = [
        f"set sign = -1 for {c}, or take it out where it stands (the sign looks reversed)"
        for c, s in flips.items()
        if s < 0
    ]
    advice += [f"add an offset of pi to {c} (its zero looks upright)" for c in turns]
    now, then = 100 * (1 - min(declared, 1.0)), 100 * (1 - best)
    what = " and ".join(advice)
    return (
        f"The conventions look wrong: {what}; the accelerations are then explained to {then:.0f} % "
        f"instead of {now:.0f} %.",
    )


def _unexplained(rig: GreyBox, runs: Sequence[Run], flips: Mapping[str, float], turns: Mapping[str, float]) -> float:
    samples = samples_of(rig, runs, most=2000, flips=flips, turns=turns)
    return regress(rig, samples, tolerance=COARSE).unexplained if samples else math.inf
