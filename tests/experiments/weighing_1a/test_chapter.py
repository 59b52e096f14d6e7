"""Do tables and pictures of experiment 1a show swings and line as a spring with two frictions has them?"""

from __future__ import annotations

import math
import re
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from tests.report.rendering import Rendered
from upright.experiments.stand.known import Known
from upright.experiments.weighing_1a.chapter import HandedOn, added_options, chapter, loading_chapter
from upright.experiments.weighing_1a.figures import (
    decrement_figure,
    extremes_figure,
    line_figure,
    plan_figure,
)
from upright.experiments.weighing_1a.run import Campaign, Weighing
from upright.identification.loadings import Loaded, Loadings
from upright.identification.model.fit import Estimate
from upright.records import Record
from upright.report.html import WORDS_OF_A_VERDICT
from upright.rig.makes import BODIES, MAKES
from upright.signals.free_swing import Decay

K, BARE, RHO, DELTA = 400.0, 0.6, 0.8, 0.001


def swing(added, first=0.05):
    """Extremes of a cart about 0.002: each is RHO of the last, less what dry friction takes, (1 + RHO) DELTA."""
    heights = [first]
    for _ in range(5):
        heights.append(RHO * heights[-1] - (1 + RHO) * DELTA)
    signs = np.array([1, -1, 1, -1, 1, -1])
    omega = math.sqrt(K / (BARE + added))
    x = 0.002 + signs * np.array(heights)
    return Decay(
        t=0.1 + math.pi / omega * np.arange(6), x=x, maximum=signs > 0, omega_d=omega, omega_n=omega, sigma=1.25,
        rho=RHO, centre=0.002, delta=DELTA, model=x + 1e-5, omega_error=0.0123, sigma_error=0.02, delta_error=2e-5,
    )  # fmt: skip


LOADS = (("0 g", 0.0), ("500 g", 0.5), ("500 g, run 2", 0.5), ("1 kg", 1.0))
SWINGS = tuple(Loaded(label=f"{label}, step 1", added=a, decay=swing(a)) for label, a in LOADS)
FOUND = Loadings(
    swings=SWINGS, k=Estimate.within(K, 2.0, 3.92), bare=Estimate.within(BARE, 0.003, 0.00588),
    damping=Estimate.within(1.23, 0.04, 0.0784), y=np.array([(BARE + a) / K * 1.01 for _, a in LOADS]),
    y_error=np.array([(BARE + a) / K * 0.005 for _, a in LOADS]), repeat=0.004, misfit=1.1,
    verdict="A line holds.",
)  # fmt: skip


def log(label):
    t = np.arange(3000) * 1e-3
    return Record(t=t, signals={"x": 0.05 * np.cos(20 * t)}, units={"x": "mm"}, outputs=("x",))


LOGS = {label: log(label) for label, _ in LOADS}


def told(found=FOUND, kind="rectilinear", **more):
    return loading_chapter(found, kind=kind, title="Loads", logs=LOGS, signals=dict.fromkeys(LOGS, "x"), **more)


def tables(chapter):
    return [b for part in chapter.parts for b in part.content if hasattr(b, "rows")]


def pictures(chapter):
    return {b.name: b for part in chapter.parts for b in part.content if hasattr(b, "draw")}


def test_every_swing_is_a_row_of_its_figures():
    """sqrt(400/0.6) = 25.82 rad/s; -2 ln 0.8 = 0.446; 1.25/25.82 = 0.0484."""
    swings, _ = tables(told())
    assert swings.rows[0] == (
        "0 g, step 1", "0", "6", "25.820", "0.012", "0.446", "0.0484", "1.00·10⁻³ ± 2.0·10⁻⁵",
    )  # fmt: skip
    assert [row[1] for row in swings.rows] == ["0", "0.5000", "0.5000", "1.000"]
    assert swings.numbers == tuple(range(1, 8))
    assert swings.headings[1] == "added [kg]"


def test_stiffness_inertia_and_friction_stand_with_interval_unit_and_meaning():
    _, found = tables(told())
    assert [tuple(map(str, row)) for row in found.rows] == [
        ("k", "400.0", "2.0", "396.1 to 403.9", "N/m", "stiffness"),
        ("m_0", "0.6000", "3.0·10⁻³", "0.5941 to 0.6059", "kg", "inertia of the bare body"),
        ("c", "1.230", "0.040", "1.152 to 1.308", "N s/m", "viscous friction"),
    ]
    assert found.numbers == (1, 2, 3)
    assert found.caption == "From 4 swings; repeats of one loading agree to 0.2 % of the frequency"  # half of y's 0.4 %
    _, alone = tables(told(replace(FOUND, repeat=math.nan)))
    assert alone.caption == "From 4 swings"
    _, beside = tables(told(truth={"k": 401.23, "m_0": 0.61, "c": 1.2}))
    assert [str(row[1]) for row in beside.rows] == ["401.2", "0.6100", "1.200"]
    assert beside.numbers == (1, 2, 3, 4)


def test_a_chapter_can_be_built_on_where_a_line_holds():
    assert told().sound
    assert not told(replace(FOUND, verdict="No line.")).sound
    assert [part.title for part in told().parts] == ["Data: the swings", "Fit: the line"]
    lost = told(left_out=("too few swings",))
    assert [part.title for part in lost.parts] == ["Data: the swings", "Left out", "Fit: the line"]
    numbers = told().numbers
    assert numbers["swings"][1] == {
        "label": "500 g, step 1", "added": 0.5, "omega_n": pytest.approx(math.sqrt(K / 1.1)), "stderr": 0.0123,
        "sigma": 1.25, "delta": DELTA,
    }  # fmt: skip
    assert numbers["k"]["value"] == K


def test_one_swing_of_each_loading_is_shown_lightest_first_and_six_at_most():
    drawing = pictures(told())["swings"].draw()
    assert [ax.get_title(loc="left").split(",")[0] for ax in drawing.axes] == ["0 g", "500 g", "1 kg"]
    many = tuple(Loaded(label=f"{i}", added=0.1 * (9 - i), decay=swing(0.1 * (9 - i))) for i in range(9))
    shown = pictures(told(replace(FOUND, swings=many)))
    assert set(shown) == {"decrements", "line"}  # no log of these labels
    (ax,) = shown["decrements"].draw().axes
    assert [t.get_text() for t in ax.get_legend().get_texts()] == ["8", "7", "6", "5", "4", "3"]


def test_the_line_goes_through_minus_the_bare_inertia_with_slope_1_over_k():
    top, left = line_figure(FOUND, "kg").axes
    line = next(li for li in top.get_lines() if li.get_label().startswith("line"))
    np.testing.assert_allclose(line.get_xydata(), [[-BARE, 0.0], [1.08, (BARE + 1.08) / K]], atol=1e-12)
    (square,) = [li for li in top.get_lines() if li.get_marker() == "s"]
    np.testing.assert_allclose(square.get_xydata(), [[-BARE, 0.0]])
    for ax, values, half in (
        (top, FOUND.y, 1.96 * FOUND.y_error), (left, [1.0] * 4, 100 * 1.96 * np.array([0.005] * 4)),
    ):  # fmt: skip
        (bars,) = ax.containers
        points, _, (lines,) = bars.lines
        np.testing.assert_allclose(points.get_xdata(), [0.0, 0.5, 0.5, 1.0])
        np.testing.assert_allclose(points.get_ydata(), values, rtol=1e-9)
        ends = np.array([segment[:, 1] for segment in lines.get_segments()])
        np.testing.assert_allclose(np.ptp(ends, axis=1), 2 * half, rtol=1e-6)
    assert top.get_ylim()[0] == 0
    assert left.get_xlabel() == "added inertia [kg]"


def test_extremes_and_recursion_lie_on_the_log_from_two_radians_before_to_eight_after():
    loaded = SWINGS[0]
    d = loaded.decay
    drawing = extremes_figure([(loaded, LOGS["0 g"], "x"), (SWINGS[3], LOGS["1 kg"].replace(units={}), "x")])
    first, second = drawing.axes
    curves = {li.get_label(): li for li in first.get_lines()}
    t = curves["log"].get_xdata()
    assert t[0] == pytest.approx(d.t[0] - 2 / d.omega_d, abs=1.1e-3)
    assert t[-1] == pytest.approx(d.t[-1] + 8 / d.omega_d, abs=1.1e-3)
    np.testing.assert_allclose(curves["log"].get_ydata(), 0.05 * np.cos(20 * t), atol=1e-9)
    np.testing.assert_array_equal(curves["extremes"].get_xydata(), np.column_stack([d.t, d.x]))
    np.testing.assert_array_equal(curves["recursion"].get_xydata(), np.column_stack([d.t, d.model]))
    (band,) = first.patches
    assert (band.get_y(), band.get_height()) == (pytest.approx(0.001), pytest.approx(0.002))  # centre +- delta
    assert first.get_title(loc="left") == "0 g, step 1: 25.82 rad/s, damping ratio 0.048"
    assert (first.get_ylabel(), second.get_ylabel()) == ("x\n[mm]", "x")
    assert second.get_xlabel() == "time [s]"
    taller = extremes_figure([(loaded, LOGS["0 g"], "x")] * 4)
    assert taller.get_size_inches()[1] - drawing.get_size_inches()[1] == pytest.approx(2.5)


def test_heights_over_the_first_fall_straight_by_viscous_friction_and_bend_by_dry():
    (ax,) = decrement_figure(SWINGS[:2]).axes
    rings, recursion, straight = ax.get_lines()[:3]
    d = SWINGS[0].decay
    over = np.abs(d.x - 0.002) / 0.05
    np.testing.assert_allclose(rings.get_ydata(), over)
    np.testing.assert_allclose(recursion.get_ydata(), np.abs(d.model - 0.002) / 0.05)
    np.testing.assert_allclose(straight.get_ydata(), RHO ** np.arange(6))
    assert (over[1:] < RHO ** np.arange(1, 6)).all()
    assert ax.get_yscale() == "log"
    assert [t.get_text() for t in ax.get_legend().get_texts()] == ["0 g, step 1", "500 g, step 1"]
    said = ax.yaxis.get_major_formatter()
    assert [said(v) for v in (0.1, 0.2, 0.5, 0.03, 2.0)] == ["0.1", "0.2", "0.5", "", "2"]


def test_what_plans_promise_is_drawn_in_percent_over_their_runs():
    plans = {
        n: tuple(SimpleNamespace(k=0.01 / n * (1 + i), bare=0.02 / n * (1 + i)) for i in (0, 1)) for n in (4, 3, 5)
    }
    (ax,) = plan_figure(plans, 4).axes
    curves = [li for li in ax.get_lines() if len(li.get_xdata()) == 3]
    assert len(curves) == 4
    runs = np.array([3, 4, 5])
    for line, percent in zip(curves, (1.0, 2.0, 2.0, 4.0), strict=True):
        np.testing.assert_allclose(line.get_xydata(), np.column_stack([runs, percent / runs]))
    (chosen,) = [li for li in ax.get_lines() if li not in curves]
    assert chosen.get_xdata()[0] == 4
    assert ax.get_ylim()[0] == 0
    assert ax.get_xticks().tolist() == [3, 4, 5]


def campaign(**more):
    rest = {
        "kind": "rectilinear", "logs": LOGS, "added": dict(LOADS), "loadings": FOUND, "left_out": (), "truth": {},
        "files": {label: f"log {i}.csv" for i, label in enumerate(LOGS)},
    }  # fmt: skip
    return Campaign(**(rest | more))


def test_loadings_are_typed_as_the_command_line_takes_them():
    assert added_options(campaign(), ["500 g", "1 kg"]) == '--added "0.5 kg" --added "1 kg"'
    assert added_options(campaign(kind="torsional", added={"a": 0.00123456789}), ["a"]) == '--added "0.00123457 kg m^2"'


@pytest.mark.parametrize(("tolerance", "said"), [(0.0, ""), (0.002, ' --tolerance "0.2 %"')])
def test_a_body_of_one_s_own_is_weighed_again_from_its_logs(tolerance, said):
    rig = SimpleNamespace(plant=BODIES["rectilinear"].rig.plant)
    done = Weighing(rig=rig, make=None, folder=Path("w"), campaign=campaign(), known=(), tolerance=tolerance)
    page = chapter(done)
    files = " ".join(f'"w/log {i}.csv"' for i in range(4))
    added = '--added "0 kg" --added "0.5 kg" --added "0.5 kg" --added "1 kg"'
    assert page.steps[0].command == f"upright loadings {files} {added}{said} --signal x --command u_applied"
    assert [(str(k.what), k.value) for k in page.findings] == [
        ("k [N/m]", "400.0"), ("m_0 [kg]", "0.6000"), ("c [N s/m]", "1.230"),
    ]  # fmt: skip
    assert page.numbers["parameters"]["m_1"]["value"] == BARE
    assert page.numbers["parameters"]["m_1"]["unit"] == "kg"


def test_logs_are_written_under_names_of_masses_and_runs(tmp_path):
    logs = {"2 masses, run 1": LOGS["0 g"]}
    assert campaign(logs=logs).written(tmp_path / "new").files == {"2 masses, run 1": "2x500g_run1.csv"}
    assert (tmp_path / "new" / "2x500g_run1.csv").exists()


def test_every_sentence_is_printed_for_some_result():
    template = Rendered(chapter.__module__)
    make = MAKES["furuta"]
    known = (Known(name="J_d", value=1.01 * make.rig.plant.J_d, stderr=1e-3 * make.rig.plant.J_d),)
    later = Weighing(
        rig=make.rig, make=make, folder=Path("w"), known=known, tolerance=0.0,
        campaign=campaign(kind="torsional", truth=dict.fromkeys(("k", "J_0", "c"), 1.0)),
    )  # fmt: skip
    with template.watched():
        page = chapter(later)
        told(left_out=("too few swings",))
        told(replace(FOUND, repeat=math.nan, swings=SWINGS[:1]), truth={"k": 401.23, "m_0": 0.61, "c": 1.2})
    assert template.missed == {}
    # ten standard errors, five times half an interval of 95 %, off by a hundredth
    assert page.detail == "J_d is 1 % from the twin's true value, outside its 95 % interval."
    assert len(f"{page.title} {page.question} {page.verdict}".split()) <= WORDS_OF_A_VERDICT


def test_what_is_handed_on_stands_beside_the_true_value_with_its_standard_error():
    make, true = MAKES["furuta"], MAKES["furuta"].rig.plant.J_d
    done = Weighing(
        rig=make.rig, make=make, folder=Path("w"), campaign=campaign(kind="torsional"), tolerance=0.0,
        known=(Known(name="J_d", value=true, stderr=2e-3 * true),),
    )  # fmt: skip
    (row,) = tables(chapter(done))[-1].rows
    value = [float(re.sub("·10⁻(.)", lambda m: f"e-{'⁰¹²³⁴⁵'.index(m[1])}", cell)) for cell in row[1:4]]
    assert value == [pytest.approx(true, rel=1e-3), pytest.approx(true, rel=1e-3), pytest.approx(2e-3 * true, rel=0.05)]
    (cover,) = chapter(done).findings
    low, high = (float(n) for n in cover.interval.replace("·10⁻³", "e-3").split(" to "))
    assert (high - low) / 2 == pytest.approx(1.96 * 2e-3 * true, rel=0.05)


@pytest.mark.parametrize(("value", "off"), [(1.25, 25.0), (0.75, 25.0), (1.0, 0.0)])
def test_what_is_handed_on_is_off_by_its_distance_over_the_truth_in_percent(value, off):
    assert HandedOn(name="m_1", value=value, stderr=0.1, truth=1.0, unit="kg").off == pytest.approx(off)
    for errors, inside in ((1.95, True), (1.97, False)):
        one = HandedOn(name="m_1", value=1.0 + errors * 0.1, stderr=0.1, truth=1.0, unit="kg")
        assert one.inside == inside
