"""The work of one tick as a run has it: a law and all supervision, on a twin in the place of a rig."""

from __future__ import annotations

import math
from collections.abc import Callable

from upright.gains import feedback, filtered, place
from upright.gains.requests import read_poles
from upright.paper.reproduce import TABLE_1
from upright.rig.makes import make_rig
from upright.rigs import Board, Mode, Tick, TwinPort
from upright.rigs.supervisor import Duty, Supervisor
from upright.running.rig import LEAN, NEAR, usual_limits

_TILT = math.radians(2)


def supervised() -> tuple[Callable[[], float], Callable[[], Tick]]:
    """A Furuta pendulum held upright: the command of a tick, and the exchange, in which the twin moves for a period.

    The twin keeps its own period, however long those of the clock on the wall are: the work is the same.
    """
    model = make_rig("furuta")
    linear = model.linear("inverted")
    estimator = filtered(linear.to_sampled(model.period, model.delay / model.period, model.lag), 0.5)
    port = TwinPort(model)
    rig = Board(port)
    beside = Supervisor(
        rig, Duty(limits=usual_limits(model), model=model, at="inverted", zero="hanging", lean=LEAN, near=NEAR)
    )
    beside.prepare()
    port.hold("inverted", [0.0, 0.0, _TILT, 0.0])
    beside.aim(feedback(estimator, place(linear.A, linear.B, read_poles(TABLE_1[0])).K))
    beside.start(Mode.HOST)
    port.let_go()
    tick, command = rig.exchange(0.0), 0.0

    def work() -> float:
        nonlocal command
        command = beside.step(tick)
        return command

    def exchange() -> Tick:
        nonlocal tick
        tick = rig.exchange(command)
        return tick

    return work, exchange
