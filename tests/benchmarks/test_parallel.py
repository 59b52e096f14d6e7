"""Are twins side by side the twins that run alone?"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from benchmarks.hazards.parallel import Twins
from benchmarks.hazards.sound import law_for
from upright.experiments.nonideal import nonideal
from upright.rig.makes import make_rig
from upright.rigs import Board, Limits, TwinPort
from upright.rigs.supervisor import Duty, Supervisor

FREE = Limits(travel=(math.inf,) * 2, speed=(math.inf,) * 2, start=(math.inf,) * 2, command=5.0, saturation=1e9)


def test_a_lane_moves_count_for_count_as_the_twin_behind_its_board_does():
    known = make_rig("furuta")
    law = law_for(known)
    rigs, tilts = [nonideal(make_rig("furuta", s), s) for s in (4, 5, 6)], (0.01, 0.03, 0.05)
    twins, commands = Twins(rigs, law, known.limit), np.zeros((402, 3))
    twins.lift(tilts)
    for k in range(401):
        twins.advance(commands[k], np.array([[0.0] * 3, [0.5 * (k == 201)] * 3]))
        commands[k + 1 : k + 2] = twins.command()
    for lane, tilt in enumerate(tilts):
        port = TwinPort(rigs[lane])
        board = Board(port)
        beside = Supervisor(board, Duty(limits=FREE, model=known, at="inverted", zero="hanging", watch=False))
        beside.prepare(zero=False)  # a frame out of level moves where it hangs
        port.hold("inverted", [0.0, 0.0, tilt, 0.0])
        beside.aim(replace(law, period=known.period))
        beside.start()
        port.let_go()
        tick = board.exchange(0.0)
        for k in range(400):
            command = beside.step(tick, 0.0)
            assert command == commands[k + 1, lane]
            port.push([0.0, 0.5 * (k == 200)])
            tick = board.exchange(command)
