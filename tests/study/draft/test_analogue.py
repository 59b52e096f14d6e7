"""Does a sensor's voltage become an angle or a place by the scale that somebody gives?"""

from __future__ import annotations

import tomllib
from pathlib import Path

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import upright as up
from upright.errors import BadInput
from upright.records import Record
from upright.records.analogue import in_places

T = 0.004 * np.arange(2500)


def swing() -> np.ndarray:
    """A pendulum of 0.31 m by SciPy, let go at 50 degrees, with viscous friction [rad]."""
    motion = solve_ivp(
        lambda t, x: [x[1], -9.81 / 0.31 * np.sin(x[0]) - 0.2 * x[1]], (0, T[-1]), [np.radians(50), 0.0], t_eval=T,
        rtol=1e-9, atol=1e-11,
    )  # fmt: skip
    return motion.y[0]


def screen(path: Path, volts: np.ndarray) -> Path:
    rows = "\n".join(f"{t:+.6E},{v:+.5E}" for t, v in zip(T, volts, strict=True))
    path.write_text(f"x-axis,1\nsecond,Volt\n{rows}\n", encoding="utf-8")
    return path


def test_a_potentiometer_on_an_oscilloscope_gives_the_length_of_its_pendulum(tmp_path):
    """68 degrees to a volt, hanging at 2.43 V; counts of a converter of 16 bits over 10 V."""
    volts = np.round((2.43 + np.degrees(swing()) / 68) * 6553.6) / 6553.6
    study = tmp_path / "pot.toml"
    up.init(screen(tmp_path / "pot.csv", volts), scale="CH1=68 deg/V", out=study)
    sensor = tomllib.loads(study.read_text(encoding="utf-8"))["sensors"]["theta"]
    assert (sensor["column"], sensor["unit"], sensor["scale"]) == ("CH1", "V", "68 deg/V")
    assert sensor["offset"] == pytest.approx(2.43, abs=0.01)
    low, high = up.identify(study).ratios["J_A/(m_p l_cg)"].interval
    assert low <= 0.31 <= high < 1.01 * low


def test_without_its_scale_the_way_to_give_it_is_said(tmp_path):
    with pytest.raises(BadInput, match=r'scale="CH1=30 deg/V"'):
        up.init(screen(tmp_path / "pot.csv", 2.43 + swing()))


def test_a_reading_without_a_unit_is_scaled_too():
    record = in_places(Record(t=T, signals={"A0": 512 + 100 * swing()}), {"A0": "0.01 m"})
    np.testing.assert_allclose(record["A0"], 5.12 + swing(), rtol=1e-12)
    assert record.units["A0"] == "m"


@pytest.mark.parametrize(
    ("scales", "sentence"),
    [
        ({"B": "1 deg/V"}, "no column 'B' to scale; .*A"),
        ({"A": "1 deg/A"}, "'A' is an angle or a length per V, as in"),
        ({"A": "0 deg/V"}, "'A' is an angle or a length per V, as in"),
        ({"A": "much"}, "got 'much'"),
    ],
)
def test_what_is_no_scale_is_refused_with_an_example(scales, sentence):
    with pytest.raises(BadInput, match=sentence):
        in_places(Record(t=T, signals={"A": swing()}, units={"A": "V"}), scales)
