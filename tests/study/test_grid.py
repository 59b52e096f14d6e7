"""Is a log brought onto its uniform time base without loss, and refused where that cannot be? By closed forms."""

from __future__ import annotations

import math
import tomllib
from pathlib import Path

import numpy as np
import pytest

from upright.errors import BadInput
from upright.physics.statement import Coordinate
from upright.records import Record
from upright.study.sensors import Drive, Grid, Sensor, drive_unit, read_drives, read_sensors
from upright.study.text import Section, StudyText

THETA, X = Coordinate("theta", "rad", "angle"), Coordinate("x", "m", "place")


def test_a_grid_has_the_period_of_its_log_or_the_one_asked_for():
    t = 2.0 + 0.01 * np.arange(101)
    own = Grid.of(t)
    np.testing.assert_allclose(own.t, t, atol=1e-12)
    assert own.uniform
    assert own.description() == ()
    coarse = Grid.of(t, 0.04)
    np.testing.assert_allclose(coarse.t, 2.0 + 0.04 * np.arange(26), atol=1e-12)
    assert not coarse.uniform
    assert coarse.description() == ("resampled from 101 to 26 samples of 40 ms",)


def test_the_period_is_the_mean_of_the_steps_that_are_no_gaps():
    steps = np.tile([0.009, 0.011], 100)
    steps[50] = 0.03
    grid = Grid.of(np.r_[0, np.cumsum(steps)])
    assert grid.t[1] == pytest.approx(np.delete(steps, 50).mean())
    assert grid.notes == ()


@pytest.mark.parametrize(("off", "uniform"), [(0.019, True), (0.021, False)])
def test_a_sample_counts_as_on_the_grid_within_a_fiftieth_of_a_period(off, uniform):
    t = 0.01 * np.arange(101)
    t[7] += off * 0.01
    grid = Grid(source=t, t=0.01 * np.arange(101))
    assert grid.uniform is uniform


@pytest.mark.parametrize(("periods", "notes"), [(4.9, 0), (5.1, 1)])
def test_a_gap_of_more_than_five_periods_is_told(periods, notes):
    steps = np.full(200, 0.01)
    steps[100] = steps[20] = periods * 0.01
    steps[100] += 0.0002
    grid = Grid.of(np.r_[0, np.cumsum(steps)])
    at = float(np.sum(steps[:100]))
    told = f"2 gap(s) bridged by straight lines, the longest {steps[100]:.3g} s at {at:.4g} s"
    assert grid.notes == (told,) * notes
    if notes:
        assert grid.description()[0] == told


@pytest.mark.parametrize(
    ("periods", "n", "silent"), [(99, 1000, False), (101, 1000, True), (120, 3000, False), (160, 3000, True)]
)
def test_a_log_silent_for_a_hundred_periods_and_a_twentieth_of_it_is_refused(periods, n, silent):
    steps = np.full(n, 0.01)
    steps[500] = periods * 0.01
    t = np.r_[0, np.cumsum(steps)]
    if silent:
        with pytest.raises(BadInput, match=rf"silent from t = 5 to {5 + periods * 0.01:g} s; make one run"):
            Grid.of(t)
    else:
        assert len(Grid.of(t).notes) == 1


def test_a_run_has_eight_samples_to_ten_million():
    t = 0.01 * np.arange(1001)
    assert Grid.of(t, 1.4).t.size == 8
    with pytest.raises(BadInput, match=r"7 samples of 1\.5 s are too few for a run; at least 8"):
        Grid.of(t, 1.5)
    with pytest.raises(BadInput, match=r"10 s in steps of 9e-07 s are 1\.11e\+07 samples"):
        Grid.of(t, 9e-7)


def test_outputs_are_interpolated_references_held_and_commands_averaged():
    """Source 0, 1, 2, ..., grid of 2.5: a change at 3 lasts 4/5 of the interval from 2.5 to 5."""
    source = np.arange(21.0)
    grid = Grid(source=source, t=2.5 * np.arange(8))
    values = source**2
    np.testing.assert_allclose(grid.outputs(values)[:4], [0, 6.5, 25, 56.5])
    np.testing.assert_array_equal(grid.references(values)[:4], [0, 4, 25, 49])
    # from 0 to 2.5: 0 for 1, 1 for 1, 4 for 0.5; from 2.5 to 5: 4 for 0.5, 9, 16; from 5: 25, 36, 49 for 0.5
    np.testing.assert_allclose(grid.commands(values)[:3], [3 / 2.5, 27 / 2.5, (25 + 36 + 24.5) / 2.5])
    same = Grid(source=source, t=source)
    for bring in (same.outputs, same.references, same.commands):
        assert bring(values) is values


def test_an_instant_of_the_grid_reads_the_sample_of_that_instant():
    source = 0.1 * np.arange(31)
    grid = Grid(source=source, t=0.3 * np.arange(11))
    np.testing.assert_array_equal(grid.references(np.arange(31.0)), 3.0 * np.arange(11))
    np.testing.assert_allclose(grid.commands(np.arange(31.0))[:10], 3.0 * np.arange(10) + 1, atol=1e-9)


def log(x, unit: str = "") -> Record:
    x = np.asarray(x, dtype=float)
    return Record(t=np.arange(float(x.size)), signals={"c": x}, units={"c": unit})


@pytest.mark.parametrize(
    ("keys", "unit", "x", "line"),
    [
        ({}, "", [0, 1], (1.0, 0.0)),
        ({"unit": "deg"}, "", [0, 1], (math.pi / 180, 0.0)),
        ({"unit": "deg"}, "rad", [0, 1], (math.pi / 180, 0.0)),
        ({}, "deg", [0, 1], (math.pi / 180, 0.0)),
        ({}, "nonsense", [0, 1], (1.0, 0.0)),
        ({"scale": 3.0, "sign": -1.0, "unit": "deg"}, "", [0, 1], (-3 * math.pi / 180, 0.0)),
        ({"counts_per_rev": 1000.0}, "counts", [0, 1], (2 * math.pi / 1000, 0.0)),
        ({"counts_per_rev": 1000.0, "scale": 2.0}, "counts", [0, 1], (4 * math.pi / 1000, 0.0)),
        ({"counts_per_rev": 1000.0}, "", [0, 1, 3], (2 * math.pi / 1000, 0.0)),  # whole and wide: counts
        ({"counts_per_rev": 1000.0}, "", [0, 1, 2], (1.0, 0.0)),
        ({"counts_per_rev": 1000.0}, "", [0, 1, 3.5], (1.0, 0.0)),
        ({}, "", [0, 1, 4], (1.0, 0.0)),
        ({"scale": 0.5}, "V", [0, 1], (0.5, 0.0)),
        ({"offset": 2.0}, "deg", [0, 1], (math.pi / 180, 2.0)),
        ({"offset": "90 deg"}, "", [0, 1], (1.0, math.pi / 2)),
        ({"offset": "1 rad"}, "deg", [0, 1], (math.pi / 180, 180 / math.pi)),
        ({"offset": "180 deg", "counts_per_rev": 1000.0}, "counts", [0, 1], (2 * math.pi / 1000, 500.0)),
        ({"offset": "30 counts", "counts_per_rev": 1000.0}, "counts", [0, 1], (2 * math.pi / 1000, 30.0)),
        ({"offset": "200 mV", "scale": 0.5}, "V", [0, 1], (0.5, 0.2)),
    ],
)
def test_a_line_has_si_per_unit_of_the_column_and_its_zero(keys, unit, x, line):
    record = log(x, unit)
    sensor = Sensor(coordinate=THETA, column="c", **keys)
    assert sensor.line(record) == pytest.approx(line)
    np.testing.assert_allclose(sensor.read(record)[0], line[0] * (np.array(x) - line[1]))


@pytest.mark.parametrize(
    ("coordinate", "unit", "ways"),
    [
        (THETA, "counts", r'so theta needs counts_per_rev = \.\.\. or scale = "\.\.\. rad/counts"'),
        (X, "counts", r'so x needs counts_per_m = \.\.\. or scale = "\.\.\. m/counts"'),
        (X, "V", r'but x is in m: correct the unit, or give scale = "\.\.\. m/V"'),
    ],
)
def test_a_column_of_another_kind_needs_a_scale(coordinate, unit, ways):
    with pytest.raises(BadInput, match=rf"column 'c' is in {unit}, {ways}"):
        Sensor(coordinate=coordinate, column="c").line(log([0, 1], unit))


def test_a_resolution_is_the_stated_one_or_a_count():
    assert Sensor(coordinate=X, column="c", counts_per_m=200.0).read(log([0, 1]))[1] == 0.005
    assert Sensor(coordinate=X, column="c", counts_per_m=200.0, resolution=0.1).read(log([0, 1]))[1] == 0.1
    assert Sensor(coordinate=X, column="c").read(log([0, 1]))[1] == 0


@pytest.mark.parametrize(
    ("coordinate", "jump", "unwrapped"), [(THETA, 4.7, False), (THETA, 4.8, True), (X, 4.8, False)]
)
def test_an_angle_that_jumps_by_more_than_three_quarters_of_a_turn_is_unwrapped(coordinate, jump, unwrapped):
    values, _, notes = Sensor(coordinate=coordinate, column="c").read(log([0, jump, jump]))
    assert notes == (("c jumps by a turn and was unwrapped",) if unwrapped else ())
    assert values[1] == pytest.approx(jump - 2 * math.pi * unwrapped)


def test_a_drive_is_what_it_says_times_scale_and_sign():
    record = log([1, 2, 4])
    np.testing.assert_array_equal(Drive(what="`c`", scale=3.0, sign=-1.0).read(record), [-3, -6, -12])
    np.testing.assert_array_equal(Drive(scale=3.0).read(record), [0, 0, 0])


def section(text: str) -> Section:
    return StudyText(Path("study.toml"), text).root()


@pytest.mark.parametrize(
    ("text", "unit"),
    [
        ('[drive]\nunit = "V"\n[actuator]\ngain = "2 N/A"', "V"),
        ('[defaults]\ndrive = { unit = "mV" }', "mV"),
        ('[inputs.u]\nunit = "A"', "A"),
        ('[[runs]]\nlabel = "x"\n[[runs]]\ndrive = { unit = "V" }', "V"),
        ('[drive]\nunit = "furlongs"\n[actuator]\ngain = "2 N/A"', "A"),
        ('[drive]\nunit = 3\n[actuator]\ngain = { guess = "2 N m/V" }', "V"),
        ('[actuator]\ngain = { value = "2 (N m)/(mA)" }', "mA"),
        ("[actuator]\ngain = 2", ""),
        ('[actuator]\ngain = "2 N"', ""),
        ('[actuator]\ngain = "2 N/furlong"', ""),
        ("runs = 3\ninputs = 4", ""),
        ("", ""),
    ],
)
def test_the_unit_of_a_command_is_stated_or_that_below_the_gain(text, unit):
    assert drive_unit(section(text)) == unit


def drives(study: str, run: str) -> list[Drive]:
    from upright.physics import find

    text = StudyText(Path("study.toml"), study + "\n[[runs]]\n" + run)
    root = text.root()
    return read_drives(root, Section(text, ("runs", 0), tomllib.loads(text.text)["runs"][0]), find("cart-pendulum"))


DRIVE = '[drive]\ncolumn = "v"\nunit = "V"\nscale = 2\nsign = -1\n'


@pytest.mark.parametrize(
    ("study", "run", "what", "scale", "sign", "unit"),
    [
        (DRIVE, "", "`v`", 2, -1, "V"),
        (DRIVE, "drive = 0", "0", 2, -1, "V"),
        (DRIVE, 'drive = "3*w"', "3*w", 2, -1, "V"),
        (DRIVE, 'drive = { column = "w", scale = 5 }', "`w`", 5, -1, "V"),
        (DRIVE, "drive = { sign = 1 }", "`v`", 2, 1, "V"),
        (DRIVE, 'loop = { kind = "pid" }', None, 2, -1, "V"),
        (DRIVE, 'loop = { kind = "pid" }\ndrive = "w"', "w", 2, -1, "V"),
        ("", "", None, 1, 1, None),
    ],
)
def test_a_run_keeps_the_drive_of_the_rig_but_for_what_it_says(study, run, what, scale, sign, unit):
    (drive,) = drives(study, run)
    stated = drive.what if drive.what is None else drive.what.strip()
    assert stated == what or (what == "0" and float(stated) == 0)
    assert (drive.scale, drive.sign, drive.unit) == (scale, sign, unit)


@pytest.mark.parametrize(
    ("study", "run", "sentence"),
    [
        (
            DRIVE + 'expression = "2*v"\n',
            "",
            "line 6: a drive has either a column or an expression, got both",
        ),
        ("[drive]\nscale = 2\n", "", 'line 2: a drive needs column = "v" or expression'),
        (DRIVE, "drive = { sign = 2 }", "line 8: sign must be 1 or -1, got 2"),
        (DRIVE, "drive = { sign = true }", "sign must be 1 or -1, got true"),
        (DRIVE, "inputs = { w = 3 }", "has no input of CartPendulum called 'w'"),
        (DRIVE, "drive = { unit = 3 }", "needs unit as text"),
    ],
)
def test_a_drive_that_says_too_much_or_too_little_is_refused_by_line(study, run, sentence):
    with pytest.raises(BadInput) as caught:
        drives(study, run)
    assert sentence in str(caught.value)


def sensors(study: str, run: str = "") -> dict[str, Sensor]:
    from upright.physics import find

    text = StudyText(Path("study.toml"), study + "\n[[runs]]\n" + run)
    own = Section(text, ("runs", 0), tomllib.loads(text.text)["runs"][0])
    return {n: s for n, (s, _) in read_sensors(text.root(), own, find("cart-pendulum")).items()}


def test_a_sensor_is_read_key_by_key_and_a_run_changes_some():
    study = (
        '[sensors.theta]\ncolumn = "a"\nunit = "counts"\ncounts_per_rev = 4000\nsign = -1\noffset = "3 counts"\n'
        '[sensors.x]\ncounts_per_m = { value = 200, measured = true }\nresolution = "2 mm"\nscale = 2\noffset = 4\n'
    )
    theta, x = (sensors(study)[n] for n in ("theta", "x"))
    assert (theta.column, theta.unit, theta.counts_per_rev, theta.counts_per_m) == ("a", "counts", 4000, None)
    assert (theta.sign, theta.offset, theta.scale, theta.of, theta.resolution) == (-1, "3 counts", None, {}, None)
    assert (x.column, x.unit, x.counts_per_rev, x.counts_per_m) == ("x", None, None, 200)
    assert (x.sign, x.offset, x.scale, x.resolution) == (1, 4, 2, 0.002)
    changed = sensors(study, "[runs.sensors.theta]\nsign = 1\n")["theta"]
    assert (changed.sign, changed.column, changed.counts_per_rev) == (1, "a", 4000)
    assert list(sensors("[sensors.x]\n")) == ["x"]
    assert sensors('[sensors.x]\nexpression = "x + 2*theta"\n')["x"].of == {"x": 1, "theta": 2}
    assert sensors('[sensors.x]\nexpression = "x"\n')["x"].of == {}
    assert sensors('[sensors.x]\nunit = "mV"\nscale = "2 mm/V"\n')["x"].scale == pytest.approx(2e-6 * 1)
    assert sensors('[sensors.x]\nunit = "mm"\nscale = "2"\n')["x"].scale == 2


@pytest.mark.parametrize(
    ("study", "sentence"),
    [
        ("[sensors.x]\ncounts_per_rev = 3\n", "line 2: x is in m, so give counts_per_m or scale, not counts_per_rev"),
        ("[sensors.theta]\ncounts_per_m = 3\n", "theta is in rad, so give counts_per_rev or scale, not counts_per_m"),
        ("[sensors.x]\nscale = 0\n", "scale must not be zero"),
        ('[sensors.x]\nexpression = "2*theta"\n', "measures '2*theta', without x in it; call it [sensors.theta]"),
        ("[sensors.y]\n", "called 'y'"),
        ("[sensors.x]\ncounts_per_m = 0\n", "counts_per_m must be above zero, got 0"),
    ],
)
def test_a_sensor_that_cannot_be_is_refused_by_line(study, sentence):
    with pytest.raises(BadInput) as caught:
        sensors(study)
    assert sentence in str(caught.value)
