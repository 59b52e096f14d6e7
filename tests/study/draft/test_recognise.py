"""Is each thing that a log shows read from the column, the stretch and the sign that show it?"""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from upright.errors import BadInput
from upright.physics import BUILT_IN, CartPendulum, Furuta, find
from upright.readers import inspect
from upright.readers.inspection import Column, Inspection
from upright.readers.resolution import Resolution
from upright.records import Record
from upright.simulation import simulate
from upright.study.draft.recognise import (
    coupling,
    drive_column,
    in_dac_counts,
    moves_against,
    moving_window,
    named_after,
    plant_of,
    position_columns,
    recognise,
    rest_level,
    swing_frequency,
    zero_reading,
)


def col(name: str, guess: str = "", **more: Any) -> Column:
    about: dict[str, Any] = {
        "unit": "", "low": 0.0, "high": 1.0, "resolution": Resolution(), "constant": False, "low_share": 0.0,
        "high_share": 0.0, "turns": 0, "drive": False, "idle": False, "switches": (), "stepwise": False, "remarks": (),
    }  # fmt: skip
    return Column(name=name, guess=guess, **(about | more))


def log(dt: float = 0.01, inputs: tuple[str, ...] = (), **signals: Any) -> Record:
    columns = {name: np.asarray(x, dtype=float) for name, x in signals.items()}
    return Record(t=dt * np.arange(next(iter(columns.values())).size), signals=columns, inputs=inputs)


def resting(record: Record, *rests: tuple[float, float]) -> Inspection:
    return replace(inspect(record), rests=rests)


COUNTS = [col(f"e{i}", "counts") for i in range(4)]
ANGLES = [col(f"a{i}", "rad") for i in range(4)]
LENGTHS = [col(f"p{i}", "mm" if i == 1 else "m") for i in range(4)]
DISKS = [col(f"disk {i}", "deg" if i == 1 else "rad") for i in range(4)]
DRIVE = col("u", "V", drive=True)
AS_CARTS = "taken for a rectilinear chain; torsional"
HANGS = "; an angle that hangs would be --plant pendulum"
FURUTA = "Two angles were taken for arm and pendulum of a Furuta pendulum."


@pytest.mark.parametrize(
    ("places", "drive", "plant", "doubt"),
    [
        (COUNTS[:1], None, "rectilinear-1", f"Counts of 1 encoder were {AS_CARTS}-1 looks the same{HANGS}."),
        (COUNTS[:2], DRIVE, "rectilinear-2", f"Counts of 2 encoders were {AS_CARTS}-2 looks the same."),
        (COUNTS, None, "rectilinear-3", f"Counts of 3 encoders were {AS_CARTS}-3 looks the same."),
        ([col("disk 1", "counts"), COUNTS[0]], None, "torsional-2",
         "Counts of 2 encoders were taken for a torsional chain; rectilinear-2 looks the same."),
        ([col("c1")], None, "rectilinear-1",
         f"Column 'c1' says neither unit nor kind; it was {AS_CARTS}-1 looks the same{HANGS}."),
        ([COUNTS[0], col("c1")], None, "rectilinear-2",
         f"Column 'c1' says neither unit nor kind; it was {AS_CARTS}-2 looks the same."),
        ([col("theta", "counts")], None, "pendulum",
         "Counts of 'theta' were taken for the angle of a pendulum, by its name; torsional-1 looks the same."),
        ([col("arm", "counts"), col("pend", "counts")], DRIVE, "furuta",
         "Counts of 'pend' were taken for the angle of a pendulum, by its name, and those of 'arm' for its arm's; "
         "cart-pendulum looks the same."),
        ([col("pole", "counts"), col("cart_pos", "counts")], DRIVE, "cart-pendulum",
         "Counts of 'pole' were taken for the angle of a pendulum, by its name, and those of 'cart_pos' for its cart's "
         "place."),
        ([col("theta1", "counts"), col("theta2", "counts")], DRIVE, "torsional-2",
         "Counts of 2 encoders were taken for a torsional chain; rectilinear-2 looks the same."),
        ([ANGLES[0], LENGTHS[0]], None, "cart-pendulum", ""),
        ([ANGLES[0], LENGTHS[1]], DRIVE, "cart-pendulum", ""),
        ([ANGLES[0], col("d", "deg")], None, "furuta", FURUTA),
        ([DISKS[0], ANGLES[0]], None, "furuta", FURUTA),
        (DISKS[:2], None, "torsional-2", "Several angles were taken for disks on a shaft."),
        (DISKS, None, "torsional-3", "Several angles were taken for disks on a shaft."),
        (LENGTHS[:2], None, "rectilinear-2", "Positions were taken for carts on springs."),
        ([LENGTHS[1]], None, "rectilinear-1", "Positions were taken for carts on springs."),
        (LENGTHS, None, "rectilinear-3", "Positions were taken for carts on springs."),
        ([COUNTS[0], LENGTHS[0]], None, "rectilinear-1", "Positions were taken for carts on springs."),
        (ANGLES[:1], None, "pendulum", ""),
        (ANGLES[:1], DRIVE, "pendulum", "One angle was taken for a pendulum on a fixed pivot."),
        ([col("position", "deg", high=1800.0)], DRIVE, "torsional-1",
         "'position' turns 5 times: taken for a disk."),
        ([col("position", "rad", high=6.0 * math.pi)], DRIVE, "pendulum",
         "One angle was taken for a pendulum on a fixed pivot."),
        ([col("position", "deg", high=1800.0)], None, "pendulum", ""),
        ([COUNTS[0], ANGLES[0]], None, "pendulum", ""),
    ],
)  # fmt: skip
def test_units_and_names_of_what_moves_tell_the_plant(places, drive, plant, doubt):
    assert plant_of(places, drive) == (plant, doubt)


T = 0.01 * np.arange(1000)
SWING = 0.5 * np.cos(5 * T) + 0.02 * np.sin(11 * T)
OTHER = 0.3 * np.cos(3 * T + 1)


def positions(record: Record, seen: Inspection | None = None) -> list[tuple[str, str]]:
    return [(c.name, c.guess) for c in position_columns(record, seen or inspect(record))]


def test_places_are_what_moves_and_is_measured():
    signals = {
        "theta": SWING, "theta_dot": SWING**2, "x": OTHER, "command": SWING * OTHER, "alpha": 0 * T,
        "voltage of it": OTHER, "phi": 2 * SWING,
    }  # fmt: skip
    record = log(**signals)
    assert positions(record) == [("x", "m")]  # theta and phi are each other's copies
    assert positions(record.replace(signals=signals | {"phi": 2 * SWING + 0.01 * OTHER})) == [
        ("theta", "rad"), ("x", "m"), ("phi", "rad"),
    ]  # fmt: skip
    fed = log(theta=SWING, x=OTHER, inputs=("x",))
    assert positions(fed) == [("theta", "rad")]


def test_of_two_equal_columns_the_first_is_the_place_and_of_a_copied_drive_the_place():
    assert positions(log(theta=SWING, phi=SWING, x=OTHER)) == [("theta", "rad"), ("x", "m")]
    assert positions(log(command=SWING, theta=SWING, x=OTHER)) == [("theta", "rad"), ("x", "m")]


def test_the_slope_of_a_place_is_a_speed_whatever_it_is_called():
    slope = np.gradient(SWING, T)
    assert positions(log(theta=SWING, phi=slope)) == [("theta", "rad")]
    blurred = slope + 0.6 * slope.std() * np.sin(41 * T)  # smoothed, they correlate by 0.94
    assert positions(log(theta=SWING, x=blurred)) == [("theta", "rad"), ("x", "m")]
    near = slope + 0.2 * slope.std() * np.sin(41 * T)  # by 0.99
    assert positions(log(theta=SWING, x=near)) == [("theta", "rad")]


@pytest.mark.parametrize(("share", "moves"), [(0.0099, False), (0.0101, True)])
def test_what_moves_by_less_than_a_hundredth_of_its_kind_is_locked(share, moves):
    theta = np.ptp(SWING) * share / np.ptp(OTHER) * OTHER
    names = [name for name, _ in positions(log(phi=SWING, theta=theta, x=1e-5 * SWING * OTHER))]
    assert names == (["phi", "theta", "x"] if moves else ["phi", "x"])


def test_counts_of_a_cart_and_of_a_pendulum_are_not_compared_where_their_columns_are_named():
    """An encoder on a rail may count 250 times as much as one on a hinge, and the pendulum moves nonetheless."""
    few = np.round(100 * OTHER / np.ptp(OTHER))
    signals = {"x [counts]": np.round(30_000 * SWING / np.ptp(SWING)), "theta [counts]": few}
    record = log(**signals)
    record = record.replace(units=dict.fromkeys(record.names, "counts"))
    assert [c.name for c in position_columns(record, inspect(record))] == ["x [counts]", "theta [counts]"]
    found = recognise(record, inspect(record))
    assert found.plant == "cart-pendulum"
    assert {n: c.name for n, c in found.columns.items()} == {"x": "x [counts]", "theta": "theta [counts]"}


@pytest.mark.parametrize("form", ["{}", "{} [counts]", "{}_counts", "{} (counts)"])
def test_columns_called_as_the_coordinates_of_a_rig_are_believed(form):
    record = log(**{form.format("theta"): np.round(4000 * SWING), form.format("psi"): np.round(4000 * OTHER)})
    record = record.replace(units=dict.fromkeys(record.names, "counts"))
    found = recognise(record, inspect(record))
    assert (found.plant, list(found.columns)) == ("furuta", ["psi", "theta"])
    assert found.columns["psi"].name == form.format("psi")


def test_theta_and_alpha_are_arm_and_pendulum():
    """As Quanser calls them; a flexible link has coordinates of these names, and is drafted where it is named."""
    record = log(theta=SWING, alpha=OTHER)
    record = record.replace(units=dict.fromkeys(record.names, "rad"))
    assert recognise(record, inspect(record)).plant == "furuta"
    assert recognise(record, inspect(record), "flexible-link").plant == "flexible-link"


def test_a_column_without_a_unit_counts_only_where_none_has_one():
    assert positions(log(c1=SWING, c2=OTHER)) == [("c1", ""), ("c2", "")]
    assert positions(log(c1=SWING, theta=OTHER)) == [("theta", "rad")]


@pytest.mark.parametrize(
    ("rest", "size", "guess"),
    [
        (math.pi + 0.09, 1, "rad"), (math.pi + 0.11, 1, ""), (math.pi - 0.09, 1, "rad"), (math.pi - 0.11, 1, ""),
        (-math.pi, 1, "rad"), (0.0, 1, ""), (math.pi, 0.31, "rad"), (math.pi, 0.29, ""),
    ],
)  # fmt: skip
def test_what_rests_half_a_turn_from_zero_is_an_angle(rest, size, guess):
    """Swings of a whole range `size` about where it rests in the end."""
    x = rest + size / 2 * np.cos(5 * T)
    assert positions(log(c1=x)) == [("c1", guess)]


def passages(n: int) -> np.ndarray:
    """Slow motion of 6 to one side and the other, so often across; with one more on this side its median is 1.55."""
    phase = np.pi * (np.arange(1000) + 0.5) / 1000 * (n + 1)
    return 6.0 * np.sin(phase) * (1 + 0.001 * np.cos(7 * T))


@pytest.mark.parametrize(("x", "guess"), [(passages(4), "deg"), (passages(3), "rad"), (0.5 * passages(9), "rad")])
def test_a_swing_of_more_than_half_a_turn_to_and_fro_is_in_degrees(x, guess):
    assert positions(log(theta=x)) == [("theta", guess)]
    record = log(theta=x)
    stated = Record(t=record.t, signals=record.signals, units={"theta": "rad"})
    assert positions(stated) == [("theta", "rad")]
    seen = inspect(record)
    counted = replace(seen, columns=(replace(seen.columns[0], resolution=Resolution(step=0.003, counts_per_rev=2000)),))
    assert positions(record, counted) == [("theta", "rad")]


def test_degrees_that_were_guessed_are_doubted():
    record = log(theta=passages(5))
    sentence = "'theta' swings to and fro by more than half a turn in rad: taken for degrees."
    assert sentence in recognise(record, inspect(record)).doubts
    named = log(theta_deg=np.degrees(passages(5)))  # its name says so
    assert not any("taken for degrees" in doubt for doubt in recognise(named, inspect(named)).doubts)


def test_converter_counts_are_known_by_their_sentence():
    assert in_dac_counts(col("u", remarks=("other", "the command in DAC counts (819 per V: 409 = 0.5 V)")))
    assert not in_dac_counts(col("u", remarks=("the reference (levels 0 and 100)",)))
    assert not in_dac_counts(col("u"))


def test_the_command_is_what_is_called_so_before_what_only_looks_so():
    switched = np.where((T > 1) & (T < 2), 0.5, 0.0)
    dac = np.where(T > 1, 409.0, 0.0)
    wobble = SWING * OTHER

    def name(record: Record) -> str | None:
        found = drive_column(record, inspect(record))
        return found.name if found else None

    assert name(log(theta=SWING)) is None
    assert name(log(theta=SWING, signal=switched)) == "signal"
    assert name(log(theta=SWING, signal=switched, voltage=wobble)) == "voltage"
    assert name(log(signal=switched, other=2 * switched + switched**2, **{"f [N]": wobble})) == "f [N]"
    assert name(log(voltage=wobble, **{"Control Effort": dac})) == "Control Effort"
    assert name(log(voltage=0 * T, signal=switched)) == "signal"
    assert name(log(theta=SWING, command=np.where(T > 1, 0.5, 0.0), reference=switched)) == "command"
    assert name(log(theta=SWING, reference=switched)) is None
    assert name(log(theta=SWING, voltage=2 * SWING)) is None  # a copy of what was measured
    first = wobble.copy()
    first[0] = 400
    assert name(log(theta=SWING, voltage=first)) == "voltage"
    assert name(log(voltage=wobble, push=switched, inputs=("push",))) == "push"
    assert name(log(voltage=wobble, push=switched, inputs=("push", "voltage"))) == "voltage"
    assert name(log(voltage=wobble, push=0 * T, inputs=("push",))) == "voltage"


def test_the_only_column_in_volts_beside_places_is_the_command_whatever_its_language():
    wobble, speed = SWING * OTHER, np.gradient(SWING, T)

    def name(place: str = "deg", **volts: Any) -> str | None:
        signals = {"Winkel": SWING, **volts}
        units = {**dict.fromkeys(volts, "V"), "Winkel": place}
        record = Record(t=T, signals=signals, units=units)
        found = drive_column(record, inspect(record))
        return found.name if found else None

    assert name(Tension=wobble) == "Tension"
    assert name(Tension=wobble, Spannung=wobble**2) is None  # nobody knows which
    assert name(Tension=speed) is None  # a tachometer
    assert name(Pendel=wobble) is None  # a potentiometer
    assert name(battery=wobble) is None
    assert name(Tension=wobble, place="") is None  # both may be potentiometers
    record = Record(t=T, signals={"Winkel": SWING, "Tension": wobble}, units={"Winkel": "deg", "Tension": "V"})
    assert any("'Tension' is the only column in V" in doubt for doubt in recognise(record, inspect(record)).doubts)
    stated = Record(t=T, signals=record.signals, units=record.units, inputs=("Tension",))
    assert not any("Tension" in doubt for doubt in recognise(stated, inspect(stated)).doubts)


def test_columns_are_assigned_by_name_then_by_kind_then_by_order():
    two = {"pend": SWING, "arm": OTHER}
    record = log(**two)
    found = recognise(record, inspect(record), "furuta")
    assert {n: c.name for n, c in found.columns.items()} == {"psi": "arm", "theta": "pend"}
    record = log(theta=SWING, phi=OTHER)
    found = recognise(record, inspect(record), "furuta")
    assert {n: c.name for n, c in found.columns.items()} == {"psi": "theta", "theta": "phi"}
    record = log(phi=SWING, theta=OTHER, position=SWING * OTHER)
    found = recognise(record, inspect(record), "cart-pendulum")
    assert {n: c.name for n, c in found.columns.items()} == {"x": "position", "theta": "theta"}
    record = log(phi=SWING)
    found = recognise(record, inspect(record), "furuta")
    assert list(found.columns) == ["psi"]
    assert "No column was found for theta; lock it, leave it unmeasured or name its column." in found.doubts
    record = log(position=SWING)
    with pytest.raises(BadInput, match="no column looks like angle of the pendulum, 0 hanging; choose another --plant"):
        recognise(record, inspect(record), "pendulum")


def test_counts_stand_in_for_angle_and_length_where_no_column_has_the_unit():
    record = log(enc1=np.round(900 * SWING), enc2=np.round(700 * OTHER))
    found = recognise(record, inspect(record), "cart-pendulum")
    assert {n: c.name for n, c in found.columns.items()} == {"x": "enc1", "theta": "enc2"}


HELD = np.r_[np.full(60, 2.0), 2 + np.sin(0.3 * np.arange(140))]
PUSH = np.r_[np.zeros(60), np.ones(140)]


@pytest.mark.parametrize(
    ("x", "u", "guess", "hangs", "window", "zero"),
    [
        (HELD, PUSH, "rad", True, (0, 2), 2.0),
        (np.r_[np.full(10, 9.0), HELD[10:]], PUSH, "m", False, (0, 2), 2.0),  # the fifty samples before the command
        (np.r_[np.full(40, 9.0), HELD[40:]], PUSH, "m", False, (0, 2), 9.0),  # 30 of them at 9
        (HELD, 1 - PUSH, "m", False, (1.0, 2), HELD[100]),  # driven from the first sample on
        (HELD, 1 - PUSH, "rad", False, (1.0, 2), "rest"),
        (HELD[55:], PUSH[55:], "m", False, (1.0, 2), 2.0),
        (HELD[56:], PUSH[56:], "m", False, (1.0, 2), HELD[156]),  # four samples are too few
        (HELD + 0.2 * np.sin(np.arange(200)), PUSH, "deg", True, (0, 2), "rest"),  # it swings already
        (HELD + 0.02 * np.sin(np.arange(200)), PUSH, "deg", True, (0, 2), 2.0),
        (HELD, None, "rad", True, (0, 2), "rest"),
    ],
)
def test_zero_is_where_a_body_lay_before_the_command(x, u, guess, hangs, window, zero):
    record = log(x=x, **({} if u is None else {"u": u}))
    seen = resting(record, (0.0, 0.01), (0.01 * x.size - 0.05, 0.01 * x.size - 0.01))
    last = float(np.median(x[-5:]))
    drive = None if u is None else col("u", "V")
    read = zero_reading(record, seen, col("x", guess), drive, window, hangs=hangs)
    assert read == pytest.approx(last if zero == "rest" else zero, abs=0.021 if hangs else 1e-12)


@pytest.mark.parametrize("idle", [0, 60])
def test_an_arm_that_may_stand_anywhere_is_zero_where_it_begins_and_not_where_a_drive_took_it(idle: int) -> None:
    """A pendulum that swings freely moves the arm before the first command, and the drive turns it by whole turns."""
    t = 0.01 * np.arange(1000)
    arm, pendulum = 0.3 * np.sin(6 * t) - 4.0 * t, 0.5 * np.cos(6 * t)
    u = np.where(np.arange(1000) < idle, 0.0, np.sign(np.sin(2 * t)))
    record = log(inputs=("u",), u=u, psi=arm, theta=pendulum)
    found = recognise(record, inspect(record), "furuta")
    assert found.rest["psi"] == 0.0


RAMP = np.arange(1000.0)


@pytest.mark.parametrize(
    ("x", "rests", "level"),
    [
        (RAMP, [(9.0, 9.99)], 949.5),
        (RAMP, [(9.0, 9.5)], 925.0),  # ends in the last twentieth
        (RAMP, [(9.0, 9.48)], 899.5),  # does not: the middle of the last fifth
        (RAMP, [], 899.5),
        (np.r_[RAMP[:800], np.tile([3.0, 8.0], 100)], [], 5.5),
        (np.r_[RAMP[:800], np.tile([3.0, 8.0], 100)], [(0.1, 0.3)], 20.0),  # within a tenth of the range of the middle
        (np.r_[RAMP[:800], np.tile([3.0, 8.0], 100)], [(0.21, 0.3)], 5.5),  # not at the start
        (np.r_[RAMP[:800], np.tile([3.0, 8.0], 100)], [(0.1, 1.9)], 5.5),  # 100 is a hand's place
        (RAMP, [(0.0, 0.1), (9.6, 9.7), (9.8, 9.9)], 985.0),
    ],
)
def test_a_body_rests_where_it_lies_still_in_the_end(x, rests, level):
    record = log(x=x)
    assert rest_level(record["x"], resting(record, *rests), record.t) == pytest.approx(level)


def fading(n: int, size: float = 1.0) -> np.ndarray:
    k = np.arange(n)
    return size * np.exp(-k / 150) * np.cos(0.2 * k)


SWITCHED = col("u", "V", drive=True, switches=((3.0, 1.0), (4.0, 0.0)))


@pytest.mark.parametrize(
    ("drive", "pushed", "rests", "window"),
    [
        (SWITCHED, False, [(0.1, 2.5)], (2.9, 9.99)),
        (SWITCHED, True, [(0.1, 2.5)], (2.9, 9.99)),
        (SWITCHED, False, [(0.3, 2.5)], (0.0, 9.99)),  # it did not lie still at the start
        (SWITCHED, False, [], (0.0, 9.99)),
        (replace(SWITCHED, switches=((0.05, 1.0),)), False, [(0.0, 0.04)], (0.0, 9.99)),
        (replace(SWITCHED, switches=()), False, [(0.1, 2.5)], (0.0, 9.99)),
        (SWITCHED, False, [(0.1, 2.5), (8.0, 9.6)], (2.9, 8.5)),
        (SWITCHED, False, [(0.1, 2.5), (8.0, 9.4)], (2.9, 9.99)),  # it moves again
        (SWITCHED, False, [(0.1, 2.5), (3.8, 9.99)], (2.9, 9.99)),  # at rest from the beginning: no stretch
        (SWITCHED, False, [(0.1, 2.5), (4.0, 9.99)], (2.9, 4.5)),
        (SWITCHED, False, [(8.0, 9.9)], (0.0, 8.5)),
        (None, True, [(0.1, 2.5)], (2.4, 9.99)),
        (None, True, [], (0.0, 9.99)),
        (None, True, [(0.0, 0.04), (9.7, 9.99)], (0.0, 9.99)),
    ],
)
def test_a_stretch_begins_before_the_command_or_the_push_and_ends_at_rest(drive, pushed, rests, window):
    record = log(x=SWING)
    found = moving_window(record, resting(record, *rests), [SWING], drive, pushed=pushed)
    assert found == pytest.approx(window)


def test_a_free_swing_begins_where_it_is_last_as_large_as_ever_and_ends_where_it_is_gone():
    x = np.r_[np.full(200, 1.0), fading(800)]
    record = log(x=x)
    seen = resting(record)
    start, stop = moving_window(record, seen, [0 * x, x], None, pushed=False)
    middle = float(x[-200:].max() + x[-200:].min()) / 2
    swing = np.abs(x - middle)
    assert start == pytest.approx(0.01 * np.flatnonzero(swing >= 0.95 * swing.max())[-1])
    assert 2.0 <= start <= 2.02
    assert stop == pytest.approx(0.01 * np.flatnonzero(swing >= 0.03 * swing.max())[-1] + 0.5)
    assert stop < 8


def test_a_stretch_too_short_to_be_one_is_the_whole_log():
    """Under a tenth of the log, and a second."""
    record = log(x=SWING)
    late = replace(SWITCHED, switches=((9.2, 1.0),))
    assert moving_window(record, resting(record, (0.0, 1.0)), [SWING], late, pushed=False) == (0.0, 9.99)
    late = replace(SWITCHED, switches=((9.05, 1.0),))
    assert moving_window(record, resting(record, (0.0, 1.0)), [SWING], late, pushed=False)[0] == pytest.approx(8.95)
    slow = log(0.1, x=SWING)
    late = replace(SWITCHED, switches=((95.0, 1.0),))
    assert moving_window(slow, resting(slow, (0.0, 1.0)), [SWING], late, pushed=False)[0] == pytest.approx(94.9)


@pytest.mark.parametrize(
    ("u", "x", "against"),
    [
        ([0, 0, 1, 1, 1, 1], [0, 0, 0, 1, 2, 3], False),
        ([0, 0, 1, 1, 1, 1], [0, 0, 0, -1, -2, -3], True),
        ([0, 0, -1, -1, -1, -1], [0, 0, 0, -1, -2, -3], False),
        ([2, 2, 1, 1, 1, 1], [0, 0, 0, 1, 2, 3], True),  # down from 2
        ([0, 0, 1, 1, 1, 1], [0, 0, 0, -0.05, 1, 3], False),  # less than 3 % of the range is no motion
        ([0, 0, 1, 1, 1, 1], [0, 0, 0, -0.15, 1, 3], True),
        ([0, 0, 1, 1, -1, -1], [0, 0, 0, 0, -2, -3], False),  # it went down after the command had changed sign
        ([0, 0, 0, 0, 0, 0], [0, 0, 0, -1, -2, -3], False),
        ([0, 0, 1, 1, 1, 1], [5, 4, 3, 2.5, 2, 1], True),
    ],
)
def test_a_short_log_tells_the_sign_of_its_drive_by_the_first_motion(u, x, against):
    t = 0.01 * np.arange(6)
    assert moves_against(t, np.array(u, dtype=float), np.array(x, dtype=float)) is against


def test_the_first_motion_is_looked_for_within_two_seconds():
    u = np.r_[0.0, np.ones(49)]
    for k, against in ((16, True), (17, False)):
        x = np.zeros(50)
        x[k:] = -1
        assert moves_against(0.125 * np.arange(50), u, x) is against


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_a_cart_that_swings_back_when_its_first_command_comes_tells_the_sign_by_its_acceleration(sign):
    """1 kg on 100 N/m, let go at -5 cm 0.3 s before: it moves against the push, and is accelerated along it."""
    t = 0.005 * np.arange(1000)
    u = np.where((t > 0.3) & (t % 3 < 1.5), 2.0, 0.0)
    cart = find("rectilinear-1")(m_1=1.0, k_1=100.0, c_1=0.5)
    x = simulate(cart, {}, [-0.05, 0.0], u, 0.005, samples=t.size)[:, 0, 0]
    begins = int(np.argmax(u > 0))
    assert x[begins + 20] < x[begins]
    assert moves_against(t, u, sign * x) is (sign < 0)


def triangle(crossings: int, half: float, dt: float = 0.01) -> tuple[np.ndarray, np.ndarray]:
    """Straight lines to and fro through zero, the first passage after a quarter of a swing."""
    t = np.arange(0, (crossings + 0.45) * half, dt) + 3.0
    phase = (t - 3.0) / half
    return t, np.abs((phase + 1.5) % 2 - 1) * 2 - 1


@pytest.mark.parametrize(("crossings", "half"), [(4, 1.0), (9, 0.37), (30, 0.213)])
def test_the_frequency_of_a_swing_is_half_a_turn_between_its_passages(crossings, half):
    t, x = triangle(crossings, half)
    assert swing_frequency(t, x) == pytest.approx(math.pi / half, rel=1e-9)
    assert swing_frequency(t, -5 * x) == pytest.approx(math.pi / half, rel=1e-9)


def test_three_passages_make_no_frequency():
    assert swing_frequency(*triangle(3, 1.0)) == 0.0
    assert swing_frequency(np.array([0.0]), np.array([1.0])) == 0.0
    assert swing_frequency(T, 0 * T) == 0.0
    assert swing_frequency(T, 1 + 0.1 * np.cos(9 * T)) == 0.0


def test_noise_about_zero_is_no_swing():
    assert swing_frequency(T, SWING + 0.01 * np.random.default_rng(1).normal(size=T.size)) == pytest.approx(5, rel=0.01)


def test_the_last_twenty_halves_tell_the_frequency():
    """Forty large swings are slower than the twenty-one passages after them."""
    slow, fast = triangle(20, 0.5), triangle(30, 0.4)
    t = np.r_[slow[0], slow[0][-1] + 0.01 + fast[0] - fast[0][0]]
    x = np.r_[slow[1], fast[1]]
    assert swing_frequency(t, x) == pytest.approx(math.pi / 0.4, rel=1e-6)


def thrown(c: float, fades: float = 0.0) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Pendulum whose hinge moves to and fro, ``theta'' = c cos(theta) x'' - w^2 sin(theta)``, by scipy.

    Both motions die out at the rate `fades` where there is one.
    """
    from scipy.integrate import solve_ivp

    t, f = 0.01 * np.arange(800), fades

    def slope(s: float, y: np.ndarray) -> list[float]:
        push = 0.2 * math.exp(-f * s) * ((f**2 - 9) * math.sin(3 * s) - 6 * f * math.cos(3 * s))
        return [y[1], c * math.cos(y[0]) * push - 25 * math.sin(y[0]) - 2 * f * y[1]]

    theta = solve_ivp(slope, (0, t[-1]), [0.1, 0], t_eval=t, rtol=1e-8).y[0]
    return t, 0.2 * np.exp(-f * t) * np.sin(3 * t), theta


@pytest.mark.parametrize("c", [2.0, -2.0, 0.5])
def test_the_coupling_of_a_thrown_pendulum_is_found(c):
    """A cart throws its pendulum against its acceleration, eq. (A1), an arm along with it, fig. 3a."""
    assert coupling(CartPendulum, *thrown(c)) == pytest.approx(-c, rel=0.01)
    assert np.sign(coupling(Furuta, *thrown(c))) == np.sign(c)


def test_what_is_not_thrown_has_no_coupling():
    t, x, theta = thrown(0.0)
    assert coupling(CartPendulum, t, x, theta) == 0.0
    assert coupling(CartPendulum, t[:35], x[:35], thrown(2.0)[2][:35]) == 0.0  # under four spans of a tenth of a second


def test_an_ordinary_log_is_recognised_as_a_whole():
    """A cart throws its pendulum against its acceleration; a mirrored column says the opposite."""
    t, x, theta = thrown(-2.0, fades=1.0)
    for sign in (1, -1):
        record = log(x=x, theta=0.3 + sign * theta)
        seen = resting(record)
        found = recognise(record, seen)
        assert found.plant == "cart-pendulum"
        assert found.mirrored is (sign < 0)
        assert (found.drive, found.reversed, found.settled) == (None, False, False)
        assert found.window == pytest.approx((0, t[-1]))
        late = record["theta"][-160:]
        assert found.rest["theta"] == pytest.approx((late.max() + late.min()) / 2)
        turned = log(arm=x, theta=0.3 + sign * theta)
        arm = recognise(turned, resting(turned), "furuta")
        assert arm.mirrored is (sign > 0)
    assert recognise(record, resting(record, (0.0, 0.01))).settled


def test_a_log_in_which_nothing_moves_names_its_file_and_what_to_look_at():
    record = log(alpha=0 * T)
    with pytest.raises(BadInput, match="no column moves like an angle, a position or a count; `upright show`"):
        recognise(record, inspect(record))


@pytest.mark.parametrize("plant", BUILT_IN)
def test_columns_are_named_after_the_one_plant_on_a_driven_body_that_has_just_these_coordinates(plant):
    """Carts, disks and links share their names with each other, a single angle is called theta by everybody."""
    own = [c.name for c in find(plant).coordinates]
    named = plant if plant in ("cart-pendulum", "furuta") else ""
    assert named_after([col(name) for name in own]) == named
    assert named_after([col(f"{name} (rad)") for name in reversed(own)]) == named
    assert named_after([col(name) for name in (*own, "delta")]) == ""
    assert named_after([col(name) for name in own[:1]]) == ""
