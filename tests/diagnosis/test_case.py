"""Is a log brought together with what is known of its rig, coordinate by coordinate?"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from benchmarks.doctored import batch
from tests.diagnosis.cases import case
from upright.diagnosis.case import COUNTERS, Place, case_of, column_unit, read_known, tells_speed, tells_time
from upright.diagnosis.forces import friction_of
from upright.errors import BadInput
from upright.physics import CartPendulum, Furuta, Pendulum, find
from upright.readers.inspection import inspect_record
from upright.records import Provenance, Record
from upright.study.sensors import Wiring

T = np.arange(200) * 0.01
SINE = np.sin(6 * T)


def test_a_coordinate_moves_by_more_than_three_percent_of_the_widest_in_its_unit():
    plant = find("rectilinear-2")
    made = replace(case(x_1=SINE), plant=plant)
    for share, moves in ((0.031, True), (0.029, False)):
        places = {n: Place(column=n, y=s * SINE, resolution=0.0, unit="m") for n, s in (("x_1", 1.0), ("x_2", share))}
        with_both = replace(made, places=places)
        assert with_both.moves("x_1")
        assert with_both.moves("x_2") == moves
    # an angle of 0.01 rad is not weighed against a metre
    other = {"x": Place(column="x", y=SINE, resolution=0.0, unit="m"),
             "theta": Place(column="theta", y=0.01 * SINE, resolution=0.0, unit="rad")}  # fmt: skip
    assert replace(made, plant=CartPendulum, places=other).moves("theta")
    assert not replace(made, places={}).moves("x_1")


def test_a_body_beside_a_wider_one_alike_was_held():
    made = case(a=SINE, b=0.19 * SINE, c=0.21 * SINE, angle=0.001 * SINE, units={"angle": "rad"})
    a, b, c, angle = (made.inspection.column(n) for n in ("a", "b", "c", "angle"))
    made = replace(made, plant=find("rectilinear-3"))
    assert made.widest("m") is a
    assert made.beside(b) == pytest.approx(0.19)
    assert [made.held(x) for x in (a, b, c)] == [False, True, False]
    assert made.beside(angle) == 1.0  # the only one in its unit
    assert not replace(made, plant=Furuta).held(b)
    assert made.span(b) == pytest.approx(0.38, rel=0.01)


def test_bodies_in_counts_or_lengths_are_alike_and_an_angle_is_not():
    assert case(a=SINE, b=SINE, units={"a": "mm", "b": "counts"}).chained
    assert not case(a=SINE, b=SINE, units={"a": "mm", "b": "rad"}).chained
    assert replace(case(a=SINE, units={"a": "rad"}), plant=find("torsional-1")).chained
    assert not replace(case(a=SINE), plant=CartPendulum).chained
    assert not any(replace(case(a=SINE), plant=find(name)).chained for name in ("flexible-link", "double-pendulum"))


def test_what_is_measured_is_what_is_placed_else_the_outputs_else_what_looks_like_a_place():
    said = {"index": {"remarks": ("the index of the row",)}, "off": {"constant": True}, "push": {"drive": True}}
    made = case(a=SINE, b=SINE, index=np.arange(200.0), off=0 * T, push=SINE, columns=said)
    assert [c.name for c in made.measured] == ["a", "b"]
    outputs = replace(made, record=made.record.replace(outputs=("b",)))
    assert [c.name for c in outputs.measured] == ["b"]
    placed = replace(made, places={"x": Place(column="push", y=SINE, resolution=0.0, unit="m")})
    assert [c.name for c in placed.measured] == ["push"]
    assert placed.coordinate("push") == "x"
    assert placed.coordinate("a") == "COORDINATE"


@pytest.mark.parametrize(
    ("factor", "stated", "line"),
    [
        (-1.0, {}, "sign = -1"),
        (-1.0, {"sign": -1.0}, "sign = 1"),
        (0.25, {}, "scale = 0.25"),
        (0.25, {"scale": 2.0}, "scale = 0.5"),
        (-3.0, {}, "scale = -3"),
    ],
)
def test_a_correction_comes_on_top_of_what_is_stated(factor, stated, line):
    known = batch("rectilinear-2", "", 1, seed=5)[0].wiring
    made = replace(case(x_1=SINE), stated={
        "x_1": replace(known.sensors["x_1"], **stated), "effort": replace(known.drive, **stated)
    })  # fmt: skip
    assert made.corrected("x_1", factor) == f"[sensors.x_1]\n{line}"
    assert made.corrected("effort", factor) == f"[drive]\n{line}"
    assert replace(made, stated={}).corrected("x_1", 2.0) == "[sensors.x_1]\nscale = 2"


def test_a_close_up_shows_forty_samples_before_and_after():
    made = case(a=SINE)
    (curve,) = made.near("a", 100).curves
    assert curve.t.tolist() == T[60:140].tolist()
    assert curve.y.tolist() == SINE[60:140].tolist()
    assert curve.style == "points"
    assert made.near("a", 10).curves[0].t[0] == 0.0
    assert made.near("a", 10).curves[0].t.size == 50
    panel, *rest = made.over_time("a", "nothing")
    assert rest == []
    assert (panel.label, panel.curves[0].style, panel.curves[0].t.size) == ("a [m]", "line", 200)


def test_a_drive_is_driven_where_an_effort_ever_leaves_zero():
    assert case(a=SINE, u=SINE, drive="u").driven
    assert not case(a=SINE, u=0 * T, drive="u").driven
    assert not case(a=SINE).driven


def test_a_column_tells_time_or_speed_by_what_is_known_of_it():
    said = {"a": {"remarks": ("the time again",)}, "b": {"unit": "", "guess": "deg"}}
    made = case(a=SINE, b=SINE, c=SINE, x_dot=SINE, units={"c": "m/s"}, columns=said)
    a, b, c, rate = (made.inspection.column(n) for n in ("a", "b", "c", "x_dot"))
    assert [tells_time(x) for x in (a, b)] == [True, False]
    assert [tells_speed(x) for x in (a, c, rate)] == [False, True, True]
    assert [column_unit(x) for x in (b, c)] == ["deg", "m/s"]


def test_a_locked_coordinate_is_not_read_and_the_others_are_as_stated():
    doctored = batch("rectilinear-2", "", 1, seed=5)[0]
    record, known = doctored.record, doctored.wiring
    inspection = inspect_record(record)
    both = case_of(record, inspection, doctored.rig, known)
    assert set(both.places) == {"x_1", "x_2"}
    assert both.zeroed
    assert both.stated.keys() == {"x_1", "x_2", "effort"}
    assert both.u == pytest.approx(known.drive.read(record))
    locked = case_of(record, inspection, doctored.rig, replace(known, locked=("x_2",), drive=None))
    assert set(locked.places) == {"x_1"}
    assert locked.locked == ("x_2",)
    assert (locked.drive, np.any(locked.u)) == ("", False)
    assert locked.stated.keys() == {"x_1", "x_2"}
    sensor = known.sensors["x_1"]
    y, resolution, _ = sensor.read(record)
    assert both.places["x_1"].y == pytest.approx(y)
    assert both.places["x_1"].unit == "m"
    step = inspection.column(sensor.column).resolution.step
    factor = abs(sensor.factor(sensor.column_unit(record, record[sensor.column])))
    assert both.places["x_1"].resolution == pytest.approx(resolution or step * factor)
    assert set(both.moduli[sensor.column]) == set(COUNTERS)  # a length makes no turn of its own


def test_an_angle_in_degrees_turns_at_360_of_its_column():
    doctored = batch("furuta", "", 1, seed=5)[0]
    sensor = doctored.wiring.sensors["theta"]
    made = case_of(doctored.record, inspect_record(doctored.record), doctored.rig, doctored.wiring)
    factor = sensor.factor(sensor.column_unit(doctored.record, doctored.record[sensor.column]))
    assert set(made.moduli[sensor.column]) == {2 * math.pi / factor, *COUNTERS}


@pytest.mark.parametrize(("unit", "factor"), [("m", 1.0), ("mm", 1e-3)])
def test_columns_that_are_recognised_are_in_the_coordinate_s_unit_from_their_rest(unit, factor):
    x = np.concatenate([np.full(200, 5.0), 5 + 30 * np.exp(-T) * SINE, np.full(400, 5.0)]) / (factor * 1e3)
    t = np.arange(x.size) * 0.01
    record = Record(t=t, signals={"x_1": x}, units={"x_1": unit}, provenance=Provenance(file="a.csv", reader="table"))
    made = case_of(record, inspect_record(record), find("rectilinear-1"), Wiring())
    (place,) = made.places.values()
    assert place.y == pytest.approx(factor * (x - x[0]), abs=1e-9)
    assert (place.unit, made.zeroed, made.plant) == ("m", False, find("rectilinear-1"))
    assert made.moduli == {"x_1": COUNTERS}


def test_friction_is_what_only_dissipates():
    friction = friction_of(CartPendulum)
    assert {"b_1", "b_2", "b_1c", "b_2c"} <= friction
    assert not {"m_p", "l_cg", "g", "m_c"} & friction


STUDY = """
[rig]
plant = "rectilinear-2"
[parameters]
m_1 = "2 kg"
m_2 = "1.5 kg"
k_12 = "400 N/m"
[drive]
column = "volts"
unit = "V"
[actuator]
gain = "5 N/V"
[sensors.x_1]
column = "a"
unit = "mm"
[sensors.x_2]
column = "b"
unit = "mm"
sign = -1
[[runs]]
file = "logs/one.csv"
locked = ["x_2"]
[[runs]]
file = "logs/two.csv"
loop = { kind = "recover", command = "volts" }
"""


def test_a_study_is_read_for_the_run_that_the_log_is(tmp_path):
    path = tmp_path / "study.toml"
    path.write_text(STUDY, encoding="utf-8")
    (rig, one), (_, other) = read_known(str(path), "elsewhere/one.csv"), read_known(str(path), "three.csv")
    assert (type(rig.plant), one.locked, rig.name) == (find("rectilinear-2"), ("x_2",), str(path))
    assert other.locked == ()
    assert one.sensors["x_1"].column == "a"
    assert other.sensors["x_2"].sign == -1.0
    assert one.drive.what.strip("`") == "volts"
    assert (rig.plant.m_2, rig.gain, rig.guessed) == (1.5, 5.0, frozenset())
    # what a loop puts out is not a command of its own
    assert read_known(str(path), "two.csv")[1].drive is None


def test_a_column_that_measures_a_sum_is_not_read_as_a_coordinate(tmp_path):
    path = tmp_path / "study.toml"
    both = STUDY.replace('column = "b"', 'column = "b"\nexpression = "x_2 - x_1"')
    path.write_text(both, encoding="utf-8")
    assert set(read_known(str(path), "three.csv")[1].sensors) == {"x_1"}


def test_a_rig_is_known_by_its_plant_s_name_and_by_nothing_else():
    assert read_known("furuta") == (Furuta, Wiring())
    with pytest.raises(BadInput, match="A rig is a plant's name, a study"):
        read_known("no-such-rig")


def test_counters_turn_at_a_turn_and_at_16_and_32_bits():
    assert (math.tau, 360.0, 2.0**16, 2.0**32) == COUNTERS


def test_an_angle_that_is_guessed_to_be_in_degrees_is_read_in_radians():
    t = np.arange(1200) * 0.01
    swing = np.where(t < 2, 0.0, 40 * np.exp(-0.6 * (t - 2)) * np.sin(5 * (t - 2)))
    record = Record(t=t, signals={"theta": swing}, units={"theta": "deg"}, provenance=Provenance(file="a.csv"))
    inspection = inspect_record(record)
    inspection = replace(inspection, columns=tuple(replace(c, guess="deg") for c in inspection.columns))
    (place,) = case_of(record, inspection, Pendulum, Wiring()).places.values()
    # from where it rests, which the end of the swing leaves open by a tenth of a degree or so
    assert np.ptp(place.y) == pytest.approx(math.radians(np.ptp(swing)))
    assert place.y[0] == pytest.approx(0.0, abs=0.01)
