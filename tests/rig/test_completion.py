"""Does the rig that a law meets have what the call says of it?"""

from __future__ import annotations

import math
from dataclasses import replace

import pytest

import upright as up
from upright.errors import BadInput
from upright.records.record import of_twin
from upright.rig.completion import completed, doubts, twin_of
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


ARM = up.Furuta(m_p=0.135, l_cg=0.19, r=0.16, J_d=0.011, J_p=6e-4)
OWN = up.Rig.known(ARM, name="bench 3", gain=0.65, limit=8.0)


def test_what_a_data_sheet_gives_is_told_and_not_said_of_the_rig():
    """Of the sheet: what the rig lacks, and the friction that its fit leaves out."""
    whole = completed(OWN, vendor="ECP 205")
    made = make_rig("furuta")
    assert (whole.limit, whole.period, whole.converter, whole.lag) == (8.0, made.period, made.converter, made.lag)
    assert (whole.plant.b_1c, whole.plant.b_2c) == (made.plant.b_1c, made.plant.b_2c)
    assert whole.name == made.name
    sheet, friction = doubts(OWN, whole)
    assert sheet.startswith("From the data sheet of the ECP 205, not specified for this rig: encoder counts of psi, ")
    assert "command limit" not in sheet  # which is its own
    assert friction == f"The fit knows no dry friction; simulations have that of the {made.name} as designed."


def test_friction_that_a_fit_knows_is_not_replaced():
    for known in ({"b_1c": 1e-3}, {"b_2c": 1e-4}):
        dry = OWN.changed(**known)
        assert completed(dry, vendor="ECP 205").plant == dry.plant
        assert len(doubts(dry, completed(dry, vendor="ECP 205"))) == 1


def test_a_delay_that_nobody_gave_is_a_servo_period_and_told_as_assumed():
    own = OWN.replace(period="4 ms", counts=4096)
    whole = completed(own)
    assert (whole.delay, whole.name, whole.plant) == (4e-3, "bench 3", ARM)
    assert doubts(own, whole) == ("Assumed, not measured: dead time.",)
    known = completed(own.replace(delay="1 ms"))
    assert known.delay == 1e-3
    assert doubts(own, known) == ()


def test_a_fit_of_one_twin_that_meets_another_is_told():
    known = make_rig("furuta", 3)
    named = replace(known, hardware=replace(known.hardware, name=of_twin(known.name, 3).rig, vendor="ECP 205"))
    for seed, said in ((3, False), (4, True)):
        told = doubts(named, completed(named), make_rig("furuta", seed))
        assert any("The fit is of another rig" in sentence for sentence in told) == said
    assert not any("another rig" in sentence for sentence in doubts(named, completed(named)))


def test_a_rig_of_one_s_own_runs_on_one_that_its_fit_allows():
    own = OWN.replace(period="4 ms", counts=4096)
    with pytest.raises(BadInput, match="drawn from the fit's covariance, and this fit has none"):
        twin_of(own, 1)
    draws = tuple((ARM.replace(J_d=0.01 + 0.001 * k), 0.6 + 0.1 * k) for k in range(3))
    met = {(twin.plant, twin.gain) for twin in (twin_of(replace(own, draws=draws), seed) for seed in range(1, 30))}
    assert met == set(draws)
    twin = twin_of(replace(own, draws=draws), 5)
    assert twin == twin_of(replace(own, draws=draws), 5)
    assert (twin.seed, twin.limit, twin.name) == (5, 8.0, "a rig that the fit of bench 3 allows")
