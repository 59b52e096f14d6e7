"""The problem of explaining runs: which numbers are sought of a rig and of each run, within which bounds."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from upright.identification.model.rig import Rig
from upright.identification.model.runs import Run
from upright.identification.model.unknowns import Unknown, shared_unknowns
from upright.identification.problem.nuisances import run_unknowns
from upright.identification.problem.residuals import Problem
from upright.identification.problem.tracks import prepare

Array = NDArray[np.float64]

ROUNDING = 12**-0.5
"""Standard deviation of the rounding to steps of one."""


def formulate(
    rig: Rig, runs: Sequence[Run], *, thin: bool = True, given: Mapping[str, Mapping[str, float]] | None = None
) -> Problem:
    """Set up the problem of explaining `runs`.

    `thin` drops samples of free runs that their period does not need; `given` holds what is known of a group of runs,
    by its label and name.
    """
    tracks = [prepare(rig, run, thin=thin) for run in runs]
    unknowns = resolved(rig, runs, shared_unknowns(rig))
    for u in (u for i, track in enumerate(tracks) for u in run_unknowns(rig, i, track.run, track.start)):
        place = next((i for i, o in enumerate(unknowns) if u.group and (o.name, o.group) == (u.name, u.group)), None)
        if place is not None:
            unknowns[place] = replace(unknowns[place], runs=(*unknowns[place].runs, *u.runs))
        elif (value := (given or {}).get(u.group, {}).get(u.name)) is not None:
            unknowns.append(replace(u, value=value, lower=value, upper=value))
        else:
            unknowns.append(u)
    return Problem(rig=rig, tracks=tracks, unknowns=unknowns, steps=np.array([1e-6 * u.scale for u in unknowns]))


def resolved(rig: Rig, runs: Sequence[Run], unknowns: Sequence[Unknown]) -> list[Unknown]:
    """The numbers sought, presliding lengths no shorter than `ROUNDING` of the finest encoder step that sees them.

    The effect of shorter ones on the outputs comes from where the steps of the integration happen to fall: differences
    of simulations then are noise, and a matrix of such differences promises intervals far too narrow.
    """
    least = _shortest(rig, runs)
    return [
        replace(u, lower=least[u.name], value=max(u.value, least[u.name]))
        if u.asked and u.name in least and u.lower < least[u.name] <= u.upper
        else u
        for u in unknowns
    ]


def unresolved(problem: Problem, x: Array) -> tuple[str, ...]:
    """Presliding lengths at coordinates `x` that the encoder does not tell from plain Coulomb friction."""
    least = _shortest(problem.rig, [track.run for track in problem.tracks])
    return tuple(
        u.name
        for u, value in zip(problem.unknowns, problem.value(x), strict=True)
        if u.asked and u.name in least and u.lower == least[u.name] and value <= u.lower * (1 + 1e-6)
    )


def _shortest(rig: Rig, runs: Sequence[Run]) -> dict[str, float]:
    """Least presliding length worth telling, by its name."""
    derived = rig.plant.derived()
    seen = [pair for run in runs for pair in zip(run.measured, run.quantum, strict=False)]
    steps = {c: min((quantum for name, quantum in seen if name == c), default=0.0) for c in derived.coordinates}
    return {j.presliding: ROUNDING * steps[derived.coordinates[j.coordinate]] for j in derived.joints if j.presliding}
