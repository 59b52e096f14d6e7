"""How often is a sound rig stopped that a person plays with, and how soon a broken one?

Rigs of both makes, drawn and worn (more friction close to rest, ripple of the torque, a frame out of level, play and
encoders off centre, a delay of its own), are held upright by a law for the rig as designed, each for 10 minutes. Every
3.3 s in the mean somebody taps the pendulum or what carries it (0.3 to 1.5 rad/s, a tenth of it in m/s for a cart),
pushes it with a finger for up to 0.2 s (12 rad/s^2 at the pendulum, 3 at the body), leans on the pendulum for up to 2 s
(0.6 rad/s^2) or pushes the body for up to 2 s (2 rad/s^2); half of them are led by a slow reference meanwhile. Time is
virtual. The seeds are none of those by which the bounds of `control/watch.py` were set (1 to 60, 100 s each).

Then something breaks after 5 s, in loops that are played with in the same way. *Stopped* counts those that the watch
stopped before the pendulum fell by 29 degrees, where the limit on lean stops a rig whose encoder shows it; *named*
those of stopped and fallen in which the likeliest cause was the right one; *after* is the time from the fault, median
and nine tenths; *body* how far what carries the pendulum was from the middle by then, in the median. Faults that the
loop bears, and that nobody moves, are seen when somebody taps it next.

The length of the board's tick is compared with the host's clock in all that while, and that sees nothing of a rig but
the times of its samples: hours of these are drawn by themselves (`benchmarks/hazards/clocks.py`), as a host takes them
that other programs keep busy. A host that pauses for longer than the watchdog is stopped by the board: *by the board*
counts that, and is no false stop. Then a tick changes after 5 s; *after* is the time to the stop, and *measured* its
length: its mean since the start, or lately where that shows it first.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import partial
from pathlib import Path

import numpy as np

from benchmarks.hazards.clocks import BOARDS, watched
from benchmarks.hazards.parallel import Twins
from benchmarks.hazards.sound import MAKES, Breaking, Lane, Played
from benchmarks.measure import Line, Target, page
from upright.rig.makes import make_rig

LANES, SECONDS, FIRST = 30, 600.0, 6001
BROKEN, BROKEN_FIRST, AFTER, WATCHED = 12, 1001, 5.0, 25.0
TICKS = (0.5, 0.9, 1.1, 2.0)
"""Lengths of a board's tick that is wrong, over what it should be."""


def _shown(channel: int, factor: float, twins: Twins, t: float) -> None:
    if t >= AFTER:
        twins.factor[channel] = factor


def _slips(channel: int, counts: float, twins: Twins, t: float) -> None:
    if t >= AFTER:
        twins.slipped[channel] = counts * (t - AFTER) * twins.resolution[channel]


def _supply(share: float, twins: Twins, t: float) -> None:
    if t >= AFTER:
        twins.supply[:] = share


def faults() -> dict[str, tuple[Breaking, str]]:
    """What breaks, by name, with a word that is in the sentence that names it."""
    out: dict[str, tuple[Breaking, str]] = {}
    for channel, body in enumerate(("body", "pendulum")):
        for factor, how in ((0.0, "dead"), (-1.0, "the wrong way round"), (0.25, "a quarter"), (0.5, "half"),
                            (2.0, "twice"), (4.0, "four times")):  # fmt: skip
            out[f"encoder of the {body}: {how}"] = partial(_shown, channel, factor), body
    per_degree = 16_000 / 360
    for rate in (0.45, 1.1):
        out[f"encoder of the pendulum slips by {rate:g} deg/s"] = partial(_slips, 1, rate * per_degree), "zero"
    out["encoder of the body slips by 200 counts/s"] = partial(_slips, 0, 200.0), "zero"
    for share in (0.5, 0.3, 0.0):
        out[f"supply at {100 * share:.0f} %"] = partial(_supply, share), "drive"
    return out


def named(why: str, word: str, body: str) -> bool:
    """Whether a sentence names the right part."""
    if why.startswith("an encoder that shows not"):
        return word in ("body", "pendulum")
    return {"body": why.startswith(body), "pendulum": why.startswith("theta"), "zero": why.startswith("the zero"),
            "drive": why.startswith("the drive")}[word]  # fmt: skip


def run(*, quick: bool, progress: Callable[[str], None], markdown: Path | None = None) -> list[Line]:
    """Ten hours of play with sound rigs, then everything broken; `quick`, ten seconds and two faults."""
    lines: list[Line] = []
    body = ["", "## Nothing broken", "", "| rig | hours | false stops | of what |", "|---|--:|--:|---|"]
    stops, hours = 0, 0.0
    for make in MAKES:
        progress(f"nothing broken: {make}")
        lanes = Played(make, range(FIRST, FIRST + (2 if quick else LANES)), 10.0 if quick else SECONDS).run()
        stopped = [lane for lane in lanes if lane.why]
        run_for = sum(min(lane.stopped, lane.fell, 10.0 if quick else SECONDS) for lane in lanes) / 3600
        stops, hours = stops + len(stopped), hours + run_for
        what = "; ".join(sorted({f"{lane.why} after {lane.stopped:.0f} s" for lane in stopped})) or "–"
        body.append(f"| {make_rig(make).name} | {run_for:.2f} | {len(stopped)} | {what} |")
    lines.append(
        Line(contender="false stops in 10 hours", ratio=(10 * stops / max(hours, 10),) * 3, target=Target(most=1.0),
             note=f"{stops} in {hours:.2f} h of play")
    )  # fmt: skip
    progress("the board's clock beside the host's")
    of_clocks, line = clocks(range(FIRST, FIRST + (2 if quick else LANES)), 10.0 if quick else SECONDS)
    lines.append(line)
    all_of = faults()
    for make in MAKES:
        body += ["", f"## Something broken: {make_rig(make).name}", "", *HEAD]
        for what, (breaking, word) in list(all_of.items())[:: 36 if quick else 1]:
            progress(f"{make}: {what}")
            lanes = Played(make, range(BROKEN_FIRST, BROKEN_FIRST + (1 if quick else BROKEN)), WATCHED, breaking).run()
            row, line = judged(make, what, word, lanes)
            body.append(row)
            lines.append(line)
    body += of_clocks
    if markdown:
        markdown.write_text(page("false_stops", "False stops", __doc__, body), encoding="utf-8")
    return lines


def clocks(seeds: range, seconds: float) -> tuple[list[str], Line]:
    """The watch of the tick's length over hours of sound clocks and over wrong ticks, and its line of the benchmark."""
    body = ["", "## The board's clock beside the host's", "", "| clock | hours | false stops | by the board |",
            "|---|--:|--:|--:|"]  # fmt: skip
    stops, hours = 0, 0.0
    for board in BOARDS:
        runs = [watched(board, seed, seconds) for seed in seeds]
        stopped, run_for = sum(len(run.stopped) for run in runs), sum(run.hours for run in runs)
        stops, hours = stops + stopped, hours + run_for
        body.append(f"| {board} | {run_for:.2f} | {stopped} | {sum(run.ended for run in runs)} |")
    body += ["", "| tick | stopped | after | measured |", "|---|--:|--:|--:|"]
    for tick in TICKS:
        runs = [watched(board, s, WATCHED, tick, AFTER) for s in range(BROKEN_FIRST, BROKEN_FIRST + BROKEN // 2)
                for board in BOARDS]  # fmt: skip
        first = np.array([run.stopped[0] for run in runs if run.stopped]).reshape(-1, 2)
        after = f"{np.median(first[:, 0]) - AFTER:.2f} s, {np.quantile(first[:, 0], 0.9) - AFTER:.2f}"
        measured = f"{first[:, 1].min():.2f} to {first[:, 1].max():.2f}"
        body.append(f"| {tick:g} times as long | {len(first)} of {len(runs)} | {after} | {measured} |")
    note = f"{stops} in {hours:.2f} h of samples"
    return body, Line(
        contender="false stops of the tick's length", ratio=(10 * stops / max(hours, 10),) * 3,
        target=Target(most=1.0), note=note,
    )  # fmt: skip


HEAD = ("| fault | loops | fell | stopped | named | after | body |", "|---|--:|--:|--:|--:|--:|--:|")


def judged(make: str, what: str, word: str, lanes: list[Lane]) -> tuple[str, Line]:
    """A fault as a row of the page and a line of the benchmark."""
    coordinate = make_rig(make).plant.coordinates[0]
    stopped = [lane for lane in lanes if math.isfinite(lane.stopped)]
    fell = sum(math.isfinite(lane.fell) for lane in lanes)
    right = sum(named(lane.why, word, coordinate.name) for lane in lanes)
    after = np.array([lane.stopped - AFTER for lane in stopped])
    when = f"{np.median(after):.2f} s, {np.quantile(after, 0.9):.2f}" if after.size else "–"
    far = float(np.median([lane.far for lane in lanes]))
    shown = f"{math.degrees(far):.0f}°" if coordinate.unit == "rad" else f"{1e3 * far:.0f} mm"
    row = f"| {what} | {len(lanes)} | {fell} | {len(stopped)} | {right} | {when} | {shown} |"
    note = f"stopped {len(stopped)}, fell {fell}, named {right} of {len(lanes)}; after {when}; body {shown}"
    return row, Line(contender=f"{make}: {what}", note=note)
