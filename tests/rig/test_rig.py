"""Is a rig what it was said to be, in whatever unit it was said, and does it say what it lacks?"""

import math

import numpy as np
import pytest

import upright as up
from tests.physics.bumpers import Bumpers
from upright.errors import BadInput
from upright.rig import Hardware, Rig

ARM = up.Furuta(m_p=0.135, l_cg=0.19, r=0.16, J_d=0.011, J_p=6e-4)
CART = up.CartPendulum(m_c=0.9, m_p=0.12, l_cg=0.2, J_p=1.5e-3)


def test_numbers_are_taken_in_any_unit_of_their_kind():
    rig = Rig.known(ARM, gain="650 N mm/V", limit="10000 mV", period="2 ms", travel="120 deg", counts=4096, lag="4 ms")
    assert rig.gain == pytest.approx(0.65)
    assert (rig.limit, rig.period, rig.lag) == pytest.approx((10.0, 2e-3, 4e-3))
    assert rig.travel == pytest.approx(2 * math.pi / 3)
    assert rig == Rig.known(ARM, gain=rig.gain, limit=10.0, period=2e-3, travel=rig.travel, counts=4096, lag=4e-3)


def test_without_a_gain_a_command_is_the_force_itself():
    rig, plain = Rig.known(ARM), ARM.linear("inverted")
    assert pytest.approx(plain.B) == rig.linear("inverted").B
    assert pytest.approx(2 * plain.B) == rig.replace(gain=2.0).linear("inverted").B


def test_a_rig_is_called_as_it_was_said_as_its_plant_or_as_its_class():
    assert Rig.known(ARM, name="bench 3").name == "bench 3"
    assert Rig.known(ARM).name == "furuta"
    assert Rig.known(Bumpers(m=1.0, J=1e-3, k=500.0, gap=0.1)).name == "Bumpers"


def test_counts_are_per_turn_or_metre_and_steps_in_si():
    rig = Rig.known(CART, counts=(20_000, 4096))
    assert rig.counts == (20_000, 4096)
    assert rig.per_unit == pytest.approx((20_000, 4096 / math.tau))
    assert rig.resolution == pytest.approx([5e-5, math.tau / 4096])
    assert rig.replace(counts=1000).counts == (1000, 1000)


@pytest.mark.parametrize(
    ("name", "meaning"), [("limit", "limit"), ("period", "servo period"), ("counts", "encoder counts of psi")]
)
def test_what_nobody_said_is_asked_for_where_it_is_needed(name, meaning):
    with pytest.raises(BadInput, match=meaning):
        getattr(Rig(plant=ARM, name="bench 3"), name)


def test_what_nobody_said_is_none_where_a_rig_can_be_without():
    rig = Rig(plant=ARM)
    assert (rig.name, rig.unit) == ("furuta", "N m")  # it is its plant, and its command the plant's moment
    assert (rig.hardware.name, rig.hardware.vendor) == (None, None)
    assert (rig.delay, rig.lag, rig.offset, rig.converter) == (0, 0, 0, 0)
    assert (rig.travel, rig.speed_limit, rig.twist, rig.saturation) == (math.inf,) * 4
    assert rig.replace(travel=1.0).replace(travel=math.inf) == rig


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"counts": (100.0,)}, "2 positive numbers of counts"),
        ({"counts": -1}, "2 positive numbers of counts"),
        ({"limit": "10 N"}, "V"),
        ({"limit": math.inf}, "positive and finite"),
        ({"period": 0}, "positive and finite, got 0"),
        ({"limits": 5.0}, "no 'limits'; did you mean 'limit'"),
    ],
)
def test_what_a_rig_cannot_have_is_said_in_a_sentence(changes, said):
    with pytest.raises(BadInput, match=said):
        Rig.known(ARM).replace(**changes)


def test_the_drive_s_other_numbers_come_and_go_together():
    rig = Rig.known(ARM).replace(more={"actuator.slope": 0.02})
    assert rig.more == {"actuator.slope": 0.02}
    assert rig.replace(more={"actuator.damping": 0.1}).more == {"actuator.damping": 0.1}
    # gain u less the slope times the speed: the column of psi' changes by that along B
    bare = Rig.known(ARM).linear("inverted")
    braked = rig.linear("inverted")
    assert braked.A[:, 1] == pytest.approx(bare.A[:, 1] - 0.02 * bare.B[:, 0])


def test_draws_and_trust_stay_with_a_rig_that_is_changed():
    rig = Rig(plant=ARM, draws=((ARM, 1.0),), hardware=Hardware(name="bench 3"))
    other = rig.replace(limit=5.0).changed(J_d=0.02)
    assert (other.draws, other.basis, other.hardware.name) == (rig.draws, rig.basis, "bench 3")
    assert other.plant.J_d == 0.02
    assert [m.A.shape for m in other.spread("hanging")] == [(4, 4)]


def test_a_rig_goes_through_the_verbs_as_an_object():
    """Poles placed for the rig's own model are those of A - B K, by numpy."""
    rig = up.Rig.known(ARM, gain="0.65 N m/V", limit="10 V", period="2 ms", counts=4096)
    poles = (-4 + 2j, -4 - 2j, -17, -3)
    told = up.design(rig, poles=poles)
    model = rig.linear("inverted")
    found = np.linalg.eigvals(model.A - model.B @ np.atleast_2d(told.K))
    assert sorted(found, key=lambda p: (p.real, p.imag)) == pytest.approx(
        sorted(poles, key=lambda p: (np.real(p), np.imag(p))), rel=1e-6
    )
    assert told.numbers["limit"] == 10.0
    assert told.numbers["period"] == 2e-3


def pulse(t):
    """A command that begins 20 ms after the first sample."""
    return float(t > 0.0195)


STILL = {"seconds": 0.2, "at": "hanging", "dt": 1e-3}


def test_a_simulated_rig_is_driven_through_its_drive():
    """A command times the gain is the plant's own force, at most that of the limit, late by the delay."""
    drive = up.Rig.known(ARM, gain=0.65, limit=2.0)
    for volts, force in ((1.0, 0.65), (5.0, 1.3), (-5.0, -1.3)):
        run, bare = up.simulate(drive, u=volts, **STILL), up.simulate(ARM, u=force, **STILL)
        assert run["theta"] == pytest.approx(bare["theta"], rel=1e-12)
        assert run["T"][-1] == pytest.approx(max(-2.0, min(volts, 2.0)))
        assert run.units["T"] == "V"
    late, prompt = (up.simulate(r, u=pulse, **STILL) for r in (drive.replace(delay="10 ms"), drive))
    assert late["psi"][10:] == pytest.approx(prompt["psi"][:-10], abs=1e-12)
    assert not late["psi"][:30].any()


def test_a_law_designed_for_a_rig_holds_it_at_its_own_period():
    rig = up.Rig.known(ARM, gain="0.65 N m/V", limit="10 V", period="4 ms", delay="4 ms", counts=4096)
    law = up.design(rig, poles="-4+-2j, -17, -3").law
    run = up.simulate(rig, law, start={"theta": "3 deg"}, seconds=4)
    assert run.period == pytest.approx(4e-3)
    assert run["theta"][-1] == pytest.approx(math.pi, abs=2 * math.tau / 4096)
    assert np.abs(run["T"]).max() < 10


def test_a_free_rig_is_sampled_at_its_servo_period():
    assert up.simulate(up.Rig.known(ARM, period="5 ms"), seconds=0.1).period == pytest.approx(5e-3)
