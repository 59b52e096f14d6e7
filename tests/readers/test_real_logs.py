"""Are the public logs read as their authors describe them? Expected values are from the README of each."""

from __future__ import annotations

import math

import numpy as np
import pytest

from tests.readers.logs import real
from upright.errors import BadInput
from upright.readers import inspect, read

pytestmark = pytest.mark.real_data

EXPORT = "ecp210_rectilinear_ucsd_export/"
FRONT_END = "ecp210_rectilinear_ucsd_1khz/"
TORSIONAL = "ecp205_torsional_ucsd/"
CRANE = "crane_cart_pendulum_kawata/"
FURUTA = "furuta_diy_odrive/"
MULTIARM = "pendulum_single_multiarm_uw/"
COULOMB = "pendulum_cart_coulomb_aau/"


@pytest.mark.parametrize(
    ("name", "samples", "period", "tolerance"),
    [
        (EXPORT + "Open_Loop/test_3_1.csv", 677, 8.854e-3, 1e-6),
        (EXPORT + "Closed_Loop/closed_loop_pid.csv", 677, 8.854e-3, 1e-6),
        (FRONT_END + "07-Feb-2025 09_20_49.txt", 10000, 1.1275e-3, 1e-6),
        (FRONT_END + "21-Feb-2025 10_26_38.mat", 10000, 1.1275e-3, 1e-6),
        (TORSIONAL + "Jan141428.mat", 10001, 1.128e-3, 5e-7),
        (TORSIONAL + "Jan211506.mat", 20001, 1.128e-3, 5e-7),
        (CRANE + "cdip_pend_data.mat", 119934, 1e-3, 1e-9),
        ("crane_gantry_aau/meascrane.mat", 104145, 1.155e-3, 4e-6),
        ("crane_gantry_aau/posxdata.mat", 17287, 1.155e-3, 4e-6),
        ("flexible_robot_freqresp/step1.txt", 2000, 2e-3, 1e-9),
        (FURUTA + "hardware_pure_joint1_oscillations.csv", 20144, 2.00e-3, 5e-6),
        ("furuta_qube_servo_balance/qube_20230828T150615_434_696_394.csv", 10000, 2e-3, 1e-9),
        (COULOMB + "pend1test/test1pend1.csv", 10442, 6.67e-3, 5e-6),
        (MULTIARM + "SingleDataFreeSwing_1_Dt_0_0001.mat", 231757, 1e-4, 1e-10),
        (MULTIARM + "SinglePendulumDataForParameterEstimation.mat", 55001, 1e-3, 1e-9),
    ],
)
def test_length_and_true_period(name: str, samples: int, period: float, tolerance: float) -> None:
    time = inspect(real(name)).time
    assert time.samples == samples
    assert time.period == pytest.approx(period, abs=tolerance)


@pytest.mark.parametrize(
    ("name", "column", "counts"),
    [
        (CRANE + "cdip_pend_data.mat", "theta", 14400),
        (CRANE + "cdip_cart_pcont_data_kP_100_ref_02.mat", "theta", 14400),
        (MULTIARM + "SingleDataFreeSwing_1_Dt_0_0001.mat", "Theta1", 40000),
        ("furuta_qube_servo_balance/qube_20230828T150615_434_696_394.csv", "theta", 2048),
        ("furuta_qube_servo_balance/qube_20230828T150615_434_696_394.csv", "alpha", 2048),
        (COULOMB + "pend1test/test1pend1.csv", "c1", 2000),
    ],
)
def test_counts_of_the_encoders(name: str, column: str, counts: int) -> None:
    found = inspect(real(name)).column(column).resolution
    assert found.counts_per_rev == counts
    assert found.step == pytest.approx(2 * math.pi / counts, rel=2e-4)


@pytest.mark.parametrize(
    ("name", "column", "step", "relative"),
    [
        (CRANE + "cdip_least_square_data.mat", "z", 4.84e-5, 1e-3),
        (COULOMB + "cartTest1/testOffPointThree.csv", "c2", 8.8e-5, 1e-3),
        ("crane_gantry_aau/meascrane.mat", "y", 3.6e-3, 2e-3),
        ("crane_gantry_aau/posxdata.mat", "y", 2.4e-3, 2e-2),
        (TORSIONAL + "Jan141428.mat", "cart1pos", 1, 0),
    ],
)
def test_steps_of_the_other_sensors(name: str, column: str, step: float, relative: float) -> None:
    assert inspect(real(name)).column(column).resolution.step == pytest.approx(step, rel=relative)


def test_an_ecp_commanded_position_follows_the_encoder_in_open_loop_only() -> None:
    open_loop = inspect(real(EXPORT + "Open_Loop/test_3_1.csv"))
    assert "follows 'Encoder 1 Pos'" in open_loop.column("Commanded Pos").remarks[0]
    effort = open_loop.column("Control Effort")
    assert effort.unit == "V"
    assert [value for _, value in effort.switches] == [0.5, 0]
    assert effort.switches[1][0] == pytest.approx(3, abs=0.02)
    assert inspect(real(EXPORT + "Closed_Loop/closed_loop_pid.csv")).column("Commanded Pos").remarks == ()
    assert inspect(real(EXPORT + "Open_Loop/test_1_1.csv")).column("Control Effort").idle


@pytest.mark.parametrize(
    ("name", "column", "sentence"),
    [
        (FRONT_END + "07-Feb-2025 09_20_49.txt", "Control Effort", "573 = 0.7 V"),
        (FRONT_END + "07-Feb-2025 11_21_31.txt", "Control Effort", "491 = 0.6 V"),
        (FRONT_END + "21-Feb-2025 09_19_16.mat", "target_v", "409 = 0.5 V"),
        (FRONT_END + "21-Feb-2025 10_26_38.txt", "Control Effort", "the reference (levels 0 and 1000)"),
        (TORSIONAL + "Jan211424.mat", "target_value", "409 = 0.5 V"),
        (TORSIONAL + "28-Jan-2025 13_03_49.mat", "target_value", "the reference (levels 0 and -30000)"),
        (TORSIONAL + "Jan281420.mat", "duty_cycle", "first samples are outliers"),
        (COULOMB + "pend1test/test1pend1.csv", "c2", "difference quotient of 'c1'"),
        (COULOMB + "cartTest1/testOffPointThree.csv", "c3", "difference quotient of 'c2'"),
        (FURUTA + "hardware_pure_joint1_oscillations.csv", "__time", "a copy of the time"),
        (FRONT_END + "07-Feb-2025 09_20_49.txt", "Sample", "the sample index"),
    ],
)
def test_columns_that_lie_are_recognised(name: str, column: str, sentence: str) -> None:
    assert sentence in " ".join(inspect(real(name)).column(column).remarks)


def test_the_front_end_writes_the_same_run_as_text_and_as_matlab() -> None:
    stem = FRONT_END + "21-Feb-2025 10_26_38"
    text, mat = read(real(stem + ".txt")), read(real(stem + ".mat"))
    np.testing.assert_array_equal(text["Encoder 1 Pos"], mat["enc1"])
    np.testing.assert_array_equal(text["Control Effort"], mat["target_v"])
    assert any("P_gain = 0.0359, I_gain = 0.172, D_gain = 0.00163" in note for note in mat.provenance.notes)


def test_the_volts_are_on_from_5_to_10_s() -> None:
    switches = inspect(real(FRONT_END + "07-Feb-2025 09_20_49.txt")).column("Control Effort").switches
    assert [round(t, 2) for t, _ in switches] == [5.0, 10.0]


def test_the_crane_starts_a_few_hundredths_late() -> None:
    assert 0.01 < inspect(real(CRANE + "cdip_pend_data.mat")).time.late < 0.1


def test_the_bag_has_one_long_gap_and_holds_its_command() -> None:
    seen = inspect(real(FURUTA + "hardware_pure_joint1_oscillations.csv"))
    longest = max(seen.time.gaps, key=lambda gap: gap.length)
    assert longest.length == pytest.approx(0.043, abs=5e-4)
    assert not any(c.name.endswith("stamp") for c in seen.columns)
    record = read(real(FURUTA + "hardware_step_response_2V.csv"))
    command = record["/effort_control/data.0"]
    assert set(np.unique(command)) == {0.0, 2.0}
    assert np.count_nonzero(np.diff(command)) == 1
    # The arm turns a tenth of a radian within 50 ms of the command: command and states share one clock.
    arm = record["/joint_states/joint0/position"]
    on = record.t[np.argmax(command > 0)]
    assert record.t[np.argmax(np.abs(arm - arm[0]) > 0.1)] == pytest.approx(on, abs=0.05)


def test_a_bag_that_lost_its_first_command_says_so() -> None:
    # Published once a second; the arm turns 1 s before the first one that was recorded.
    lost = read(real(FURUTA + "hardware_step_response_4V.csv")).provenance.notes
    assert any("an earlier command was not recorded" in note for note in lost)


def test_the_qube_repeats_its_law_to_the_last_bit() -> None:
    record = read(real("furuta_qube_servo_balance/qube_20230828T150615_434_696_394.csv"))
    total = record["control_output"] + record["feedforward"]
    np.testing.assert_allclose(record["plant_input"], np.clip(total, -10, 10), atol=1e-14)


def test_the_multiarm_pieces_follow_on_from_each_other() -> None:
    record = read(real(MULTIARM + "SinglePendulumDataForParameterEstimation.mat"))
    assert record.t[-1] == pytest.approx(55.0)
    assert np.ptp(np.diff(record.t)) < 1e-12
    # Angle and rate belong together across the seams: the angle is the integral of the rate.
    angle, rate = record["Y_1"], record["Y_2"]
    integral = angle[0] + np.concatenate(([0], np.cumsum((rate[1:] + rate[:-1]) / 2 * np.diff(record.t))))
    assert np.abs(integral - angle).max() < 0.02


def test_a_file_of_parameters_is_no_log() -> None:
    with pytest.raises(BadInput, match=r"got only parameters: EstimatedParameters \(1x5\)"):
        read(real(MULTIARM + "EstimatedParameters_SinglePendulum.mat"))


def test_every_matlab_log_agrees_with_scipy() -> None:
    from scipy.io import loadmat

    for path in sorted(real("ecp205_torsional_ucsd").glob("*.mat")):
        record, content = read(path), loadmat(path)
        for name in record.names:
            np.testing.assert_array_equal(record[name], content[name].ravel().astype(float))
