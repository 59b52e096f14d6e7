"""Does a frame that is lost on the wire cost a rig less than its run, when time passes while the host waits?"""

from __future__ import annotations

import pytest

from benchmarks.hazards.firmware import KNOWN, host_port, no_host
from benchmarks.hazards.story import Column, in_loop
from upright.rigs.protocol import Mode


@pytest.fixture(params=[Mode.HOST, Mode.MCU])
def column(request):
    if reason := no_host():
        pytest.skip(reason)
    return Column(name="firmware", known=KNOWN, make=host_port, loop=request.param)


@pytest.mark.parametrize(("requests", "stopped_by"), [(1, "none needed"), (3, "none needed"), (5, "WATCHDOG")])
def test_a_watchdog_stands_three_requests_lost_in_a_row(column, requests, stopped_by):
    def lose(story):
        story.on.line.loses = requests

    found = in_loop(lose, after=0.05, then=0.1)(column)
    assert found.stopped_by == stopped_by
    # the watchdog's 20 ms, and the tick that sees that they are over
    assert found.zero_after is None or found.zero_after == pytest.approx(0.020, abs=1.001e-3)
