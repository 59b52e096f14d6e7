"""Does a search end where the cost is least, wherever it begins? Studies of real rigs from random guesses.

Every guess is multiplied by ``exp(0.3 z)``, z normal: a factor of two is one in fifty. Costs are those of the whole
model, weighed as by the study's own fit. Needs UPRIGHT_REAL_DATA.
"""

from __future__ import annotations

import functools
import math
import os
import time
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np

from benchmarks.asked import studies
from benchmarks.measure import Line, of_each
from benchmarks.real import STUDIES
from upright.identification.estimate import find_optimum
from upright.identification.model.grey_box import GreyBox, neutral
from upright.identification.problem.residuals import Problem, formulate
from upright.identification.problem.simulated import with_noise
from upright.identification.problem.trips import with_trip_guesses
from upright.identification.search.descent import SearchLog
from upright.study.load import load_study
from upright.workers import HERE, Workers

SPREAD, NEAR = 0.3, 0.005
"""Of the logarithms of the guesses; share above the lowest cost known within which a search has found it."""
STARTS, QUICK = 300, 2


@functools.cache
def _reference(name: str) -> tuple[GreyBox, list[Any], Problem, dict[str, float]]:
    """A study's rig and runs, the whole problem weighed as by its own fit, and the values of that fit."""
    study = load_study(STUDIES / f"{name}.toml", data=os.environ["UPRIGHT_REAL_DATA"])
    runs = [with_trip_guesses(study.model, run) for run in study.runs if run.role == "fit"]
    rig = with_noise(study.model, runs)
    weighed, own = find_optimum(rig, runs, "auto", SearchLog())
    problem = formulate(rig, runs)
    problem.weigh_like(weighed)
    return rig, runs, problem, weighed.values_at(own.x)


def ended(name: str, seed: int) -> float:
    """Cost at which one search ends, seed 0 that of the study's own guesses."""
    rig, runs, problem, values = _reference(name)
    if seed:
        rng = np.random.default_rng(seed)
        moved = {
            n: replace(p, value=float(np.clip(p.value * math.exp(SPREAD * rng.normal()), p.lower, p.upper)))
            if p.estimate else p
            for n, p in rig.parameters.items()
        }  # fmt: skip
        found, there = find_optimum(replace(rig, parameters=moved), runs, "auto", SearchLog())
        values = found.values_at(there.x)
    left_out = {n: neutral(rig.plant, n) for n in rig.estimated if n not in values}
    return problem.cost(problem.place(left_out | values))


def run(*, quick: bool, progress: Callable[[str], None], workers: Workers = HERE, starts: int = STARTS) -> list[Line]:
    """One line per study; `quick`, few starts of every sixth."""
    if not os.environ.get("UPRIGHT_REAL_DATA"):
        return [Line(contender="all studies", note="left out: UPRIGHT_REAL_DATA names no folder")]
    lines: list[Line] = []
    for name in studies()[:: 6 if quick else 1]:
        progress(name)
        begin = time.perf_counter()
        costs, _ = of_each(functools.partial(ended, name), range((QUICK if quick else starts) + 1), workers)
        seconds = (time.perf_counter() - begin) / len(costs)
        own, *others = costs
        least = min(costs)
        share = np.mean(np.array(others) <= (1 + NEAR) * least)
        note = f"{100 * share:.3g} % of {len(others)} starts end within {100 * NEAR:g} % of the lowest cost known "
        note += f"({least:.6g}; the study's own {own / least:.4g} times that; asked: 95 %)"
        lines.append(Line(contender=name, seconds=(seconds,) * 3, note=note))
    return lines
