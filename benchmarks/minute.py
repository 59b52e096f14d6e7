"""Is a minute on the ATmega2560 the same each time, to the last bit, and how long is its longest tick?

Its own program under simavr, from encoder edges to frames of its converter, holds a Furuta pendulum that is tapped
every 3 s, once with the loop on the board and once on the host. Each is run twice: all samples (tick, counts, command)
are compared. A last row has the largest law that a board takes, a Kalman observer of four states. Time is virtual; a
tick has 16,000 cycles, and the longest is that of the processor from its interrupt to its return, whatever wire and
encoders do meanwhile.
"""

from __future__ import annotations

import tempfile
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from benchmarks.boards import COUNTS, STEP, Board, build, plant
from benchmarks.designs import GAIN, LIMITS, PARAMETERS, inverted, observed
from benchmarks.measure import Line, Target
from upright.laws import Law
from upright.rigs import Mode
from upright.rigs.serial import SerialRig

SECONDS, QUICK, LARGE = 60.0, 3.0, 6.0
UPRIGHT = plant(PARAMETERS, GAIN, theta=np.pi)
KICKS = {float(t): (-1) ** t * 0.8 for t in range(2, 60, 3)}
"""Speed that a tap adds to the pendulum [rad/s], by time [s]."""
CLOCK, TICK = 16e6, 16_000
"""Cycles of the processor, in a second and in a tick."""
MOST = 0.7
"""Share of a tick that the longest may take: the rest is for wire and encoders."""


def run(*, quick: bool, progress: Callable[[str], None]) -> list[Line]:
    """Both loops; reached when nothing differs, no tick is lost and the longest is short enough."""
    with tempfile.TemporaryDirectory(prefix="upright-firmware-") as name:
        folder = Path(name)
        if reason := build("avr", folder, "avr-gcc") or build("simrig", folder, "cc simavr"):
            return [Line(contender="ATmega2560 in simavr", note=f"left out: {reason}")]
        lines: list[Line] = []
        for mode in (Mode.MCU, Mode.HOST):
            progress(mode.name)
            where = f"loop on the {'board' if mode == Mode.MCU else 'host'}"
            lines.append(_line(folder, where, mode, inverted(), QUICK if quick else SECONDS, most=MOST))
        progress("observer")
        lines.append(_line(folder, "observer on the board", Mode.MCU, observed(), LARGE, most=1.0))
    return lines


def _line(folder: Path, what: str, mode: Mode, law: Law, seconds: float, *, most: float) -> Line:
    runs: list[NDArray[np.int64]] = []
    lost, longest = 0, 0.0
    for _ in range(2):
        board = Board(folder / "simrig", folder / "atmega2560-analog.elf", *UPRIGHT)
        rows, rig = held(board, mode, law, seconds, KICKS, lockstep=True)
        runs.append(rows)
        lost, longest = lost + rig.snapshot().lost, max(longest, board.state()[7])
        board.close()
    same = np.array_equal(runs[0], runs[1])
    return Line(
        contender=f"{seconds:g} s, {what}",
        seconds=(longest / CLOCK, longest / CLOCK, longest / CLOCK),
        target=Target(most=most * TICK / CLOCK if same and not lost else -1.0, of="seconds"),
        note=f"{len(runs[0])} samples, twice {'the same to the last bit' if same else 'not the same'}; {lost} ticks "
        f"lost; longest tick {longest:.0f} of {TICK} cycles",
    )


def on_the_host(law: Law) -> Callable[[tuple[int, ...]], float]:
    """The law sample by sample in double precision, as a loop on the host has it; a function of counts."""
    target = np.broadcast_to(np.asarray(law.target), 2)
    assert law.begin is not None
    begin, z = law.begin, None

    def step(counts: tuple[int, ...]) -> float:
        nonlocal z
        w = np.array(counts) / COUNTS - target
        if z is None:
            z = begin @ w
        u = float((law.C @ z + law.D @ w)[0])
        z = law.A @ z + law.B @ w
        return u

    return step


def held(
    board: Board, mode: Mode, law: Law, seconds: float, kicks: Mapping[float, float], **how: Any
) -> tuple[NDArray[np.int64], SerialRig]:
    """Samples (tick, counts, steps applied) of a run that is kicked, and the rig afterwards."""
    rig = board.rig(**how)
    rig.open()
    rig.clear_fault()
    rig.configure(LIMITS)
    rig.zero()
    rig.arm()
    rig.start(mode, law if mode == Mode.MCU else None)
    step, command = on_the_host(law), 0.0
    tick = first = rig.exchange(0.0)
    to_come, rows = sorted(kicks), list[tuple[int, ...]]()
    while tick.time - first.time < seconds:
        if to_come and tick.time - first.time >= to_come[0]:
            board.do(f"kick {kicks[to_come.pop(0)]!r}")
        tick = rig.exchange(command)
        assert tick.mode == mode, tick
        rows.append((tick.tick - first.tick, *tick.counts, round(tick.applied / STEP)))
        if mode == Mode.HOST:
            command = step(tick.counts)
    return np.array(rows), rig
