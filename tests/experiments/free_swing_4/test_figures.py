"""Do the pictures of experiment 4 show paths in degrees or centimetres, and the energy stacked in millijoules?"""

from __future__ import annotations

import numpy as np
import pytest

from upright.experiments.free_swing_4.chapter import chapter
from upright.experiments.free_swing_4.figures import drift_figure, energy_figure, frames_figure
from upright.experiments.free_swing_4.release import DriftPath, freed
from upright.experiments.free_swing_4.run import EnergyBalance, FreeSwing
from upright.rig.makes import make_rig

T = np.linspace(0.0, 3.0, 301)


def path(name, end, remedy):
    """A straight way to `end` with a swing of 0.1 about it."""
    return DriftPath(
        name=name,
        remedy=remedy,
        t=T,
        psi=end * T / 3 + 0.1 * np.sin(20 * T),
        centre=end * T / 3,
        slope=end / 3,
        end=end,
    )


PATHS = (path("free, level", 0.01, False), path("pushed", 0.6, False), path("spring", -0.02, True))


@pytest.mark.parametrize(("body", "factor", "unit"), [("disk", 180 / np.pi, "[°]"), ("cart", 100.0, "[cm]")])
def test_paths_without_the_spring_stand_left_and_those_with_it_right_in_one_scale(body, factor, unit):
    free, held = drift_figure(PATHS, body).axes
    for ax, paths in ((free, PATHS[:2]), (held, PATHS[2:])):
        drawn = [line for line in ax.get_lines() if len(line.get_xdata())]
        assert len(drawn) == 2 * len(paths)
        for one, (thin, bold) in zip(paths, zip(drawn[::2], drawn[1::2], strict=True), strict=True):
            np.testing.assert_allclose(thin.get_xydata(), np.column_stack([T, factor * one.psi]))
            np.testing.assert_allclose(bold.get_xydata(), np.column_stack([T, factor * one.centre]))
            assert thin.get_linewidth() < bold.get_linewidth()
        assert [t.get_text() for t in ax.get_legend().get_texts()] == [p.name for p in paths]
        assert ax.get_xlabel() == "time [s]"
    assert free.get_ylabel().endswith(unit)
    assert free.get_ylim() == held.get_ylim()
    most = factor * max(p.psi.max() for p in PATHS)
    assert free.get_ylim()[1] > 1.2 * most  # room for the legend
    assert (free.get_title(loc="left"), held.get_title(loc="left")) == (
        f"{body} free", f"{body} anchored by a soft spring",
    )  # fmt: skip


def test_energies_are_stacked_from_what_is_still_there_on():
    """Two joules that go over to friction: every layer in millijoules, their sum constant."""
    t = np.linspace(0.0, 8.0, 801)
    stored = 2.0 * np.exp(-t)
    taken = {"viscous friction": 0.75 * (2.0 - stored), "Coulomb friction of psi": 0.25 * (2.0 - stored)}
    (ax,) = energy_figure(t, stored, taken).axes
    shown = t[::2]  # 400 are enough
    tops = [layer.get_paths()[0].vertices for layer in ax.collections]
    assert len(tops) == 3
    for vertices, top in zip(tops, (stored, stored + taken["viscous friction"], 2.0 + 0 * t), strict=True):
        for x, y in zip(shown.tolist(), top[::2].tolist(), strict=True):
            candidates = vertices[np.isclose(vertices[:, 0], x), 1]
            assert np.isclose(candidates, 1e3 * y).any()
        assert set(vertices[:, 0].tolist()) <= set(shown.tolist())
    assert [text.get_text() for text in ax.get_legend().get_texts()] == [
        "still in the motion", "taken by viscous friction", "taken by Coulomb friction of ψ",
    ]  # fmt: skip
    assert len({layer.get_hatch() for layer in ax.collections}) == 3  # told apart on grey paper
    assert (ax.get_xlabel(), ax.get_ylabel()) == ("time [s]", "energy [mJ]")
    few = energy_figure(t[:10], stored[:10], {"drag": stored[:10]}).axes[0]
    assert len(set(few.collections[0].get_paths()[0].vertices[:, 0].tolist())) == 10  # all of a short one


@pytest.mark.parametrize(
    ("make", "rows", "unit"),
    [("furuta", (("free, level", "0.19", "0.57"), ("pushed", "11", "34"), ("spring", "−0.38", "−1.1")), "°"),
     ("linear", (("free, level", "0.33", "1.0"), ("pushed", "20", "60"), ("spring", "−0.67", "−2.0")), "cm")],
)  # fmt: skip
def test_the_chapter_s_table_of_drift_is_in_degrees_or_centimetres(make, rows, unit, tmp_path):
    """0.01 rad is 0.57 degrees, over 3 s 0.19 per second; 0.01 m is 1 cm."""
    ways = (*PATHS, path("pushed, spring", 0.0, True), path("out of level", 0.0, False),
            path("out of level, spring", 0.0, True))  # fmt: skip
    t = np.linspace(0, 1, 11)
    energy = EnergyBalance(t=t, stored=0.02 - 0.01 * t, dissipated={"viscous friction": 0.0123 * t})
    done = FreeSwing(rig=freed(make_rig(make)), folder=tmp_path, drifts=ways, balance=energy)
    told = chapter(done)
    assert [part.title for part in told.parts][1:] == [
        "Where the energy went",
        f"Why the {'disk' if make == 'furuta' else 'cart'} wanders",
    ]
    (table,) = [b for b in told.parts[2].content if hasattr(b, "rows")]
    assert table.rows[:3] == rows
    assert table.numbers == (1, 2)
    assert table.headings[1].endswith(f"[{unit}/s]")
    drift = next(b for b in told.parts[2].content if hasattr(b, "draw"))
    assert f"free, level {rows[0][2] if make == 'linear' else '0.6'} {unit}" in drift.description
    (balance,) = [b for b in told.parts[1].content if hasattr(b, "draw")]
    assert balance.description == "At the end: viscous friction 12.3 mJ."
    assert told.numbers["drift"]["pushed"] == {"slope": pytest.approx(0.2), "end": 0.6}


def test_frames_are_right_handed_and_turned_by_the_angles_that_are_drawn():
    """Where axis i points along s z, s = +-1, of a page with x to the right and y up, the next two are i x j = k."""
    above, outside = frames_figure().axes
    for ax in (above, outside):
        drawn = [xy for line in ax.lines for xy in zip(*line.get_data(), strict=True)]
        drawn += [t.get_position() for t in ax.texts] + [t.xy for t in ax.texts if not t.get_text()]
        (left, right), (low, high) = ax.get_xlim(), ax.get_ylim()
        assert all(left < x < right and low < y < high for x, y in drawn)  # nothing is cut off
    for ax, out, fixed, turned, first, second, name in (
        (above, -1, "n", "a", 2, 3, "psi"),  # axis 1 into the page, (-z) x 2 = 3
        (outside, 1, "a", "b", 1, 3, "theta"),  # axis 2 out of it, 3 = 1 x z
    ):
        arrows = {}
        labels = [t for t in ax.texts if t.get_text().startswith(r"$\mathbf")]
        for arrow, label in zip([t for t in ax.texts if not t.get_text()], labels, strict=True):
            along = np.subtract(arrow.xy, arrow.xyann)
            letter, axis = label.get_text()[9], int(label.get_text()[-2])
            arrows[letter, axis] = along
            ahead = np.subtract(label.get_position(), arrow.xy)
            assert along[0] * ahead[1] - along[1] * ahead[0] == pytest.approx(0.0, abs=1e-12)
            assert along @ ahead > 0  # its name stands beyond its tip
        assert len(arrows) == 4
        assert {round(float(np.hypot(*v)), 9) for v in arrows.values()} == {0.55}
        for letter in (fixed, turned):
            x, y = arrows[letter, first]
            # s z x (x, y) = s (-y, x); (x, y) x s z = s (y, -x)
            wanted = (y, -x) if first == 1 else (out * -y, out * x)
            assert arrows[letter, second] == pytest.approx(wanted, abs=1e-12)
        where, to = (np.arctan2(*arrows[letter, first][::-1]) for letter in (fixed, turned))
        arc = max(ax.lines, key=lambda line: len(line.get_xdata()))
        radius, angle = np.hypot(*arc.get_data()), np.arctan2(*arc.get_data()[::-1])
        np.testing.assert_allclose(radius, radius[0])
        assert np.degrees([to - where, angle[-1] - angle[0]]) == pytest.approx([out * 35, out * 35])
        assert (angle[0], angle[-1]) == pytest.approx((where, to))
        (bar,) = [line for line in ax.lines if line.get_linewidth() == 6]
        ((x0, x1), (y0, y1)) = bar.get_data()
        assert (x0, y0) == (0.0, 0.0)
        assert np.arctan2(y1, x1) == pytest.approx(to)  # the arm lies along its axis 2, the rod along its axis 1
        assert any(t.get_text() == rf"$\{name}$" for t in ax.texts)
    (mass,) = [line for line in outside.lines if line.get_marker() == "o"]
    assert 0 < np.hypot(*np.ravel(mass.get_data())) < 1.5  # within the rod
