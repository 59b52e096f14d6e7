"""How are two programs compared fairly on a machine that others use too?

Contenders take turns, round after round; a ratio is taken within each round and its median and quartiles
are shown. In-process work is timed in CPU seconds of this process on one thread, which a neighbour cannot
stretch; whole processes are timed by the clock on the wall.
"""

from __future__ import annotations

import functools
import gc
import importlib
import math
import re
import time
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from typing import Any, TypeVar

import numpy as np

from upright.progress import Progress, silent
from upright.workers import HERE, Workers
from upright.workers import spread as share_out

T = TypeVar("T")
Spread = tuple[float, float, float]
"""Median, lower and upper quartile."""

BATCH = 0.02  # s; what is shorter is run several times in its turn, as a program in use would


class Unavailable(Exception):
    """A contender cannot run here; the message says why."""


@dataclass(frozen=True, kw_only=True)
class Target:
    """What has to be reached: at most `most` times the reference's time, or at most `most` seconds."""

    most: float
    of: str = "ratio"  # or "seconds"

    def __str__(self) -> str:
        if self.of == "seconds":
            return f"< {self.most:g} s" if self.most >= 0.1 else f"< {1e3 * self.most:g} ms"
        return f"<= {self.most:g} x"


@dataclass(frozen=True, kw_only=True)
class Contender:
    """Something to time: `run()` does `share` of the whole problem, `error()` says how wrong it is."""

    name: str
    run: Callable[[], Any]
    share: float = 1.0
    target: Target | None = None
    error: Callable[[Any], float] | None = None
    note: str = ""


@dataclass(frozen=True, kw_only=True)
class Line:
    """One row of the table."""

    contender: str
    seconds: Spread | None = None
    ratio: Spread | None = None
    rounds: int = 0
    error: float | None = None
    target: Target | None = None
    note: str = ""

    @property
    def reached(self) -> bool | None:
        """Whether the median meets the target; None where nothing was asked or nothing ran."""
        value = self.ratio if self.target is not None and self.target.of == "ratio" else self.seconds
        if self.target is None or value is None:
            return None
        return value[0] <= self.target.most


def spread(values: Sequence[float]) -> Spread:
    """Median, lower and upper quartile."""
    low, middle, high = np.percentile(values, [25, 50, 75])
    return float(middle), float(low), float(high)


def of_each(
    work: Callable[[Any], T], which: Iterable[Any], workers: Workers = HERE, progress: Progress = silent
) -> tuple[list[T], Spread]:
    """What each came to, such as the twin of each seed, and the mean CPU seconds."""
    done = share_out(
        functools.partial(_timed, work), list(which), workers=workers, progress=progress, what="twin"
    ).all()
    return [result for result, _ in done], spread([sum(seconds for _, seconds in done) / len(done)])


def _timed(work: Callable[[Any], T], one: Any, _progress: Progress) -> tuple[T, float]:
    start = time.process_time()
    return work(one), time.process_time() - start


def library(name: str, what: str, part: str, *size: int, **more: Any) -> Callable[[], Contender]:
    """Contender that is the function `part` of a module of `benchmarks.libraries`."""

    def build() -> Contender:
        module = importlib.import_module(f"benchmarks.libraries.with_{name}")
        return Contender(name=what, run=getattr(module, part)(*size), **more)

    return build


def page(
    name: str, title: str, about: str | None, body: Sequence[str], headline: str, *, needs: str = ""
) -> str:  # fmt: skip
    """Published page of a benchmark: the question, the result in a sentence, the method as its module states it.

    `needs` stands before the command.
    """
    first, _, *rest = (about or "").strip().splitlines()
    command = f"Written by `{needs}python -m benchmarks {name} --markdown benchmarks/{name}.md`."
    return "\n".join([f"# {title}: {first}", "", f"**{headline}**", "", command, "", *rest, *body]) + "\n"


def shares(lines: Iterable[Line]) -> dict[str, float]:
    """Percent that a line's note begins with, by the line's name; those that begin otherwise are left out."""
    found = {line.contender: re.match(r"([\d.]+) %", line.note) for line in lines}
    return {name: float(match[1]) for name, match in found.items() if match}


def built(builders: dict[str, Callable[[], Contender]]) -> tuple[list[Contender], list[Line]]:
    """Contenders that can run here, and a line with the reason for each that cannot."""
    able, unable = [], []
    for name, build in builders.items():
        try:
            able.append(build())
        except (ImportError, Unavailable) as reason:
            missing = getattr(reason, "name", None)
            note = f"left out: {f'{missing} is not installed' if missing else reason}"
            unable.append(Line(contender=name, note=note))
    return able, unable


def compare(
    builders: dict[str, Callable[[], Contender]],
    *,
    rounds: int,
    patience: float = 3.0,
    clock: Callable[[], float] = time.process_time,
    progress: Callable[[str], None] = print,
) -> list[Line]:
    """Time every contender in turn; the first that can run is the reference of the ratios.

    A contender whose one run takes longer than `patience` seconds sits out all rounds but two.
    """
    able, lines = built(builders)
    taken: dict[str, list[float]] = {c.name: [] for c in able}
    ratios: dict[str, list[float]] = {c.name: [] for c in able}
    errors: dict[str, float | None] = {}
    turns: dict[str, int] = {}
    batch: dict[str, int] = {}
    for contender in able:
        progress(contender.name)
        result = contender.run()  # compiles, allocates, fills caches
        errors[contender.name] = contender.error(result) if contender.error else None
        del result
        start = time.perf_counter()
        contender.run()
        once = time.perf_counter() - start
        turns[contender.name] = rounds if once < patience else min(2, rounds)
        batch[contender.name] = max(1, math.ceil(BATCH / once))
    for _ in range(rounds):
        reference = None
        for contender in able:
            if len(taken[contender.name]) >= turns[contender.name]:
                continue
            gc.collect()
            gc.disable()  # as timeit does: whoever comes late would pay for everyone's objects
            start = clock()
            for _ in range(batch[contender.name]):
                contender.run()
            seconds = (clock() - start) / batch[contender.name] / contender.share
            gc.enable()
            reference = seconds if contender is able[0] else reference
            taken[contender.name].append(seconds)
            if reference:
                ratios[contender.name].append(seconds / reference)
    for contender in able:
        lines.append(
            Line(
                contender=contender.name,
                seconds=spread(taken[contender.name]),
                ratio=spread(ratios[contender.name]) if ratios[contender.name] else None,
                rounds=len(taken[contender.name]),
                error=errors[contender.name],
                target=contender.target,
                note=contender.note,
            )
        )
    order = list(builders)
    return sorted(lines, key=lambda line: order.index(line.contender))
