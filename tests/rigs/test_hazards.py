"""Is every hazard stopped by an interlock that is made for it, in its time?"""

from __future__ import annotations

import pytest

from benchmarks.measure import Unavailable
from benchmarks.safety import HAZARDS, judged

LONG = ("1 of 1,000,000 bytes", "1 of 100,000 bytes")
"""Corruption so rare that a minute has to pass before it shows."""


def brief(column, hazard):
    """Whether a row takes seconds; the others, most of them under simavr, are in `python -m benchmarks safety`."""
    simulated = column.name.startswith("ATmega")
    return not hazard.what.startswith(LONG) and (
        not simulated or any(word in hazard.what for word in ("hang", "dead", "anew"))
    )


EVERY = [
    pytest.param(column, h, id=f"{column.name}: {h.what}")
    for column, all_of in HAZARDS.items()
    for h in all_of
    if brief(column, h)
]


@pytest.mark.slow
@pytest.mark.parametrize(("column", "hazard"), EVERY)
def test_a_hazard_is_stopped_in_time(column, hazard):
    if reason := column.unable():
        pytest.skip(reason)
    try:
        line = judged(hazard, column, hazard.tell(column))
    except Unavailable as why:
        pytest.skip(str(why))
    assert line.reached is not False, line.note
