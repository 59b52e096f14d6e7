"""Does every step of a first power-up tell what a scripted rig did, and what mends it?"""

from __future__ import annotations

import math
from types import SimpleNamespace

import numpy as np
import pytest

from upright.rig.makes import make_rig
from upright.rigs import Fault, Mode
from upright.running import power_up
from upright.running.power_up import PATIENCE, REMINDERS, FirstPowerUp

NOTHING = Fault(0)
CART = make_rig("linear")


@pytest.fixture(autouse=True)
def _model(monkeypatch):
    """A model that goes 10 cm per volt, without a dead zone; its pendulum goes against it by 0.4 rad per volt."""

    def response(model, zero, pulse):
        assert zero == "hanging"
        assert "actuator.dead_zone" not in model.more
        return SimpleNamespace(moved={"x": 0.1 * pulse, "theta": -0.4 * pulse})

    monkeypatch.setattr(power_up, "pulse_response", response)


class Rig:
    """A rig that answers as it is told to: counts and faults tick by tick, the last ones for ever."""

    def __init__(self, *ticks):
        self.ticks, self.time, self.done = list(ticks) or [((0, 0), NOTHING)], 0.0, []

    def exchange(self, command):
        assert command == 0.0
        counts, faults = self.ticks.pop(0) if len(self.ticks) > 1 else self.ticks[0]
        self.time += 0.1
        return SimpleNamespace(counts=counts, faults=faults, time=self.time)

    def __getattr__(self, name):
        return lambda *what: self.done.append((name, *what))


def steps(*ticks, rig=CART, hand=lambda _: True, way=(1.0, 1.0), travel=(0.2, math.inf), **more):
    """A walk along a cart of 100 and a pendulum of 1000 counts per metre and radian, within 20 cm and 10 V."""
    model = rig.replace(counts=[100.0, 2 * math.pi * 1000]) if rig is CART else rig
    about = SimpleNamespace(counts=(100 * way[0], 1000 * way[1]), step=1e-3)
    held = SimpleNamespace(travel=travel, start=(0.05, math.inf), command=10.0, watchdog=0.02)
    beside = SimpleNamespace(rig=Rig(*ticks), about=about, held=held, duty=SimpleNamespace(zero="hanging"))
    beside.pulses = []
    walk = FirstPowerUp(beside=beside, model=model, hand=hand, **more)

    def script(moves):
        def pulse(height):
            beside.pulses.append(height)
            return SimpleNamespace(moved=dict(zip(("x", "theta"), moves(height), strict=True)))

        beside.pulse = pulse

    walk_pulses = script
    return walk, beside, walk_pulses


def shown(counts, before=(7, 7)):
    """What is found where the cart is moved, then the pendulum, each by so many counts."""
    moved = [(before, NOTHING)]
    for i, c in enumerate(counts):
        at = list(before)
        at[i] += c
        moved += [(tuple(at), NOTHING), (before, NOTHING)]
    return moved


def test_a_hand_moves_a_cart_by_ten_centimetres_and_a_pendulum_by_a_turn():
    """100 counts per metre are 10, 1000 per radian 6283."""
    asked = []
    walk, _, _ = steps(*shown((10, 6283)), hand=lambda text: asked.append(text) or True)
    cart, pendulum = walk.by_hand()
    assert (cart.good, cart.observed) == (True, "showed 100 mm")
    assert (pendulum.good, pendulum.observed) == (True, "showed 360 degrees")
    assert walk.counts == {}
    assert asked[0].startswith("The motor without power")
    assert asked[1].startswith("Move x by hand by 100 mm in the sense that is to be positive")
    assert asked[2].startswith("Move theta by hand by one full turn, its free end leaving in the positive sense of x")


@pytest.mark.parametrize(
    ("counts", "way", "seen", "said"),
    [
        (-10, 1, {"x": -100}, "counts the wrong way, swap its channels"),
        (-10, -1, {"x": 100}, "showed 100 mm"),
        (5, 1, {"x": 50}, "0.5 times the motion requested: wrong counts per metre"),
        (-5, 1, {"x": -50}, "0.5 times the motion requested, and counts the wrong way: wrong counts per metre"),
        (40, 1, {"x": 400}, "4 times the motion requested: wrong counts"),
        (13, 1, {}, "1.3 times the motion requested: wrong counts"),
        (0, 1, {}, "showed 0 mm: not connected, or not this channel"),
    ],
)
def test_counts_that_were_seen_are_a_half_or_twice_those_described_or_only_about(counts, way, seen, said):
    walk, _, _ = steps(*shown((counts, 6283 * 1)), way=(float(way), 1.0))
    cart, _ = walk.by_hand()
    assert said in cart.observed
    if way < 0:
        assert (cart.good, walk.counts) == (True, {})
    else:
        assert (cart.good, walk.counts) == (False, seen)
    if counts == 13:
        assert cart.fix.startswith("it has about 130 counts per metre and not 100")
    if counts == 5:
        assert cart.fix.startswith("it has 50 counts per metre and not 100")


def test_counts_that_come_at_another_s_place_are_told_as_plugs():
    """The cart's ten counts come where the pendulum's belong."""
    walk, _, _ = steps(((0, 0), NOTHING), ((0, 10), NOTHING))
    first = next(walk.by_hand())
    assert (first.good, first.fix) == (False, "swap the plugs of x and theta")
    assert "theta moved" in first.observed


def test_a_fault_and_a_hand_that_is_not_there_are_no_verdict_on_an_encoder():
    walk, _, _ = steps(((0, 0), Fault.STOP))
    assert [(f.good, "stop" in f.observed) for f in walk.by_hand()] == [(False, True)] * 2
    walk, _, _ = steps(hand=lambda text: "Move" not in text)
    assert [(f.good, f.observed) for f in walk.by_hand()] == [(None, "not moved")] * 2
    walk, _, _ = steps(hand=None)
    assert [(f.good, f.observed) for f in walk.by_hand()] == [(None, "it was not moved")] * 2


@pytest.mark.parametrize(("travel", "words"), [(0.16, "100 mm"), (0.14, "70 mm"), (0.06, "30 mm")])
def test_where_the_travel_is_short_a_hand_moves_by_half_of_it(travel, words):
    asked = []
    walk, _, _ = steps(*shown((10, 0)), travel=(travel, math.inf), hand=lambda text: asked.append(text) or False)
    list(walk.by_hand())
    assert words in asked[1]


@pytest.mark.parametrize(
    ("travel", "words"),
    [(7.0, "one full turn, in the sense that is to be positive, such as anticlockwise seen from above"),
     (6.0, "a quarter turn, in the sense that is to be positive, such as anticlockwise"),
     (math.inf, "one full turn, in the sense that is to be positive, and hold")],
)  # fmt: skip
def test_an_arm_with_a_cable_turns_by_a_quarter(travel, words):
    asked = []
    walk, _, _ = steps(rig=make_rig("furuta"), travel=(travel, math.inf), hand=lambda t: asked.append(t) or False)
    list(walk.by_hand())
    assert f"Move psi by hand by {words}" in asked[1]


def moves(dead, of=1.0, back=None):
    """A cart that goes 1 cm per volt beyond its dead zone, `of` times as far; its pendulum goes along."""

    def moved(u):
        far = max(abs(u) - (dead if u > 0 or back is None else back), 0.0)
        return math.copysign(0.1 * far * of, u), math.copysign(0.1 * far * of, u)

    return moved


def test_pulses_grow_by_half_until_the_body_moves_to_either_side():
    """From 0.2 % of 10 V on: 0.02 * 1.5^k; the dead zone lies in the middle of two of them."""
    walk, beside, script = steps(rig=CART.changed(b_1c=0.0, b_1s=0.0))
    script(moves(0.5, back=0.8))
    found = {f.what: f for f in walk.drive()}
    below, first = walk.dead_zone
    assert below < 0.5 + 0.03 / 0.1 < first  # three counts, which are 3 cm, are still
    assert first / below == pytest.approx(1.5)
    assert beside.pulses[0] == pytest.approx(0.02)
    assert beside.pulses[1] / beside.pulses[0] == pytest.approx(1.5)
    heights = [0.02 * 1.5**k for k in range(20)]
    up = next(h for h in heights if 0.1 * (h - 0.5) > 0.03)
    down = next(h for h in heights if 0.1 * (h - 0.8) > 0.03)
    assert first == pytest.approx(up)
    lost, error = (up / 1.5 + up) / 2, (up - up / 1.5) / math.sqrt(12)
    assert walk.lost == pytest.approx((lost, error))
    assert found["the drive, forward"].observed == (
        f"x moves from {up:.3g} V on, and not at {up / 1.5:.3g} V: a dead zone of {lost:.3g} V, standard error "
        f"{error:.2g} V"
    )
    assert found["the drive, backward"].observed == f"moves from {down:.3g} V on, and not at {down / 1.5:.3g} V"
    assert min(beside.pulses) == pytest.approx(-down)


def test_what_friction_takes_is_no_dead_zone():
    """The command that dry friction takes is f_c over the drive's gain."""
    walk, _, _ = steps()
    p = CART.plant
    takes = max(p.b_1c, p.b_1s) / CART.gain
    walk.dead_zone = (0.9 * takes, 1.35 * takes)
    assert walk.lost == (0.0, 0.0)
    walk.dead_zone = (2 * takes, 3 * takes)
    assert walk.lost == pytest.approx((1.5 * takes, takes / math.sqrt(12)))
    walk.dead_zone = (0.0, 0.02)
    assert walk.lost == (0.0, 0.0)


def test_the_errors_of_dead_zones_are_as_large_as_their_standard_error_says():
    """Of true dead zones all over two steps of the pulses, none of which is special: their logarithms are uniform.

    Between pulses of 1 and 1.5 the density of a true x is 1/(x ln 1.5), told is 1.25, so by integration the errors are
    0.1451 in the root mean square, where the standard error says 0.5/sqrt(12) = 0.1443; 57.2 % are smaller than that,
    and none is larger than sqrt(3) times.
    """
    share, rig = [], CART.changed(b_1c=0.0, b_1s=0.0).replace(counts=[100.0, 2 * math.pi * 1000])
    for true in 0.02 * 1.5 ** (np.arange(80) / 40 + 7.0125):
        walk, _, script = steps(rig=rig)
        script(moves(true, of=1e4))  # three counts are 30 uV
        next(walk.drive())
        lost, error = walk.lost
        share.append(abs(lost - true) / error)
    assert np.sqrt(np.mean(np.square(share))) == pytest.approx(0.1451 / 0.1443, abs=5e-3)
    assert np.mean(np.less(share, 1.0)) == pytest.approx(0.572, abs=1 / 40)
    assert max(share) < math.sqrt(3.0) + 1e-3


def test_a_drive_is_told_by_what_it_moves():
    def told(script_of, hand=lambda _: True):
        walk, beside, script = steps(hand=hand)
        script(script_of)
        return list(walk.drive()), beside

    swapped, _ = told(lambda u: (-u, -u))
    assert [f.fix for f in swapped] == ["swap the motor's two leads"]
    one_way, _ = told(lambda u: (abs(u), abs(u)))
    assert one_way[-1].what == "the drive, backward"
    assert (one_way[-1].good, "one way only" in one_way[-1].observed) == (False, True)
    dead = [
        told(lambda u: (0.0, 0.0), hand)[0][0] for hand in (lambda _: True, lambda t: "Does the bridge have" not in t)
    ]
    assert ["enable line" in f.observed for f in dead] == [True, False]
    assert "the bridge has no supply" in dead[1].observed
    _, beside = told(lambda u: (0.0, 0.0))
    assert beside.pulses[-1] == 10.0  # the largest command was tried


@pytest.mark.parametrize(
    ("ratio", "at_most", "good", "word"),
    [(0.7, 0.8, True, ""), (0.5, 0.6, False, "the drive is weak"), (1.6, 2.5, False, "stronger than described"),
     (1.4, 2.5, True, ""), (0.6, 0.68, True, "")],
)  # fmt: skip
def test_a_drive_gives_as_described_to_a_factor_of_one_and_a_half(ratio, at_most, good, word):
    """Somewhere between the two commands of the dead zone; a gain that is a guess says nothing of it."""
    walk, _, _ = steps()
    finding = walk._strength("1 V moved x 10 mm", ratio, at_most)
    assert finding.good is good
    assert word in finding.observed
    assert f"{ratio:.2g} to {at_most:.2g} times its model's" in finding.observed
    assert "guess" not in finding.observed
    guessed, _, _ = steps(rig=CART.replace(sources={**CART.sources, "actuator.gain": "guessed"}))
    finding = guessed._strength("1 V moved x 10 mm", ratio, at_most)
    assert finding.good
    assert finding.observed.endswith("times its model's, whose gain is a guess")


@pytest.mark.parametrize(("goes", "wrong"), [(-0.5, False), (0.5, True), (0.0, False)])
def test_a_pendulum_that_goes_the_wrong_way_is_told_with_its_counts(goes, wrong):
    """Under ten times the first pulse that moved anything, 1.5 V, beside a model under 1.4 to 1.35 V."""
    walk, beside, script = steps(travel=(1.0, math.inf))
    script(lambda u: (0.1 * (u - 0.125), goes * u))
    walk.dead_zone = 0.1, 0.15
    finding = walk._size(0.15)
    assert beside.pulses == [1.5]
    assert finding.good is not wrong
    assert ("theta went the wrong way" in finding.observed) == wrong
    assert walk.counts == ({"theta": pytest.approx(-2 * math.pi * 1000)} if wrong else {})
    if not wrong:
        assert "1.5 V moved x 138 mm" in finding.observed
        assert "0.98 to 1 times its model's" in finding.observed  # 1.375 over 1.4 and over 1.35


def test_where_the_travel_is_short_the_size_is_seen_of_a_weaker_pulse():
    """At most 0.4 of 20 cm by the model, in steps of 1.5 down from ten times the first that moved: 1.5, 1, 0.67."""
    walk, beside, script = steps()
    script(lambda u: (0.1 * u, -0.4 * u))
    walk.dead_zone = 0.1, 0.15
    assert walk._size(0.15).good
    assert beside.pulses == [pytest.approx(1.5 / 1.5**2)]


def test_a_pressed_button_takes_the_motor_s_power():
    def pressed(moved, hand=lambda _: True):
        walk, beside, script = steps(hand=hand)
        script(lambda u: (moved, 0.0))
        walk.dead_zone = 0.3, 0.4
        return list(walk.button()), beside.pulses

    (good,), pulses = pressed(0.03)  # three counts are still
    assert (good.good, pulses) == (True, [0.8])
    (bad,), _ = pressed(-0.04)
    assert (bad.good, "moved although the button is pressed" in bad.observed) == (False, True)
    (left,), pulses = pressed(0.0, hand=lambda _: False)
    assert (left.good, left.observed, pulses) == (None, "not pressed", [])
    assert pressed(0.0, hand=None)[0] == []
    untried, _, _ = steps()
    assert list(untried.button()) == []  # nothing ever moved


@pytest.mark.parametrize(
    ("faults", "good", "said"),
    [
        (Fault.OVERTRAVEL, True, "switched off beyond 200 mm"),
        (Fault.OVERSPEED, False, ""),
        (NOTHING, None, "it was not pushed"),
    ],
)
def test_the_end_of_travel_is_waited_for(faults, good, said):
    walk, beside, _ = steps(((0, 0), NOTHING), ((0, 0), NOTHING), ((30, 0), faults))
    (finding,) = walk.travel()
    assert finding.good is good
    assert finding.observed.startswith(said)
    assert [name for name, *_ in beside.rig.done] == ["arm", "stop", "clear_fault"]
    waited = beside.rig.time
    assert (waited > PATIENCE) == (faults == NOTHING)
    assert waited < PATIENCE + 0.5
    assert list(steps(travel=(math.inf, math.inf))[0].travel()) == []
    (left,) = steps(hand=lambda _: False)[0].travel()
    assert (left.good, left.observed) == (None, "not tried")


@pytest.mark.parametrize(
    ("faults", "good"),
    [(Fault.WATCHDOG, True), (Fault.STALE, True), (Fault.WATCHDOG | Fault.OVERSPEED, True), (NOTHING, False),
     (Fault.OVERSPEED, None)],
)  # fmt: skip
def test_silence_of_twice_the_watchdog_stops_a_rig(faults, good):
    waited = []
    still = ((0, 0), NOTHING)
    walk, beside, _ = steps(still, still, still, ((0, 0), faults), wait=waited.append)
    (finding,) = walk.watchdog()
    assert finding.good is good
    assert waited == [pytest.approx(0.04)]
    assert finding.observed.startswith("40 ms of silence: ")
    assert finding.observed.endswith("it went on") == (faults == NOTHING)
    assert finding.fix == ("do not run it; flash the firmware again" if good is False else "")
    assert beside.rig.done == [("arm",), ("start", Mode.HOST), ("stop",), ("clear_fault",)]


@pytest.mark.parametrize(("counts", "requests"), [(5, 1), (6, 1 + REMINDERS), (-6, 1 + REMINDERS)])
def test_who_leaves_the_body_off_its_start_window_is_reminded(counts, requests):
    """Within 5 cm, which are 5 counts; not for ever."""
    asked = []
    walk, _, _ = steps(((counts, 0), NOTHING), hand=asked.append)
    walk._steadied()
    assert len(asked) == requests
    if requests > 1:
        assert f"x is {10 * counts} mm from where it was" in asked[1]
        assert "within 50 mm of that" in asked[1]
