"""Why is a peer better on a run that was held out? Its numbers in upright's place, and finer nodes of collocation.

A number that upright leaves open within its interval may lie where a peer has it: then the fitted run does not tell
which of the two is nearer, and another one would.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from scipy.interpolate import CubicSpline

from benchmarks.peers.ours import asked, records_of
from benchmarks.peers.task import Answer, Samples, Task, fit_percent, study_text
from upright.identification import predict
from upright.study import load_study

FINER = 4
"""Nodes of collocation for every sample, by which the midpoint rule errs a sixteenth of what it does at one."""


@dataclass(frozen=True, kw_only=True)
class Lead:
    """A peer that predicts one held-out run of a task better than upright, and both answers."""

    peer: str
    run: str
    task: Task
    theirs: Answer
    ours: Answer


def explained(leads: Sequence[Lead], collocated: Callable[[Task], Answer], tie: float) -> list[str]:
    """A paragraph for each log and other numbers; `collocated` answers as opty does, `tie` is no lead yet [points]."""
    groups: dict[tuple[str, tuple[float, ...]], list[Lead]] = {}
    for lead in leads:
        groups.setdefault((lead.task.name, tuple(lead.theirs.values.values())), []).append(lead)
    out: list[str] = []
    for (name, _), mine in groups.items():
        mine = [lead for lead in mine if lead.peer == mine[0].peer]
        out += ["", f"**{mine[0].peer} on {name}.** {_elsewhere(mine)}"]
        if mine[0].peer == "opty" and mine[0].task.plant == "pendulum":
            out[-1] += " " + _finer(mine, collocated(finer(mine[0].task)), tie)
    return out


def finer(task: Task, times: int = FINER) -> Task:
    """The task with so many nodes for a sample, on a cubic spline through the angles of a free swing."""
    run = task.fitted
    at = np.arange((run.t.size - 1) * times + 1) / times
    t = np.interp(at, np.arange(run.t.size), run.t)
    return replace(task, fitted=Samples(t=t, u=np.zeros(t.size), y=CubicSpline(run.t, run.y)(t)))


def simulated(task: Task, values: Mapping[str, float]) -> dict[str, list[float]]:
    """Fit percents of every run in upright's simulation at some numbers, each with a start of its own."""
    study = load_study(Path("study.toml"), text=study_text(task), records=records_of(task))
    runs = [replace(run, role="predict") for run in study.runs]
    scores = predict({asked(n): v for n, v in values.items()}, study.model, runs)
    return {label: list(score.fit_percent.values()) for label, score in scores.items()}


def _elsewhere(leads: Sequence[Lead]) -> str:
    """How a peer's numbers do in upright's simulation."""
    task, theirs, ours = leads[0].task, leads[0].theirs, leads[0].ours
    inside = [n for n, (low, high) in ours.intervals.items() if low <= theirs.values[n] <= high]
    there, here = (simulated(task, answer.values) for answer in (theirs, ours))
    missed = [" / ".join(f"{100 - p:.2f}" for p in percents["fitted"]) for percents in (there, here)]
    held = " and ".join(f"{lead.run} to {' / '.join(f'{p:.1f}' for p in there[lead.run])} %" for lead in leads)
    every = len(inside) == len(ours.intervals)
    said = (
        f"In upright's simulation its numbers predict {held}. They miss {missed[0]} % of the fitted run, upright's "
        f"{missed[1]} %. {'All' if every else f'{len(inside)} of'} {len(ours.intervals)} lie in upright's intervals"
    )
    if every and np.mean(there["fitted"]) < np.mean(here["fitted"]):
        return f"{said}: they fit worse, yet the fitted run does not rule them out."
    return f"{said}."


def _finer(leads: Sequence[Lead], answer: Answer, tie: float) -> str:
    """What is left of a lead with finer nodes."""
    left = [
        float(np.mean(fit_percent(held, answer.predicted[lead.run])) - np.mean(fit_percent(held, ours)))
        for lead in leads
        for held, ours in [(lead.task.held_out[lead.run], lead.ours.predicted[lead.run])]
    ]
    off = [max(abs(a.values[n] / v - 1) for n, v in leads[0].ours.values.items()) for a in (leads[0].theirs, answer)]
    said = (
        f"With {FINER} nodes a sample its lead is {' and '.join(f'{round(x, 1) + 0.0:g}' for x in left)} points, and "
        f"its numbers are within {100 * off[1]:.1f} % of upright's ({100 * off[0]:.1f} % with one)"
    )
    return f"{said}: the lead comes from the step of the midpoint rule." if max(left) <= tie else f"{said}."
