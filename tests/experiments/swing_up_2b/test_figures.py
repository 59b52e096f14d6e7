"""Do the pictures of experiment 2b show the log in degrees and millijoules, and where the feedback held?"""

from __future__ import annotations

import math

import numpy as np
import pytest

from tests.experiments.swing_up_2b.closed_form import GOOD, LAW, RIG, T, climbed
from upright.experiments.swing_up_2b.figures import ascent_figure, check_figure, portrait_figure


def curve(ax):
    """The line of many points."""
    return max(ax.get_lines(), key=lambda line: len(line.get_xdata()))


def levels(ax, style):
    return sorted(float(line.get_ydata()[0]) for line in ax.get_lines()
                  if line.get_linestyle() == style and len(line.get_xdata()) == 2)  # fmt: skip


def test_angle_energy_command_and_arm_stand_below_each_other_up_to_2_5_s_of_holding():
    """Energy over upright at rest: J theta'^2/2 - weight (1 + cos theta), in mJ."""
    run = climbed()
    angle, energy, command, arm = ascent_figure(run).axes
    shown = T[T <= 4.5]
    w = 2 * math.pi
    up = shown >= 2.0
    theta = np.where(up, math.pi + 0.05 * np.cos(w * shown), 2.5 * np.sin(w * shown))
    speed = np.where(up, -0.05 * w * np.sin(w * shown), 2.5 * w * np.cos(w * shown))
    joule = 0.5 * LAW.body.J * speed**2 - LAW.body.weight * (1 + np.cos(theta))
    volts = np.where(shown < 2.0, 8.0, 0.4) * np.cos(5 * shown)
    for ax, expected in (
        (angle, np.degrees(theta)), (energy, 1e3 * joule), (command, volts),
        (arm, 0.6 * np.sin(3 * shown)),
    ):  # fmt: skip
        np.testing.assert_allclose(curve(ax).get_xdata(), shown)
        np.testing.assert_allclose(curve(ax).get_ydata(), expected, atol=1e-9)
        (shaded,) = [p for p in ax.patches if p.get_alpha() == 0.14]
        assert (shaded.get_x(), shaded.get_x() + shaded.get_width()) == pytest.approx((2.0, 4.5))
    assert levels(angle, "--") == [-180.0, 180.0]  # upright, either way round, within sight of +-143 degrees
    assert [t.get_position() for t in angle.texts] == [(0.0, -180.0), (0.0, 180.0)]
    assert (levels(energy, "--"), levels(energy, ":")) == ([0.0], [-2e3 * LAW.body.weight])
    assert {t.get_text().strip(): t.get_position() for t in energy.texts} == {
        "upright at rest": (4.5, 0.0), "hanging at rest": (4.5, -2e3 * LAW.body.weight),
    }  # fmt: skip
    assert levels(command, "--") == [-10.0, 10.0]
    assert levels(arm, "--") == [-1.5, 1.5]
    assert command.get_ylim() == (-13.0, 13.0)
    assert (command.get_ylabel(), angle.get_ylabel(), energy.get_ylabel()) == (
        "command [V]", "angle θ [°]", "energy [mJ]",
    )  # fmt: skip
    assert arm.get_ylabel().endswith("[rad]")


def test_a_bound_far_beyond_the_curve_is_written_and_not_drawn():
    """8 V of 10 is near; 2.5 V is a quarter and still drawn, 2.4 V is not."""
    for volts, drawn in ((2.5, True), (2.4, False)):
        _, _, command, _ = ascent_figure(climbed(volts=volts)).axes
        assert levels(command, "--") == ([-10.0, 10.0] if drawn else [])
        assert ("limit ±10" in [t.get_text() for t in command.texts]) != drawn
    *_, arm = ascent_figure(climbed(far=0.05)).axes
    assert [t.get_text() for t in arm.texts] == ["travel ±1.5"]


def test_a_pendulum_that_is_never_caught_is_shown_to_the_end_and_one_that_falls_is_shaded_twice():
    drawing = ascent_figure(climbed(caught=99))
    assert curve(drawing.axes[0]).get_xdata()[-1] == T[-1]
    assert not drawing.axes[0].patches
    twice = ascent_figure(climbed(falls=[(2.5, 3.0)]))
    ends = [(p.get_x(), p.get_x() + p.get_width()) for p in twice.axes[0].patches]
    assert np.ravel(ends) == pytest.approx([2.0, 2.49, 3.0, 5.5])


def test_upright_is_marked_on_every_turn_in_sight():
    """Held after one more turn, at 540 degrees."""
    angle = ascent_figure(climbed(turns=1.0)).axes[0]
    assert levels(angle, "--") == [-180.0, 180.0, 540.0]


def test_the_portrait_lies_within_a_turn_with_the_separatrix_about_it():
    """Energy of rest upright: theta' = 2 omega cos(theta/2), so 2 omega hanging and 0 upright."""
    run = climbed()
    (ax,) = portrait_figure(run).axes
    lines = {line.get_label(): line for line in ax.get_lines()}
    edge = lines["energy of upright"]
    np.testing.assert_allclose(edge.get_xdata()[[0, -1]], [-180, 180])
    np.testing.assert_allclose(
        edge.get_ydata(), 2 * LAW.body.omega * np.cos(np.radians(edge.get_xdata()) / 2), atol=1e-12
    )
    lower = [line for line in ax.get_lines() if line.get_linestyle() == "--" and line is not edge]
    np.testing.assert_allclose(lower[0].get_ydata(), -edge.get_ydata())
    pump, feedback = lines["pump"].get_xydata(), lines["feedback"].get_xydata()
    pump, feedback = (xy[np.isfinite(xy[:, 0])] for xy in (pump, feedback))
    w, some = 2 * math.pi, T[::6]
    before = some[some < 2.0]
    np.testing.assert_allclose(
        pump, np.column_stack([np.degrees(2.5 * np.sin(w * before)), 2.5 * w * np.cos(w * before)]), atol=1e-6
    )
    assert np.abs(feedback[:, 0]).min() > 180 - math.degrees(0.05) - 1e-6
    assert np.abs(feedback[:, 0]).max() <= 180
    assert np.abs(feedback[:, 1]).max() == pytest.approx(0.05 * w, rel=0.01)
    (ring,) = [line for line in ax.get_lines() if line.get_marker() == "o"]
    assert ring.get_ydata()[0] == pytest.approx(run.speeds[200, 1])
    assert abs(ring.get_xdata()[0]) == pytest.approx(180 - math.degrees(0.05), abs=0.01)
    assert ax.get_xlim() == (-180, 180)
    assert ax.get_xticks().tolist() == [-180, -90, 0, 90, 180]


def test_a_curve_over_the_edge_is_broken_and_not_drawn_across():
    """What trembles about upright is on either edge of the picture; no line spans it."""
    (ax,) = portrait_figure(climbed()).axes
    for line in ax.get_lines():
        if line.get_label() in ("pump", "feedback"):
            steps = np.diff(line.get_xdata())
            assert not (np.abs(steps[np.isfinite(steps)]) > 180).any()


def test_every_catch_has_a_ring_and_the_legend_one():
    (ax,) = portrait_figure(climbed(falls=[(2.5, 3.0)])).axes
    rings = [line for line in ax.get_lines() if line.get_marker() == "o"]
    assert len(rings) == 2
    assert [t.get_text() for t in ax.get_legend().get_texts()].count("handover") == 1


def test_encoders_stand_beside_the_model_s_motion_each_in_its_unit():
    axes = check_figure(GOOD, ("rad", "rad")).axes
    for i, (ax, name) in enumerate(zip(axes, ("psi", "theta"), strict=True)):
        shown, model = ax.get_lines()
        np.testing.assert_array_equal(shown.get_xydata(), np.column_stack([GOOD.t, GOOD.shown[:, i]]))
        np.testing.assert_array_equal(model.get_xydata(), np.column_stack([GOOD.t, GOOD.motion[:, i]]))
        assert model.get_label() == f"model × {GOOD.value[i]:.4g}"
        assert ax.get_ylabel() == rf"$\{name}$ [rad]" or "[rad]" in ax.get_ylabel()
    assert axes[-1].get_xlabel().startswith("time")
    assert RIG.plant.coordinates[0].unit == "rad"
