"""Are the laws of real rigs found in their logs? Gains as their authors' settings files and programs state them."""

from __future__ import annotations

import numpy as np
import pytest

from tests.readers.logs import real
from upright.closed_loop import Recovery, recover_law
from upright.readers import read

pytestmark = [pytest.mark.real_data, pytest.mark.slow]

QUBE = "furuta_qube_servo_balance/qube_20230828T"
ECP205 = "ecp205_torsional_ucsd/"
ECP210 = "ecp210_rectilinear_ucsd_1khz/"
EXPORT = "ecp210_rectilinear_ucsd_export/Closed_Loop/"

CONTROLLER = {"kp theta": 6.0, "kd theta": 1.8, "kp alpha": 30.0, "kd alpha": 2.5}
TAU = 50.0  # rad/s, controller.toml


@pytest.mark.parametrize("name", ["150615_434_696_394", "161155_317_133_447", "162054_076_821_556"])
@pytest.mark.parametrize("column", ["control_output", "plant_input"])
def test_the_qube_law_reproduces_to_the_last_digits(name: str, column: str) -> None:
    record = read(real(f"{QUBE}{name}.csv"))
    limited = column == "plant_input"
    found = recover_law(
        record, measured=["theta", "alpha"], references=["target_theta", "target_alpha"], command=column,
        feedforward=["feedforward"] if limited else [],
    )  # fmt: skip
    assert found.quality == "exact"
    assert np.abs(found.residual[3:]).max() < 1e-12
    values = {gain: -found.gains[gain].value for gain in CONTROLLER}
    assert values == pytest.approx(CONTROLLER, rel=1e-10)
    assert 1 / found.gains["tau"].value == pytest.approx(TAU, rel=1e-10)
    if limited and np.abs(record[column]).max() == 10:
        assert found.law.limit == pytest.approx(10)


def ecp205(name: str) -> Recovery:
    record = read(real(f"{ECP205}{name}.mat"))
    return recover_law(record, measured=["cart1pos"], references=["target_value"], command="duty_cycle")


def ecp210(name: str) -> Recovery:
    record = read(real(f"{ECP210}21-Feb-2025 {name}.mat"))
    return recover_law(record, measured=["enc1"], references=["target_v"], command="duty")


@pytest.mark.parametrize(
    ("name", "stated"),
    [
        ("28-Jan-2025 13_03_49", {"kp": 1}),
        ("Jan281500", {"kp": 0.1125}),
        ("Jan281420", {"kp": 0.8, "ki": 0.7, "kd": 0.005}),
        ("Jan281509", {"kp": 0.8, "ki": 0.5, "kd": 0.02}),
        ("Jan291232", {"kp": 0.264, "ki": 0.18, "kd": 0.015}),
        ("29-Jan-2025 12_29_47", {"kp": 0.564, "ki": 0.18, "kd": 0.015}),
        ("p_0.6_d_0.01", {"kp": 0.6, "kd": 0.01}),
        ("p_0.6_d_0.01_i_0.5", {"kp": 0.6, "ki": 0.5, "kd": 0.01}),
        ("p_0.6_i_0.5_d_0.02", {"kp": 0.6, "ki": 0.5, "kd": 0.02}),
    ],
)
def test_the_gains_of_the_torsional_front_end_are_those_its_files_state(name: str, stated: dict[str, float]) -> None:
    found = ecp205(name)
    assert found.quality in ("exact", "rounding")
    assert found.largest < 0.55
    gains = {gain: value.value for gain, value in found.gains.items() if gain in ("kp", "ki", "kd")}
    # the program's idea of its period is off by a thousandth, and that scales ki and kd
    assert gains == pytest.approx(stated, rel=2e-3)
    if "kd" in stated:
        assert found.structure.endswith("two-tap difference of the measurement")
        assert found.gains["second tap"].value == pytest.approx(0.8, abs=0.01)


@pytest.mark.parametrize(
    ("name", "ki"),
    [
        ("10_26_38", 0.172),
        ("10_35_00", 0.22),  # runParameters say 0.35, an edit that came too late for this run
        ("10_47_19", 0.8),
    ],
)
def test_the_gains_of_the_rectilinear_front_end_are_negative(name: str, ki: float) -> None:
    found = ecp210(name)
    assert found.quality == "rounding"
    assert found.gains["kp"].value == pytest.approx(-0.0359, rel=5e-3)
    assert found.gains["kd"].value == pytest.approx(-0.00163, rel=5e-3)
    assert found.gains["ki"].value == pytest.approx(-ki, rel=2e-3)


def test_an_exported_p_loop_is_exact_and_its_pid_is_refused() -> None:
    columns = {"measured": ["Encoder 1 Pos"], "references": ["Commanded Pos"], "command": "Control Effort"}
    p = recover_law(read(real(f"{EXPORT}closed_loop_kp.csv")), **columns)
    assert p.structure == "P"
    assert p.quality == "rounding"
    # kp 0.5, 1.6 steps of 10 V/16380 per count
    low, high = p.gains["kp"].interval
    assert low < 0.5 * 1.6 * 10 / 16380 < high
    pid = recover_law(read(real(f"{EXPORT}closed_loop_pid.csv")), **columns)
    assert pid.quality == "poor"
