"""Are signs and scales that contradict the equations told, with the factor that mends them?"""

from __future__ import annotations

import math
from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from tests.diagnosis.cases import case
from upright.diagnosis.case import Place
from upright.diagnosis.forces import (
    Explanation,
    ForceBalance,
    against_form,
    against_gain,
    against_numbers,
    values_of,
)
from upright.diagnosis.motion import SmoothedMotion, Term
from upright.physics import CartPendulum, Pendulum, find
from upright.rig import Rig

T = np.arange(0, 12, 0.02)
CART = find("rectilinear-2")
NUMBERS = {"m_1": 2.0, "m_2": 1.5, "k_1": 200.0, "k_12": 400.0, "k_2": 100.0, "c_1": 0.0, "c_2": 0.0}


def values():
    return dict.fromkeys(CART.names(), 0.0) | NUMBERS


def motion(effort=1.0, one=1.0, two=1.0, drag=3.0):
    """Two carts that are moved as somebody likes, and the force that takes, by hand; what is shown times factors."""
    q = np.array([0.02 * np.sin(3 * T) + 0.01 * np.sin(7 * T), 0.015 * np.sin(4 * T + 1) + 0.008 * np.sin(9 * T)])
    v = np.array([0.06 * np.cos(3 * T) + 0.07 * np.cos(7 * T), 0.06 * np.cos(4 * T + 1) + 0.072 * np.cos(9 * T)])
    a = np.array([-0.18 * np.sin(3 * T) - 0.49 * np.sin(7 * T), -0.24 * np.sin(4 * T + 1) - 0.648 * np.sin(9 * T)])
    # the second cart goes as its springs say: what is left is its friction
    u = 2.0 * a[0] + 200 * q[0] + 400 * (q[0] - q[1]) + drag * v[0]
    shown = np.array([[one], [two]])
    return SmoothedMotion(
        plant=CART, t=T, q=q * shown, v=v * shown, a=a * shown, u=effort * u / 5.0, fades=np.array([1e-4, 1e-4]),
        rows=(0,), samples=np.arange(T.size), dt=0.02, command=u, weights=np.ones(1),
    )  # fmt: skip


def test_a_needed_force_is_that_of_the_equations_of_motion():
    m = replace(motion(), rows=(0, 1))
    balance = ForceBalance(m, values(), 5.0)
    tau, inertial = balance.needed(np.array([[1.0, 1.0], [1.0, -2.0]]))
    for h, two in enumerate((1.0, -2.0)):
        q, a = m.q * [[1.0], [two]], m.a * [[1.0], [two]]
        assert tau[h, 0] == pytest.approx(2.0 * a[0] + 200 * q[0] + 400 * (q[0] - q[1]))
        assert tau[h, 1] == pytest.approx(1.5 * a[1] + 100 * q[1] + 400 * (q[1] - q[0]))
        assert inertial[h] == pytest.approx(np.array([[2.0], [1.5]]) * a)


def test_a_record_that_obeys_its_numbers_leaves_nothing():
    now = ForceBalance(motion(), values(), 5.0).declared()
    assert now.unexplained == pytest.approx([0.0], abs=1e-12)
    assert now.gain == 5.0
    assert now.cost == pytest.approx(math.log(0.004))
    free = ForceBalance(motion(), values(), math.nan).declared()
    assert free.gain == pytest.approx(5.0)  # as the regression says where nobody does


@pytest.mark.parametrize("factor", [-1.0, 0.5, 10.0, math.pi / 180])
def test_the_factor_on_an_effort_is_found(factor):
    best, *_ = ForceBalance(motion(effort=1 / factor), values(), 5.0).others()
    assert best.who == "effort"
    assert best.factor == pytest.approx(factor, rel=1e-6)
    assert best.gain == pytest.approx(5.0 * factor)
    assert best.unexplained.max() < 1e-9


def test_friction_must_brake():
    """Of a force along with the speed the effort is what is left to blame."""
    assert ForceBalance(motion(drag=3.0), values(), 5.0).declared().unexplained[0] < 1e-12
    pushed = ForceBalance(motion(drag=-3.0), values(), 5.0).declared().unexplained[0]
    v, a = motion().v[0], 2.0 * motion().a[0]
    assert pushed == pytest.approx(np.mean((3.0 * (v - v.mean())) ** 2) / np.var(a), rel=1e-6)


@pytest.mark.parametrize("factor", [-1.0, 0.25, 4.0])
def test_the_factor_on_a_sensor_is_found(factor):
    found = ForceBalance(motion(one=1 / factor, two=1.0), values(), 5.0).others()
    best = min((e for e in found if e.who == "x_1"), key=lambda e: e.cost)
    assert best.factor == pytest.approx(factor, rel=0.02)
    assert best.unexplained.max() < 0.01


@pytest.mark.parametrize(("coupling", "rel"), [(4e2, 4e-3), (4e4, 1e-4)])
def test_the_stiffer_the_bodies_are_joined_the_sharper_is_the_factor(coupling, rel):
    """Off by d it takes the force k_12 d x_1 at least, of which a hundredth of the inertial force may be left."""
    m = motion()
    u = m.u + (coupling - 400) * (m.q[0] - m.q[1]) / 5.0
    shown = np.array([[1 / 3.7], [1.0]])
    wrong = replace(m, q=m.q * shown, v=m.v * shown, a=m.a * shown, u=u, command=u)
    assert 0.01 * np.std(2.0 * m.a[0]) / np.std(coupling * m.q[0]) < rel
    found = ForceBalance(wrong, values() | {"k_12": coupling}, 5.0).others()
    best = next(e for e in found if e.who == "x_1")
    assert best.factor == pytest.approx(3.7, rel=rel)


def known(m):
    """The case of a motion: columns named after the coordinates, the effort in volts."""
    made = case(0.02, x_1=m.q[0], x_2=m.q[1], u=m.u, drive="u")
    places = {n: Place(column=n, y=m.q[i], resolution=1e-5, unit="m") for i, n in enumerate(("x_1", "x_2"))}
    return replace(made, plant=CART, places=places, rig=Rig(plant=CART(**NUMBERS), gain=7.0))


def test_a_reversed_effort_is_told_as_a_sign_and_half_of_it_as_a_scale():
    m = motion(effort=-1.0)
    (finding,) = against_numbers(known(m), ForceBalance(m, values(), 5.0))
    assert finding.kind == "sign"
    assert finding.evidence["factor [1]"] == pytest.approx(-1.0)
    assert finding.sentence.startswith("The sign of the effort 'u' looks reversed: the rig's known numbers leave ")
    assert finding.key == "[drive]\nsign = -1"
    assert finding.left == pytest.approx(0.0, abs=1e-6)
    now = ForceBalance(m, values(), 5.0).declared().unexplained[0]
    assert finding.evidence["unexplained now [%]"] == pytest.approx(100 * now)
    assert f"leave {100 * now:.0f} % of the inertial force unexplained, and 0.0 % with it" in finding.sentence
    m = motion(effort=0.25)
    (finding,) = against_numbers(known(m), ForceBalance(m, values(), 5.0))
    assert finding.kind == "scale"
    assert "The effort 'u' is off by a factor: times 4 (encoder lines taken for counts) it fits" in finding.sentence
    assert finding.key == "[drive]\nscale = 4"
    assert finding.columns == ("u",)
    before, after = finding.panels
    assert before.label == "force on x_1 [N],\nas declared"
    assert after.label == "force on x_1 [N],\nwith the factor"
    inertial, left = before.curves
    assert inertial.y == pytest.approx(2.0 * m.a[0])
    assert np.var(left.y) / np.var(inertial.y) == pytest.approx(
        ForceBalance(m, values(), 5.0).declared().unexplained[0], rel=1e-3
    )
    assert np.abs(after.curves[1].y).max() < 1e-6
    assert after.curves[0].y == pytest.approx(inertial.y)
    m = motion(effort=-0.25)
    (finding,) = against_numbers(known(m), ForceBalance(m, values(), 5.0))
    assert "times -4 (encoder lines taken for counts) it fits" in finding.sentence


def test_a_right_or_nearly_right_record_is_not_doubted():
    for effort in (1.0, 1.1):
        m = motion(effort=effort)
        assert against_numbers(known(m), ForceBalance(m, values(), 5.0)) == []


@cache
def real():
    """The balance of the motion as it is."""
    return ForceBalance(motion(), values(), 5.0)


class Said:
    """A balance that has been computed."""

    def __init__(self, now, *others, gain=5.0):
        self.now, self.found, self.motion, self.gain = now, list(others), motion(), gain
        self.names, self.driven, self.used = ["x_1", "x_2"], 0, True
        self.friction, self.needed = real().friction, real().needed

    def declared(self):
        return self.now

    def others(self):
        return self.found


def left(who, factor, *unexplained):
    return Explanation(who=who, factor=factor, unexplained=np.array(unexplained), gain=5.0)


@pytest.mark.parametrize(
    ("now", "best", "told"),
    [
        ((0.5,), ("x_1", 2.0, 0.05), True),
        ((0.019,), ("x_1", 2.0, 0.0), False),  # two percent are borne
        ((0.021,), ("x_1", 2.0, 0.0), True),
        ((0.6,), ("x_1", 2.0, 0.14), True),
        ((0.5,), ("x_1", 2.0, 0.16), False),  # nor is so much clear
        ((0.9,), ("x_1", 2.0, 0.14), True),
        ((40.0,), ("x_1", 2.0, 0.39), True),  # a hundredth of what is left now
        ((40.0,), ("effort", 2.0, 0.39), False),
        ((0.3,), ("x_1", 2.0, 0.09), False),  # 3.2 times less
        ((0.3,), ("x_1", 2.0, 0.08), True),  # 3.6 times less
        ((0.5,), ("x_1", 1.24, 0.01), False),
        ((0.5,), ("x_1", 1.26, 0.01), True),
        ((0.5,), ("x_1", 0.81, 0.01), False),
        ((0.07,), ("x_1", 1.5, 0.001), False),
        ((0.07,), ("x_1", 1.6, 0.001), True),
        ((0.07,), ("x_1", 0.66, 0.001), False),
        ((0.07,), ("x_1", 0.64, 0.001), True),
    ],
)
def test_a_factor_is_told_where_it_is_far_off_and_leaves_plainly_less(now, best, told):
    found = against_numbers(known(motion()), Said(left("", 1.0, *now), left(*best)))
    assert bool(found) == told


def test_of_factors_that_do_alike_the_nearest_to_one_is_proposed_and_the_others_are_named():
    now = left("", 1.0, 0.5)
    (finding,) = against_numbers(
        known(motion()),
        Said(now, left("x_1", 10.0, 0.01), left("effort", 0.5, 0.011), left("x_2", 0.9, 0.01), left("x_2", 3.0, 0.02)),
    )
    assert finding.sentence.startswith("The effort 'u' or 'x_1' is off by a factor: times 0.5 it fits")
    assert finding.columns == ("x_1", "u")
    (finding,) = against_numbers(known(motion()), Said(now, left("x_1", -2.0, 0.01), left("effort", 2.0, 0.01)))
    assert finding.key == "[drive]\nscale = 2"  # of equals the one that turns nothing
    for factor, kind in ((-0.76, "sign"), (-0.74, "scale"), (-1.32, "sign"), (-1.34, "scale")):
        (finding,) = against_numbers(known(motion()), Said(now, left("x_1", factor, 0.01)))
        assert finding.kind == kind


@pytest.mark.parametrize(
    ("factor", "cause"),
    [
        (180 / math.pi, "degrees taken for radians"), (math.pi / 180, "radians taken for degrees"),
        (2 * math.pi, "turns taken for radians"), (4.0, "encoder lines taken for counts"),
        (0.25, "counts taken for encoder lines"), (1000.0, "thousandths taken for units"),
        (0.001, "units taken for thousandths"), (4.2, "encoder lines taken for counts"), (4.3, ""), (5.0, ""),
    ],
)  # fmt: skip
def test_a_factor_that_is_a_confusion_of_units_is_named(factor, cause):
    (finding,) = against_numbers(known(motion()), Said(left("", 1.0, 0.5), left("x_2", factor, 0.01)))
    assert ("taken for" in finding.sentence) == bool(cause)
    assert f"times {factor:.3g}{f' ({cause})' if cause else ''} it fits" in finding.sentence


@pytest.mark.parametrize(
    ("unexplained", "gain", "used", "told"),
    [(0.26, 5.0, True, True), (0.24, 5.0, True, False), (0.9, math.nan, True, False), (0.9, 5.0, False, False)],
)
def test_an_effort_is_believed_no_more_where_it_leaves_a_quarter(unexplained, gain, used, told):
    said = Said(left("", 1.0, unexplained), gain=gain)
    said.used = used
    made = known(motion())
    found = list(against_gain(made, said))
    assert bool(found) == told
    for finding in found:
        alike = float(np.corrcoef(made.u, made.places["x_1"].y)[0, 1])
        assert finding.evidence == pytest.approx(
            {"unexplained [%]": 100 * unexplained, "correlation with the motion [%]": 100 * alike}
        )
        assert f"it leaves {100 * unexplained:.0f} % of the force on 'x_1' unexplained" in finding.sentence
        assert ("follows it" in finding.sentence) == (alike > 0.6)


def test_another_row_that_is_unexplained_does_not_tell_of_the_effort():
    said = Said(left("", 1.0, 0.5, 0.31))
    said.motion = replace(said.motion, rows=(0, 1))
    assert list(against_gain(known(motion()), said)) == []
    said.now = left("", 1.0, 0.5, 0.29)
    said.friction = ForceBalance(said.motion, values(), 5.0).friction
    said.needed = ForceBalance(said.motion, values(), 5.0).needed
    assert list(against_gain(known(motion()), said))


def test_numbers_that_are_guesses_hold_nothing():
    made = known(motion())
    assert values_of(replace(made, rig=None), frozenset()) == (
        "only the plant's name is known; a study with its numbers tells"
    )

    def guess(*names):
        return replace(made, rig=replace(made.rig, sources=dict.fromkeys(names, "guessed")))

    assert values_of(guess("m_1"), frozenset()) == "m_1 is a guess; give the fit.json"
    assert values_of(guess("m_1", "m_2"), frozenset()) == "m_1, m_2 are guesses; give the fit.json"
    found, gain = values_of(guess("c_1"), frozenset({"c_1"}))
    assert gain == 7.0
    assert (found["c_1"], found["m_1"]) == (0.0, 2.0)
    assert math.isnan(values_of(guess("actuator.gain"), frozenset())[1])


def term(who, text, slope, share=0.5, total=0.1):
    alone = np.sin(T)
    return Term(
        who=who, text=text, slope=slope, share=share, total=total, target=slope * alone, alone=alone,
        t=T,
    )  # fmt: skip


def signs(*found, plant=CART, made=None, **how):
    m = replace(motion(), plant=plant)
    names = [c.name for c in plant.coordinates]
    made = made or replace(
        case(0.02, **dict.fromkeys(names, T), u=T, drive="u"), plant=plant,
        places={n: Place(column=n, y=0.5 * np.sin(T), resolution=1e-5, unit=c.unit)
                for n, c in zip(names, plant.coordinates, strict=True)},
    )  # fmt: skip
    return against_form(replace(made, **how), m, list(found))


@pytest.mark.parametrize(
    ("slope", "share", "total", "told"),
    [(-2.0, 0.5, 0.1, True), (2.0, 0.5, 0.1, False), (-2.0, 0.11, 0.1, True), (-2.0, 0.09, 0.1, False),
     (-2.0, 0.5, 0.59, True), (-2.0, 0.5, 0.61, False)],
)  # fmt: skip
def test_a_sign_is_believed_where_its_term_explains_something_and_little_is_left(slope, share, total, told):
    found = signs(term(("effort", "x_1"), "effort", slope, share, total))
    assert bool(found) == told
    for finding in found:
        assert finding.sentence.startswith("Positive effort, negative motion: 'u' pushes 'x_1' backwards.")
        assert finding.key == "[drive]\nsign = -1"
        assert finding.evidence == pytest.approx({"slope found [SI]": -2.0, "explains [%]": 100 * share})
        assert finding.advice == "Set the sign of 'u'."
        assert finding.panels[-1].label == "acceleration\nof x_1 [m/s^2]"
        target, line = finding.panels[-1].curves
        assert line.y == pytest.approx(target.y)


def test_a_spring_that_pushes_tells_of_the_body_that_is_not_driven_unless_the_effort_is_against_the_driven_one():
    (finding,) = signs(term(("x_1", "x_2"), "spring", -3.0))
    assert finding.columns == ("x_2",)
    assert finding.sentence == (
        "'x_1' and 'x_2' count against each other: a spring pulls one body towards the other, but the accelerations "
        "say the opposite."
    )
    assert finding.key == "[sensors.x_2]\nsign = -1"
    (finding,) = signs(term(("x_1", "x_2"), "spring", -3.0), term(("effort", "x_1"), "effort", -1.0))
    assert finding.columns == ("x_1",)
    # where another spring is right, only the effort is against
    (finding,) = signs(
        term(("x_1", "x_2"), "spring", -3.0), term(("x_2", "x_1"), "spring", 3.0),
        term(("effort", "x_1"), "effort", -1.0),
    )  # fmt: skip
    assert finding.columns == ("u",)
    (finding,) = signs(term(("x_2", "x_1"), "spring", -3.0, share=0.2), term(("x_1", "x_2"), "throw", -3.0, share=0.9))
    assert "a hinge that is accelerated throws its pendulum" in finding.sentence


def test_gravity_that_pushes_away_tells_of_a_zero_that_is_upright():
    (finding,) = signs(term(("theta", "theta"), "gravity", -8.0), plant=Pendulum)
    assert finding.severity == "warning"
    assert finding.key == '[sensors.theta]\noffset = "180 deg"'
    assert finding.evidence["largest angle [rad]"] == pytest.approx(0.5, rel=1e-3)
    # a throw that is against tells the same of a weak gravity, but where a study says the zero
    throw = term(("x", "theta"), "throw", -2.0)
    weak = term(("theta", "theta"), "gravity", -8.0, share=0.004)
    (finding,) = signs(throw, weak, plant=CartPendulum)
    assert "its zero is upright" in finding.sentence
    for slope, words in ((-0.1, "its zero is upright"), (0.1, "count against each other")):  # however long the rod
        (finding,) = signs(throw, replace(weak, slope=slope), plant=CartPendulum)
        assert words in finding.sentence
    (finding,) = signs(throw, weak, plant=CartPendulum, zeroed=True)
    assert "count against each other" in finding.sentence
    (finding,) = signs(throw, replace(weak, share=0.002), plant=CartPendulum)
    assert "count against each other" in finding.sentence
    assert finding.columns == ("theta",)
