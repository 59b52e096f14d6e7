"""A host in a process of its own, killed with -9 in the middle of its loop; what it leaves is the board's affair.

Nobody passes time on the board but the host that lives: when it is dead, the board's ticks are let pass one by one. By
the clock on the wall they pass by themselves, and whoever looks polls.
"""

from __future__ import annotations

import signal
import subprocess
import sys
import threading
from pathlib import Path

from benchmarks.boards import rig_on
from benchmarks.hazards.firmware import KNOWN, host_port
from benchmarks.hazards.story import COAST, STIRRED, Column, Happened, Story, reckoned
from benchmarks.measure import Unavailable
from upright.errors import RigStopped
from upright.rigs import Fault, Mode
from upright.rigs.supervisor import Supervisor

_PAUSE = threading.Event()
READY = "holds it"
LEANING = 0.02
"""As little as a slow start of the host lets grow [rad]."""
TRIES = 5
"""A busy machine may stop the loop before it is killed."""


def host(path: str, loop: Mode, lockstep: bool) -> None:
    """Hold the rig at the end of a pty until killed."""
    column = Column(name="", known=KNOWN, make=host_port, loop=loop)
    beside = Supervisor(rig_on(path, lockstep=lockstep), column.duty)
    beside.prepare(zero=False)
    beside.aim(column.law)
    print(READY, flush=True)
    input()
    beside.start(loop)
    tick = beside.rig.exchange(0.0)
    while True:
        tick = beside.rig.exchange(beside.step(tick))


def killed(column: Column, *, by_the_wall: bool = False) -> Happened:
    """What the board does when its host dies, and what it tells the next one."""
    for _ in range(TRIES):
        story = Story(column, by_the_wall=by_the_wall)
        on = story.on
        story.beside.prepare()  # zeroes the encoders
        story.beside.target = (0.0, KNOWN.plant.equilibrium("inverted")["theta"])
        on.rig.close()
        on.lift(LEANING)
        command = [sys.executable, "-m", __name__, on.board.port, column.loop.name, str(not by_the_wall)]
        folder = Path(__file__).parents[2]
        with subprocess.Popen(
            command, cwd=folder, text=True, stdin=subprocess.PIPE, stdout=subprocess.PIPE
        ) as child:  # fmt: skip
            assert child.stdin is not None
            assert child.stdout is not None
            if READY not in child.stdout.readline():
                raise RuntimeError("the host that was to be killed did not start")
            on.let_go()
            print(file=child.stdin, flush=True)
            first = on.look()
            while child.poll() is None and on.look() < first + 1e3 * STIRRED:
                _PAUSE.wait(0.01)  # a host by the clock on the wall needs the processor
            ran = on.board.state()[7] == column.loop
            story.breaks()
            child.send_signal(signal.SIGKILL)
            child.wait()
        if not by_the_wall:
            on.look()
            on.look()  # what the dead host had written is heard between the two
            story.breaks()
        on.silence(COAST)
        try:
            on.rig = story.beside.rig = on.rejoin()
            story.beside.prepare()
            story.told = "nothing"
        except RigStopped as stop:
            story.told = str(stop)
        done = reckoned(story, story.beside.faults & ~Fault.RESET)
        on.close()
        if ran:
            return done
    raise Unavailable(f"the machine is too busy: the loop stopped {TRIES} times before its host was killed")


if __name__ == "__main__":
    host(sys.argv[1], Mode[sys.argv[2]], sys.argv[3] == "True")
