"""Does each line of a drafted study say what was seen, in the unit beside it? Values worked out by hand."""

from __future__ import annotations

import math
import tomllib
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from tests.study.draft.test_recognise import col, log, resting
from upright.physics import find
from upright.physics.statement import Coordinate
from upright.readers.inspection import Column
from upright.readers.resolution import Resolution
from upright.study.draft.described import counts_of, describe, is_cut_off
from upright.study.draft.pendulum import Balanced, balance_of, pendulum_tables, recognised_upright, starts_upright
from upright.study.draft.recognise import Recognised
from upright.study.draft.tables import command_unit, drive_table, rig_toml, run_tables, sensor_table
from upright.study.text import TomlTable, study_text

DAC = ("the command in DAC counts (819 per V: 409 = 0.5 V)",)


def read(*tables: TomlTable) -> dict[str, Any]:
    return tomllib.loads(study_text(tables))


def comments(*tables: TomlTable) -> dict[str, str]:
    """What stands behind the key of each line, keys that are commented out included."""
    lines = [line.removeprefix("# ") for line in study_text(tables).splitlines() if " = " in line]
    return {line.partition(" = ")[0]: line.partition("   # ")[2] for line in lines}


@pytest.mark.parametrize(
    ("column", "unit", "factor"),
    [
        (col("u", "V"), "V", 1.0), (col("u", "V", unit="mV"), "V", 1e-3), (col("u"), "", 1.0),
        (col("u", "kN"), "N", 1e3), (col("u", "N mm"), "N m", 1e-3), (col("u", "counts", remarks=DAC), "V", 1 / 819),
    ],
)  # fmt: skip
def test_a_command_has_its_unit_without_a_prefix_or_that_of_its_converter(column, unit, factor):
    assert command_unit(column) == (unit, factor)


@pytest.mark.parametrize(
    ("unit", "scale", "against", "keys", "said"),
    [
        ("V", 1.0, False, {"unit": "V"}, "-1.5 to 2.5 V"),
        ("", 1.0, False, {}, "-1.5 to 2.5"),
        ("V", 1 / 819, True, {"unit": "V", "scale": 0.001221, "sign": -1}, "-1.5 to 2.5 DAC counts"),
    ],
)
def test_a_drive_says_its_range_its_scale_and_its_sign(unit, scale, against, keys, said):
    table = drive_table(col("push", low=-1.5, high=2.5), unit, scale, reversed_=against)
    assert read(table)["drive"] == {"column": "push"} | keys
    assert comments(table)["column"] == said
    assert ("# unit" in str(table)) == (not unit)


THETA, X = Coordinate("theta", "rad", "angle"), Coordinate("x", "m", "place")


@pytest.mark.parametrize(
    ("where", "column", "zero", "mirrored", "keys"),
    [
        (THETA, col("a", "rad", low=-1, high=2), 0.25, False, {"unit": "rad", "offset": 0.25}),
        (THETA, col("a", "counts"), 3.0, True,
         {"unit": "counts", "counts_per_rev": {"value": 4096, "assumed": True}, "offset": 3.0, "sign": -1}),
        (X, col("a", "counts"), 3.0, False,
         {"unit": "counts", "counts_per_m": {"value": 4096, "assumed": True}, "offset": 3.0}),
        (THETA, col("a", "rad", resolution=Resolution(step=math.pi / 1000, counts_per_rev=2000)), 0, False,
         {"unit": "rad", "counts_per_rev": {"value": 2000, "measured": True}, "offset": 0.0}),
        (X, col("a", "m", resolution=Resolution(step=math.pi / 1000, counts_per_rev=2000)), 0, False,
         {"unit": "m", "resolution": {"value": "0.003142 m", "measured": True}, "offset": 0.0}),
        (THETA, col("a", "rad", resolution=Resolution(step=0.02)), 0, False,
         {"unit": "rad", "resolution": {"value": "0.02 rad", "measured": True}, "offset": 0.0}),
        (X, col("a", "mm", resolution=Resolution(step=0.02)), 0, False,
         {"unit": "mm", "resolution": {"value": "0.02 mm", "measured": True}, "offset": 0.0}),
        (X, col("a", "mm", resolution=Resolution(step=0.1, decimals=True)), 0, False,
         {"unit": "mm", "resolution": {"value": "0.1 mm", "assumed": True}, "offset": 0.0}),
        (THETA, col("a", "deg", resolution=Resolution(hidden=0.01)), 0, False,
         {"unit": "deg", "resolution": {"value": "0.01 deg", "assumed": True}, "offset": 0.0}),
        (X, col("a", high=100.0), 0.99e-7, False, {"offset": 0.0}),
        (X, col("a", high=100.0), 1.01e-7, False, {"offset": 1.01e-7}),
        (X, col("a", low=-100.0, high=0.0), -0.99e-7, False, {"offset": 0.0}),
    ],
)  # fmt: skip
def test_a_sensor_says_its_unit_its_steps_its_zero_and_its_sign(where, column, zero, mirrored, keys):
    table = sensor_table(where, column, zero, (4096, "see the encoder"), driven=True, mirrored=mirrored)
    assert read(table)["sensors"][where.name] == {"column": "a"} | keys
    told = comments(table)
    assert told["column"] == f"{column.low:g} to {column.high:g} {column.guess}".rstrip()
    assert told.get("unit", "") == ("guessed; the log does not say" if column.guess else "")
    assert told["offset"] == f"reading at which {where.name} is zero, here where it lay before the first command"
    assert ("# sign" in str(table)) == (not mirrored)
    free = sensor_table(where, column, zero, (4096, "see the encoder"), driven=False)
    assert comments(free)["offset"].endswith("here where it comes to rest")


def test_a_stated_unit_is_not_called_a_guess():
    table = sensor_table(X, col("a", "m", unit="m"), 0, (1, ""), driven=True)
    assert comments(table)["unit"] == ""


def test_runs_have_their_window_and_a_rig_its_coarser_period():
    one, two = read(*run_tables("a.csv", [("up", 1.0, 2.5, "fit"), ("down", 3.0, 4.25, "predict")]))["runs"]
    assert one == {"label": "up", "file": "a.csv", "window": [1.0, 2.5], "role": "fit"}
    assert two == {"label": "down", "file": "a.csv", "window": [3.0, 4.25], "role": "predict", "refit": True}
    rig = rig_toml("pendulum", find("pendulum"), log(0.002, x=np.arange(5)), 0.008)
    assert read(rig)["rig"] == {"plant": "pendulum", "period": "8 ms"}
    assert comments(rig) == {
        "plant": "coordinates: theta [rad] angle of the pendulum, 0 hanging",
        "period": "the log has a sample every 2 ms",
    }  # fmt: skip
    assert read(rig_toml("pendulum", find("pendulum"), log(x=np.arange(5))))["rig"] == {"plant": "pendulum"}


def shown(plant: str, columns: dict[str, Column], **more: Any) -> Recognised:
    about: dict[str, Any] = {
        "rest": dict.fromkeys(columns, 0.0), "drive": None, "reversed": False, "throw": 0.0, "window": (1.0, 5.0),
        "frequency": 5.0, "settled": False, "doubts": (),
    }  # fmt: skip
    return Recognised(plant=plant, columns=columns, **(about | more))


WIDE = 2.0 * np.sin(0.05 * np.arange(600))  # no pendulum that is kept upright
RECORD = log(x=WIDE, psi=WIDE, theta=WIDE, u=WIDE)
SEEN = resting(RECORD)
ARM, PENDULUM, CART = col("psi", "rad", high=0.8), col("theta", "rad"), col("x", "m", high=0.4)
U = col("u", "V", drive=True, low=-3.0, high=2.0)
L = 9.81 / 25


def drafted(found: Recognised) -> dict[str, Any]:
    return read(*pendulum_tables(RECORD, SEEN, found, "log.csv", "log")[1])


def test_a_hanging_pendulum_starts_from_the_length_of_its_period():
    study = drafted(shown("pendulum", {"theta": PENDULUM}))
    given = study["parameters"]
    assert {n: v for n, v in given.items() if "value" in v} == {
        "m_p": {"value": "1 kg", "assumed": True}, "J_p": {"value": "0 kg m^2", "assumed": True},
    }  # fmt: skip
    asked = {n: v["guess"] for n, v in given.items() if "guess" in v}
    assert asked == {
        "l_cg": f"{L:.3g} m", "b_2": f"{0.002 * 5 * L**2:.3g} N m s/rad", "b_2c": f"{0.002 * 9.81 * L:.3g} N m",
        "b_2q": f"{0.002 * L**2:.3g} N m s^2/rad^2",
    }  # fmt: skip
    assert study["defaults"] == {"unknown": ["initial", "offset"]}
    assert [(r["label"], r["window"]) for r in study["runs"]] == [("log", [1.0, 5.0])]
    still = drafted(shown("pendulum", {"theta": PENDULUM}, frequency=0.0))
    assert still["parameters"]["l_cg"]["guess"] == f"{9.81 / 36:.3g} m"


@pytest.mark.parametrize(("stop", "runs"), [(1 + 12.1 * 2 * math.pi / 5, 2), (1 + 11.9 * 2 * math.pi / 5, 1)])
def test_the_tail_of_more_than_twelve_free_swings_is_kept_for_prediction(stop, runs):
    found = shown("pendulum", {"theta": PENDULUM}, window=(1.0, stop))
    told = drafted(found)["runs"]
    assert len(told) == runs
    if runs == 2:
        split = 1 + 0.6 * (stop - 1)
        assert [(r["label"], r["role"]) for r in told] == [("log start", "fit"), ("log tail", "predict")]
        assert [r["window"] for r in told] == [
            pytest.approx([1, split], rel=1e-4),
            pytest.approx([split, stop], rel=1e-4),
        ]
    torque = shown("pendulum", {"theta": PENDULUM}, window=(1.0, stop), drive=U)
    assert len(drafted(torque)["runs"]) == 1


def test_a_driven_cart_pendulum_starts_from_a_gain_that_moves_it_as_far():
    found = shown("cart-pendulum", {"x": CART, "theta": PENDULUM}, drive=U, settled=True, reversed=True, throw=-0.8)
    study = drafted(found)
    given = study["parameters"]
    assert {n: v["value"] for n, v in given.items() if "value" in v} == {
        "m_p": "0.1 kg", "J_p": "0 kg m^2",
    }  # fmt: skip
    assert {n: v["guess"] for n, v in given.items() if "guess" in v} == {
        "m_c": "1 kg",
        "l_cg": f"{L:.3g} m", "b_2": f"{0.002 * 5 * 0.1 * L**2:.3g} N m s/rad",
        "b_2c": f"{0.001 * 9.81 * 0.1 * L:.3g} N m",
        "b_1": "1.1 N s/m", "b_1c": "0.11 N",
    }  # fmt: skip
    # 1.1 kg that swing 0.2 m to each side at 5 rad/s, by 3 V
    assert study["actuator"] == {"gain": {"guess": f"{1.1 * 0.2 * 25 / 3:.3g} N/V", "min": 0}}
    assert study["drive"] == {"column": "u", "unit": "V", "sign": -1}
    assert study["sensors"]["theta"]["sign"] == -1
    assert "sign" not in study["sensors"]["x"]
    assert study["defaults"] == {"unknown": ["initial"]}
    counted = {"x": col("x", "counts", high=1000.0), "theta": PENDULUM}
    dac = col("u", "counts", low=0.0, high=819.0, remarks=DAC)
    gain = drafted(shown("cart-pendulum", counted, drive=dac, frequency=0.0))["actuator"]["gain"]["guess"]
    assert gain == f"{1.1 * 500 * 4e-4 * 36:.3g} N/V"


@pytest.mark.parametrize(("guess", "high", "metres"), [("mm", 400.0, 0.2), ("m", 0.4, 0.2)])
def test_a_gain_does_not_depend_on_the_unit_of_the_column(guess, high, metres):
    found = shown("cart-pendulum", {"x": col("x", guess, high=high), "theta": PENDULUM}, drive=U)
    assert drafted(found)["actuator"]["gain"]["guess"] == f"{1.1 * metres * 25 / 3:.3g} N/V"


def test_an_arm_is_held_where_nothing_says_what_drove_it():
    study = drafted(shown("furuta", {"psi": ARM, "theta": PENDULUM}))
    given = study["parameters"]
    assert {n: v["value"] for n, v in given.items() if "value" in v} == {
        "m_p": "0.1 kg", "J_p": "0 kg m^2", "J_d": "0.001 kg m^2",
    }  # fmt: skip
    assert given["r"] == {"guess": "0.1 m", "max": "5 m"}
    thrown = drafted(shown("furuta", {"psi": ARM, "theta": PENDULUM}, throw=-0.8))
    assert thrown["parameters"]["r"]["guess"] == f"{0.8 * L:.3g} m"  # its hinge's acceleration is r psi''
    assert "b_1" not in given
    assert study["defaults"] == {"held": ["psi"], "unknown": ["initial", "offset"]}
    driven = drafted(shown("furuta", {"psi": ARM, "theta": PENDULUM}, drive=U))
    assert {n: v["guess"] for n, v in driven["parameters"].items() if "guess" in v and n[0] in "Jb"} == {
        "J_d": "0.001 kg m^2", "b_1": "0.002 N m s/rad", "b_1c": "0.0002 N m",
        "b_2": f"{0.002 * 5 * 0.1 * L**2:.3g} N m s/rad",
        "b_2c": f"{0.001 * 9.81 * 0.1 * L:.3g} N m",
    }  # fmt: skip
    assert driven["actuator"]["gain"]["guess"] == f"{2e-3 * 0.4 * 25 / 3:.3g} (N m)/V"
    assert "held" not in driven["defaults"]
    locked = drafted(shown("furuta", {"theta": PENDULUM}))
    assert locked["defaults"] == {"locked": ["psi"], "unknown": ["initial", "offset"]}
    assert {"J_d", "r"} <= {n for n, v in locked["parameters"].items() if v.get("assumed")}
    alone = drafted(shown("furuta", {"theta": PENDULUM}, drive=U))
    assert "b_1" not in alone["parameters"]


def test_a_long_log_is_fitted_on_a_grid_of_two_hundred_steps_a_swing():
    """50 000 samples of 1 ms at 5 rad/s: 6.28 ms, in whole samples."""
    long = log(0.001, x=np.arange(50_000))
    for stop, period in ((42.0, "6 ms"), (40.9, None)):
        found = shown("pendulum", {"theta": PENDULUM}, window=(1.0, stop))
        tables = pendulum_tables(long, resting(long), found, "log.csv", "log")[1]
        assert read(*tables)["rig"].get("period") == period
    still = shown("pendulum", {"theta": PENDULUM}, window=(1.0, 42.0), frequency=0.0)
    assert "period" not in read(*pendulum_tables(long, resting(long), still, "log.csv", "log")[1])["rig"]


UPRIGHT = Balanced(rate=7.0, throw=0.8, pull=-12.0, centre=0.25)
LEVER = 9.81 / 49


def test_a_balanced_pendulum_is_sized_by_the_rate_at_which_it_falls():
    assert UPRIGHT.length == pytest.approx(LEVER)
    assert UPRIGHT.arm() == pytest.approx(0.8 * LEVER)
    assert Balanced(rate=7.0, throw=-0.1, pull=1, centre=0).arm() == pytest.approx(0.3 * LEVER)
    assert Balanced(rate=7.0, throw=-9.0, pull=1, centre=0).arm() == pytest.approx(3 * LEVER)
    assert UPRIGHT.inertia("cart-pendulum") == 0.5
    assert UPRIGHT.inertia("furuta") == pytest.approx(0.2 * (0.8 * LEVER) ** 2)
    assert UPRIGHT.gain("cart-pendulum") == 6.0
    assert Balanced(rate=7.0, throw=1, pull=0, centre=0).gain("cart-pendulum") == 5e-7


def test_numbers_of_a_balanced_pendulum_follow_from_its_inertia():
    cart = starts_upright(UPRIGHT, "cart-pendulum")
    # of the hinge, two thousandths of m l^2 times the rate, and a thousandth of the pendulum's weight on its lever
    hinge = {"b_2": 0.002 * 7.0 * 0.1 * LEVER**2, "b_2c": 0.001 * 9.81 * 0.1 * LEVER}
    assert {n: v for n, (v, _) in cart.assumed.items()} == {"m_p": 0.1, "J_p": 0.0, "m_c": 0.5}
    assert cart.guesses == pytest.approx({"l_cg": LEVER, "b_1": 1.0, "b_1c": 0.12} | hinge)
    assert cart.uncertain == {}
    arm, inertia = starts_upright(UPRIGHT, "furuta"), 0.2 * (0.8 * LEVER) ** 2
    assert {n: v for n, (v, _) in arm.assumed.items()} == {"m_p": 0.1, "J_p": 0.0}
    assert arm.guesses == pytest.approx(
        {"l_cg": LEVER, "b_1": 2 * inertia, "b_1c": 0.24 * inertia, "J_d": inertia / 2, "k_psi": 2 * inertia} | hinge
    )
    assert arm.uncertain == {"r": (pytest.approx(0.8 * LEVER), "30 %")}


@pytest.mark.parametrize(
    ("plant", "throw", "mirrored"),
    [("furuta", 0.8, False), ("furuta", -0.8, True), ("cart-pendulum", 0.8, False), ("cart-pendulum", -0.8, True)],
)
def test_a_pendulum_thrown_against_its_plants_convention_is_mirrored(plant, throw, mirrored):
    columns = {"psi": ARM, "theta": col("theta", "deg")}
    found = recognised_upright(shown(plant, columns), Balanced(rate=7.0, throw=throw, pull=-1.0, centre=0.2))
    assert found.mirrored is mirrored
    assert found.reversed
    assert not recognised_upright(shown(plant, columns), Balanced(rate=7, throw=1, pull=1, centre=0)).reversed
    assert found.rest == {"psi": 0.0, "theta": pytest.approx(math.degrees(0.2 + (math.pi if mirrored else -math.pi)))}
    assert found.frequency == 7.0
    assert found.doubts[-1].startswith("The pendulum falls away from where it is kept: it was taken for balanced")


def balancing(theta: float = 0.02) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Arm on which ``theta'' = -0.5 psi'' + 36 theta`` and ``psi'' = 40 u``, kept up by state feedback and a shaker."""
    dt, n = 0.004, 3000
    x, out = np.array([0.0, 0.0, theta, 0.0]), np.zeros((n, 3))
    A = np.array([[0, 1, 0, 0], [0, 0, 0, 0], [0, 0, 0, 1], [0, 0, 36.0, 0]])
    B = np.array([0, 40.0, 0, -20.0])
    from scipy.linalg import expm
    from scipy.signal import place_poles

    K = place_poles(A, B[:, None], [-4, -5, -6 + 2j, -6 - 2j]).gain_matrix[0]
    step = expm(np.block([[A, B[:, None]], [np.zeros((1, 5))]]) * dt)
    for k in range(n):
        u = -K @ x + 0.05 * np.sin(11 * k * dt) + 0.05 * np.sin(5 * k * dt)
        out[k] = x[0], x[2], u
        x = step[:4, :4] @ x + step[:4, 4] * u
    return out[:, 0], out[:, 1], out[:, 2]


def test_a_balanced_arm_tells_its_rate_its_throw_and_its_pull():
    psi, theta, u = balancing()
    record = log(0.004, psi=psi, theta=theta + 3.0, u=u)
    columns = {"psi": col("psi", "rad"), "theta": col("theta", "rad")}
    found = balance_of(record, shown("furuta", columns, drive=U))
    assert found is not None
    assert found.rate == pytest.approx(6.0, rel=0.02)
    assert found.throw == pytest.approx(0.5, rel=0.02)  # upright an arm throws its pendulum backward
    assert found.pull == pytest.approx(40.0, rel=0.02)
    assert found.centre == pytest.approx(3.0, abs=0.01)
    study = read(*pendulum_tables(record, resting(record), shown("furuta", columns, drive=U), "l.csv", "l")[1])
    assert study["defaults"] == {"horizon": ["50 ms", "200 ms"], "unknown": ["offset.theta", "input_offset"]}
    assert study["actuator"]["delay"] == {"guess": "1 ms", "max": "10 ms"}
    assert study["sensors"]["theta"]["offset"] == pytest.approx(3.0 - math.pi, abs=0.01)
    wide = log(0.004, psi=psi, theta=theta * 0.65 / np.abs(theta - np.median(theta)).max(), u=u)
    assert balance_of(wide, shown("furuta", columns, drive=U)) is None  # beyond 0.6 rad it falls
    rare = log(0.004, psi=psi, theta=theta, u=np.where(np.arange(u.size) % 4, u, 0.0))
    assert balance_of(rare, shown("furuta", columns, drive=U)) is None  # a loop is at work all the time
    assert balance_of(record, shown("furuta", columns)) is None
    assert balance_of(record, shown("furuta", {"theta": columns["theta"]}, drive=U)) is None
    assert balance_of(record, shown("torsional-2", columns, drive=U)) is None
    short = record.window(0, 1.2)
    assert balance_of(short, shown("furuta", columns, drive=U)) is None


def described(found: Recognised, seen=SEEN) -> tuple[dict[str, Any], dict[str, str], str]:
    found, tables = pendulum_tables(RECORD, seen, found, "log.csv", "log")
    describe(tables, RECORD, seen, found)
    return read(*tables), comments(*tables), study_text(tables)


def test_a_limit_is_that_of_a_command_that_is_cut_off_and_not_of_the_top_of_steps():
    t = 0.01 * np.arange(2000)
    sine, steps = np.clip(4 * np.sin(3 * t), -3, 3), np.repeat(np.random.default_rng(1).uniform(-3, 3, 40), 50)
    assert is_cut_off(sine, 0.3)
    assert not is_cut_off(steps, 0.025)
    assert not is_cut_off(2 * np.sin(3 * t), 0.0)
    assert not is_cut_off(np.sign(np.sin(3 * t)), 0.5)


def test_nobody_measured_the_limit_that_a_log_shows():
    columns = {"x": CART, "theta": PENDULUM}
    study, told, text = described(shown("cart-pendulum", columns, drive=U))
    assert "limit" not in study["actuator"]
    assert '# limit = "3 V"' in text
    assert told["limit"].startswith("MEASURE")
    assert study["rig"]["servo_period"] == {"value": "10 ms", "assumed": True}
    assert '# travel = "0.2 m"' in text
    assert "travel" not in described(shown("cart-pendulum", columns))[2]


@pytest.mark.parametrize(
    ("plant", "guess", "high", "vendor", "travel"),
    [
        ("cart-pendulum", "mm", 400.0, "ECP 210", "0.2 m"),
        ("furuta", "deg", 90.0, "ECP 205", "0.785 rad"),
        ("furuta", "counts", 90.0, "ECP 205", "... rad"),
    ],
)
def test_a_log_of_converter_counts_is_an_ecp_rigs(plant, guess, high, vendor, travel):
    dac = col("u", "counts", drive=True, low=0.0, high=819.0, remarks=DAC)
    first = "x" if plant == "cart-pendulum" else "psi"
    columns = {first: col(first, guess, high=high), "theta": PENDULUM}
    seen = replace(SEEN, columns=(dac,))
    study, _, text = described(shown(plant, columns, drive=dac), seen)
    assert study["rig"]["vendor"] == vendor
    assert "servo_period" not in study["rig"]
    assert f'# travel = "{travel}"' in text
    assert '# limit = "1 V"' in text
    assert counts_of(seen, "rad")[0] == 16000
    assert counts_of(seen, "m")[0] == 226629
    assert counts_of(SEEN, "rad")[0] == 4096
    assert counts_of(SEEN, "m")[0] == 10_000
    assert counts_of(replace(SEEN, reader="ecp"), "rad")[0] == 16000
