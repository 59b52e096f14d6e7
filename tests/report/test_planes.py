"""Are poles, loci and loops drawn where python-control has them, with its margins?"""

from __future__ import annotations

import json
import math
import re
from dataclasses import replace

import control
import numpy as np
import pytest

import upright as up
from tests.report.interactive.drawn import circles, curve, drawings, panels, values
from upright.designing.chapter import chapter
from upright.designing.run import DesignRequest, design_for
from upright.gains.loop import response
from upright.identification.model.fit import Estimate, Pole
from upright.report.page import Picture
from upright.report.planes import Poles, fitted_poles_chart, locus_chart, loop_chart, pole_chart
from upright.systems import StateSpace

A = np.array([[0.0, 1.0], [30.0, -0.4]])
B = np.array([[0.0], [8.0]])
FALLING = StateSpace(A=A, B=B, C=np.eye(2), D=np.zeros((2, 1)), states=("theta", "theta_dot"), inputs=("u",),
                     outputs=("theta", "theta_dot"))  # fmt: skip
PERIOD = 0.01


@pytest.fixture(scope="module")
def done():
    """An unstable plant under state feedback, sampled every 10 ms and a sample late."""
    return design_for(
        FALLING, DesignRequest(at="", poles=np.array([-6 + 3j, -6 - 3j]), period=PERIOD, delay=1.0, speed="measured")
    )


@pytest.fixture(scope="module")
def theirs(done):
    """The same loop gain, put together by python-control."""
    held = control.c2d(control.ss(A, B, np.eye(2), 0), PERIOD)
    late = control.ss(np.zeros((1, 1)), [[1.0]], [[1.0]], [[0.0]], PERIOD)
    return control.series(late, held, control.ss([], [], [], done.K, PERIOD))


def drawn_loop(done):
    return loop_chart(response(done.sampled, done.law), done.chosen.margins, PERIOD)


def pictures(done):
    return {b.name: b for p in chapter(done).parts for b in p.content if isinstance(b, Picture)}


def test_magnitude_and_phase_of_the_loop_are_those_of_python_control(done, theirs):
    chart = drawn_loop(done)
    for i, of in ((0, lambda L: 20 * np.log10(np.abs(L))), (1, lambda L: np.degrees(np.angle(L)))):
        w, shown = curve(chart, i, "--ink,")
        expected = of(theirs(np.exp(1j * w * PERIOD)))
        off = shown - expected
        off -= 360 * np.round(off / 360) if i else 0.0
        # a tenth of a unit on axes of 150, over about 60 dB or 270 degrees
        assert np.abs(off).max() < 0.004 * np.ptp(chart.spans[i])


def test_dashed_lines_stand_at_the_crossings_of_python_control(done, theirs):
    _, _, _, phase_at, gain_at, _ = control.stability_margins(theirs, returnall=True)
    gain, phase, *_ = control.stability_margins(theirs, returnall=True)
    magnitude, turn = drawn_loop(done).panels
    ours = [(w, float(text.removeprefix("× "))) for w, text in magnitude.places]
    expected = sorted(zip(phase_at, gain, strict=True))
    # at zero frequency nothing is drawn on an axis of decades
    assert [w for w, _ in ours] == pytest.approx([w for w, _ in expected if w > 0.1], rel=1e-4)
    assert [k for _, k in ours] == pytest.approx([k for w, k in expected if w > 0.1], rel=5e-3)
    assert [w for w, _ in turn.places] == pytest.approx(sorted(gain_at), rel=1e-4)
    assert [float(text.removesuffix("°")) for _, text in turn.places] == pytest.approx(
        [abs(p) for _, p in sorted(zip(gain_at, phase, strict=True))], rel=5e-3
    )


def test_the_phase_is_drawn_through_180_degrees_where_the_gain_margins_are(done):
    chart = drawn_loop(done)
    w, phase = curve(chart, 1, "--ink,")
    for at, _ in chart.panels[0].places:
        turned = float(np.interp(at, w, phase))
        assert abs(math.remainder(turned - 180.0, 360.0)) < 3.0


def test_poles_stand_at_those_of_python_control(done):
    kinds = [Poles(name="a", values=control.poles(control.ss(A, B, np.eye(2), 0)), mark="o", colour="q0"),
             Poles(name="b", values=np.linalg.eigvals(A - B @ done.K), mark="o", colour="q1")]  # fmt: skip
    chart = pole_chart(kinds)
    root = math.sqrt(0.04 + 30.0)
    np.testing.assert_allclose(np.sort(circles(chart, 0, "--q0")[:, 0]), [-0.2 - root, -0.2 + root], atol=0.03)
    np.testing.assert_allclose(circles(chart, 0, "--q1"), [[-6.0, 3.0]], atol=0.03)


def test_the_unstable_half_and_no_more_is_tinted(done):
    chart = pole_chart([Poles(name="a", values=np.array([5.0 + 0j, -6.0]), mark="x")])
    *_, panel = panels(drawings(chart.svg("a"))["wide"])[0]
    (tint,) = [p.get("d") for p in panel.iter("path") if p.get("fill-opacity")]
    left = float(re.match(r"M([\d.]+)", tint)[1])
    assert values(chart, 0, [left], [0.0])[0][0] == pytest.approx(0.0, abs=0.02)


def test_poles_beyond_the_picture_are_counted_below_it():
    kinds = [Poles(name="open", values=np.array([2.0 + 0j, -3.0]), mark="x"),
             Poles(name="fast", values=np.array([-14.0 + 0j, -2 + 60j, -2 - 60j, -1.0]), mark="+")]  # fmt: skip
    assert pole_chart(kinds, frame=1).label == "real part [1/s]; 2 outside the picture"
    assert pole_chart(kinds).label == "real part [1/s]"


def test_the_locus_passes_through_python_controls_lqr_at_the_weight_under_the_cursor():
    request = DesignRequest(at="", weights=(1.0, 0.0), R=0.02, period=PERIOD, delay=0.0, speed="measured")
    read = json.loads(pictures(design_for(FALLING, request))["locus"].answers)
    tracks = [line for line in read["panels"][0]["lines"] if "notes" in line]
    for i in (0, 120, 299):
        digits, _, power = tracks[0]["notes"][i].removeprefix("R ").partition("·10")
        R = float(digits) * 10.0 ** int(power.translate(str.maketrans("⁻⁰¹²³⁴⁵⁶⁷⁸⁹", "-0123456789")) or 0)
        expected = control.lqr(A, B, np.diag([1.0, 0.0]), [[R]])[2]
        ours = [complex(line["x"][i], line["y"][i]) for line in tracks if line["y"][i] is not None]
        upper = [z for z in expected if z.imag > -1e-9]
        # three digits are told of the weight, and poles go with its fourth root at most
        np.testing.assert_allclose(np.sort_complex(ours), np.sort_complex(upper), rtol=3e-3)


def test_intervals_of_fitted_poles_are_told_and_drawn_as_bars():
    def estimate(value, half):
        return Estimate(value=value, stderr=half / 2, interval=(value - half, value + half), unit="1/s")

    fitted = {"hanging": (Pole(real=estimate(-1.0, 0.4), imag=estimate(6.0, 1.0)),)}
    chart = fitted_poles_chart(fitted)
    (line,) = json.loads(chart.values())["panels"][0]["lines"]
    assert line["notes"] == ["95 % −1.40 to −0.600 1/s, ± 5.00 to 7.00 rad/s"]
    *_, panel = panels(drawings(chart.svg("a"))["wide"])[0]
    bars = [p.get("d") for p in panel.iter("path") if p.get("stroke-width") == "1.1"]
    ends = [np.array(re.findall(r"(-?[\d.]+) (-?[\d.]+)", bar), dtype=float) for bar in bars]
    upright, level = sorted((values(chart, 0, *e.T) for e in ends), key=lambda e: abs(e[0][0] - e[0][1]))
    np.testing.assert_allclose(np.sort(upright[1]), [5.0, 7.0], atol=0.02)
    np.testing.assert_allclose(np.sort(level[0]), [-1.4, -0.6], atol=0.02)


def test_only_the_upper_half_is_drawn_with_every_set_in_its_own_mark():
    tracks = np.array([[-1 + 1j, -1 - 1j], [-2 + 3j, -2 - 3j]])
    sets = {"set 1": np.array([-4 + 2j, -4 - 2j]), "set 2": np.array([-6.0 + 0j, -5.0])}
    chart = locus_chart(
        tracks, np.array([1.0, 0.5]), sets, np.array([4.0 + 0j, -2 + 1j, -2 - 1j]), of="LQR", symbol="R"
    )
    lines = {line.name: line for line in chart.panels[0].lines if line.mark}
    assert {n: line.mark for n, line in lines.items()} == {"open loop": "x", "set 1": "o", "set 2": "s"}
    assert sorted(zip(lines["open loop"].x, lines["open loop"].y, strict=True)) == [(-2, 1), (4, 0)]
    low, high = chart.spans[0]
    assert low < 0 < 2 < high
    assert chart.span == pytest.approx((-7.0, 5.0))  # a tenth of the width beside the poles


def test_a_design_draws_its_poles_its_loop_and_the_way_back(done):
    assert list(pictures(done)) == ["poles", "loop", "swing"]
    assert type(up.design(FALLING, poles="-6+-3j", period=PERIOD).plot("loop")).__name__ == "Chart"


def test_a_pole_that_rests_on_an_assumed_number_has_no_interval_in_the_picture():
    seen, rests = (
        Estimate.within(-2.0, 0.1, 0.2),
        replace(Estimate.within(5.0, 0.1, 0.2), rests_on=("r",), status="rests on r"),
    )
    still = Estimate.within(0.0, 0.0, 0.0)
    chart = fitted_poles_chart({"inverted": [Pole(real=e, imag=still) for e in (rests, seen)]})
    (line,) = chart.panels[0].lines
    assert line.notes[0] == "rests on r"
    assert line.across is not None
    assert [ends.tolist() for ends in line.across] == [[5.0, -2.2], [5.0, -1.8]]
