"""How well a rig repeats itself: what one run says about another of the same command.

No model has to do better: above this ceiling there is nothing left to explain, only what the rig does differently
every time.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields, is_dataclass
from itertools import permutations
from typing import Any

import numpy as np
from numpy.typing import NDArray

from upright.identification.inference.scoring import fit_percent
from upright.identification.ladder.decision import gain_scatter
from upright.identification.model.fit import RunScore
from upright.identification.model.runs import Run

Array = NDArray[np.float64]

SAME = 0.02
"""Two commands are the same when they differ by less than this share of their size: they may switch a sample apart."""


@dataclass(frozen=True, kw_only=True)
class Repeats:
    """Runs that repeat one another, by their labels.

    `percents` are by signal the fit percent of every run by every other one, without what a model may adapt as well:
    the offset at the start, or the one that suits best where runs estimate their own offset. `errors` are by run the
    mean of `log_error` over the others and the signals.
    """

    labels: tuple[str, ...]
    percents: Mapping[str, tuple[float, ...]]
    errors: Mapping[str, float]

    @property
    def ceiling(self) -> dict[str, float]:
        """Median fit percent by signal."""
        return {n: float(np.median(values)) for n, values in self.percents.items()}


def repeats(runs: Sequence[Run]) -> tuple[Repeats, ...]:
    """Groups of runs that repeat one another, as their studies declare or as their commands show.

    Runs repeat when they declare the same label (`Run.repeats`), or when the same coordinates are measured and held,
    the same numbers are known, and the same command, which has to change, drives them through the same law. Releases by
    hand differ, so free runs have to declare it.
    """
    groups: list[list[Run]] = []
    for run in runs:
        group = next((g for g in groups if same(g[0], run)), None)
        if group is None:
            groups.append([run])
        else:
            group.append(run)
    return tuple(_compare(g) for g in groups if len(g) > 1)


def same(a: Run, b: Run) -> bool:
    """Whether one run repeats the other."""
    if a.repeats is not None or b.repeats is not None:
        return a.repeats == b.repeats and a.measured == b.measured and _rhythm(a, b)
    if a.measured != b.measured or not _rhythm(a, b) or a.known != b.known or set(a.held) != set(b.held):
        return False
    if not all(_alike(a.held[n], b.held[n]) for n in a.held) or not _alike(a.loop, b.loop):
        return False
    here, there = _overlap(a, b)
    u, v = a.u[here], b.u[there]
    if not np.any(u != u[:1]) and a.loop is None:
        return False
    size = np.abs(u - u.mean(axis=0)).mean(axis=0) + np.abs(v - v.mean(axis=0)).mean(axis=0)
    apart = np.abs(u - v).mean(axis=0)
    return u.shape[0] > max(a.t.size, b.t.size) // 2 and bool(np.all(apart <= SAME * size / 2))


def _rhythm(a: Run, b: Run) -> bool:
    """Whether two runs drift apart by less than a sample."""
    return abs(a.period - b.period) * min(a.t.size, b.t.size) < a.period


def _first_change(run: Run) -> int:
    """Sample at which a command changes for the first time, 0 when none does."""
    return int(np.argmax(np.any(run.u != run.u[:1], axis=1)))


def _overlap(a: Run, b: Run) -> tuple[slice, slice]:
    """Samples of each run that belong together: from the start, or where their commands change for the first time.

    A record may begin just before or just after the command does.
    """

    def from_(i: int, j: int) -> tuple[float, slice, slice]:
        before = min(i, j)
        n = min(a.t.size - i, b.t.size - j) + before
        here, there = slice(i - before, i - before + n), slice(j - before, j - before + n)
        return float(np.abs(a.u[here] - b.u[there]).mean()), here, there

    nearest = min(from_(0, 0), from_(_first_change(a), _first_change(b)), key=lambda one: one[0])
    return nearest[1], nearest[2]


def _compare(group: Sequence[Run]) -> Repeats:
    """Every run of a group explained by every other."""
    percents: dict[str, list[float]] = {}
    errors: dict[str, list[float]] = {run.label: [] for run in group}
    for a, b in permutations(group, 2):
        here, there = _overlap(a, b)
        rest = max(1, _first_change(a) - here.start)  # stands still until the command changes
        for k, name in enumerate(a.measured):
            if name in a.held:
                continue
            y, z = a.y[here, k], b.y[there, k]
            until = None if {"offset", f"offset.{name}"} & {*a.unknown} else rest
            percent = fit_percent(y - y[:until].mean(), z - z[:until].mean())
            percents.setdefault(name, []).append(percent)
            errors[a.label].append(log_error(percent))
    return Repeats(
        labels=tuple(run.label for run in group),
        percents={n: tuple(v) for n, v in percents.items()},
        errors={label: float(np.mean(v)) for label, v in errors.items() if v},
    )


def log_error(percent: float) -> float:
    """Logarithm of what is missed over how much the signal moves."""
    return math.log(max(1 - percent / 100, 1e-9))


def at_ceiling(groups: Sequence[Repeats], scores: Mapping[str, RunScore]) -> bool:
    """Whether runs predict one another no better than a model predicts them, by more than one standard error.

    The same rule by which `decision.compare_rungs` keeps a richer model, a repeat being the richest of all.
    """
    gains = [
        float(np.mean([log_error(p) for p in scores[label].fit_percent.values()])) - error
        for group in groups
        for label, error in group.errors.items()
        if label in scores
    ]
    return bool(gains) and float(np.mean(gains)) <= gain_scatter(np.array(gains))


def _alike(a: Any, b: Any) -> bool:
    """Whether two laws, or two motions, are the same as far as both last."""
    if a is None or b is None or type(a) is not type(b):
        return a is b
    if is_dataclass(a):
        return all(_alike(getattr(a, f.name), getattr(b, f.name)) for f in fields(a))
    if isinstance(a, np.ndarray) and a.ndim and np.ptp(a) > 0:
        n = min(a.shape[0], b.shape[0])
        x, y = np.asarray(a[:n], dtype=np.float64), np.asarray(b[:n], dtype=np.float64)
        return x.shape == y.shape and bool(np.abs(x - y).mean() <= SAME * np.abs(x - x.mean()).mean())
    return bool(np.array_equal(a, b))
