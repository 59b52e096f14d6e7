"""Do the pictures of experiment 3 show what was logged, in degrees from the step on, and the poles that there are?"""

from __future__ import annotations

import math

import numpy as np
import pytest

from tests.experiments.tracking_3.closed_form import (
    FAR,
    GIVE,
    PD,
    RATE,
    RIG,
    SET_1,
    SET_4,
    SIZE,
    SUM,
    TWIST,
    motion,
    outcome,
    ran,
    tracking,
)
from upright.experiments.tracking_3.figures import (
    Tradeoff,
    in_reading_unit,
    poles_chart,
    steps_figure,
    tradeoff_figure,
)
from upright.experiments.tracking_3.laws import AT, loop_poles
from upright.experiments.tracking_3.run import figured
from upright.report.planes import RootLocus, loci_chart

DEG = 180 / math.pi


def curves(ax):
    """Lines of many points, by their labels."""
    return {line.get_label(): line for line in ax.get_lines() if len(line.get_xdata()) > 20}


def marked(ax, mark):
    return [line for line in ax.get_lines() if line.get_marker() == mark and len(line.get_xdata())]


def test_a_trial_of_closed_form_has_the_figures_of_that_form():
    """``1 - exp(-a t)``: rise ln 9/a, within 5 % after ln 20/a, never beyond its rest; the push moves it by GIVE."""
    run = figured(motion(), SIZE)
    tick = RIG.period
    assert run.figures.rise == pytest.approx(math.log(9) / RATE, abs=2 * tick)
    assert run.figures.settling_5 == pytest.approx(math.log(20) / RATE, abs=2 * tick)
    assert run.figures.arrival == pytest.approx(math.log(20) / RATE, abs=2 * tick)
    assert run.figures.overshoot == 0.0
    assert run.twist == pytest.approx(TWIST * math.exp(-RATE * tick), abs=RATE * tick * TWIST)
    assert run.travel == pytest.approx(SIZE + (TWIST - SIZE) * math.exp(-RATE * 2.0), abs=1e-6)
    # means over 50 samples at either end, where what is left has died away to exp(-15)
    assert run.give == pytest.approx(GIVE, rel=2e-6)
    assert (run.effort.peak, run.effort.saturated) == (pytest.approx(4.0, abs=4.0 * RATE * tick), 0.0)
    assert run.effort.share == pytest.approx(run.effort.peak / RIG.limit)
    assert math.isinf(run.tripped)


def test_effort_is_that_of_the_step_and_not_of_the_push():
    late = motion()
    late.u[late.t > 2.2] = 9.0
    assert figured(late, SIZE).effort.peak < 4.0


@pytest.mark.parametrize(
    ("bounds", "size", "twist", "when"),
    [
        ({"twist": 0.15}, SIZE, 0.2, 0.1),  # twisted too far at once
        ({"travel": 0.2}, SIZE, 0.0, 0.1 + math.log(5) / RATE),  # 0.25 (1 - exp) passes 0.2
        ({"travel": 0.2}, -SIZE, 0.0, 0.1 + math.log(5) / RATE),  # to the other side
    ],
)
def test_a_run_ends_where_twist_or_travel_is_left(bounds, size, twist, when):
    run = figured(motion(RIG.replace(**bounds), size, twist=twist), size)
    assert run.tripped == pytest.approx(when, abs=RIG.period)
    assert run.figures is None
    assert math.isinf(run.give)
    assert run.travel == pytest.approx(max(abs(size) * (1 - math.exp(-RATE * (when - 0.1))), twist), rel=0.02)


def test_a_log_that_ends_early_has_tripped_where_it_ends():
    """A live rig's stop; what was seen up to there counts."""
    run = figured(motion(seconds=1.0), SIZE)
    assert run.tripped == pytest.approx(1.0, abs=RIG.period)
    assert run.figures is None
    assert run.twist == pytest.approx(TWIST, rel=0.01)


@pytest.mark.parametrize(("of", "shown"), [("m", (1e3, "mm")), ("rad", (DEG, "deg")), ("1", (1.0, "1"))])
def test_lengths_are_read_in_millimetres_and_angles_in_degrees(of, shown):
    assert in_reading_unit(of) == shown


def test_steps_stand_in_degrees_over_time_from_the_step_both_disks_above_the_command():
    drawing = steps_figure(tracking(), [outcome(SET_1), outcome(SET_4)])
    near, far, command = drawing.axes
    for ax, body in ((near, 0), (far, 1)):
        for name in ("set 1", "set 4"):
            t, y = curves(ax)[name].get_data()
            assert t[0] == pytest.approx(-0.05, abs=RIG.period)
            assert t[-1] == pytest.approx(0.5, abs=RIG.period)
            after = np.maximum(t, 0.0)
            expected = SIZE * (1 - np.exp(-RATE * after)) + (body == 0) * np.where(t > -1e-9, TWIST, 0) * np.exp(
                -RATE * after
            )
            np.testing.assert_allclose(y, DEG * expected, atol=DEG * RATE * RIG.period * TWIST)
        assert ax.get_ylim() == pytest.approx((-0.15 * DEG * SIZE, 1.3 * DEG * SIZE))
        assert ax.get_ylabel().endswith("[deg]")
        reference = next(line for line in ax.get_lines() if line.get_label() == "reference")
        np.testing.assert_allclose(reference.get_xdata(), [-0.05, 0, 0, 0.5])
        np.testing.assert_allclose(reference.get_ydata(), [0, 0, DEG * SIZE, DEG * SIZE])
        assert not marked(ax, "X")
    t, u = next(iter(curves(command).values())).get_data()
    assert (t[0], t[-1]) == (pytest.approx(-0.005, abs=RIG.period), pytest.approx(0.1, abs=RIG.period))
    np.testing.assert_allclose(u[t > 0], 4.0 * np.exp(-RATE * t[t > 0]), rtol=1e-9)
    assert sorted(line.get_ydata()[0] for line in command.get_lines() if len(line.get_xdata()) == 2) == [-10.0, 10.0]
    assert command.get_ylim() == (-13.0, 13.0)
    assert command.get_ylabel() == "command [V]"
    assert command.get_xlim() == pytest.approx((-0.005, 0.102))
    assert not [text for ax in (near, far) for text in ax.texts]  # no push within half a second


def test_a_comparison_shows_the_far_disk_alone_up_to_the_push_and_beyond():
    drawing = steps_figure(tracking(), [outcome(SET_4)], until=3.4, kick=None)
    far, command = drawing.axes
    t, y = curves(far)["set 4"].get_data()
    assert t[-1] == pytest.approx(3.4, abs=0.01)
    assert y[-1] == pytest.approx(DEG * (SIZE - GIVE), rel=1e-4)
    early = (t > 0) & (t < 0.02)  # where the near disk is a TWIST ahead
    np.testing.assert_allclose(y[early], DEG * SIZE * (1 - np.exp(-RATE * t[early])), atol=DEG * SIZE * 0.01)
    for ax in (far, command):
        assert [line.get_xdata()[0] for line in ax.get_lines() if line.get_linestyle() == "-."] == [2.0]
    assert [text.get_text().strip() for text in far.texts] == ["push begins"]
    assert far.texts[0].get_position()[0] == 2.0
    assert far.get_ylim() == pytest.approx((-0.15 * DEG * SIZE, 1.75 * DEG * SIZE))
    assert far.get_xlim() == command.get_xlim() == pytest.approx((-0.06, 1.02 * 3.4))


def test_a_run_that_trips_ends_in_a_cross_within_the_picture():
    lost = ran(tripped=0.3)
    drawing = steps_figure(tracking(), [outcome(SET_1, lost)])
    near, far, _ = drawing.axes
    for ax in (near, far):
        (cross,) = marked(ax, "X")
        assert cross.get_xdata()[0] == pytest.approx(0.2, abs=RIG.period)  # 0.1 s after the step is the step's zero
        assert ax.get_ylim()[0] <= cross.get_ydata()[0] <= ax.get_ylim()[1]
        assert curves(ax)["set 1"].get_xdata()[-1] == cross.get_xdata()[0]
    later = steps_figure(tracking(), [outcome(SET_1, ran(tripped=0.7))])  # after what is shown
    assert not [line for ax in later.axes for line in marked(ax, "X")]


def points(line):
    seen = np.isfinite(line.y)
    return np.sort_complex(line.x[seen] + 1j * line.y[seen])


def upper(values):
    return np.sort_complex(values[values.imag > -1e-9])


def test_poles_are_those_of_rig_model_and_request_in_the_upper_half_plane():
    other = RIG.changed(k_12=1.5 * RIG.plant.k_12)
    done = tracking(outcome(SET_1), outcome(SET_4), outcome(SUM), rig=other)
    drawing = poles_chart(done)
    assert len(drawing.panels) == 3
    left = 1.12 * SET_4.requested.real.min()
    assert drawing.span == pytest.approx((left, -0.06 * left))
    high = 1.2 * max(np.abs(p.imag).max() for p in (RIG.linear(AT).poles(), SET_1.requested, SET_4.requested))
    for panel, law in zip(drawing.panels, (SET_1, SET_4, SUM), strict=True):
        by_name = {line.name: line for line in panel.lines}
        np.testing.assert_allclose(points(by_name["open loop"]), upper(RIG.linear(AT).poles()), atol=1e-9)
        np.testing.assert_allclose(points(by_name["requested"]), upper(law.requested))
        np.testing.assert_allclose(points(by_name["on the fitted model, sampled and late"]), upper(law.poles))
        np.testing.assert_allclose(points(by_name["on the rig"]), upper(loop_poles(other, law.law)))
        assert panel.limits[1] == pytest.approx(high)
        assert panel.title == f"{law.name}, imaginary part"
    every = [(p, loop_poles(other, law.law), law.poles, law.requested) for law in (SET_1, SET_4, SUM)
             for p in [RIG.linear(AT).poles()]]  # fmt: skip
    beyond = sum(z.real < left or z.imag > high for kinds in every for p in kinds for z in upper(p))
    assert drawing.note == f"; {beyond} outside the picture"


def test_the_tradeoff_shows_the_curve_its_bounds_and_every_law():
    bargain = Tradeoff(
        stiffness=np.array([1.0, 3.0, 10.0]), decay=np.array([2.0, 5.0, 1.0]), bound=9.3, shaft=2.7,
        points={"set 4": (20.0, 9.0), "PD, tuned": (5.0, -1.0)}, unit="N m/rad",
    )  # fmt: skip
    (ax,) = tradeoff_figure(bargain).axes
    lines = {line.get_label(): line for line in ax.get_lines()}
    np.testing.assert_array_equal(lines["PD, near encoder, best kd"].get_xydata(), [[1, 2], [3, 5], [10, 1]])
    assert lines["half the root of k/inertia 1"].get_ydata() == [9.3, 9.3]
    assert lines["stiffness of the shaft"].get_xdata() == [2.7, 2.7]
    assert lines["set 4"].get_xydata().tolist() == [[20.0, 9.0]]
    assert lines["PD, tuned"].get_xydata().tolist() == [[5.0, 0.0]]  # unstable: at the foot
    assert lines["set 4"].get_color() != lines["PD, tuned"].get_color()
    assert lines["set 4"].get_marker() != lines["PD, tuned"].get_marker()
    assert ax.get_xscale() == "log"
    assert ax.get_ylim()[0] == 0


def test_root_loci_share_a_scale_and_show_the_upper_half():
    open_loop = np.array([0, -2.0, -1 + 20j, -1 - 20j])
    loci = [
        RootLocus(title=title, gains=np.array([1.0, 2.0]), tracks=np.array([[-1 + 2j, -1 - 2j], [-3.0, -4 + 5j]]),
                  marked=np.array([-3 - 1j, -3 + 1j]), zeros=zeros)
        for title, zeros in (("near encoder", np.array([-5.0, 7j])), ("far encoder", np.array([-5.0 + 0j])))
    ]  # fmt: skip
    drawing = loci_chart(loci, open_loop, of="as kp rises", symbol="kp", marked="tuned")
    size = 1.5 * math.hypot(1, 20)
    assert drawing.span == pytest.approx((-size, 0.6 * size))
    for panel, locus in zip(drawing.panels, loci, strict=True):
        lines = {line.name: line for line in panel.lines}
        tracks = [line for line in panel.lines if not line.mark]
        np.testing.assert_allclose(points(tracks[0]), np.sort_complex([-1 + 2j, -3]))
        np.testing.assert_allclose(points(tracks[1]), [-4 + 5j])
        assert [line.notes for line in tracks] == [("kp 1.00", "kp 2.00")] * 2
        np.testing.assert_allclose(points(lines["open loop"]), np.sort_complex([0, -2, -1 + 20j]))
        np.testing.assert_allclose(points(lines["zero"]), np.sort_complex(locus.zeros))
        np.testing.assert_allclose(points(lines["tuned"]), [-3 + 1j])
        assert panel.limits[1] == pytest.approx(size)
        assert panel.title == locus.title


def test_colours_differ_from_law_to_law():
    drawing = steps_figure(tracking(), [outcome(law) for law in (SET_1, SET_4, SUM, PD, FAR)])
    lines = [curves(drawing.axes[0])[law.name] for law in (SET_1, SET_4, SUM, PD, FAR)]
    assert len({line.get_color() for line in lines}) == 5


def test_a_command_that_holds_a_spring_is_no_unrest_and_a_ripple_about_it_is():
    """2 V all the while rest; with 0.3 V of a sine about them the rms is 0.3/sqrt(2)."""
    for ripple in (0.0, 0.3):
        held = motion(volts=0.0)
        held.u[held.t >= 0.1] = 2.0
        held.u[:] += ripple * np.sin(2 * math.pi * 25 * held.t)
        rest = figured(held, SIZE).rest
        assert rest.rms * RIG.limit == pytest.approx(ripple / math.sqrt(2), abs=0.02 * ripple + 1e-9)
