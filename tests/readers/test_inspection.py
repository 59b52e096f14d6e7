"""Is a log seen through: its steps, its remarks, its gaps and when it rests?"""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from upright.readers import inspect
from upright.readers.resolution import resolution_of
from upright.records import Record


def swing(n: int = 4000, dt: float = 2e-3) -> tuple[np.ndarray, np.ndarray]:
    t = dt * np.arange(n)
    return t, 0.9 * np.exp(-0.3 * t) * np.cos(5 * t)


def counted(x: np.ndarray, step: float) -> np.ndarray:
    return step * np.round(x / step)


@settings(deadline=None)
@given(st.sampled_from([2000, 2048, 4096, 8192, 14400, 16000, 40000]), st.floats(-3, 3))
def test_the_counts_of_an_encoder_are_found(counts: int, offset: float) -> None:
    _, theta = swing()
    found = resolution_of(counted(theta, 2 * math.pi / counts) + offset)
    assert found.counts_per_rev == counts
    assert found.step == pytest.approx(2 * math.pi / counts, rel=1e-9)


@pytest.mark.parametrize("decimals", [5, 6, 9])
def test_the_counts_survive_text_with_few_decimals(decimals: int) -> None:
    _, theta = swing()
    found = resolution_of(np.round(counted(theta, 2 * math.pi / 2000), decimals))
    assert found.counts_per_rev == 2000


@settings(deadline=None)
@given(st.floats(2e-5, 1e-2).filter(lambda step: abs(math.log10(step) % 1) > 1e-6))  # 1e-3 could be decimals
def test_a_linear_encoder_has_its_step_and_no_revolution(step: float) -> None:
    _, x = swing()
    found = resolution_of(counted(x, step))
    assert found.step == pytest.approx(step, rel=1e-6)


def test_a_converter_is_told_from_the_digits_of_its_text() -> None:
    _, x = swing()
    found = resolution_of(np.round(counted(30 * x, 80 / 4096), 6))  # 12 bits over +-40 V, always an even last digit
    assert found.step == pytest.approx(80 / 4096, rel=1e-5)
    assert resolution_of(counted(x, 2e-5)).step == pytest.approx(2e-5)


def test_a_smooth_signal_has_no_step() -> None:
    rng = np.random.default_rng(5)
    assert resolution_of(rng.normal(size=3000)).step == 0
    assert resolution_of(swing()[1]).step == 0


def test_whole_counts_are_exact() -> None:
    assert resolution_of(np.array([0.0, 6, -9, 3, 12])).step == 3


def test_a_difference_quotient_is_no_sensor_but_a_tachometer_is() -> None:
    t, theta = swing()
    theta_counts = counted(theta, 2 * math.pi / 2000)
    quotient = np.diff(theta_counts, prepend=theta_counts[0]) / 2e-3
    filtered = np.zeros_like(quotient)
    for k in range(1, t.size):
        filtered[k] = filtered[k - 1] + 0.2 * (quotient[k] - filtered[k - 1])
    tachometer = np.gradient(theta, t) + np.random.default_rng(0).normal(0, 0.01, t.size)
    record = Record(t=t, signals={"p": theta_counts, "v": quotient, "vf": filtered, "tacho": tachometer})
    seen = inspect(record)
    assert "backward difference quotient of 'p'" in seen.column("v").remarks[0]
    assert "first-order filter (weight 0.2)" in " ".join(seen.column("vf").remarks)
    assert seen.column("tacho").remarks == ()
    assert seen.column("p").remarks == ()


@pytest.mark.parametrize("weight", [0.05, 0.4, 0.7])
def test_the_weight_of_a_filtered_difference_quotient_is_that_of_its_program(weight: float) -> None:
    """v[k] - v[k-1] is the weight times what the new quotient is ahead of the last value."""
    t, theta = swing()
    counts = counted(theta, 2 * math.pi / 2000)
    quotient = np.diff(counts, prepend=counts[0]) / 2e-3
    filtered = np.zeros_like(quotient)
    for k in range(1, t.size):
        filtered[k] = filtered[k - 1] + weight * (quotient[k] - filtered[k - 1])
    remarks = inspect(Record(t=t, signals={"p": counts, "v": filtered})).column("v").remarks
    assert f"first-order filter (weight {weight:.2g})" in " ".join(remarks)


def test_an_exact_rate_beside_an_exact_position_is_not_accused() -> None:
    t, theta = swing()
    assert inspect(Record(t=t, signals={"p": theta, "v": np.gradient(theta, t)})).column("v").remarks == ()


def test_copies_of_time_index_and_other_columns_are_named() -> None:
    t, theta = swing(500)
    seen = inspect(
        Record(t=t, signals={"received": t + 4e-4, "Sample": np.arange(500), "x": theta, "deg": theta * 180 / math.pi})
    )
    assert "a copy of the time, 0.4 ms later" in seen.column("received").remarks[0]
    assert "sample index" in seen.column("Sample").remarks[0]
    assert "times 57.2958" in seen.column("deg").remarks[0]


@pytest.mark.parametrize(
    ("level", "sentence"),
    [(409, "409 = 0.5 V"), (573, "573 = 0.7 V"), (-491, "-491 = -0.6 V"), (1000, "the reference")],
)
def test_an_effort_in_dac_counts_is_told_from_a_reference(level: int, sentence: str) -> None:
    t, theta = swing(900)
    effort = np.where((t > 0.5) & (t < 1.2), level, 0)
    column = inspect(Record(t=t, signals={"enc": np.round(900 * theta), "Control Effort": effort})).column(
        "Control Effort"
    )
    assert sentence in column.remarks[0]
    assert column.drive
    assert [value for _, value in column.switches] == [level, 0]


def test_gaps_jitter_and_a_late_start_are_measured() -> None:
    t = 0.028 + 1e-3 * np.delete(np.arange(1000), np.arange(300, 320))
    time = inspect(Record(t=t, signals={"x": t})).time
    assert time.late == pytest.approx(0.028)
    assert [(gap.missing, round(gap.start, 6)) for gap in time.gaps] == [(20, 0.327)]
    assert time.period == pytest.approx(1e-3)
    assert time.jitter == 0


def test_saturation_rests_and_turns_are_seen() -> None:
    t, theta = swing(3000)
    u = np.clip(20 * np.cos(3 * t), -10, 10)
    still = np.where(t < 2, 0.0, np.sin(4 * (t - 2)))
    seen = inspect(Record(t=t, signals={"theta": 4 * np.pi + 0.1 * theta, "plant_input": u, "alpha": still}))
    # |20 cos| > 10 for two thirds of a cycle, half of that on each side.
    assert seen.column("plant_input").high_share == pytest.approx(1 / 3, abs=0.05)
    assert seen.column("plant_input").low_share == pytest.approx(1 / 3, abs=0.05)
    assert seen.column("theta").turns == 2
    alone = inspect(Record(t=t, signals={"alpha": still}))
    assert alone.rests[0][0] == 0
    assert alone.rests[0][1] == pytest.approx(2, abs=0.26)


def test_a_commanded_position_that_is_the_measured_one_is_no_reference() -> None:
    """Read a sample later on a triangle of 3 counts a sample, it differs by 3 but at turns: its steps do not."""
    t = 1e-3 * np.arange(600)
    encoder = 3.0 * np.abs(np.arange(600) % 200 - 100)
    late = np.concatenate([encoder[:1], encoder[:-1]])
    seen = inspect(Record(t=t, signals={"Commanded Pos": late, "Encoder 1 Pos": encoder}))
    assert seen.column("Commanded Pos").remarks == (
        "follows 'Encoder 1 Pos' (steps differ by 0 at the median); no reference, open loop",
    )
    reference = np.where(np.arange(600) % 200 < 100, 300.0, 0.0)
    seen = inspect(Record(t=t, signals={"Commanded Pos": reference, "Encoder 1 Pos": encoder}))
    assert not any("follows" in remark for remark in seen.column("Commanded Pos").remarks)


def test_a_commanded_position_a_sixth_of_a_turn_ahead_of_the_encoder_does_not_follow_it() -> None:
    """Over whole turns two waves correlate by the cosine of what they are apart: 1/2 here, however large they are."""
    angle = 2 * math.pi * np.arange(600) / 200
    encoder, command = 300 * np.cos(angle), 300 * np.cos(angle + math.pi / 3)
    seen = inspect(Record(t=1e-3 * np.arange(600), signals={"Commanded Pos": command, "Encoder 1 Pos": encoder}))
    assert not any("follows" in remark for remark in seen.column("Commanded Pos").remarks)


def test_first_samples_that_are_far_outside_the_rest_are_named() -> None:
    t, theta = swing(300)
    first, later = theta.copy(), theta.copy()
    first[1] = later[5] = -80.0
    seen = inspect(Record(t=t, signals={"first": first, "later": later}))
    assert any("the first samples are outliers (80 against 0.89" in remark for remark in seen.column("first").remarks)
    assert not any("first samples" in remark for remark in seen.column("later").remarks)


def test_an_idle_input_is_named() -> None:
    t, theta = swing(300)
    column = inspect(Record(t=t, signals={"theta": theta, "Control Effort": 0 * t})).column("Control Effort")
    assert column.idle
    assert column.constant


WILD = st.sampled_from([0.0, 1.0, -1.0, 409.0, 1e29, -1e29, 1e-300, 0.5, 3.3, 1e-12, 2 * math.pi])


@settings(deadline=None, max_examples=200)
@given(st.lists(st.tuples(st.floats(1e-6, 1e6), WILD, WILD, WILD), min_size=2, max_size=40))
def test_any_valid_record_can_be_inspected(rows: list[tuple[float, float, float, float]]) -> None:
    steps, x, y, z = np.array(rows).T
    names = {"Commanded Pos": x, "Encoder 1 Pos": y, "Control Effort": z, "theta": x + y}
    seen = inspect(Record(t=np.cumsum(steps), signals=names))
    assert len(seen.columns) == 4
    assert all(
        math.isfinite(c.low) and math.isfinite(c.resolution.step) and 0 <= c.low_share <= 1 for c in seen.columns
    )
    assert seen.time.period > 0


@pytest.mark.parametrize(
    ("name", "unit"),
    [
        ("x_m", "m"), ("pos_mm", "mm"), ("theta_rad", "rad"), ("theta_deg", "deg"), ("pendulum_angle_deg", "deg"),
        ("x", "m"), ("theta_m", "rad"), ("u_m", ""), ("theta_dot_deg", "rad/s"), ("cart_cm", "cm"), ("cart_m", "m"),
        ("tilt_deg", "deg"), ("slider_mm", "mm"), ("motor_m", ""),
    ],
)  # fmt: skip
def test_a_unit_behind_the_name_of_a_place_is_its_own(name: str, unit: str) -> None:
    """``theta_m`` is the angle of a motor and no length; what is behind a rate is left as it was."""
    t, x = swing()
    assert inspect(Record(t=t, signals={name: 0.3 * x})).column(name).guess == unit


@pytest.mark.parametrize(("name", "drives"), [("Vm (V)", True), ("Motor [V]", True), ("pot [V]", False)])
def test_volts_that_change_with_every_sample_measure_and_those_in_steps_drive(name: str, drives: bool) -> None:
    t, theta = swing()
    noisy = theta + 1e-3 * np.random.default_rng(0).normal(size=t.size)
    volts = np.repeat([0.0, 1.5, -1.2, 0.7, -2.1, 0.0, 1.9, 0.3], t.size // 8) if drives else noisy
    seen = inspect(Record(t=t, signals={name: volts, "theta": theta}, units={name: "V", "theta": "rad"}))
    assert seen.column(name).drive == drives


def test_the_former_name_of_a_columns_remarks_reads_the_same_and_warns():
    column = inspect(Record(t=np.arange(9.0), signals={"k": np.arange(9.0)})).column("k")
    with pytest.warns(DeprecationWarning, match="remarks"):
        assert column.lies == column.remarks != ()
