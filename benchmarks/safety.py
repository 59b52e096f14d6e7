"""What stops a rig when something breaks, how soon, and how far has it moved by then? Every hazard, caused on purpose.

A Furuta pendulum of make furuta, with parameters that differ from its controller's, is stabilised upright at 1 kHz (the
twin: 1131 Hz). A tap sets it moving, then something breaks. The columns:

- *zero after*: time from the fault until the drive gets nothing any more. That is the converter at zero or the power
  stage off, to a tick. Where the host's loop trusts drive and arm encoder, it first brakes the arm for at most 0.3 s,
  which is included.
- *arm*: largest distance of the arm from its set point, until a second after that.
- *lean*: angle of the pendulum when the output went to zero. From there it falls freely.

Arm and lean are the true motion, not what encoders show. Zero output does not brake: an arm that is fast at its limit
coasts past it. A limit on travel therefore needs a limit on speed beside it.

Four rigs are broken, all under the supervisor of `upright run`:

- the twin: the simulator with dry friction, delay and lag
- the firmware with the loop on the host: the board's program with a simulated pendulum inside (viscous friction, no
  delay or lag)
- the firmware with the loop on the board
- the ATmega2560's own program in simavr, from encoder edges to frames of its converter

Time is virtual: one tick per exchange that is answered, and as many ticks as the host waits for an answer that does not
come. A host is really killed: its process controls the pendulum and gets SIGKILL. No virtual time passes for a dead
host, so the test advances the board tick by tick from there; rows "by the clock on the wall" run in real time instead.

This is supervision in software, not a rated safety function, and a simulation does not replace a test on the bench. A
rig also needs an emergency stop in hardware.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path

from benchmarks.hazards import board, firmware, logs, twin
from benchmarks.hazards.killed import killed
from benchmarks.hazards.story import (
    LIMITS,
    STILL,
    Column,
    Happened,
    Story,
    Telling,
    at_start,
    in_loop,
    pushed,
    rising_to,
    runaway,
    silent,
    turning_to,
)
from benchmarks.measure import Line, Target, Unavailable, page
from upright.rig.makes import make_rig
from upright.rigs import Fault, Limits, Mode

TICKS = 2
"""What a limit on time may be overrun by: the tick that sees it and the one that acts [periods]."""


@dataclass(frozen=True, kw_only=True)
class Hazard:
    """One row: what breaks, which interlock is to stop it, and, where one is set, within which time [s] and ticks."""

    what: str
    by: Fault
    tell: Telling
    within: float = math.inf
    ticks: int = TICKS
    stands: bool = False


WIDE = replace(LIMITS, travel=(math.inf, math.inf), speed=(math.inf, math.inf), saturation=1.0)
NO_TRAVEL = replace(LIMITS, travel=(math.inf,) * 2, speed=(10.0, math.inf))
NO_SPEED = replace(LIMITS, speed=(math.inf,) * 2)
TWISTED = Limits(
    travel=(math.inf,) * 2, speed=(math.inf,) * 2, start=(math.inf,) * 2, command=5.0, twist=math.radians(20),
)  # fmt: skip
SHAFT = make_rig("torsional", 2)
BY_THE_WALL = partial(killed, by_the_wall=True)
F = Fault


def _wraps(story: Story) -> None:
    """The pendulum, half a turn from where it was zeroed, is pushed over the end of its counter."""
    story.on.encoders.wrapped(1, 14)
    story.on.tap(5.0)


def _slips(channel: int, speed: float) -> Callable[[Story], None]:
    """An encoder loses so much a second [rad/s]."""

    def slips(story: Story) -> None:
        known = story.column.known
        story.on.encoders.slipping(channel, speed * known.per_unit[channel] * known.period)

    return slips


def _slow_tick(story: Story) -> None:
    """The board's tick takes twice its length, and only the host's clock knows."""
    story.on.port.ticks_long = 2
    story.beside.clock = lambda: story.on.port.true_time


def _disobeys(story: Story) -> None:
    """A tap, whose answer stays on the output whatever is written; then somebody stops the run."""
    story.on.tap(1.0)
    story.go(0.04)
    story.on.port.obeys = False
    story.beside.give_up(F.STOP, "Stopped by hand.")


SOUND = tuple(
    Hazard(what=f"nothing broken, a tap of {speed:g} rad/s", by=F(0), stands=True,
           tell=in_loop(lambda s: None, after=1.0, taps=speed)) for speed in (0.5, 1.0, 2.0)
)  # fmt: skip
ENCODERS = (
    Hazard(what="pendulum's encoder dead, moving", by=F.ENCODER | F.MODEL,
           tell=in_loop(lambda s: s.on.encoders.dead(1))),
    Hazard(what="pendulum's encoder dead, at rest, then a tap of 1 rad/s", by=F.ENCODER | F.MODEL | F.OVERTRAVEL,
           tell=in_loop(lambda s: s.on.encoders.dead(1), after=STILL, tilt=0.0, taps=1.0)),
    Hazard(what="arm's encoder dead, moving", by=F.ENCODER | F.MODEL,
           tell=in_loop(lambda s: s.on.encoders.dead(0))),
    Hazard(what="arm's encoder dead, at rest, then a tap of 1 rad/s", by=F.ENCODER | F.MODEL,
           tell=in_loop(lambda s: s.on.encoders.dead(0), after=STILL, tilt=0.0, taps=1.0)),
    Hazard(what="arm's encoder dead before the start", by=F.SELF_TEST,
           tell=at_start(lambda s: s.on.encoders.dead(0))),
    Hazard(what="pendulum's encoder dead before the start", by=F.SELF_TEST,
           tell=at_start(lambda s: s.on.encoders.dead(1))),
    Hazard(what="pendulum's sign flips, moving", by=F.MODEL | F.OVERTRAVEL | F.OVERSPEED,
           tell=in_loop(lambda s: s.on.encoders.scaled(1, -1.0))),
    Hazard(what="arm's sign flips, moving", by=F.MODEL | F.OVERTRAVEL,
           tell=in_loop(lambda s: s.on.encoders.scaled(0, -1.0))),
    Hazard(what="pendulum's sign wrong from the start", by=F.SELF_TEST,
           tell=at_start(lambda s: s.on.encoders.scaled(1, -1.0))),
    Hazard(what="pendulum's sign wrong, the pulse left out", by=F.MODEL | F.OVERTRAVEL,
           tell=at_start(lambda s: s.on.encoders.scaled(1, -1.0), check=False)),
    *(Hazard(what=f"{body}'s scale wrong by {factor:g}", by=F.SELF_TEST,
             tell=at_start(lambda s, i=i, factor=factor: s.on.encoders.scaled(i, factor)))
      for i, body in enumerate(("arm", "pendulum")) for factor in (2.0, 4.0)),
    *(Hazard(what=f"pendulum's scale wrong by {factor:g}, the pulse left out", by=F.START,
             tell=at_start(lambda s, factor=factor: s.on.encoders.scaled(1, factor), check=False))
      for factor in (2.0, 4.0)),
    *(Hazard(what=f"arm's scale wrong by {factor:g}, the pulse left out", by=F.MODEL | F.OVERTRAVEL | F.OVERSPEED,
             tell=at_start(lambda s, factor=factor: s.on.encoders.scaled(0, factor), check=False, tilt=0.1))
      for factor in (2.0, 4.0)),
    Hazard(what="pendulum loses 200 counts at once (4.5 degrees)", by=F.OVERSPEED | F.MODEL,
           tell=in_loop(lambda s: s.on.encoders.lost(1, 200))),
    *(Hazard(what=f"pendulum's encoder slips by {rate:g} deg/s", by=F.MODEL,
             tell=in_loop(_slips(1, math.radians(rate)), then=10.0)) for rate in (0.45, 1.1)),
    Hazard(what="pendulum loses 20 counts at once", by=F.MODEL, stands=True,
           tell=in_loop(lambda s: s.on.encoders.lost(1, 20))),
)  # fmt: skip
TIMES = (
    Hazard(what="stale: the same sample for ever", by=F.STALE, within=LIMITS.watchdog,
           tell=in_loop(lambda s: setattr(s.link, "lost", 1.0), link=True)),
    Hazard(what="loop late by 15 ms, once", by=F(0), stands=True, tell=silent(0.015)),
    Hazard(what="loop late by 50 ms", by=F.WATCHDOG, within=LIMITS.watchdog, tell=silent(0.05)),
)  # fmt: skip
LAWS = (
    Hazard(what="absurd gains (a million times)", by=F.GAINS,
           tell=at_start(law=lambda c: replace(c.law, D=1e6 * c.law.D))),
    Hazard(what="destabilizing gains (sign)", by=F.GAINS,
           tell=at_start(law=lambda c: replace(c.law, C=-c.law.C, D=-c.law.D))),
    Hazard(what="destabilizing gains, no model to ask", by=F.OVERTRAVEL | F.OVERSPEED | F.SATURATION,
           tell=pushed(runaway)),
)  # fmt: skip
LOST_NUMBERS = (
    Hazard(what="command NaN", by=F.GAINS, within=0.0,
           tell=at_start(law=turning_to(math.nan), check=False, tilt=0.0)),
    Hazard(what="command infinite", by=F.GAINS, within=0.0,
           tell=at_start(law=turning_to(math.inf), check=False, tilt=0.0)),
)  # fmt: skip
LIMITED = (
    Hazard(what="command at its limit for longer than 1 s, the rig held fast", by=F.SATURATION, within=1.0,
           tell=pushed(rising_to(6.0), held=True, limits=WIDE)),
    Hazard(what="over-travel", by=F.OVERTRAVEL, within=0.0, tell=pushed(rising_to(0.4), limits=NO_SPEED)),
    # the firmware measures a speed over 8 ticks, and the arm is faster by half of them when it is seen to be too fast
    Hazard(what="over-speed", by=F.OVERSPEED, within=0.0, ticks=TICKS + 4,
           tell=pushed(rising_to(5.0, within=0.05), limits=NO_TRAVEL)),
    Hazard(what="start 11.5 degrees off upright", by=F.START, tell=at_start(tilt=0.2)),
    Hazard(what="start with the arm 143 degrees from its zero, 115 allowed", by=F.START, tell=at_start(arm=2.5)),
)  # fmt: skip
ON_THE_TWIN = (
    *SOUND, *ENCODERS,
    Hazard(what="pendulum's counter wraps at 2^13", by=F.OVERSPEED | F.OVERTRAVEL | F.MODEL, tell=in_loop(_wraps)),
    *(Hazard(what=f"supply at {100 * share:.0f} %, then taps", by=F.MODEL,
             tell=in_loop(lambda s, share=share: setattr(s.on.port, "strength", share), taps=1.0))
      for share in (0.5, 0.3)),
    Hazard(what="the board's tick takes twice its length", by=F.MODEL,
           tell=in_loop(_slow_tick, first=lambda s: setattr(s.beside, "clock", lambda: s.on.port.true_time))),
    Hazard(what="the drive does not obey: zero and power off do nothing, stopped by hand", by=F.MODEL,
           tell=in_loop(_disobeys)),
    *TIMES,
    Hazard(what="host killed (-9)", by=F.WATCHDOG, within=LIMITS.watchdog, tell=silent(1.0)),
    Hazard(what="link cut", by=F.WATCHDOG, within=LIMITS.watchdog,
           tell=in_loop(lambda s: setattr(s.link, "cut", True), link=True)),
    *(Hazard(what=f"{100 * share:g} % of the frames corrupted", by=F.MODEL | F.STALE | F.WATCHDOG, stands=True,
             tell=in_loop(lambda s, share=share: setattr(s.link, "lost", share), link=True)) for share in (0.01, 0.3)),
    *LOST_NUMBERS, *LAWS, *LIMITED,
    Hazard(what="shaft twisted beyond 20 degrees", by=F.TWIST, within=0.0,
           tell=pushed(rising_to(4.0), limits=replace(TWISTED, command=10.0), apart=True, truth=SHAFT)),
    Hazard(what="disk full while logging", by=F(0), stands=True, tell=logs.full_disk),
    Hazard(what="power lost in the middle of a log", by=F(0), stands=True, tell=logs.power_loss),
)  # fmt: skip
COUNTERS = (
    Hazard(what="both counters run over, at 2^31 and 2^32, where the rig is held", by=F(0), stands=True,
           tell=in_loop(lambda s: None, first=board.runs_over)),
    Hazard(what="a transition that no encoder makes", by=F.ENCODER, within=0.0, tell=in_loop(board.says("illegal"))),
)  # fmt: skip
STARTED_ANEW = (
    Hazard(what="board starts anew (a dip of its supply)", by=F.RESET, within=0.0, tell=in_loop(board.starts_anew)),
    Hazard(what="board starts anew, and hears all of the run again", by=F.RESET, within=0.0,
           tell=in_loop(board.hears_it_all_again(reset=True), after=0.3)),
    Hazard(what="stopped, the board hears all of the run again", by=F.RESET, within=0.0,
           tell=in_loop(board.hears_it_all_again(reset=False), after=0.3)),
)  # fmt: skip
CUT = Hazard(what="link cut", by=F.WATCHDOG, within=LIMITS.watchdog, tell=in_loop(lambda s: s.on.cut()))
CORRUPTED = tuple(
    Hazard(what=f"1 of {1 / chance:,.0f} bytes corrupted, both ways", by=F.WATCHDOG | F.STALE, stands=True,
           tell=board.corrupted(chance, seconds)) for chance, seconds in
    ((1e-6, 30.0), (1e-5, 15.0), (1e-4, 4.0), (1e-3, 4.0), (1e-2, 4.0))
)  # fmt: skip
ON_FIRMWARE = (
    *SOUND, *ENCODERS, *COUNTERS, *TIMES,
    Hazard(what="15 ticks of the board never come", by=F(0), stands=True, tell=in_loop(board.says("skip 15"))),
    Hazard(what="25 ticks of the board never come", by=F.OVERRUN, within=0.025, tell=in_loop(board.says("skip 25"))),
    Hazard(what="a tick comes due during the one before", by=F.OVERRUN, within=0.0,
           tell=in_loop(board.says("overrun"))),
    Hazard(what="host killed (-9), then time is let pass", by=F.WATCHDOG, within=LIMITS.watchdog, tell=killed),
    Hazard(what="host killed (-9), by the clock on the wall", by=F.WATCHDOG, within=LIMITS.watchdog,
           ticks=10, tell=BY_THE_WALL),
    CUT,
    *CORRUPTED,
    Hazard(what="full command that waited for 50 ms in a buffer", by=F.STALE, within=0.0,
           tell=in_loop(board.in_a_buffer)),
    *STARTED_ANEW,
    Hazard(what="3 requests in a row do not arrive", by=F(0), stands=True, tell=in_loop(board.missed(3))),
    Hazard(what="5 requests in a row do not arrive", by=F.WATCHDOG, within=LIMITS.watchdog,
           tell=in_loop(board.missed(5))),
    *LAWS,
    Hazard(what="NaN for a command, past the supervisor", by=F.GAINS, within=0.0, tell=in_loop(board.no_number)),
    *LIMITED,
    Hazard(what="arm and pendulum 20 degrees apart, where they are a shaft's ends", by=F.TWIST, within=0.0,
           tell=pushed(rising_to(1.0), limits=TWISTED, apart=True)),
)  # fmt: skip
ON_THE_BOARD = (
    *ON_FIRMWARE,
    Hazard(what="NaN for a gain, past the supervisor", by=F.GAINS, within=0.0,
           tell=board.past_supervisor(lambda law: law, board.without_numbers)),
    Hazard(what="absurd gains (a million times), past the supervisor", by=F.GAINS, within=0.0,
           tell=board.past_supervisor(lambda law: replace(law, D=1e6 * law.D))),
    Hazard(what="gains beyond all numbers of 32 bits, past the supervisor", by=F.GAINS, within=0.0,
           tell=board.past_supervisor(lambda law: replace(law, D=1e60 * law.D))),
    Hazard(what="destabilizing gains (sign), past the supervisor", by=F.OVERTRAVEL | F.OVERSPEED | F.SATURATION,
           tell=board.past_supervisor(lambda law: replace(law, C=-law.C, D=-law.D))),
)  # fmt: skip
IN_SILICON = (
    SOUND[1],
    Hazard(what="processor hangs, interrupts off", by=F.RESET, within=0.015, tell=in_loop(board.hangs)),
    *STARTED_ANEW,
    *(h for h in ENCODERS if h.what.endswith(("dead, moving", "flips, moving"))),
    *COUNTERS,
    Hazard(what="loop late by 50 ms", by=F.WATCHDOG, within=LIMITS.watchdog, tell=silent(0.05)),
    CUT,
    *CORRUPTED,
)
COLUMNS = (
    Column(name="twin", known=twin.KNOWN, make=twin.TwinHazards),
    Column(name="firmware, loop on the host", known=firmware.KNOWN, make=firmware.host_port, unable=firmware.no_host),
    Column(name="firmware, loop on the board", known=firmware.KNOWN, make=firmware.host_port, loop=Mode.MCU,
           unable=firmware.no_host),
    Column(name="ATmega2560 in simavr, loop on the host", known=firmware.KNOWN, make=firmware.atmega2560,
           unable=firmware.no_avr),
    Column(name="ATmega2560 in simavr, loop on the board", known=firmware.KNOWN, make=firmware.atmega2560,
           loop=Mode.MCU, unable=firmware.no_avr),
)  # fmt: skip
HAZARDS = dict(zip(COLUMNS, (ON_THE_TWIN, ON_FIRMWARE, ON_THE_BOARD, IN_SILICON, IN_SILICON), strict=True))
"""What is done to which rig."""


def judged(hazard: Hazard, column: Column, found: Happened) -> Line:
    """A row as a line of the benchmark: reached when a right interlock stopped it, in its time."""
    stopped = found.zero_after is not None or found.stopped_by != "none needed"
    right = hazard.stands and not stopped
    right = right or any(f.name in found.stopped_by.split(" | ") for f in Fault if f in hazard.by)
    after = 0.0 if found.zero_after is None else float(found.zero_after)  # numpy.False_ is not False
    within = hazard.within + (hazard.ticks + 1e-6) * column.period if right else -1.0
    return Line(
        contender=f"{column.name}: {hazard.what}",
        seconds=(after, after, after),
        target=Target(most=within, of="seconds"),
        note=f"{found.stopped_by}; arm {math.degrees(found.arm):.1f} deg; {found.told}",
    )


def run(*, quick: bool, progress: Callable[[str], None], markdown: Path | None = None) -> list[Line]:
    """Break everything in turn, on every column that can run here; `quick`, every 48th thing."""
    lines: list[Line] = []
    body: list[str] = []
    late: list[str] = []
    for column, hazards in HAZARDS.items():
        body += ["", f"## {column.name[0].upper()}{column.name[1:]}", ""]
        if reason := column.unable():
            lines.append(Line(contender=column.name, note=f"left out: {reason}"))
            body.append(f"Left out: {reason}.")
            continue
        body += HEAD
        for hazard in hazards[:: 48 if quick and markdown is None else 1]:
            progress(f"{column.name}: {hazard.what}")
            try:
                found = hazard.tell(column)
            except Unavailable as why:
                lines.append(Line(contender=f"{column.name}: {hazard.what}", note=f"left out: {why}"))
                body.append(f"| {hazard.what} | left out | | | | {why} |")
                continue
            lines.append(judged(hazard, column, found))
            body.append(written(hazard, found, lines[-1].reached is not False))
            if found.overran:
                after = 1e3 * (found.zero_after or 0.0)
                late.append(f"- {column.name}: {hazard.what} ({found.stopped_by} after {after:.0f} ms)")
    if markdown:
        missed = [f"- {line.contender} ({line.note})" for line in lines if line.reached is False]
        travel = f"{math.degrees(LIMITS.travel[0]):.0f} degrees"
        last = [
            "",
            "## Not as required",
            "",
            *(missed or ["Every hazard was stopped by its interlock and in time."]),
            "",
        ]
        if late:
            last += [
                f"Stopped by the right interlock, but the arm passed its travel limit of {travel}, driven or coasting:",
                "",
                *late,
            ]
        judged_lines = [line for line in lines if line.reached is not None]
        result = headline(len(judged_lines) - len(missed), len(judged_lines))
        markdown.write_text(page("safety", "Safety", __doc__, [*body, *last], result), encoding="utf-8")
    return lines


def headline(right: int, cases: int) -> str:
    """The result in a sentence."""
    return f"{right} of {cases} cases ended as required."


HEAD = (
    "| hazard | stopped by | zero after | arm | lean | message |",
    "|---|---|--:|--:|--:|---|",
)


def written(hazard: Hazard, found: Happened, right: bool) -> str:
    """A row of the page."""
    after = "–" if found.zero_after is None else f"{1e3 * found.zero_after:.0f} ms"
    if "refused" in found.told or "START" in found.stopped_by or "SELF_TEST" in found.stopped_by:
        after = "never on" if not found.arm else after
    arm = f"{math.degrees(found.arm):.1f}°" if found.arm else "–"
    lean = f"{math.degrees(found.lean):.1f}°" if found.lean else "–"
    by = found.stopped_by.replace(" | ", ", ") + ("" if right else " **(not as required)**")
    return f"| {hazard.what} | {by} | {after} | {arm} | {lean} | {found.told} |"
