"""Do the pictures of a response show it in decibels and degrees with its errors, and what each point is worth?"""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

from upright.experiments.frequency_1b.chapter import log_chapter
from upright.experiments.frequency_1b.figures import bode_charts, quality_chart
from upright.experiments.frequency_1b.run import LoggedResponse
from upright.identification.frequency.response import FrequencyResponse

OMEGA = np.array([1.0, 2.0, 5.0, 10.0, 20.0])
LAG = 8.0 / (1j * OMEGA + 4.0)
"""8/(s + 4), and twice integrated: phases from 0 to -90 and from -180 to -270 degrees."""
RESPONSE = np.column_stack([LAG, LAG / (1j * OMEGA) ** 2])
COHERENCE = np.array([[1.0, 0.99], [0.9, 0.4], [0.999, 0.98], [0.3, 0.97], [1.0, 0.96]])
DATA = FrequencyResponse(
    omega=OMEGA, response=RESPONSE, outputs=("x", "theta"), units=("m", "rad", "V"),
    variance=(0.02 * np.abs(RESPONSE)) ** 2, coherence=COHERENCE, distortion=np.full((5, 2), 0.05),
    drive=np.full(5, 3.0 + 4.0j), notes=("A note.",),
)  # fmt: skip


def test_magnitude_phase_and_coherence_stand_with_their_95_percent_bars():
    """20 log10 of the magnitude; of an error of 2 % the bars are 1.96 * 20/ln 10 * 0.02 dB and 1.96 * 0.02 rad."""
    # the error's mean square is of real and imaginary part together
    error = DATA.error
    for j, (name, chart) in enumerate(zip(("x", "θ"), bode_charts(DATA), strict=True)):
        assert (chart.label, chart.logarithmic) == ("frequency [rad/s]", True)
        magnitude, phase, coherence = chart.panels
        (shown,) = magnitude.lines
        np.testing.assert_array_equal(shown.x, OMEGA)
        np.testing.assert_allclose(shown.y, 20 * np.log10(np.abs(RESPONSE[:, j])))
        low, high = shown.bars
        np.testing.assert_allclose((high - low) / 2, 1.96 * 20 / math.log(10) * error[:, j])
        (shown,) = phase.lines
        turns = (shown.y - np.degrees(np.unwrap(np.angle(RESPONSE[:, j])))) / 360
        np.testing.assert_allclose(turns, round(turns[0]), atol=1e-9)  # whole turns are free
        low, high = shown.bars
        np.testing.assert_allclose((high - low) / 2, np.degrees(1.96 * error[:, j]))
        np.testing.assert_array_equal(coherence.lines[0].y, COHERENCE[:, j])
        assert [p.title for p in chart.panels] == [f"{name} / u, magnitude", f"{name} / u, phase", "coherence"]
        assert [p.unit for p in chart.panels] == [f"dB re 1 {('m', 'rad')[j]}/V", "deg", ""]


def test_a_bar_is_half_a_turn_long_at_most_however_little_is_known():
    data = FrequencyResponse(
        omega=OMEGA, response=RESPONSE, outputs=("x", "theta"), variance=1e30 * np.ones((5, 2)),
        coherence=0.1 * np.ones((5, 2)),
    )  # fmt: skip
    for chart in bode_charts(data, None):
        low, high = chart.panels[1].lines[0].bars
        np.testing.assert_allclose(high - low, 360.0)


def test_a_model_is_drawn_within_half_a_turn_of_the_points_it_explains():
    w = np.geomspace(1, 20, 200)
    model = 8.0 / (1j * w + 4.0)
    both = np.column_stack([model, model / (1j * w) ** 2])
    for j, chart in enumerate(bode_charts(DATA, fine=[(w, both)])):
        magnitude, phase, _ = chart.panels
        points, curve = phase.lines
        np.testing.assert_allclose(np.interp(np.log(OMEGA), np.log(w), curve.y), points.y, atol=0.1)
        np.testing.assert_allclose(magnitude.lines[1].y, 20 * np.log10(np.abs(both[:, j])))
        assert curve.name == "least squares"


def test_each_quality_has_a_panel_of_its_own():
    """1 - coherence, harmonics, error in percent, amplitude |H| |u| with |3 + 4j| = 5 V beside it."""
    panels = quality_chart(DATA).panels
    expected = (np.maximum(1 - COHERENCE, 1e-9), DATA.distortion, 100 * DATA.error, 5.0 * np.abs(RESPONSE))
    assert [p.title for p in panels] == ["1 − coherence", "harmonics over fundamental", "standard error", "amplitude"]
    for panel, values in zip(panels, expected, strict=True):
        assert panel.logarithmic
        for j, line in enumerate(panel.lines[:2]):
            np.testing.assert_allclose(line.y, values[:, j])
            np.testing.assert_array_equal(line.x, OMEGA)
    command = panels[-1].lines[2]
    np.testing.assert_allclose(command.y, 5.0)
    assert [line.name for line in panels[-1].lines] == ["x [m]", "θ [rad]", "command [V]"]
    assert len({line.mark for line in panels[-1].lines}) == 3


def test_what_nobody_measured_is_not_drawn():
    bare = FrequencyResponse(omega=OMEGA, response=RESPONSE, outputs=("x", "theta"), drive=np.full(5, 1.0 + 0j))
    panels = quality_chart(bare).panels
    assert "harmonics over fundamental" not in [p.title for p in panels]
    assert [line.name for line in panels[-1].lines] == ["x", "θ", "command"]  # no units, no brackets


def test_a_response_without_a_fit_says_where_it_follows_the_command_and_how_well():
    """At 3 of 5 frequencies both outputs follow by half of their power or more; there the error is as stated."""
    told = log_chapter(LoggedResponse(sources=("a.csv", "b.csv"), response=DATA, answer=None, folder=Path("out")))
    percent = f"{100 * np.median(DATA.error[[0, 2, 4]]):.2g}"
    assert told.verdict.startswith(
        f"Where most of the power follows the command (3 of 5 frequencies), magnitudes are known to {percent}"
    )
    assert told.sound
    assert told.parts[0].content[:2] == ("5 frequencies from 1 to 20 rad/s in a.csv, b.csv.", "A note.")
    quality = told.parts[0].content[2]
    assert quality.description == "Least coherence 0.3, largest distortion 0.05."
    *_, table = told.parts[1].content
    assert len(table.rows) == 10
    assert table.rows[5] == ("theta", "1.000", f"{20 * math.log10(8 / math.sqrt(17)):.3f}", "166.0", percent, "0.9900")
    assert table.numbers == (1, 2, 3, 4, 5)
    assert told.numbers["outputs"]["x"]["phase_deg"][0] == pytest.approx(-math.degrees(math.atan(1 / 4)))
    assert told.numbers["outputs"]["x"]["error_percent"][0] == pytest.approx(100 * DATA.error[0, 0])
    poor = FrequencyResponse(omega=OMEGA, response=RESPONSE, outputs=("x", "theta"), coherence=0.49 * np.ones((5, 2)))
    lost = log_chapter(LoggedResponse(sources=("a.csv",), response=poor, answer=None, folder=Path("out")))
    assert not lost.sound
    assert lost.verdict.startswith("At no frequency does half of the power follow the command")
