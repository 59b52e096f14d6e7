"""Is the drive off in time, and does it stay off, whoever dies in whatever state of a run?"""

from __future__ import annotations

import pytest

from benchmarks.hazards.dying import MOMENTS, WAYS, WHOLE, die
from benchmarks.measure import Unavailable

IDLE, PULSE, HOST, *_ = MOMENTS
OF_ALL = [pytest.param(moment, way, id=f"{moment.name}: {way}") for moment in MOMENTS for way in WAYS]
BRIEF = [(IDLE, WHOLE), (PULSE, "kill -9 of its loop"), (HOST, WHOLE), (HOST, "kill -9 of its loop")]


def dead(built, moment, way):
    folder = built("host", "cc")
    try:
        death = die(folder / "rig-host", moment, way)
    except Unavailable as why:
        pytest.skip(str(why))
    assert death.safe, death
    return death


@pytest.mark.parametrize(
    ("moment", "way"),
    [BRIEF[0], *(pytest.param(*case, marks=pytest.mark.slow) for case in BRIEF[1:])],
    ids=[f"{moment.name}: {way}" for moment, way in BRIEF],
)
def test_the_drive_goes_off_by_the_interlock_that_is_made_for_it(built, moment, way):
    death = dead(built, moment, way)
    # only the watchdog is left where the loop is killed, and it waits for its time
    by_watchdog = way.endswith("loop")
    assert (death.driven > 0.04) == by_watchdog, death


@pytest.mark.slow
@pytest.mark.parametrize(("moment", "way"), OF_ALL)
def test_no_drive_stays_on_whatever_dies_in_whatever_state(built, moment, way):
    dead(built, moment, way)
