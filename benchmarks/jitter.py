"""Does this machine keep time for a loop? A minute at 1 kHz, at real-time priority and at ordinary priority.

Required, at real-time priority (FIFO) on an idle machine: at most 30 late ticks of 60,000, and 0.1 ms for the work of a
tick. The other rows show what a user without that priority gets, and what a higher rate costs.

- *late*: ticks whose deadline had passed before the loop was back to wait for it, or that woke a period or more behind.
  They are counted and never caught up.
- *work*: controller and supervision of a tick with its bank of filters. A twin stands for the rig; its simulation is
  not included.
- *time for*: the fastest rate for which work and late wake-ups leave time, where that is above the rate tried.
- *taken by host*: how long the host of a virtual machine gave its processors to others meanwhile.
"""

from __future__ import annotations

import math
import os
import platform
from collections.abc import Callable
from itertools import pairwise
from pathlib import Path

import numpy as np

from benchmarks.measure import Line, Target, page, spread
from upright.realtime.jitter import TOLERATED, Jitter, measure
from upright.running.tick import supervised

SECONDS, QUICK = 60.0, 2.0
WORK = 1e-4
"""What law and supervision of a tick may take [s]: a fifth of a period at 2 kHz."""
EDGES = (1, 2, 5, 10, 20, 50, 100, 200, 500, 1000, 2000, 5000)
"""Of the histogram [us]."""
KINDS = ((1000.0, True), (1000.0, False), (2000.0, True))
"""Rate [Hz], and whether FIFO is asked for; the first is what is asked."""


def run(*, quick: bool, progress: Callable[[str], None], markdown: Path | None = None) -> list[Line]:
    """One loop after the other; only the first has targets, of its late ticks and of their work."""
    lines: list[Line] = []
    all_of_them: list[Jitter] = []
    load = os.getloadavg()[0] if hasattr(os, "getloadavg") else float("nan")
    for rate, fifo in KINDS:
        progress(f"{rate:g} Hz, {'FIFO' if fifo else 'ordinary priority'}")
        found = measure(QUICK if quick else SECONDS, rate, fifo=fifo, make=supervised)
        lines += _lines(found, asked=(rate, fifo) == KINDS[0])
        all_of_them.append(found)
    if markdown:
        where = f"{platform.system()} {platform.release()}, {os.cpu_count()} processors, load {load:.2f} at the start."
        head = ["", where, "", "| rate | priority | late | p50 | p99 | p99.9 | largest | work p50 | work p99 | "
                "rate held | time for | taken by host |",
                "|--:|---|--:|--:|--:|--:|--:|--:|--:|--:|--:|--:|"]  # fmt: skip
        rows = [_row(found) for found in all_of_them]
        content = [*head, *rows, "", *_histogram(all_of_them)]
        first = all_of_them[0]
        result = headline(first.late, first.due, 1 / first.period, first.standing.priority, first.quantiles["max"])
        markdown.write_text(page("jitter", "Jitter", __doc__, content, result), encoding="utf-8")
    return lines


def _lines(found: Jitter, *, asked: bool) -> list[Line]:
    """Share of ticks that were late, and of the time that a tick's work may take, both in the column of the times."""
    q, share = found.quantiles, found.late / (TOLERATED * found.due)
    right = asked and found.standing.priority == "FIFO"
    name = f"{1 / found.period:.0f} Hz, {found.standing.priority}"
    late = Line(
        contender=f"{name}: late ticks by those allowed",
        ratio=(share, share, share),
        target=Target(most=1.0) if right else None,
        note=f"{found.late} of {found.due} late; p50 {1e6 * q['p50']:.0f}, p99.9 {1e6 * q['p99.9']:.0f}, "
        f"largest {1e6 * q['max']:.0f} us",
    )
    work = Line(
        contender=f"{name}: law and supervision of a tick by {1e3 * WORK:g} ms",
        ratio=spread((found.work / WORK).tolist()),
        target=Target(most=1.0) if right else None,
        note=f"p50 {1e6 * np.median(found.work):.0f}, p99 {1e6 * np.percentile(found.work, 99):.0f} us",
    )
    return [late, work]


def headline(late: int, due: int, rate: float, priority: str, longest: float) -> str:
    """The result in a sentence: late ticks of those due, at a rate [Hz], and the latest wake-up [s]."""
    return (
        f"{late} of {due} ticks were late at {rate:.0f} Hz and {priority} priority (at most {TOLERATED * due:.0f} "
        f"allowed); the longest wake-up was {1e6 * longest:.0f} µs late."
    )


def _histogram(loops: list[Jitter]) -> list[str]:
    """Ticks by how far behind their deadline they were woken."""
    names = [f"{1 / f.period:.0f} Hz, {f.standing.priority}" for f in loops]
    counts = np.array([np.histogram(1e6 * f.behind, bins=[-math.inf, *EDGES, math.inf])[0] for f in loops])
    ranges = [f"up to {EDGES[0]} µs", *(f"{a} to {b} µs" for a, b in pairwise(EDGES)), f"beyond {EDGES[-1]} µs"]
    rows = [f"| {what} | {' | '.join(str(n) for n in column)} |" for what, column in zip(ranges, counts.T, strict=True)]
    return [f"| woken behind the deadline | {' | '.join(names)} |", f"|---|{'--:|' * len(names)}", *rows]


def _row(found: Jitter) -> str:
    q = [*found.quantiles.values(), *np.percentile(found.work, [50, 99])]
    times = " | ".join(f"{1e6 * v:.0f} µs" for v in q)
    more = f"{found.promising} Hz" if found.promising else ""
    return (
        f"| {1 / found.period:.0f} Hz | {found.standing.priority} | {found.late} of {found.due} | {times} | "
        f"{found.rate:g} Hz | {more} | {found.stolen:.2g} s |"
    )
