"""Drives that go off although the log says on: found from the motion alone, then estimated with the rest."""

from __future__ import annotations

import os
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from upright.identification import GreyBox, Parameter, Run
from upright.identification.estimate import identify, predict
from upright.identification.problem.trips import (
    find_trips,
    silenced,
    trip_sentence,
    unasked_trips,
    with_trip_guesses,
)
from upright.physics import Furuta
from upright.physics.oscillators import Torsional2
from upright.signals.trips import Trip, find_trip
from upright.simulation import simulate

COUNT = 2 * np.pi / 16000
DISKS = {"J_1": 2e-3, "J_2": 1.5e-3, "k_12": 0.4, "c_1": 1e-4, "c_2": 5e-5, "f_1c": 8e-3, "f_2c": 3e-3}
DRIVE = {"actuator.gain": 0.2, "actuator.damping": 1.2e-3, "actuator.standby": 6e-4}


def spin_up(*, seconds: float = 6.0, dt: float = 2e-3, volts: float = 0.5, **fields) -> Run:
    """Two disks, at rest until 1 s, volts until 4 s, in whole counts; `actuator` may hold more about the drive."""
    drive = DRIVE | {f"actuator.{n}": v for n, v in fields.pop("actuator", {}).items()}
    n = round(seconds / dt)
    t = np.arange(n) * dt
    u = np.where((t >= 1.0) & (t < 4.0), volts, 0.0)[:, None]
    y = simulate(Torsional2(**DISKS), drive, [0.0] * 4, u, dt, samples=n)[:, [0, 2], 0]
    run = {"label": "spin-up", "role": "fit", "measured": ("theta_1", "theta_2"), "resolution": (COUNT, COUNT)} | fields
    return Run(t=t, u=u, y=np.round(y / COUNT) * COUNT, **run)


def asked(*names: str, off: float = 1.0) -> GreyBox:
    """The two disks with guesses of some numbers, `off` times the truth."""
    parameters = {n: Parameter(name=n, value=v) for n, v in (DISKS | DRIVE).items()}
    parameters |= {n: Parameter(name=n, value=off * parameters[n].value, estimate=True) for n in names}
    return GreyBox(plant=Torsional2, parameters=parameters)


@pytest.mark.slow
def test_a_trip_is_seen_without_a_model_and_to_a_few_samples():
    for end in (1.7, 2.531, 3.4):
        (trip,) = find_trips(asked(), spin_up(actuator={"end": end}))
        assert not trip.late
        assert trip.logged == pytest.approx(4.0, abs=1e-9)
        # counts over the smoothing leave about a sample, 2 ms
        assert trip.at == pytest.approx(end, abs=5e-3)
        assert trip.after < trip.before


def test_a_trip_is_seen_under_a_command_that_was_resampled():
    """The mean over an interval in which a step falls is no level of the command."""
    run = spin_up(actuator={"end": 1.7})
    u = run.u.copy()
    u[np.flatnonzero(np.diff(u[:, 0]) > 0)[0]] = 0.25
    (trip,) = find_trips(asked(), replace(run, u=u))
    assert trip.at == pytest.approx(1.7, abs=5e-3)


def test_a_late_begin_is_seen():
    (trip,) = find_trips(asked(), spin_up(actuator={"start": 1.8}))
    assert trip.late
    assert trip.logged == pytest.approx(1.0, abs=1e-9)
    assert trip.at == pytest.approx(1.8, abs=5e-3)


@pytest.mark.parametrize("end", [None, 2.2, 3.1])
def test_an_arm_whose_pendulum_swings_far_trips_where_it_does_and_nowhere_else(end):
    """What the rod does to its arm is no line in its angle and speed: by the arm's equation the trip still shows."""
    dt, n = 2e-3, 3000
    t = np.arange(n) * dt
    arm = {"m_p": 0.1, "l_cg": 0.2, "r": 0.15, "J_d": 3e-3, "J_p": 4e-4, "b_1": 3e-3, "b_2": 2e-4, "b_1c": 1e-3}
    drive = {"actuator.gain": 0.1} | ({"actuator.end": end} if end else {})
    u = np.where((t >= 0.5) & (t < 4.5), 2.0 * np.sin(5 * t + 1), 0.0)[:, None]
    y = simulate(Furuta(**arm), drive, [0.0, 0.0, 1.5, 0.0], u, dt, samples=n)[:, [0, 2], 0]
    run = Run(label="arm", role="fit", t=t, u=u, y=np.round(y / COUNT) * COUNT, measured=("psi", "theta"),
              resolution=(COUNT, COUNT))  # fmt: skip
    known = {n: Parameter(name=n, value=v) for n, v in (dict.fromkeys(Furuta.names(), 0.0) | arm | {"g": 9.81}).items()}
    found = find_trips(GreyBox(plant=Furuta, parameters=known), run)
    assert [trip.late for trip in found] == [False] * bool(end)
    assert all(trip.at == pytest.approx(end, abs=0.02) for trip in found)  # counts over the smoothing, some samples


@pytest.mark.slow
@pytest.mark.parametrize(
    "actuator", [{}, {"knee": 10.0, "fade": 5e-3}, {"lag": 0.02, "slope": 2e-3}, {"damping": 0.0, "standby": 0.0}]
)
def test_friction_brakes_and_a_torque_speed_curve_are_no_trip(actuator):
    assert find_trips(asked(), spin_up(actuator=actuator)) == []


def test_neither_a_sine_nor_a_held_disk_is_a_trip():
    dt, n = 2e-3, 3000
    t = np.arange(n) * dt
    for u, held in ((0.3 * np.sin(2 * np.pi * 0.8 * t), False), (np.where(t < 4.0, 0.5, 0.0), True)):
        from upright.simulation import Held

        locked = {"theta_2": Held()} if held else None
        y = simulate(Torsional2(**DISKS), DRIVE, [0.0] * 4, u[:, None], dt, samples=n, held=locked)[:, 0, 0]
        y = np.round(y / COUNT) * COUNT
        assert find_trip(t, u, y, resolution=COUNT) is None
        assert find_trip(t, u, y, resolution=COUNT, late=True) is None


def test_a_sine_that_trips_is_seen():
    dt, n, end = 2e-3, 3000, 3.3
    t = np.arange(n) * dt
    u = 0.5 * np.sin(2 * np.pi * 0.8 * t)
    p = DRIVE | {"actuator.end": end}
    y = simulate(Torsional2(**DISKS), p, [0.0] * 4, u[:, None], dt, samples=n)[:, [0, 2], 0]
    y = np.round(y / COUNT) * COUNT
    trip = find_trip(t, u, y[:, 0], [y[:, 1]], resolution=COUNT)
    assert trip is not None
    assert trip.at == pytest.approx(end, abs=0.02)


@pytest.mark.slow
def test_a_fit_says_that_a_drive_went_off_and_what_to_declare():
    fit = identify(asked("f_1c", off=0.7), [spin_up(actuator={"end": 2.5}, label="silent")])
    (said,) = [w for w in fit.warnings if "went off" in w or "gone off" in w]
    assert "'silent'" in said
    assert "2.5" in said
    assert 'unknown = ["initial", "input_end"]' in said


@pytest.fixture(scope="module")
def tripped():
    """Two runs that trip and one that does not, everything 30 % off."""
    own = {"unknown": ("initial", "input_end")}
    runs = [
        spin_up(actuator={"end": 2.5}, label="trips at 2.5 s", **own),
        spin_up(actuator={"end": 1.9}, label="trips at 1.9 s", volts=0.4, **own),
        spin_up(label="stays on", volts=0.3),
    ]
    names = ("J_1", "J_2", "k_12", "c_1", "c_2", "f_1c", "f_2c", "actuator.damping", "actuator.standby")
    return identify(asked(*names, off=0.7), runs), names


@pytest.mark.slow
def test_the_moment_of_a_trip_is_estimated_with_the_friction(tripped):
    fit, _ = tripped
    for label, end in (("trips at 2.5 s", 2.5), ("trips at 1.9 s", 1.9)):
        e = fit.per_run[label]["input_end"]
        assert e.unit == "s"
        assert e.status == "well determined"
        # four standard errors: one miss in 16,000
        assert abs(e.value - end) < 4 * e.stderr + 1e-4
        assert e.stderr < 5e-3
    assert "input_end" not in fit.per_run["stays on"]
    assert not [w for w in fit.warnings if "gone off" in w]


def test_a_tripping_rig_is_recovered_from_counts(tripped):
    fit, names = tripped
    truth = DISKS | DRIVE
    for name in names:
        e = fit.estimates[name]
        assert abs(e.value - truth[name]) < 4 * e.stderr + 2e-3 * truth[name], name
    for name in ("J_1", "J_2", "k_12", "f_1c", "actuator.damping", "actuator.standby"):
        assert fit.estimates[name].value == pytest.approx(truth[name], rel=0.1), name
    assert min(v for s in fit.runs.values() for v in s.fit_percent.values()) > 99


def test_where_no_trip_is_seen_the_search_begins_at_the_logged_end():
    run = with_trip_guesses(asked(), spin_up(unknown=("input_end",)))
    assert run.guesses["input_end"] == pytest.approx(4.0, abs=2 * run.period)  # volts until the sample before 4 s


def test_a_prediction_finds_its_own_trip_and_says_so(tripped):
    fit, _ = tripped
    run = spin_up(actuator={"end": 3.1}, label="other", volts=0.45, unknown=("initial", "input_end"), role="predict")
    told = predict(fit, fit.model, [run])["other"]
    assert told.adapted == ("initial", "input_end")
    assert min(told.fit_percent.values()) > 99


LATE_CLOCK = Run(
    label="push", role="fit", t=5.0 + 0.1 * np.arange(40), y=np.zeros((40, 1)), measured=("theta_1",),
    u=np.where(np.arange(40) < 30, 2.0, 0.0)[:, None], unknown=("initial",),
)  # fmt: skip
"""A record that begins at 5 s, volts in the first 3 s of it."""
BEGUN = Trip(at=0.5, error=0.01, logged=0.0, before=3.0, after=0.1, late=True, unexplained=0.1, otherwise=0.5)
ENDED = replace(BEGUN, at=1.3, logged=3.0, before=4.0, after=0.2, late=False)


def known(*trips: Trip, plain: bool = False) -> Any:
    return SimpleNamespace(of=lambda run: ([*trips], plain))


def test_a_command_is_silent_before_a_drive_came_on_and_from_where_it_went_off():
    acting = silenced(LATE_CLOCK, [replace(BEGUN, at=0.46), replace(ENDED, at=1.26)]).u[:, 0]
    since = np.arange(40) * 0.1
    np.testing.assert_array_equal(acting, np.where((since > 0.46) & (since < 1.26), 2.0, 0.0))
    np.testing.assert_array_equal(silenced(LATE_CLOCK, []).u, LATE_CLOCK.u)


def test_a_trip_is_told_on_the_clock_of_the_log_with_what_to_declare():
    assert trip_sentence(LATE_CLOCK, ENDED) == (
        "In run 'push' the drive seems to have gone off at 6.3 s although the command is logged until 8 s "
        '(acceleration 4 before, 0.2 after): declare unknown = ["initial", "input_end"].'
    )
    assert "have come on only at 5.5 s although the command is logged from 5 s" in trip_sentence(LATE_CLOCK, BEGUN)
    assert trip_sentence(LATE_CLOCK, BEGUN).endswith('declare unknown = ["initial", "input_start"].')


def test_a_trip_is_told_unless_its_moment_is_estimated():
    said = unasked_trips(asked(), [LATE_CLOCK], known(BEGUN, ENDED))
    assert said == [trip_sentence(LATE_CLOCK, trip) for trip in (BEGUN, ENDED)]
    own = replace(LATE_CLOCK, unknown=("input_end",))
    assert unasked_trips(asked(), [own], known(BEGUN, ENDED)) == [trip_sentence(own, BEGUN)]
    for name in ("actuator.start", "actuator.end"):
        everywhere = Parameter(name=name, value=1.0, estimate=True)
        rig = GreyBox(plant=Torsional2, parameters={**asked().parameters, name: everywhere})
        assert unasked_trips(rig, [LATE_CLOCK], known(BEGUN, ENDED)) == []


def test_moments_that_are_estimated_begin_where_the_motion_shows_them():
    both = replace(LATE_CLOCK, unknown=("input_start", "input_end"))
    assert with_trip_guesses(asked(), both, known(BEGUN, ENDED)).guesses == {"input_start": 0.5, "input_end": 1.3}
    # a guess that somebody gave stays, and of what is not estimated there is none
    given = replace(both, guesses={"input_end": 2.0})
    assert with_trip_guesses(asked(), given, known(BEGUN, ENDED)).guesses == {"input_start": 0.5, "input_end": 2.0}
    assert with_trip_guesses(asked(), LATE_CLOCK, known(BEGUN, ENDED)) is LATE_CLOCK
    # where the motion plainly follows the command, the last sample at which it acts
    plain = with_trip_guesses(asked(), both, known(plain=True)).guesses
    assert plain == {"input_end": pytest.approx(2.9)}


@pytest.mark.real_data
@pytest.mark.parametrize(
    ("name", "end"),
    [
        # read off the speed by eye: where it turns from rising to falling
        ("Jan211424", 8.26), ("Jan211450", 5.63), ("Jan211520", 5.82), ("21-Jan-2025 15_18_23", 5.53),
        ("Jan211453", None), ("Jan211506", None), ("Jan141428", None), ("28-Jan-2025 14_36_10", None),
    ],
)  # fmt: skip
def test_silent_trips_of_a_real_drive_are_found(name, end):
    from upright.readers import read

    record = read(Path(os.environ["UPRIGHT_REAL_DATA"]) / "ecp205_torsional_ucsd" / f"{name}.mat")
    t = np.linspace(record.t[0], record.t[-1], record.t.size)
    u, y, other = (np.asarray(record[c], dtype=float) for c in ("target_value", "cart1pos", "cart2pos"))
    trip = find_trip(t, u, -y, [other], resolution=1.0)
    if end is None:
        assert trip is None
    else:
        assert trip is not None
        assert t[0] + trip.at == pytest.approx(end, abs=0.03)
