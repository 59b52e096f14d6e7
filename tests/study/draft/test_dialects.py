"""Is a log drafted, and read, as the same study whatever units and headers its program wrote it with?"""

import math

import numpy as np
import pytest

from upright.readers import inspect, read
from upright.study.draft.draft import draft
from upright.study.load import load_study

T = np.round(5e-3 * np.arange(2000), 6)
U = np.where(T % 2 < 1, 1.2, -0.7) * (T >= 1)
SWING = np.exp(-0.1 * T) * np.sin(6 * T) * (T >= 1)
SMALL = {"rad": ("deg", 180 / math.pi), "m": ("mm", 1e3), "V": ("mV", 1e3)}
PLACES = {
    "cart-pendulum": {"x": ("m", np.round(0.2 * SWING, 5)), "theta": ("rad", 0.4 * SWING)},
    "furuta": {"psi": ("rad", 0.3 * SWING), "theta": ("rad", 0.4 * SWING)},
    "torsional-2": {"theta_1": ("rad", 3 * SWING), "theta_2": ("rad", 3.2 * np.roll(SWING, 3))},
}


@pytest.fixture
def met(tmp_path):
    """Draft and load the study of a log in a dialect: its separator, its small units or not, its form of a header."""

    def make(columns, mark, small, form):
        rows, names = [(1e3 if small else 1.0) * T], [form.format("t", "ms" if small else "s")]
        for name, (unit, values) in {**columns, "u": ("V", U)}.items():
            other, per = SMALL[unit] if small else (unit, 1.0)
            names.append(form.format(name, other))
            rows.append(per * values)
        text = [mark.join(names), *(mark.join(f"{x:.9g}" for x in row) for row in np.column_stack(rows))]
        log = tmp_path / "log.csv"
        log.write_text("\n".join(text) + "\n", encoding="utf-8")
        record = read(log)
        study = tmp_path / "study.toml"
        study.write_text(draft(record, inspect(record), log, study), encoding="utf-8")
        return load_study(study)

    return make


@pytest.mark.slow
@pytest.mark.parametrize("plant", PLACES)
def test_a_log_in_degrees_millimetres_milliseconds_and_millivolts_is_the_same_study_to_the_last_bit(met, plant):
    """Its text has nine digits, of which those of a degree are others than those of a radian."""
    count = 2 * math.pi / 4096
    columns = {n: (u, np.round(y / count) * count if u == "rad" else y) for n, (u, y) in PLACES[plant].items()}
    one, other, third = (
        met(columns, ",", False, "{} [{}]"), met(columns, ";", True, "{} [{}]"), met(columns, "\t", False, "{}_{}")
    )  # fmt: skip
    for study in (other, third):
        assert study.plant == one.plant == plant
        assert study.model.estimated == one.model.estimated
        np.testing.assert_array_equal(study.runs[0].t, one.runs[0].t)
        np.testing.assert_array_equal(study.runs[0].u, one.runs[0].u)
        # the zero of a swing that nobody saw at rest is written with nine digits
        np.testing.assert_allclose(study.runs[0].y, one.runs[0].y, rtol=0, atol=1e-9)
        assert study.runs[0].resolution == pytest.approx(one.runs[0].resolution, rel=1e-12)
        assert study.rig.counts == pytest.approx(one.rig.counts, rel=1e-12)


def test_digits_that_hide_an_encoders_steps_bound_them(met):
    """0.01 degrees in the text: an encoder of 36,000 counts, or any that is finer, would look so."""
    theta = np.deg2rad(np.round(np.rad2deg(0.4 * np.roll(SWING, 5)), 2))
    study = met({"x": ("m", np.round(0.2 * SWING, 5)), "theta": ("rad", theta)}, ";", True, "{} [{}]")
    counts = study.rig.hardware.entries["counts.theta"]
    assert (counts.value, counts.source) == (pytest.approx(36_000), "assumed")
