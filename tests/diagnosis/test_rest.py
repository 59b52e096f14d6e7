"""Rest positions that differ, bodies that creep and swings that grow are told by how much."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from tests.diagnosis.cases import case
from upright.diagnosis import Finding, examine, read_known
from upright.diagnosis.rest import examine_rest
from upright.records import Provenance, Record

DT = 0.01
STEP = 1e-5


def told(kind: str, rig: str = "", **columns: np.ndarray) -> list[Finding]:
    t = np.arange(len(next(iter(columns.values())))) * DT
    units = {n: "V" if n == "u" else "m" for n in columns}
    log = {n: x if n == "u" else np.round(x / STEP) * STEP for n, x in columns.items()}
    record = Record(t=t, signals=log, units=units, provenance=Provenance(file="log.csv", reader="table"))
    return [f for f in examine(record, *(read_known(rig) if rig else ())).findings if f.kind == kind]


def settling(levels: list[float], seconds: float = 6.0, first: float = 1.0) -> np.ndarray:
    """A cart that settles at one level after another, by decaying swings: at rest after about 4 s."""
    t = np.arange(round(seconds / DT)) * DT
    x, before = [np.full(round(first / DT), levels[0])], levels[0]
    for level in levels[1:]:
        x.append(level + (before - level) * np.exp(-2 * t) * np.cos(9 * t))
        before = level
    return np.concatenate(x)


def pushed(levels: list[float], volts: list[float]) -> dict[str, np.ndarray]:
    u = np.repeat(volts, [100] + [600] * (len(levels) - 1))
    return {"x_1": settling(levels), "u": u}


def test_rests_of_a_driven_cart_are_compared_where_its_drive_is_off() -> None:
    """It begins at 0 and, pushed to 30 mm and let go, stops at 2 mm: dry friction holds it there."""
    (finding,) = told("drift", "rectilinear-1", **pushed([0.0, 0.03, 0.002], [0.0, 1.0, 0.0]))
    assert finding.evidence["apart [m]"] == pytest.approx(2e-3, abs=1e-4)
    x = pushed([0.0, 0.03, 0.002], [0.0, 1.0, 0.0])["x_1"]
    assert finding.evidence["of the range [%]"] == pytest.approx(100 * 2e-3 / np.ptp(x), rel=0.05)
    assert finding.key == 'unknown = ["initial", "offset.x_1"]'
    assert len(finding.spans) == 2
    # 3 % of the range is no drift
    assert told("drift", "rectilinear-1", **pushed([0.0, 0.03, 0.0008], [0.0, 1.0, 0.0])) == []


def test_a_hand_that_holds_before_the_release_is_no_rest_of_a_free_cart() -> None:
    assert told("drift", "rectilinear-1", x_1=settling([0.03, 0.0])) == []
    assert told("drift", "rectilinear-1", x_1=settling([0.03, 0.0, 0.0])) == []
    (finding,) = told("drift", "rectilinear-1", x_1=settling([0.03, 0.0, 0.002], first=2.0))
    assert finding.evidence["apart [m]"] == pytest.approx(2e-3, abs=1e-4)


def test_disks_without_a_spring_to_ground_rest_anywhere() -> None:
    levels = pushed([0.0, 0.03, 0.002], [0.0, 1.0, 0.0])
    assert told("drift", "torsional-1", theta_1=levels["x_1"], u=levels["u"]) == []
    # an arm without an anchor does too, its pendulum hangs straight down again
    both = {"psi": levels["x_1"], "theta": 0.9 * levels["x_1"], "u": levels["u"]}
    assert [f.columns for f in told("drift", "furuta", **both)] == [("theta",)]


def grown(rate: float, volts: float = 1.0, period: float = 0.5) -> dict[str, np.ndarray]:
    t = np.arange(800) * DT
    x = np.where(t < 1, 0.0, np.exp(rate * (t - 1)) * np.sin(2 * np.pi * (t - 1) / period))
    return {"x_1": 1e-3 * x, "u": np.where(t < 1, 0.0, volts)}


def test_a_swing_that_grows_under_a_constant_effort_is_told() -> None:
    """7 s hold 28 half swings of 0.25 s; from the first seven to the last seven they grow by 21 half swings' worth."""
    (finding,) = told("self-excited", "rectilinear-1", **grown(0.2))
    assert finding.evidence["half swings [1]"] == pytest.approx(27, abs=2)
    assert finding.evidence["growth [1]"] == pytest.approx(np.exp(0.2 * 0.25 * 20.5), rel=0.1)
    assert finding.key == 'role = "predict"'
    assert finding.spans[0] == pytest.approx((1.0, 7.99), abs=0.02)


@pytest.mark.parametrize(
    "case", [{"rate": -0.2}, {"rate": 0.2, "volts": 0.0}, {"rate": 0.0}, {"rate": 0.2, "period": 2.5}]
)
def test_a_swing_that_dies_or_is_driven_by_nothing_or_is_short_is_not(case: dict[str, float]) -> None:
    """2.5 s a swing are five half swings, too few to tell."""
    assert told("self-excited", "rectilinear-1", **grown(**case)) == []


@pytest.mark.parametrize(("share", "creeps"), [(0.0, False), (0.1, True), (0.19, True), (0.21, False)])
def test_a_body_that_moves_a_little_beside_its_like_was_held_and_creeps(share: float, creeps: bool) -> None:
    t = np.arange(1500) * DT
    x = 0.02 * np.exp(-0.1 * t) * np.cos(9 * t)
    found = told("creep", "rectilinear-2", x_1=x, x_2=share * x)
    assert bool(found) is creeps
    for finding in found:
        assert finding.columns == ("x_2",)
        assert finding.key == 'held = ["x_2"]'
        assert finding.evidence["range [m]"] == pytest.approx(share * finding.evidence["beside [m]"], rel=1e-2)
        assert f"{100 * share:.2g} % of the motion" in finding.sentence


T = np.arange(1500) * DT


def rests(level: float, t0: float = 1.0, share: float = 1.0) -> np.ndarray:
    """At zero for a while, a swing of 30 mm, and rest at a level."""
    return np.where(
        t0 > T, 0.0, share * 0.03 * np.exp(-2 * (T - t0)) * np.sin(9 * (T - t0)) + np.where(T > 5, level, 0)
    )


def driven_rest(level: float, **more: object) -> list[Finding]:
    made = case(x=np.round(rests(level) / STEP) * STEP, u=np.where((T > 1) & (T < 5), 1.0, 0.0), drive="u")
    return [f for f in examine_rest(replace(made, **more)) if f.kind == "drift"]


def test_a_drift_is_told_from_three_percent_and_five_steps_on() -> None:
    span = float(np.ptp(rests(0.0)))
    (finding,) = driven_rest(0.035 * span)
    assert finding.evidence["apart [m]"] == pytest.approx(0.035 * span, rel=0.03)
    assert finding.evidence["of the range [%]"] == pytest.approx(3.5, rel=0.03)
    assert "comes to rest" in finding.sentence
    assert "(3.5 % of its range)" in finding.sentence
    assert driven_rest(0.025 * span) == []
    # the sign does not matter
    assert driven_rest(-0.035 * span)[0].evidence["apart [m]"] == pytest.approx(0.035 * span, rel=0.03)


@pytest.mark.parametrize(("steps", "differs"), [(4, False), (6, True)])
def test_five_steps_of_a_coarse_encoder_are_no_drift(steps: int, differs: bool) -> None:
    """Steps of a millimetre, of which 3 % of the range are fewer than two."""
    x = np.round(rests(steps * 1e-3) / 1e-3) * 1e-3
    made = case(x=x, u=np.where((T > 1) & (T < 5), 1.0, 0.0), drive="u")
    assert 0.03 * np.ptp(x) < 2e-3
    assert [f.kind for f in examine_rest(made)].count("drift") == differs


def test_rests_of_a_speed_beside_a_reference_or_too_short_are_none() -> None:
    span = float(np.ptp(rests(0.0)))
    u = np.where((T > 1) & (T < 5), 1.0, 0.0)
    made = case(x=rests(0.1 * span), u=u, drive="u")
    assert [f.kind for f in examine_rest(made) if f.kind == "drift"]
    speed = case(x=rests(0.1 * span), u=u, drive="u", units={"x": "m/s"})
    assert not [f for f in examine_rest(speed) if f.kind == "drift"]
    reference = case(x=rests(0.1 * span), u=u, drive="u", columns={"u": {"remarks": ("the reference",)}})
    assert not [f for f in examine_rest(reference) if f.kind == "drift"]
    spans = made.inspection.rests

    def with_rests(*found: tuple[float, float]) -> list[Finding]:
        other = replace(made, inspection=replace(made.inspection, rests=found))
        return [f for f in examine_rest(other) if f.kind == "drift"]

    assert len(spans) >= 2
    assert with_rests((0.0, 0.9), (8.0, 9.0))
    assert not with_rests((0.0, 0.19), (8.0, 9.0))
    assert not with_rests((0.0, 0.9), (8.0, 8.19))
    assert not with_rests((0.0, 0.9))
    # while the drive acts a rest is where it pushes to
    assert not with_rests((0.0, 0.9), (2.0, 2.5))
    assert with_rests((0.0, 0.9), (5.5, 6.0), (8.0, 9.0))[0].spans == ((0.0, 0.9), (5.5, 6.0), (8.0, 9.0))


def test_the_growth_of_a_swing_is_that_of_its_last_quarter_over_its_first() -> None:
    """Amplitudes of a geometric series: the median of the last quarter of n half swings over that of the first."""
    for period, rate, told_ in ((0.5, 0.3, True), (0.5, 0.004, False), (2.2, 0.3, False)):
        t = np.arange(800) * DT
        x = 1e-3 * np.exp(rate * t) * np.sin(2 * np.pi * t / period)
        made = case(x=x, u=np.full(800, 1.5), drive="u")
        made = replace(made, u=np.where(t < 0.5, 0.0, 1.5))
        found = [f for f in examine_rest(made) if f.kind == "self-excited"]
        assert bool(found) == told_
        for finding in found:
            n = finding.evidence["half swings [1]"]
            quarter = n // 2 // 2
            assert finding.evidence["growth [1]"] == pytest.approx(np.exp(rate * period / 2 * (n - quarter)), rel=0.03)
            start, stop = finding.spans[0]
            assert (start, stop) == pytest.approx((0.5, 7.99))
            assert "from 0.5 to 7.99 s while the effort stays at 1.5" in finding.sentence
            assert (
                f"the amplitude grows {finding.evidence['growth [1]']:.3g} times over {n:.0f} half" in finding.sentence
            )
            (envelope,) = finding.panels[-1].curves
            assert finding.panels[-1].label == "amplitude [m]"
            # half swings: from one extreme to the next, at the instant between
            expected = 1e-3 * np.exp(rate * envelope.t) * np.cosh(rate * period / 4)
            assert envelope.y == pytest.approx(expected, rel=0.02)
            assert np.diff(envelope.t) == pytest.approx(period / 2, abs=0.021)


def test_every_body_that_is_free_must_grow() -> None:
    t = np.arange(800) * DT
    growing = 1e-3 * np.exp(0.3 * t) * np.sin(4 * np.pi * t)
    steady = 5e-3 * np.sin(4 * np.pi * t)
    u = np.where(t < 0.5, 0.0, 1.5)
    assert [f.kind for f in examine_rest(case(x=growing, y=0.5 * growing, u=u, drive="u"))] == ["self-excited"]
    assert examine_rest(case(x=growing, y=steady, u=u, drive="u")) == []
    # one that is held says nothing
    held = case(x=growing, y=0.1 * steady, u=u, drive="u")
    assert [f.kind for f in examine_rest(held) if f.kind == "self-excited"] == ["self-excited"]


@pytest.mark.parametrize(("steps", "creeps"), [(4.9, False), (5.1, True)])
def test_a_body_creeps_from_five_steps_of_its_sensor_on(steps: float, creeps: bool) -> None:
    x = np.exp(-0.1 * T) * np.cos(9 * T)
    q = {"resolution": replace(case(x=x).inspection.columns[0].resolution, step=0.01)}
    y = steps * 0.01 * (np.arange(1500) / 1499)
    made = case(x=x, y=y, columns={"y": q})
    assert bool([f for f in examine_rest(made) if f.kind == "creep"]) == creeps
