"""Do the pictures of experiment 2 show what ran, in degrees and centimetres, until it was lost, and what was told?"""

from __future__ import annotations

import math
from types import SimpleNamespace

import numpy as np
import pytest
from matplotlib.colors import to_hex

from upright.control import Trial
from upright.control.preflight import WORDS
from upright.experiments.regulation_2.figures import COLOURS, chances_figure, runs_figure, ways_figure
from upright.records import Record
from upright.rig.makes import make_rig

RIG = make_rig("linear")
T = np.arange(300) * 0.01


def run(theta=0.1, x=0.05, volts=3.0, rig=RIG):
    """A cart and a pendulum that swing about upright, and a command, as closed forms say."""
    states = np.zeros((T.size, 4))
    states[:, 0], states[:, 2] = x * np.sin(4 * T), math.pi + theta * np.cos(5 * T)
    log = Record(t=T, signals={"u": T}, inputs=("u",))
    return Trial(
        rig=rig, at="inverted", t=T, x=states, u=volts * np.cos(7 * T), rest=np.array([0, math.pi]), record=log
    )


def attempt(before, after=None, title="set 1: stabilised"):
    return SimpleNamespace(before=SimpleNamespace(run=before), after=after, title=title)


def lines(ax, style="-"):
    return [line for line in ax.get_lines() if line.get_linestyle() == style and len(line.get_xdata()) > 2]


def test_deviations_stand_in_degrees_and_centimetres_the_pendulum_above_the_cart_above_the_command():
    drawing = runs_figure([attempt(run(), run(0.2, 0.03, 2.0)), attempt(run(0.3))], seconds=2.5)
    assert len(drawing.axes) == 6
    axes = np.reshape(np.array(drawing.axes), (3, 2))
    shown = T[T <= 2.5]
    for row, expected, other in (
        (0, np.degrees(0.1 * np.cos(5 * shown)), np.degrees(0.2 * np.cos(5 * shown))),
        (1, 5.0 * np.sin(4 * shown), 3.0 * np.sin(4 * shown)),
        (2, 3.0 * np.cos(7 * shown), 2.0 * np.cos(7 * shown)),
    ):
        (told,), (came,) = lines(axes[row, 0], "--"), lines(axes[row, 0])
        np.testing.assert_allclose(told.get_xdata(), shown)
        np.testing.assert_allclose(told.get_ydata(), expected, atol=1e-9)
        np.testing.assert_allclose(came.get_ydata(), other, atol=1e-9)
    assert lines(axes[0, 1]) == []  # nothing was run
    assert [ax.get_ylabel().rpartition(" ")[2] for ax in axes[:, 0]] == ["[deg]", "[cm]", "[V]"]
    assert [ax.get_title(loc="left") for ax in axes[0]] == ["set 1: stabilised"] * 2
    for ax in axes[2]:
        limits = [line.get_ydata()[0] for line in ax.get_lines() if line.get_linestyle() == ":"]
        assert limits == [-RIG.limit, RIG.limit]
        low, high = ax.get_ylim()
        assert low < -RIG.limit < RIG.limit < high
        assert ax.get_xlabel() == "time [s]"


@pytest.mark.parametrize(("reach", "seen"), [(0.17, True), (0.05, False)])
def test_the_ends_of_the_travel_are_drawn_where_they_are_near(reach, seen):
    """The rail of 20 cm either way is in sight of a cart that goes 17 cm, and not of one that goes 5."""
    assert RIG.travel == 0.20
    drawing = runs_figure([attempt(run(x=reach)), attempt(run(x=reach))], seconds=3.0)
    for ax in np.reshape(np.array(drawing.axes), (3, 2))[1]:
        ends = [line.get_ydata()[0] for line in ax.get_lines() if line.get_linestyle() == ":"]
        assert ends == ([-20.0, 20.0] if seen else [])
    assert ("end of travel" in [t.get_text() for ax in drawing.axes for t in ax.texts]) == seen


def test_a_run_is_drawn_until_it_is_lost_and_a_cross_stands_there():
    """A cart whose rail ends at 20 cm is past it once 0.4 sin 4t > 0.2."""
    gone = math.asin(0.5) / 4
    drawing = runs_figure([attempt(run(x=0.4))], seconds=3.0)
    pendulum, cart, command = drawing.axes
    for ax in (pendulum, cart):
        (cross,) = [line for line in ax.get_lines() if line.get_marker() == "x"]
        assert cross.get_xdata()[0] == pytest.approx(gone, abs=0.011)
        (told,) = lines(ax, "--")
        assert told.get_xdata()[-1] == cross.get_xdata()[0]
        assert told.get_ydata()[-1] == cross.get_ydata()[0]
    assert lines(command, "--")[0].get_xdata()[-1] == pytest.approx(gone, abs=0.011)
    later = runs_figure([attempt(run(x=0.4))], seconds=0.1)  # before anything is lost
    assert not [line for ax in later.axes for line in ax.get_lines() if line.get_marker() == "x"]


def test_shares_of_every_end_add_up_to_a_hundred_with_what_came_beside():
    told = {
        "set 1": dict.fromkeys(WORDS, 0.0) | {"stabilised": 0.75, "falls": 0.25},
        "set 2": dict.fromkeys(WORDS, 0.0)
        | {"stabilised": 0.5, "stabilised with saturation": 0.3, "does not settle": 0.2},
    }
    drawing = chances_figure(told, {"set 1": "stabilised", "set 2": ""})
    (ax,) = drawing.axes
    bars = np.array([[(b.get_x(), b.get_width()) for b in part] for part in ax.containers])
    assert [to_hex(part[0].get_facecolor()) for part in ax.containers] == [to_hex(COLOURS[w][0]) for w in WORDS]
    for i, name in enumerate(told):
        assert bars[:, i, 1] == pytest.approx([100 * told[name][w] for w in WORDS])
        assert bars[:, i, 0] == pytest.approx(np.concatenate([[0], np.cumsum(bars[:-1, i, 1])]))
    assert [(t.get_text(), t.get_position()[1]) for t in ax.texts] == [("measured: stabilised", 0)]
    assert ax.get_xlim() == (0, 100)
    assert ax.yaxis_inverted()  # the first set on top
    taller = chances_figure(told | {f"set {k}": told["set 1"] for k in range(3, 9)}, {})
    assert taller.get_size_inches()[1] > 2 * drawing.get_size_inches()[1]


def test_a_way_to_the_velocities_is_its_command_sample_by_sample():
    drawing = ways_figure({"plain": run(volts=1.0), "filtered": run(volts=2.0)}, 0.5)
    first, second = drawing.axes
    for ax, volts, name in ((first, 1.0, "plain"), (second, 2.0, "filtered")):
        (line,) = ax.get_lines()
        np.testing.assert_allclose(line.get_xdata(), T[:51])
        np.testing.assert_allclose(line.get_ydata(), volts * np.cos(7 * T[:51]))
        assert line.get_drawstyle() == "steps-post"  # a command stays until the next
        assert ax.get_title(loc="left") == name
    assert first.get_ylabel().endswith("[V]")
    assert second.get_ylabel() == ""
