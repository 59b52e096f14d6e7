"""What breaks on a board and between board and host: what only firmware has, or only firmware can be given."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np

from benchmarks.hazards.story import SAFE, Column, Happened, Story, Telling, in_loop
from upright.errors import RigStopped
from upright.rigs import Mode
from upright.rigs.board import fault_text
from upright.rigs.onboard import OnboardLaw, onboard
from upright.rigs.wire import Kind, exchange, pack

HALF_TURN = 8000
"""Counts from hanging to upright."""
BOOTED = 0.01
"""By which a board that starts anew ticks [s]."""
HUNG = 0.03
"""Longer than the processor's own watchdog takes [s]."""


def corrupted(chance: float, seconds: float = 4.0) -> Telling:
    """One bit of each spoiled byte is flipped, both ways."""

    def spoil(story: Story) -> None:
        story.on.line.spoils = chance

    def note(story: Story) -> str:
        """How much was spoiled, and that the board and the host noticed all of it."""
        line = story.on.line
        return f" ({line.spoiled} bytes spoiled, {1e3 * line.waited:.0f} ms waited for answers to repeated requests)"

    return in_loop(spoil, then=seconds, note=note)


def missed(requests: int) -> Callable[[Story], None]:
    """The next requests do not arrive."""

    def miss(story: Story) -> None:
        story.on.line.loses = requests

    return miss


def runs_over(story: Story) -> None:
    """Both counters reach the ends of their numbers where the rig is held."""
    story.on.encoders.at(0, 2**31)
    story.on.encoders.at(1, 2**32 - HALF_TURN)


def says(line: str, *, ticks: int = 0) -> Callable[[Story], None]:
    """A line to the simulated board; the host sees the sample after it."""

    def say(story: Story) -> None:
        story.on.board.do(line)
        story.tick = story.beside.rig.exchange(story.beside.step(story.tick)) if ticks == 0 else story.tick

    return say


def hangs(story: Story) -> None:
    """The processor stops; by the time it is heard of again, it was reset."""
    story.on.board.do("hang")
    story.on.silence(HUNG)
    story.tick = story.beside.rig.exchange(0.0)


def starts_anew(story: Story) -> None:
    """The board's supply dips, and comes back at once."""
    story.on.board.do("reset")
    story.on.silence(BOOTED)
    story.tick = story.beside.rig.exchange(0.0)


def hears_it_all_again(*, reset: bool) -> Callable[[Story], None]:
    """All that the host sent until now comes again, greeting, ARM and START included, to a board that was stopped."""

    def again(story: Story) -> None:
        sent = list(story.on.line.sent)
        if reset:
            story.on.board.do("reset")
            story.on.silence(BOOTED)
        else:
            story.beside.rig.stop()
        for frame in sent:
            story.on.line.write(frame)
            story.on.line.read(0.0)
        story.tick = story.beside.rig.exchange(0.0)

    return again


def in_a_buffer(story: Story) -> None:
    """Full command, which answers a sample of long ago, comes out of a buffer on its way."""
    old = story.tick.tick
    story.go(0.05)
    story.breaks()
    story.on.line.write(pack(Kind.EXCHANGE, 0, story.on.rig.session, exchange(16_000.0, old)))
    story.tick = story.beside.rig.exchange(0.0)


def no_number(story: Story) -> None:
    """NaN for a command, or a reference, past the supervisor."""
    story.tick = story.beside.rig.exchange(math.nan)


def past_supervisor(law: Callable[[Any], Any], sent: Callable[[OnboardLaw], OnboardLaw] | None = None) -> Telling:
    """A law that the supervisor would refuse is sent to the board all the same; `sent` changes its bytes."""

    def tell(column: Column) -> Happened:
        story = Story(column)
        beside, on = story.beside, story.on
        beside.prepare()
        on.lift(0.08)
        bad = law(beside.aim(column.law))
        on.rig.arm()
        story.breaks()
        try:
            if sent:
                body = sent(onboard(bad, beside.about, beside.about.period)).body()
                on.line.write(pack(Kind.LAW, 0, on.rig.session, body))
            else:
                on.rig.start(Mode.MCU, bad)
            on.let_go()
            for _ in range(round(4.0 / column.period)):
                story.tick = on.rig.exchange(0.0)
                if story.tick.faults:
                    raise RigStopped(f"{beside.about.name} stopped itself: {fault_text(story.tick.faults)}.")
            story.told = SAFE
        except RigStopped as stop:
            story.told = str(stop)
            story.tick = on.rig.exchange(0.0)
        return story.end()

    return tell


def without_numbers(law: OnboardLaw) -> OnboardLaw:
    """NaN for one of its gains, which no `Law` may hold."""
    matrix = law.matrix.copy()
    matrix[-1, 4] = np.nan
    return replace(law, matrix=matrix)
