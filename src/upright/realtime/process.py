"""A run in a process of its own: nothing that the parent does, draws or collects makes a tick late.

The child shows how it goes in shared memory, reads one flag that asks it to stop, and zeroes its rig when its parent is
gone: an orphan that goes on driving a rig is the worst that can happen here. Its parent is the process whose id was
sent with the run, since one that dies while the child still starts is no longer there to be looked up.
"""

from __future__ import annotations

import multiprocessing
import os
import pickle
import sys
import time
import traceback
from collections.abc import Callable
from multiprocessing.connection import Connection, wait
from typing import Any

from upright.errors import BadInput, RigStopped, UprightError
from upright.laws import of_values
from upright.realtime.desk import Desk
from upright.realtime.interrupts import ENDING, ignoring
from upright.realtime.pace import Pace, Virtual, WallClock
from upright.realtime.priority import step_forward
from upright.realtime.session import RunEnd, RunOrder, RunState, carry_out
from upright.rigs.protocol import Capabilities, Fault, Mode

_READINGS = 8
_FIELDS = 8
_POLL = 0.05  # s between two looks of the parent
DEAF = 2.0
"""How long the parent may not look before the loop ends, since nobody can stop it then [s]: it was itself stopped, or
waits for a terminal that takes nothing more."""
_PR_SET_PDEATHSIG = 1  # of linux/prctl.h
BY_HAND = "Stopped by hand."


class _Window:
    """State of a run in shared memory, one writer: a number that is odd while it is written, then the state."""

    def __init__(self, memory: Any, phase: Any) -> None:
        self._memory, self._phase = memory, phase

    def put(self, state: RunState) -> None:
        m = self._memory
        m[0] += 1
        m[1:_FIELDS] = (
            state.time, state.tick, state.late, int(state.mode), int(state.faults), state.command, state.applied,
        )  # fmt: skip
        m[_FIELDS] = len(state.readings)
        m[_FIELDS + 1 : _FIELDS + 1 + len(state.readings)] = state.readings[:_READINGS]
        if state.phase != self._last:
            self._last = state.phase
            self._phase.value = state.phase.encode()[:200]
        m[0] += 1

    _last = ""

    def get(self) -> RunState:
        while True:
            before = self._memory[0]
            m = list(self._memory)
            if before == self._memory[0] and before % 2 == 0:
                break
        n = int(m[_FIELDS])
        return RunState(
            phase=self._phase.value.decode(errors="replace"), time=m[1], tick=int(m[2]), late=int(m[3]),
            mode=Mode(int(m[4])), faults=Fault(int(m[5])), command=m[6], applied=m[7],
            readings=tuple(m[_FIELDS + 1 : _FIELDS + 1 + n]),
        )  # fmt: skip


def run_in_process(
    order: RunOrder, *, watch: Callable[[RunState], str] = lambda _: "", paced: bool = True, desk: Desk | None = None
) -> RunEnd:  # fmt: skip
    """Run a law on a rig in a process of its own.

    Parameters
    ----------
    watch : callable
        Shown the state some twenty times a second; answers with a sentence when it wants the run to end.
    paced : bool
        Whether ticks wait for the clock on the wall; twins and replays can do without.
    desk : Desk, optional
        Where every tick is shown, and from where the run can be stopped, tapped and given other gains.

    Raises
    ------
    UprightError
        That the run ended with before it began.
    """
    context = multiprocessing.get_context("spawn")
    try:
        pickle.dumps(order)
    except (pickle.PicklingError, AttributeError, TypeError) as error:
        raise BadInput(f"this run cannot be sent to a process of its own ({error}); run it inline.") from None
    memory = context.RawArray("d", _FIELDS + 1 + _READINGS)
    phase = context.RawArray("c", 201)
    stop, looks = context.RawValue("b", 0), context.RawValue("q", 0)
    ours, theirs = context.Pipe(duplex=False)
    child = context.Process(
        target=_child, args=(os.getpid(), order, memory, phase, stop, looks, theirs, paced, desk), name="upright loop"
    )
    with ignoring():  # Ctrl-C reaches a whole group of processes; the child is stopped by its flag
        child.start()
    theirs.close()
    window = _Window(memory, phase)
    answer: Any = None
    try:
        while not wait([ours, child.sentinel], _POLL):
            looks.value += 1
            _ask(stop, watch, window)
        answer = ours.recv() if ours.poll(1.0) else None
    except EOFError:
        answer = None
    except KeyboardInterrupt:
        with ignoring():  # a second one must not lose the verdict
            stop.value = 1
            answer = _last(ours)
    finally:
        with ignoring():
            stop.value = 1
            child.join(10.0)
            if child.is_alive():
                child.kill()
                child.join()
            ours.close()
    if isinstance(answer, UprightError):
        raise answer
    if isinstance(answer, RunEnd):
        return answer
    if isinstance(answer, str):
        raise RuntimeError(f"the loop's process failed:\n{answer}")
    state = window.get()
    return RunEnd(
        ticks=state.tick, late=state.late, passed=max(0, state.late - state.tick),  # at least
        stopped=f"The loop's process was killed (code {child.exitcode}) {state.time:.3g} s into the run; the rig's own "
        "watchdog zeroes its command. The log holds what came before.",
        faults=Fault.WATCHDOG,
    )  # fmt: skip


def _last(pipe: Connection) -> Any:
    """The child's answer after a request to stop; None when it dies without one."""
    try:
        return pipe.recv() if pipe.poll(10.0) else None
    except EOFError:
        return None


def _ask(stop: Any, watch: Callable[[RunState], str], window: _Window) -> None:
    if watch(window.get()):
        stop.value = 1


def _child(
    parent: int, order: RunOrder, memory: Any, phase: Any, stop: Any, looks: Any, pipe: Connection, paced: bool,
    desk: Desk | None = None,
) -> None:  # fmt: skip
    import signal

    for each in ENDING:  # to be ended is to be zeroed first; Ctrl-C is the parent's affair
        signal.signal(each, signal.SIG_IGN if each == signal.SIGINT else _interrupt_once)
    end_with_parent()
    window, orphan, deaf = _Window(memory, phase), dead_parent(parent), deaf_parent(looks)
    if orphan():
        return  # before anything is opened

    def stopped() -> str:
        if stop.value or (desk is not None and desk.stopping):
            return BY_HAND
        if orphan():
            return "The program that started the loop is gone."
        return f"The program that started the loop has not looked at it for {DEAF:g} s." if deaf() else ""

    def clock(about: Capabilities) -> tuple[Pace, str]:
        if not paced:
            return Virtual(), ""
        standing = step_forward(fifo=order.fifo)
        if about.paced or (about.virtual and not order.wall):
            return Virtual(), standing.warning
        return WallClock(about.period, vigil=standing.vigil), standing.warning

    def show(state: RunState) -> None:
        window.put(state)
        if desk is not None:
            desk.put(state)

    heard: dict[str, Any] = {} if desk is None else {"heed": desk.heed}
    answer: Any
    try:
        answer = carry_out(order, law=of_values(order.law), show=show, stopped=stopped, pace=clock, **heard)
    except UprightError as error:
        answer = error if isinstance(error, RigStopped | BadInput) else RigStopped(str(error))
    except BaseException:
        answer = traceback.format_exc()
    if not orphan():
        pipe.send(answer)
    pipe.close()


def _interrupt_once(_signal: int, _frame: object) -> None:
    """A second signal must not interrupt the zeroing that the first one began."""
    import signal

    for each in ENDING:  # not SIG_IGN, of which Python complains where a second one has come by now
        signal.signal(each, lambda _signal, _frame: None)
    raise KeyboardInterrupt


def end_with_parent() -> None:
    """Let the kernel send SIGTERM when the parent dies, also where no tick passes, as within a pulse or a wait.

    It is sent when the *thread* ends that started this process; `run_in_process` waits there for as long as this
    process lives. Nothing is sent for a parent that was gone before this call: compare its id afterwards.
    """
    if sys.platform == "linux":
        import ctypes
        import signal

        ctypes.CDLL(None).prctl(_PR_SET_PDEATHSIG, ctypes.c_ulong(signal.SIGTERM))


def deaf_parent(looks: Any, clock: Callable[[], float] = time.monotonic) -> Callable[[], bool]:
    """Whether the parent has stopped looking; evaluated at every tick."""
    last, since = -1, 0.0

    def deaf() -> bool:
        nonlocal last, since
        if looks.value != last:
            last, since = looks.value, clock()
        return clock() - since > DEAF

    return deaf


def dead_parent(parent: int) -> Callable[[], bool]:
    """Whether the process of that id, which started this one, is gone; evaluated at every tick."""
    if sys.platform != "win32":
        return lambda: os.getppid() != parent
    # ids of the dead stay there, and a launcher may stand between; the handle was opened before anything was imported
    process = multiprocessing.parent_process()
    return lambda: process is not None and not process.is_alive()
