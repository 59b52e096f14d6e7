"""Do the pictures of a response show it in decibels and degrees with its errors, and what each point is worth?"""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

from upright.experiments.frequency_1b.chapter import log_chapter
from upright.experiments.frequency_1b.figures import bode_figure, quality_figure
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


def points(ax):
    (bars,) = ax.containers
    dots, _, (lines,) = bars.lines
    half = np.array([np.ptp(segment[:, 1]) / 2 for segment in lines.get_segments()])
    return dots.get_xydata(), half


def test_magnitude_and_phase_stand_with_their_95_percent_bars():
    """20 log10 of the magnitude; of an error of 2 % the bars are 1.96 * 20/ln 10 * 0.02 dB and 1.96 * 0.02 rad."""
    axes = np.reshape(np.array(bode_figure(DATA).axes), (2, 2))
    # the error's mean square is of real and imaginary part together
    error = DATA.error
    for j, name in enumerate(("x", "θ")):
        xy, half = points(axes[0, j])
        np.testing.assert_allclose(xy, np.column_stack([OMEGA, 20 * np.log10(np.abs(RESPONSE[:, j]))]))
        np.testing.assert_allclose(half, 1.96 * 20 / math.log(10) * error[:, j])
        xy, half = points(axes[1, j])
        expected = np.degrees(np.unwrap(np.angle(RESPONSE[:, j])))
        turns = (xy[:, 1] - expected) / 360
        np.testing.assert_allclose(turns, round(turns[0]), atol=1e-9)  # whole turns are free
        np.testing.assert_allclose(half, np.degrees(1.96 * error[:, j]))
        assert axes[0, j].get_title(loc="left") == f"{name} / u"
        assert axes[1, j].get_xlabel() == "frequency [rad/s]"
        assert axes[1, j].get_xscale() == "log"
    assert axes[0, 0].get_ylabel() == "magnitude [dB re 1 m/V]"
    assert axes[1, 0].get_ylabel() == "phase [deg]"
    assert axes[0, 1].get_ylabel() == ""


def test_a_model_is_drawn_within_half_a_turn_of_the_points_it_explains():
    w = np.geomspace(1, 20, 200)
    model = 8.0 / (1j * w + 4.0)
    both = np.column_stack([model, model / (1j * w) ** 2])
    axes = np.reshape(np.array(bode_figure(DATA, fine=[(w, both)]).axes), (2, 2))
    for j in range(2):
        curve = max(axes[1, j].get_lines(), key=lambda line: len(line.get_xdata()))
        shown, _ = points(axes[1, j])
        np.testing.assert_allclose(np.interp(np.log(OMEGA), np.log(w), curve.get_ydata()), shown[:, 1], atol=0.1)
        high = max(axes[0, j].get_lines(), key=lambda line: len(line.get_xdata()))
        np.testing.assert_allclose(high.get_ydata(), 20 * np.log10(np.abs(both[:, j])))


def test_frequencies_are_marked_at_one_two_and_five_of_each_decade():
    axes = bode_figure(DATA).axes
    assert axes[-1].xaxis.get_major_locator()().tolist() == [1.0, 2.0, 5.0, 10.0, 20.0]
    said = axes[-1].xaxis.get_major_formatter()
    assert [said(v) for v in (0.5, 1.0, 20.0)] == ["0.5", "1", "20"]


def test_each_quality_has_a_panel_of_whole_decades():
    """1 - coherence, harmonics, error in percent, amplitude |H| |u| with |3 + 4j| = 5 V beside it."""
    incoherent, harmonics, errors, amplitude = quality_figure(DATA).axes
    for ax, values in (
        (incoherent, np.maximum(1 - COHERENCE, 1e-9)), (harmonics, DATA.distortion), (errors, 100 * DATA.error),
        (amplitude, 5.0 * np.abs(RESPONSE)),
    ):  # fmt: skip
        for j, line in enumerate(ax.get_lines()[:2]):
            np.testing.assert_allclose(line.get_xydata(), np.column_stack([OMEGA, values[:, j]]))
        low, high = np.log10(ax.get_ylim())
        shown = np.concatenate([line.get_ydata() for line in ax.get_lines()])
        assert (low, high) == (pytest.approx(round(low)), pytest.approx(round(high)))
        assert low <= np.log10(shown.min()) < low + 1
        assert high >= low + 1
        assert high - 1 <= max(np.log10(shown.max()), low)
    command = amplitude.get_lines()[2]
    np.testing.assert_allclose(command.get_ydata(), 5.0)
    assert [t.get_text() for t in amplitude.get_legend().get_texts()] == ["x [m]", "θ [rad]", "command [V]"]
    assert [t.get_text() for t in incoherent.get_legend().get_texts()] == ["x", "θ"]
    marks = [line.get_marker() for line in incoherent.get_lines()]
    assert len(set(marks)) == 2
    assert amplitude.get_xlabel() == "frequency [rad/s]"


def test_what_nobody_measured_is_said_and_not_drawn():
    bare = FrequencyResponse(omega=OMEGA, response=RESPONSE, outputs=("x", "theta"), drive=np.full(5, 1.0 + 0j))
    harmonics = quality_figure(bare).axes[1]
    assert [t.get_text() for t in harmonics.texts] == ["not measured by a sweep"]
    assert not len(harmonics.get_yticks())
    amplitude = quality_figure(bare).axes[3]
    assert [t.get_text() for t in amplitude.get_legend().get_texts()] == ["x", "θ", "command"]  # no units, no brackets


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
    _, table = told.parts[1].content
    assert len(table.rows) == 10
    assert table.rows[5] == ("theta", "1.000", f"{20 * math.log10(8 / math.sqrt(17)):.3f}", "166.0", percent, "0.9900")
    assert table.numbers == (1, 2, 3, 4, 5)
    assert told.numbers["outputs"]["x"]["phase_deg"][0] == pytest.approx(-math.degrees(math.atan(1 / 4)))
    assert told.numbers["outputs"]["x"]["error_percent"][0] == pytest.approx(100 * DATA.error[0, 0])
    poor = FrequencyResponse(omega=OMEGA, response=RESPONSE, outputs=("x", "theta"), coherence=0.49 * np.ones((5, 2)))
    lost = log_chapter(LoggedResponse(sources=("a.csv",), response=poor, answer=None, folder=Path("out")))
    assert not lost.sound
    assert lost.verdict == "Nowhere does half of the power follow the command: this log tells no response."
