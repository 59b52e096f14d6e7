"""How is the question put? Rig and runs become tracks and numbers sought, perturbed by what the outputs can feel."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from upright.identification.model.model import Rig, Run
from upright.identification.model.unknowns import Unknown, base_values, friction_names, shared_unknowns
from upright.identification.problem.blending import moving_alike
from upright.identification.problem.normal import Normal
from upright.identification.problem.nuisances import run_unknowns
from upright.identification.problem.problem import Problem
from upright.identification.problem.track import prepare

Array = NDArray[np.float64]

STEP = 1e-5
"""A perturbed number moves the weighted outputs by about this much, root mean square."""

ROUNDING = 12**-0.5
"""Standard deviation of the rounding to steps of one."""


def pose(
    rig: Rig,
    runs: Sequence[Run],
    *,
    thin: bool = True,
    only_shared: bool = False,
    given: Mapping[str, Mapping[str, float]] | None = None,
) -> Problem:
    """Set up the problem of explaining `runs`.

    `only_shared` leaves out what differs from run to run; `given` holds what is known of a group of runs, by its label
    and name.
    """
    tracks = [prepare(rig, run, thin=thin) for run in runs]
    unknowns = visible(rig, runs, shared_unknowns(rig))
    own = [run_unknowns(rig, i, t.run, t.start) for i, t in enumerate(tracks)] if not only_shared else []
    for u in (u for found in own for u in found):
        place = next((i for i, o in enumerate(unknowns) if u.group and (o.name, o.group) == (u.name, u.group)), None)
        if place is not None:
            unknowns[place] = replace(unknowns[place], runs=(*unknowns[place].runs, *u.runs))
        elif (value := (given or {}).get(u.group, {}).get(u.name)) is not None:
            unknowns.append(replace(u, value=value, lower=value, upper=value))
        else:
            unknowns.append(u)
    steps = np.array([1e-6 * u.scale for u in unknowns])
    blends = {i: W for i, track in enumerate(tracks) if (W := moving_alike(track)) is not None}
    return Problem(
        blends=blends,
        rig=rig,
        tracks=tracks,
        unknowns=unknowns,
        base=base_values(rig),
        friction=friction_names(rig),
        steps=steps,
    )


def visible(rig: Rig, runs: Sequence[Run], unknowns: Sequence[Unknown]) -> list[Unknown]:
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


def settle_steps(problem: Problem, x: Array, horizon: float) -> Normal:
    """Choose perturbations that move the outputs by about `STEP`, so that no guess of a size is needed.

    The model at `x` comes back, found with perturbations not far from those.
    """
    for _ in range(4):
        before = problem.steps
        here = problem.normal(x, horizon)
        rescale_steps(problem, here, horizon)
        if np.all((problem.steps < 30 * before) & (problem.steps > before / 30)):
            return here
    return problem.normal(x, horizon)


def rescale_steps(problem: Problem, normal: Normal, horizon: float) -> None:
    """Choose perturbations by the effects found at an earlier evaluation within `horizon` seconds."""
    samples = sum(problem.samples(i, horizon) * t.restarts.size for i, t in enumerate(problem.tracks))
    effect = np.sqrt(np.maximum(np.diag(normal.matrix), 0.0) / samples)
    wanted = np.where(effect > 0, STEP / np.maximum(effect, 1e-300), 100 * problem.steps)
    wanted = np.clip(wanted, problem.steps * 1e-4, problem.steps * 1e4)
    scale = np.array([u.scale for u in problem.unknowns])
    problem.steps = np.clip(wanted, 1e-9 * scale, 1e-3 * scale)
