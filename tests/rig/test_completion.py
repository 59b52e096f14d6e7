"""Does the rig that a law meets have what the call says of it?"""

from __future__ import annotations

import math

import pytest

from upright.rig.completion import completed, twin_of
from upright.rig.makes import MAKES, make_rig
from upright.verbs.options import rig_entries


@pytest.mark.parametrize("make", ["furuta", "linear"])
def test_a_twin_of_a_make_has_the_counts_period_and_limit_that_a_call_gives(make):
    known = make_rig(make)
    said = rig_entries(known.plant, known.unit, {"counts": 1000, "period": "4 ms", "limit": 3.0})
    twin = twin_of(completed(known, said, vendor=MAKES[make].vendor, who="test"), 3)
    per_turn = [
        n * (2 * math.pi if c.unit == "rad" else 1) for n, c in zip(twin.per_unit, twin.plant.coordinates, strict=True)
    ]
    assert per_turn == pytest.approx([1000, 1000])
    assert (twin.period, twin.limit) == pytest.approx((4e-3, 3.0))


def test_what_a_call_does_not_give_is_the_twin_s_own():
    known = make_rig("furuta")
    twin = twin_of(completed(known, {}, vendor=MAKES["furuta"].vendor, who="test"), 3)
    own = make_rig("furuta", 3)
    assert (twin.per_unit, twin.period, twin.limit) == (own.per_unit, own.period, own.limit)
    assert twin.plant == own.plant
