"""Is every hazard stopped by an interlock that is made for it, in its time?"""

from __future__ import annotations

import pytest

from benchmarks.safety import COLUMNS, HAZARDS, judged


@pytest.mark.slow
@pytest.mark.parametrize("column", COLUMNS, ids=lambda c: c.name)
@pytest.mark.parametrize("hazard", HAZARDS, ids=lambda h: h.what)
def test_a_hazard_is_stopped_in_time(hazard, column):
    line = judged(hazard, hazard.tell(column))
    assert line.reached is not False, line.note
