"""Does this machine keep time for a loop? A minute at 1 kHz at real-time priority, and at ordinary priority beside it.

What is asked, at most 30 late ticks of 60,000, is asked of real-time priority (FIFO) on an idle machine; the other rows
say what a user without that priority has, and what a rate costs. A tick is late when its deadline had passed before the
loop was back to wait for it, or when it was woken a period or more behind; late ticks are counted, never caught up.
The last column says for how long the host of a virtual machine gave its processors to others meanwhile.
"""

from __future__ import annotations

import os
import platform
from collections.abc import Callable
from pathlib import Path

from benchmarks.measure import Line, Target, page
from upright.realtime.jitter import TOLERATED, Jitter, measure

SECONDS, QUICK = 60.0, 5.0
KINDS = ((1000.0, True), (1000.0, False), (2000.0, True))
"""Rate [Hz], and whether FIFO is asked for; the first is what is asked."""


def run(*, quick: bool, progress: Callable[[str], None], markdown: Path | None = None) -> list[Line]:
    """One loop after the other; only the first has a target, of its late ticks."""
    lines: list[Line] = []
    rows: list[str] = []
    load = os.getloadavg()[0] if hasattr(os, "getloadavg") else float("nan")
    for rate, fifo in KINDS:
        progress(f"{rate:g} Hz, {'FIFO' if fifo else 'ordinary priority'}")
        found = measure(QUICK if quick else SECONDS, rate, fifo=fifo)
        lines.append(_line(found, asked=(rate, fifo) == KINDS[0]))
        rows.append(_row(found))
    if markdown:
        where = f"{platform.system()} {platform.release()}, {os.cpu_count()} processors, load {load:.2f} at the start."
        head = ["", where, "", "| rate | priority | late | p50 | p99 | p99.9 | largest | rate held | taken by host |",
                "|--:|---|--:|--:|--:|--:|--:|--:|--:|"]  # fmt: skip
        markdown.write_text(page("jitter", "Jitter", __doc__, [*head, *rows]), encoding="utf-8")
    return lines


def _line(found: Jitter, *, asked: bool) -> Line:
    """Share of ticks that were late, in the column of the times."""
    q, share = found.quantiles, found.late / (TOLERATED * found.behind.size)
    right = found.standing.priority == "FIFO"
    return Line(
        contender=f"{1 / found.period:.0f} Hz, {found.standing.priority}: late ticks by those allowed",
        ratio=(share, share, share),
        target=Target(most=1.0) if asked and right else None,
        note=f"{found.late} of {found.behind.size} late; p50 {1e6 * q['p50']:.0f}, p99.9 {1e6 * q['p99.9']:.0f}, "
        f"largest {1e6 * q['max']:.0f} us",
    )


def _row(found: Jitter) -> str:
    q = found.quantiles
    times = " | ".join(f"{1e6 * v:.0f} µs" for v in q.values())
    return (
        f"| {1 / found.period:.0f} Hz | {found.standing.priority} | {found.late} of {found.behind.size} | {times} | "
        f"{found.rate} Hz | {found.stolen:.2g} s |"
    )
