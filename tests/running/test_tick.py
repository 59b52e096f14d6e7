"""Is the work of a tick that is timed that of a run, for as long as anybody times it?"""

from __future__ import annotations

import math

import pytest

from upright.control.watch import Watch
from upright.rig.makes import make_rig
from upright.rigs import Mode
from upright.running.tick import supervised


def test_the_tick_that_is_timed_holds_a_pendulum_upright_beside_the_bank_of_filters(monkeypatch):
    seen, see = [], Watch.see
    monkeypatch.setattr(Watch, "see", lambda self, y, u: seen.append(u) or see(self, y, u))
    work, exchange = supervised()
    commands = []
    for _ in range(3000):
        commands.append(work())
        tick = exchange()
    assert tick.mode == Mode.HOST
    assert tick.counts[1] / make_rig("furuta").per_unit[1] == pytest.approx(math.pi, abs=0.01)
    assert seen == pytest.approx(commands)
    assert max(commands) > 0.1 > 0 > min(commands)
