"""Does a search end where the cost is least, wherever it begins? Studies of real rigs from random guesses.

Every guess is multiplied by ``exp(0.3 z)``, z normal: a factor of two is one in fifty. Costs are those of the whole
model, weighted as by the study's own fit. A search reaches the lowest cost known when it ends within half a percent of
it. Of each study as many of 300 starts run as a number of CPU seconds allows (`--starts`, `--seconds`), at least three:
this page allows 8 seconds a study. Needs UPRIGHT_REAL_DATA. Required: 95 % of the starts.
"""

from __future__ import annotations

import functools
import math
import os
import re
import time
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.asked import studies
from benchmarks.measure import Line, of_each
from benchmarks.real import STUDIES
from benchmarks.rigs import publish
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
STARTS, QUICK, FEWEST = 300, 2, 3
REQUIRED = 0.95
"""Share of the starts."""


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


def timed(name: str, seed: int) -> tuple[float, float]:
    """Cost at which one search ends, and the CPU seconds that it took."""
    began = time.process_time()
    return ended(name, seed), time.process_time() - began


def within(name: str, starts: int, seconds: float, workers: Workers) -> list[tuple[float, float]]:
    """Costs and CPU seconds of searches, as many at a time as there are workers, until these seconds are spent."""
    done: list[tuple[float, float]] = []
    while len(done) < starts and (len(done) < FEWEST or sum(cpu for _, cpu in done) < seconds):
        seeds = range(len(done) + 1, min(starts, len(done) + workers.number) + 1)
        done += of_each(functools.partial(timed, name), seeds, workers)[0]
    return done


def headline(lines: Sequence[Line]) -> str:
    """The result in a sentence, from the line of each study."""
    counts = {line.contender: [int(n) for n in re.findall(r"\d+", line.note)[:2]] for line in lines}
    found, of = (sum(column) for column in zip(*counts.values(), strict=True))
    few = [f"{name} ({a} of {b})" for name, (a, b) in counts.items() if a < REQUIRED * b]
    return f"{found} of {of} searches end where the cost is least; " + (
        f"fewer than {100 * REQUIRED:.0f} % do of {', '.join(few)}."
        if few
        else f"{100 * REQUIRED:.0f} % or more do of every study."
    )


def run(
    *, quick: bool, progress: Callable[[str], None], workers: Workers = HERE, starts: int = STARTS,
    seconds: float = 60.0, markdown: Path | None = None,
) -> list[Line]:  # fmt: skip
    """One line per study; `quick`, few starts of one."""
    if not os.environ.get("UPRIGHT_REAL_DATA"):
        return [Line(contender="all studies", note="left out: UPRIGHT_REAL_DATA names no folder")]
    lines: list[Line] = []
    for name in studies()[: 1 if quick else None]:
        progress(name)
        own = ended(name, 0)
        done = within(name, QUICK if quick else starts, seconds, workers)
        costs, cpu = [cost for cost, _ in done], float(np.median([taken for _, taken in done]))
        least = min(own, *costs)
        found = int(np.sum(np.array(costs) <= (1 + NEAR) * least))
        note = f"{found} of {len(costs)} starts ({100 * found / len(costs):.3g} %; asked 95) end within {100 * NEAR:g} "
        note += f"% of the lowest cost known; the study's own guesses at {own / least:.4g} times that; {cpu:.2g} s CPU "
        lines.append(Line(contender=name, seconds=(cpu, cpu, cpu), note=note + "each"))
        if markdown is not None:  # what is done is kept, should somebody interrupt
            publish(markdown, "starts", "Random starts", __doc__, lines, headline(lines))
    return lines
