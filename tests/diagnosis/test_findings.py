"""Does each finding about a sensor say where, how much and what to do, by the numbers that were put in?"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from tests.diagnosis.cases import case
from upright.diagnosis import examine
from upright.diagnosis.case import Place
from upright.diagnosis.findings import KINDS, Diagnosis, Finding
from upright.diagnosis.motion import motion_of
from upright.diagnosis.sensors import clipped, examine_sensors, frozen_from
from upright.physics import find
from upright.records import Provenance, Record

DT = 0.01
T = np.arange(1000) * DT
STEP = 1e-3
SWING = np.round(np.exp(-0.1 * T) * np.sin(3 * T) / STEP) * STEP


def found_in(kind, **how):
    findings, mended = examine_sensors(case(DT, **how))
    return [f for f in findings if f.kind == kind], mended


def test_a_dead_sensor_is_told_by_what_acts_or_moves():
    flat = {"y": {"constant": True, "low": 2.5}}
    (finding,), _ = found_in("dead", x=SWING, y=np.full(1000, 2.5), measured=("x", "y"), columns=flat)
    assert finding.sentence == (
        "'y' reads 2.5 from the first to the last sample although 'x' moves: the sensor is dead, or the body was "
        "clamped."
    )
    assert finding.evidence == {"samples [1]": 1000, "value [m]": 2.5}
    assert (finding.severity, finding.key) == ("fault", 'locked = ["q_y"]')
    (finding,), _ = found_in(
        "dead", x=SWING, y=np.full(1000, 2.5), u=np.sin(T), drive="u", measured=("x", "y"), columns=flat
    )
    assert "although the effort acts" in finding.sentence
    # of what nothing acts on and nothing moves beside, nothing is known
    assert not found_in("dead", y=np.full(1000, 2.5), measured=("y",), columns=flat)[0]
    assert not found_in("dead", x=SWING, y=np.full(1000, 2.5), measured=("x",), columns=flat)[0]
    made = case(DT, x=SWING, y=np.full(1000, 2.5), measured=("x", "y"), columns=flat)
    assert not [f for f in examine_sensors(replace(made, locked=("q_y",)))[0] if f.kind == "dead"]
    assert [f for f in examine_sensors(replace(made, locked=("q_x",)))[0] if f.kind == "dead"]


def test_wraps_are_counted_with_their_turn_and_the_record_is_mended():
    spin = np.round((0.3 + 1.7 * T + 0.2 * np.sin(T)) / STEP) * STEP
    made = case(DT, a=np.mod(spin, 2 * math.pi), units={"a": "rad"}, measured=("a",))
    made = replace(made, moduli={"a": (2 * math.pi,)})
    findings, mended = examine_sensors(made)
    (finding,) = findings
    at = np.flatnonzero(np.diff(np.floor(spin / (2 * math.pi)))) + 1
    assert finding.kind == "wrap"
    assert finding.evidence == pytest.approx({"turn [rad]": 2 * math.pi, "wraps [1]": at.size})
    assert (
        f"'a' wraps {at.size} times: its counter jumps by 6.28319 rad (first at {T[at[0]]:.5g} s)" in finding.sentence
    )
    assert finding.marks == pytest.approx(T[at])
    assert finding.key == '[sensors.q_a]\nunit = "rad"'
    assert np.diff(mended["a"] - spin) == pytest.approx(np.zeros(999), abs=1e-9)
    assert finding.panels[1].curves[0].t[40] == pytest.approx(T[at[0]])
    assert finding.panels[0].curves[0].y == pytest.approx(np.mod(spin, 2 * math.pi))


def test_the_largest_of_several_jumps_is_named_and_all_are_taken_out():
    x = SWING + np.where(np.arange(1000) >= 300, 0.2, 0.0) - np.where(np.arange(1000) >= 600, 0.5, 0.0)
    (finding,), mended = found_in("jump", x=x, measured=("x",))
    assert finding.severity == "fault"
    assert finding.evidence["jumps [1]"] == 2
    assert finding.evidence["jump [m]"] == pytest.approx(-0.5, abs=0.03)
    assert "m between two samples at 6 s and stays there (2 such jumps)" in finding.sentence
    assert finding.key == 'window = [6, "end"]'
    assert finding.marks == pytest.approx((3.0, 6.0))
    assert mended["x"] == pytest.approx(SWING, abs=0.04)
    (single,), _ = found_in("jump", x=SWING + np.where(np.arange(1000) >= 300, 0.2, 0.0), measured=("x",))
    assert "such jumps" not in single.sentence
    # a speed may jump at a stop
    assert not found_in("jump", x=x, measured=("x",), units={"x": "m/s"})[0]


def test_the_largest_of_several_outliers_is_named():
    x = SWING.copy()
    x[[400, 700]] += 0.4, -0.9
    (finding,), mended = found_in("spike", x=x, measured=("x",))
    assert finding.evidence == pytest.approx({"largest [m]": -0.9, "spikes [1]": 2}, abs=0.02)
    assert "'x' has 2 isolated outliers, the largest of -0.9" in finding.sentence
    assert "at 7 s." in finding.sentence
    assert finding.marks == pytest.approx((4.0, 7.0))
    assert mended["x"] == pytest.approx(SWING, abs=2 * STEP)
    x[700] = SWING[700]
    (finding,), _ = found_in("spike", x=x, measured=("x",))
    assert "has 1 isolated outlier, the largest" in finding.sentence


def test_a_sensor_that_freezes_is_told_with_the_sample():
    k = int(np.argmax(np.abs(np.diff(SWING[500:])))) + 500
    x = np.where(np.arange(1000) < k, SWING, SWING[k])
    (finding,), mended = found_in("stuck", x=x, y=SWING, measured=("x", "y"))
    at, sudden = frozen_from(x, STEP)
    assert at == k
    assert finding.evidence == pytest.approx({"from [s]": T[k], "abruptness [1]": sudden})
    assert f"'x' freezes at {x[k]:.6g} from {T[k]:.5g} s to the end" in finding.sentence
    assert finding.key == f'window = ["start", {T[k]:.6g}]'
    assert [p.curves[0].name for p in finding.panels] == ["x", "y", "x"]
    assert mended is None


def test_a_ramp_that_stops_dead_is_as_sudden_as_its_speed():
    """2 mm a sample, all of it lost at once, beside speeds that change by no more than half a step."""
    x = np.round(np.minimum(np.arange(400), 200) * 2.0)
    at, sudden = frozen_from(x, 1.0)
    assert at == 200
    assert sudden == pytest.approx(2.0 / 0.5)
    assert frozen_from(x[:207], 1.0)[0] == -1  # seven samples do not show it
    assert frozen_from(x[:209], 1.0)[0] == 200
    assert frozen_from(np.round(np.minimum(np.arange(400), 200) * 1.0), 1.0)[0] == -1  # a step a sample is no motion
    assert frozen_from(np.zeros(400), 1.0) == (-1, 0.0)
    assert frozen_from(np.concatenate([np.arange(23.0) * 2, np.full(100, 44.0)]), 1.0) == (-1, 0.0)
    assert frozen_from(np.concatenate([np.arange(26.0) * 2, np.full(100, 50.0)]), 1.0)[0] == 25


def cut_off(limit):
    """To and fro between -2 and 2 at an even pace, as far as the limit lets it."""
    way = 2.0 - np.abs(np.mod(2.13 * T, 8.0) - 4.0)
    return np.clip(np.round(way / STEP) * STEP, -10.0, limit)


def test_a_sensor_at_its_limit_is_told_with_the_share_of_its_samples():
    x = cut_off(1.5)
    (finding,), _ = found_in("saturation", x=x, measured=("x",))
    assert finding.evidence["share [%]"] == pytest.approx(100 * np.mean(x == 1.5), rel=0.02)
    assert "'x' is cut off at 1.5 for" in finding.sentence
    assert not found_in("saturation", x=cut_off(3.0), measured=("x",))[0]
    # a body that was held reached no limit
    made = case(DT, x=x, y=20 * np.sin(T), measured=("x", "y"))
    assert not [f for f in examine_sensors(replace(made, plant=find("rectilinear-2")))[0] if f.columns == ("x",)]
    coarse = {"x": {"resolution": replace(made.inspection.column("x").resolution, step=3.5 / 49)}}
    assert not found_in("saturation", x=x, measured=("x",), columns=coarse)[0]


def test_a_limit_is_one_end_or_both():
    low, high, share = clipped(cut_off(1.5), STEP, inertia=True)
    assert math.isnan(low)
    assert high == 1.5
    assert share == pytest.approx(np.mean(cut_off(1.5) == 1.5), rel=0.02)
    low, high, _ = clipped(-cut_off(1.5), STEP, inertia=True)
    assert (low, math.isnan(high)) == (-1.5, True)
    both = np.clip(cut_off(1.5), -1.2, 2.0)
    assert clipped(both, STEP, inertia=True)[:2] == (-1.2, 1.5)
    assert clipped(np.round(both * 2) / 2, STEP, inertia=True)[2] == 0.0  # few values tell nothing


def record(**signals):
    n = len(next(iter(signals.values())))
    units = {k: "V" if k == "u" else "rad" if k.startswith("theta") else "m" for k in signals}
    source = Provenance(file="log.csv", reader="table")
    return Record(t=np.arange(n) * DT, signals=signals, units=units, provenance=source)


def test_what_cannot_be_looked_for_is_said_with_its_reason():
    cart = find("rectilinear-1")
    alone = examine(record(x_1=SWING))
    assert alone.unchecked["effort"] == "the log has no effort column that could be recognised"
    assert alone.unchecked["sign"] == "the rig is not specified; name it with --rig"
    assert set(alone.checked) == set(KINDS) - set(alone.unchecked) - {"settings"}
    assert alone.rigs
    assert (alone.samples, alone.duration, alone.rig) == (1000, pytest.approx(9.99), "")
    zero = examine(record(x_1=SWING, u=0 * T), cart)
    assert "is zero throughout" in zero.unchecked["early"]
    assert zero.rig == "rectilinear-1"
    assert zero.rigs == ()
    push = examine(record(x_1=SWING, u=np.cos(T)), cart)
    assert push.unchecked["early"] == "'u' acts from the first sample on"
    assert "only the plant's name is known" in push.unchecked["scale"]
    assert not {"sign", "trip"} & set(push.unchecked)
    # of a cart's force without its effort only a free spring is left, whose sign nothing turns
    free = examine(record(x_1=SWING), cart)
    assert free.unchecked["sign"] == "the record holds no motion whose sign is known"


def test_findings_come_worst_first_and_notes_are_nothing_wrong():
    x = SWING + np.where(np.arange(1000) >= 300, 0.2, 0.0)
    x[600] += 0.5
    found = examine(record(x_1=x))
    assert [f.severity for f in found.findings] == sorted(
        (f.severity for f in found.findings), key=("fault", "warning", "note").index
    )
    assert {"jump", "spike"} <= {f.kind for f in found.wrong}
    made = [Finding(kind="gap", columns=(), severity=s, sentence="") for s in ("fault", "warning", "note")]
    told = Diagnosis(
        file="", rig="", samples=1, duration=1.0, findings=tuple(made), checked=(), unchecked={},
    )  # fmt: skip
    assert [f.severity for f in told.wrong] == ["fault", "warning"]


def test_what_was_mended_while_reading_stands_among_the_findings():
    before = Finding(kind="clock", columns=("time",), severity="fault", sentence="The clock starts again.")
    assert before in examine(record(x_1=SWING), before=(before,)).findings


def test_a_record_that_is_spoilt_is_not_asked_for_its_forces():
    holed = np.delete(T, np.arange(300, 420))
    rows = np.searchsorted(T, holed)
    log = Record(
        t=holed, signals={"x_1": SWING[rows], "u": np.cos(3 * T)[rows]}, units={"x_1": "m", "u": "V"},
        provenance=Provenance(file="log.csv", reader="table"),
    )  # fmt: skip
    found = examine(log, find("rectilinear-1"))
    assert "gap" in {f.kind for f in found.wrong}
    assert found.unchecked["sign"] == "after the gap found above, mend that first"


def test_a_motion_is_missed_where_a_coordinate_is():
    made = case(DT, x=SWING, measured=("x",))
    assert motion_of(made) == "the rig is not specified; name it with --rig"
    plant = find("cart-pendulum")
    place = {"x": Place(column="x", y=SWING, resolution=STEP, unit="m")}
    assert motion_of(replace(made, plant=plant, places=place)) == "no column measures theta"
    locked = motion_of(replace(made, plant=plant, places=place, locked=("theta",)))
    assert locked.rows == (0,)
    inner = np.isin(np.round(T, 6), np.round(locked.t, 6))
    assert locked.q[0] == pytest.approx(SWING[inner], abs=0.01)
    assert np.all(locked.q[1] == 0)
    # exp(-0.1 t) sin(3 t)
    speed = np.exp(-0.1 * locked.t) * (3 * np.cos(3 * locked.t) - 0.1 * np.sin(3 * locked.t))
    assert locked.v[0] == pytest.approx(speed, abs=0.1)
    assert locked.fades[0] == pytest.approx(0.02 * np.std(locked.v[0]))
    still = replace(made, plant=find("rectilinear-1"), places={"x_1": replace(place["x"], y=0 * SWING)})
    assert motion_of(still) == "nothing moves"
    short = case(DT, x=SWING[:30], measured=("x",))
    few = replace(short, plant=find("rectilinear-1"), places={"x_1": replace(place["x"], y=SWING[:30])})
    assert motion_of(few) == "the record is too short beside its swings"
