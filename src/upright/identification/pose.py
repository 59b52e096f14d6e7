"""How is the question put? Rig and runs become tracks and numbers sought, perturbed by what the outputs can feel."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from upright.identification.blending import moving_alike
from upright.identification.model import Rig, Run
from upright.identification.normal import Normal
from upright.identification.nuisances import run_unknowns
from upright.identification.problem import Problem
from upright.identification.tracks import prepare
from upright.identification.unknowns import base_values, friction_names, shared_unknowns

Array = NDArray[np.float64]

STEP = 1e-5
"""A perturbed number moves the weighted outputs by about this much, root mean square."""


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
    unknowns = shared_unknowns(rig)
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
