"""How often is a healthy rig stopped while somebody plays with it, and how soon a broken one?

**Nothing broken.** Random rigs of both types are stabilised upright for 10 minutes each, in virtual time, by a
controller designed for the nominal rig. They have effects that the controller does not know: more friction close to
rest, torque ripple, a frame out of level, encoders with play and off centre, a delay. Half of them also follow a slow
reference. A person interferes every 3.3 s on average, in one of four ways:

- a tap on the pendulum or on the body that carries it: 0.3 to 1.5 rad/s, a tenth of that in m/s for a cart
- a push with a finger for up to 0.2 s: 12 rad/s^2 at the pendulum, 3 at the body
- leaning on the pendulum for up to 2 s: 0.6 rad/s^2
- pushing the body for up to 2 s: 2 rad/s^2

The seeds are not those that set the thresholds in `control/watch.py` (1 to 60, 100 s each).

**Something broken.** The same loops and the same play, with one fault from 5 s on. The columns:

- *fell*, *stopped*: the pendulum fell by 29 degrees, or the watch stopped the loop before that. At 29 degrees the limit
  on lean stops a rig whose encoder still shows the angle.
- *named*: of those that stopped or fell, how many messages name the right cause as the likeliest.
- *after*: time from the fault to the stop, median and 90th percentile.
- *body*: distance of arm or cart from the centre by then, median.

A fault that the loop tolerates shows only when the rig is moved again, so these times depend on the taps.

**The board's clock.** The length of the board's tick is compared with the host's clock all the time. That check sees
nothing but the times of samples, so it has hours of its own (`benchmarks/hazards/clocks.py`), drawn as a host with busy
neighbours takes them. When a host pauses for longer than the watchdog, the board stops: *by the board* counts these,
and they are not false stops. For the second table the tick changes after 5 s. *After* is the time to the stop,
*measured* the tick's length: its mean since the start, or of late where that shows the change first.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import partial
from pathlib import Path

import numpy as np
from scipy.stats import chi2

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
    """Ten hours of play with healthy rigs, then everything broken; `quick`, ten seconds and two faults."""
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
        markdown.write_text(page("false_stops", "False stops", __doc__, body, headline(stops, hours)), encoding="utf-8")
    return lines


def headline(stops: int, hours: float) -> str:
    """The result in a sentence, with the 95 % interval of a Poisson count."""
    low, high = 10 / hours * chi2.ppf([0.025, 0.975], [2 * max(stops, 0.5), 2 * stops + 2]) / 2
    low = low if stops else 0.0
    shown = "which this shows" if high <= 1 else "which so few hours do not show"
    return (
        f"{stops} false stop{'s' if stops != 1 else ''} in {hours:.2f} hours of play (95 % interval {low:.1g} to "
        f"{high:.2g} in 10 hours). Required: at most 1 in 10 hours, {shown}."
    )


def clocks(seeds: range, seconds: float) -> tuple[list[str], Line]:
    """The watch of the tick's length over hours of healthy clocks and over wrong ticks, and its line."""
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
