"""How long does the drive stay on after program, loop, cable or board dies, in every state of a run?

The firmware runs as a process in real time and records by itself how long its drive had a command and its power stage
was on. The program is that of `upright run`, with its loop in a process of its own. Three times bound the answer:

- the watchdog: 50 ms
- an armed board waits a second for its host, at zero command
- a loop whose program no longer responds ends after 2 s

*Bound* is the time that applies, plus the longest delay by which other programs kept the board's process from its
ticks.
"""

from __future__ import annotations

import tempfile
import time
from collections.abc import Callable
from pathlib import Path

from benchmarks.boards import build
from benchmarks.hazards.dying import MOMENTS, STARTING, WAYS, WHOLE, Death, Moment, die
from benchmarks.measure import Line, Target, Unavailable, page

INSTANTS = 50
SPANS = {"starting": 2.0, "ARMED, a pulse": 0.25, "running, HOST": 1.0}
"""For how long the instants are spread over a state [s]; a start is timed beforehand."""


def run(*, quick: bool, progress: Callable[[str], None], markdown: Path | None = None) -> list[Line]:
    """A row for each state and way to die, and one for each of three states with the program killed at 50 instants."""
    with tempfile.TemporaryDirectory(prefix="upright-dying-") as name:
        folder = Path(name)
        if reason := build("host", folder, "cc"):
            return [Line(contender="every state", note=f"left out: {reason}")]
        firmware = folder / "rig-host"
        lines = [_killed(firmware, moment, 1 if quick else INSTANTS, progress) for moment in (STARTING, *MOMENTS[1:3])]
        for moment in MOMENTS[2:3] if quick else MOMENTS:
            for way in list(WAYS)[: 2 if quick else None]:
                progress(f"{moment.name}: {way}")
                try:
                    lines.append(_line(die(firmware, moment, way)))
                except Unavailable as why:
                    lines.append(Line(contender=f"{moment.name}: {way}", note=str(why)))
    if markdown is not None:
        of_them = [line for line in lines if line.reached is not None]
        result = headline(sum(bool(x.reached) for x in of_them), len(of_them))
        markdown.write_text(page("dying", "Dying", __doc__, ["", *_rows(lines)], result), encoding="utf-8")
    return lines


def headline(right: int, cases: int) -> str:
    """The result in a sentence."""
    return f"In {right} of {cases} cases the drive was off within its bound."


def _line(death: Death) -> Line:
    seconds, most = death.driven, death.longest[0] if not death.on else 0.0
    stage = f"power stage off after {1e3 * death.powered:.0f} ms" if not death.on else "the power stage stays on"
    return Line(
        contender=f"{death.moment.name}: {death.way}", seconds=(seconds, seconds, seconds),
        target=Target(most=most if death.safe else 0.0, of="seconds"), note=stage,
    )  # fmt: skip


def _killed(firmware: Path, moment: Moment, instants: int, progress: Callable[[str], None]) -> Line:
    """The program killed at as many instants of a state, spread over it."""
    span = _start(firmware) if moment is STARTING else SPANS[moment.name]
    deaths = list[Death]()
    for k in range(instants):
        progress(f"{moment.name}, killed at instant {k + 1} of {instants}")
        deaths.append(die(firmware, moment, WHOLE, span * k / instants))
    longest, left = max(d.driven for d in deaths), sum(d.on for d in deaths)
    late = sum(not d.safe for d in deaths)
    return Line(
        contender=f"{moment.name}, {instants} instants in {span:.2g} s", seconds=(longest, longest, longest),
        target=Target(most=max(d.longest[0] for d in deaths) if not late else 0.0, of="seconds"),
        note=f"drive on after the death {left} of {instants}, later than its bound {late}; the longest is shown",
    )  # fmt: skip


def _start(firmware: Path) -> float:
    """How long a program takes until it arms its rig [s]."""
    began = time.monotonic()
    die(firmware, MOMENTS[1], WHOLE)
    return time.monotonic() - began - 0.3  # by which what is dead was looked at


def _rows(lines: list[Line]) -> list[str]:
    out = ["| state | what dies | command on for [ms] | bound [ms] | |", "|---|---|--:|--:|---|"]
    for line in lines:
        state, _, way = line.contender.partition(": ")
        if line.seconds is None or line.target is None:
            out.append(f"| {state} | {way} | | | {line.note} |")
        else:
            late = "" if line.reached else "**missed** "
            out.append(f"| {state} | {way or WHOLE} | {1e3 * line.seconds[0]:.0f} | {1e3 * line.target.most:.0f} | "
                       f"{late}{line.note} |")  # fmt: skip
    return out
