"""A host that dies, is stopped or loses its board at a moment of a run, and how long the drive is on after that.

The firmware runs as a process by the clock on the wall at the end of a pty; a program runs a blind command on it in a
loop's process of its own, as `upright run` does. What the drive did is counted by the board, tick by tick.
"""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass
from functools import partial
from pathlib import Path

from benchmarks.boards import Board, rig_on
from benchmarks.measure import Unavailable
from upright.laws import as_values
from upright.realtime.process import DEAF, run_in_process
from upright.realtime.session import RunOrder, Stage
from upright.rigs import Limits, Mode
from upright.rigs.supervisor import Duty, Supervisor
from upright.running.rig import excitation_law

LIMITS = Limits(travel=(9.0, 9.0), speed=(9.0, 9.0), start=(1.0, 1.0), command=5.0, watchdog=0.05)
PATIENCE = 1.0
"""That an armed board has with its host, at zero command (firmware/ceilings.h) [s]."""
SETTLED = 0.15
"""After what happened the board is looked at for longer than any interlock takes [s]."""
LONGEST, POLL = 30.0, 5e-4
TRIES = 5
"""A busy machine may stop a run by itself before it comes to its moment."""
_PAUSE = threading.Event()


@dataclass(frozen=True, kw_only=True)
class Moment:
    """A state of host and board: whether a pulse is given, who runs the loop, and the board's mode, known by itself or
    after a loop; without a mode it is any time since the program began. By `after` a command is put out [s].
    """

    name: str
    mode: Mode | None
    after: float = 0.0
    loop: Mode = Mode.HOST
    check: bool = False
    over: bool = False

    def comes(self, modes: set[int]) -> bool:
        """Whether a run that was seen in these modes may be there."""
        return not self.over or bool(modes & _LOOPS)


_LOOPS = {int(Mode.HOST), int(Mode.MCU)}
STARTING = Moment(name="starting", mode=None, check=True)
MOMENTS = (
    Moment(name="starting, IDLE", mode=Mode.IDLE),
    Moment(name="ARMED, a pulse", mode=Mode.ARMED, after=0.03, check=True),
    Moment(name="running, HOST", mode=Mode.HOST, after=0.1),
    Moment(name="running, MCU", mode=Mode.MCU, after=0.1, loop=Mode.MCU),
    Moment(name="stopping, FAULT", mode=Mode.FAULT, over=True),
    Moment(name="stopping, IDLE", mode=Mode.IDLE, over=True),
)


class Program:
    """A program that runs a command on a board, its loop's process, and the board itself."""

    def __init__(self, firmware: Path, moment: Moment, folder: Path, seconds: float) -> None:
        self.board = Board(firmware)
        self._process = subprocess.Popen(
            [sys.executable, "-m", __name__, self.board.port, moment.loop.name, str(int(moment.check)), str(seconds),
             str(folder / "run.mcap")],
            cwd=Path(__file__).parents[2], stdout=subprocess.PIPE, text=True, start_new_session=True,
        )  # fmt: skip
        self.loop = 0

    def started(self) -> None:
        """Wait until the loop's process has begun to make its rig."""
        assert self._process.stdout is not None
        self.loop = int(self._process.stdout.readline() or 0)

    def gone(self) -> None:
        """Wait until every process of it has ended by itself."""
        assert self._process.stdout is not None
        self._process.stdout.read()  # comes to its end with the last one that could write

    def kill_parent(self) -> None:
        self._process.kill()

    def kill_loop(self) -> None:
        os.kill(self.loop, signal.SIGKILL)

    def stop_parent(self) -> None:
        self._process.send_signal(signal.SIGSTOP)

    def stop_loop(self) -> None:
        os.kill(self.loop, signal.SIGSTOP)

    def hang_up(self) -> None:
        """The terminal is closed: every process of its session hears of it."""
        os.killpg(self._process.pid, signal.SIGHUP)

    def suspend(self) -> None:
        """Ctrl-Z."""
        os.killpg(self._process.pid, signal.SIGTSTP)

    def cut(self) -> None:
        self.board.do("cut")

    def reset(self) -> None:
        self.board.do("reset")

    def power_dips(self) -> None:
        """The board is without power for 50 ms, a resistor at its enable line, and comes back."""
        self.board.do("cut", "reset")
        _PAUSE.wait(0.05)
        self.board.do("reset", "join")

    def goes_on(self) -> None:
        """Whatever was stopped."""
        with suppress(ProcessLookupError):
            os.killpg(self._process.pid, signal.SIGCONT)

    def end(self) -> None:
        with suppress(ProcessLookupError):
            os.killpg(self._process.pid, signal.SIGKILL)
        self._process.wait()
        assert self._process.stdout is not None
        self._process.stdout.close()
        self.board.close()


WHOLE, OUT_OF_SIGHT = "kill -9 of the program", "SIGSTOP of the program"
WAYS: dict[str, Callable[[Program], None]] = {
    WHOLE: Program.kill_parent,
    "kill -9 of its loop": Program.kill_loop,
    OUT_OF_SIGHT: Program.stop_parent,
    "SIGSTOP of its loop": Program.stop_loop,
    "SIGHUP, the terminal is closed": Program.hang_up,
    "SIGTSTP, Ctrl-Z": Program.suspend,
    "the cable is pulled": Program.cut,
    "the board is reset": Program.reset,
    "the board's power dips": Program.power_dips,
}


@dataclass(frozen=True, kw_only=True)
class Death:
    """What the drive did after it [s]: until when a command was put out and the power stage on, and whether it is on.

    `at_once` is for how long others kept the board itself, a process here, from its ticks.
    """

    moment: Moment
    way: str
    driven: float
    powered: float
    at_once: float
    on: bool

    @property
    def longest(self) -> tuple[float, float]:
        """How long a command and the power stage may be on by the interlocks that are made for it [s]."""
        driven = (DEAF if self.way == OUT_OF_SIGHT else LIMITS.watchdog) + self.at_once
        return driven, max(driven, PATIENCE + self.at_once if self.moment.mode == Mode.ARMED else 0.0)

    @property
    def safe(self) -> bool:
        """Whether the drive was off in time, and stayed off."""
        driven, powered = self.longest
        return self.driven <= driven and self.powered <= powered and not self.on


def die(firmware: Path, moment: Moment, way: str, after: float | None = None) -> Death:
    """Let a run come to a moment, and what dies die, some time after it began [s].

    Raises
    ------
    Unavailable
        When the machine is too busy for a run to come there.
    """
    for _ in range(TRIES):
        with tempfile.TemporaryDirectory() as folder:
            program = Program(firmware, moment, Path(folder), 0.1 if moment.over else 20.0)
            try:
                if _brought(program, moment, moment.after if after is None else after):
                    return _dead(program, moment, way)
            finally:
                program.end()
    raise Unavailable(f"the machine is too busy: {TRIES} runs did not come to '{moment.name}'")


def _brought(program: Program, moment: Moment, after: float) -> bool:
    if moment.mode is None:
        _PAUSE.wait(after)
        return True
    program.started()
    modes, last = set[int](), time.monotonic() + LONGEST
    while time.monotonic() < last:
        mode = int(program.board.state()[7])
        modes.add(mode)
        if mode == moment.mode and moment.comes(modes):
            _PAUSE.wait(after)
            return int(program.board.state()[7]) == moment.mode
        if mode in _LOOPS and moment.mode == Mode.FAULT:
            program.board.do("illegal")
        if mode == Mode.FAULT and modes & _LOOPS:
            return False
        _PAUSE.wait(POLL)
    return False


def _dead(program: Program, moment: Moment, way: str) -> Death:
    board = program.board
    WAYS[way](program)
    then = _power(board)
    if way == WHOLE:
        program.gone()
    longest = DEAF if way == OUT_OF_SIGHT else PATIENCE if moment.mode == Mode.ARMED and way != WHOLE else 0.0
    _PAUSE.wait(SETTLED + longest)
    if moment.mode != Mode.IDLE or moment.over:  # a program that was stopped before it armed arms when it goes on
        program.goes_on()
        _PAUSE.wait(SETTLED)
    now = _power(board)
    return Death(
        moment=moment, way=way, driven=max(0.0, 1e-3 * (now[1] - then[0])),
        powered=max(0.0, 1e-3 * (now[2] - then[0])), at_once=1e-3 * now[3], on=bool(board.state()[6]),
    )  # fmt: skip


def _power(board: Board) -> list[int]:
    return [int(number) for number in board.say("power").split()]


def stage(port: str) -> Stage:
    """A run on a board, which says the loop's process by its number."""
    print(os.getpid(), flush=True)
    rig = rig_on(port, lockstep=False, patience=1.0)
    beside = Supervisor(rig, Duty(limits=LIMITS))
    return Stage(supervisor=beside, bring=lambda: None, let_go=lambda: None, units=("rad", "rad"))


def program(port: str, loop: str, check: str, seconds: str, log: str) -> None:
    """Put 1 V out."""
    law = excitation_law([1.0], 2, 1e-3)
    order = RunOrder(make=partial(stage, port), law=as_values(law), seconds=float(seconds), log=Path(log),
                     mode=Mode[loop], check=check == "1", fifo=False)  # fmt: skip
    run_in_process(order)


if __name__ == "__main__":
    program(*sys.argv[1:])
