"""Does the chapter of experiment 4 print what the fits came to, each number of the run and the signal that it names?"""

from __future__ import annotations

import math
import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from tests.experiments.free_swing_4.test_figures import path
from tests.report.conftest import make_fit
from upright.basis import SIMULATED
from upright.experiments.free_swing_4.chapter import chapter
from upright.experiments.free_swing_4.release import TILT, freed
from upright.experiments.free_swing_4.run import FreeSwing, QuestionFit, questions
from upright.identification.model.fit import Estimate
from upright.report.symbols import number
from upright.rig.makes import make_rig

DISK, CART = freed(make_rig("furuta", 3)), freed(make_rig("linear", 3))
SHARES = {"level_model": (61.0, 83.5), "tilt_model": (99.5, 99.25), "spring": (98.5, 97.5)}
DRIFTS = (
    path("free, level", 0.01, False), path("out of level by 0.25°", -math.radians(31), False),
    path("out of level by 0.25°, spring", math.radians(4), True), path("pushed", 0.31, False),
    path("pushed, spring", 0.041, True),
)  # fmt: skip


def fitted(shares=(99.0, 98.0), foreseen=(97.0, 96.5), **estimates):
    """A fit by hand: shares of psi and theta, of the fitted runs the worst and a better one, and what it predicts."""
    fit = make_fit()
    score = fit.runs["release"]

    def run(role, psi, theta):
        return replace(score, role=role, fit_percent={"psi": psi, "theta": theta})

    psi, theta = shares
    runs = {"release": run("fit", psi, theta), "again": run("fit", 99.9, 99.8), "other": run("predict", *foreseen)}
    return replace(fit, runs=runs, estimates={**fit.estimates, **estimates}, per_run={})


def done(rig=DISK, names=("free_swing", "no_scale", *SHARES), **more):
    true = rig.plant.parameters()
    own = {
        name: replace(Estimate.within(off * true[name], 0.0, 0.2 * true[name]), unit="N m s/rad")
        for name, off in (("b_1", 1.1), ("b_2", 1.3))
    }
    answers = {}
    for q in questions(rig):
        if q.name not in names:
            continue
        lean = {"tilt_y": Estimate.within(math.sin(math.radians(0.2)), 0, 0.001)} if q.name == "tilt_model" else {}
        fit = fitted(SHARES.get(q.name, (99.0, 98.0)), **lean)
        if q.name == "free_swing":
            fit = replace(fit, estimates=own)
        answers[q.name] = QuestionFit(question=q, study=None, fit=fit)
    result = FreeSwing(rig=rig, folder=Path("swing"), answers=answers, drifts=DRIFTS)
    for name, value in more.items():
        setattr(result, name, value)
    return result


@pytest.fixture(scope="module")
def told():
    return chapter(done())


def said(page):
    return f"{page.verdict} {page.detail}"


def test_the_verdict_counts_the_truths_that_their_intervals_hold_and_gives_each_run_s_worst_share(told):
    """Of b_1, 10 % off, and b_2, 30 % off, within 20 % one holds."""
    assert told.verdict.startswith("1 of 2 estimates agree with the true values (95 % intervals).")
    shares = [float(n) for n in re.findall(r"to ([\d.]+) % or better", told.verdict)]
    assert shares == [98.0, 99.8, 96.5]
    assert (told.sound, told.key, told.first_line) == (True, "4", SIMULATED)
    unit = "[N m s/rad]"
    assert [(k.what, k.value, k.truth) for k in told.findings] == [
        (f"b_1 {unit}", number(1.1 * DISK.plant.b_1, 4), number(DISK.plant.b_1, 4)),
        (f"b_2 {unit}", number(1.3 * DISK.plant.b_2, 4), number(DISK.plant.b_2, 4)),
    ]  # fmt: skip


def test_a_level_model_stands_beside_a_leaning_one_with_the_worst_of_what_each_was_fitted_to(told):
    pair = "a level model cannot explain the disk (fit 61.0 %); a model that estimates the lean can (99.25 %)."
    assert f"With the rig 0.25° out of level, {pair}" in said(told)
    for names in (("free_swing", "level_model"), ("free_swing", "tilt_model"), ("free_swing",)):
        assert "cannot explain" not in said(chapter(done(names=names)))
    assert pair in said(chapter(done(names=("level_model", "tilt_model"))))


def test_the_table_of_a_leaning_rig_has_the_worst_run_of_either_role_and_the_lean_in_degrees(told):
    (part,) = [p for p in told.parts if p.title == "Is the rig level?"]
    (table,) = [b for b in part.content if hasattr(b, "rows")]
    rows = [[str(cell) for cell in row] for row in table.rows]
    assert [row[1:5] for row in rows] == [
        ["61.0 %", "83.5 %", "97.0 %", "96.5 %"], ["99.50 %", "99.25 %", "97.0 %", "96.5 %"],
        ["98.5 %", "97.5 %", "97.0 %", "96.5 %"],
    ]  # fmt: skip
    assert [row[5] for row in rows] == ["", "0.2000°", ""]
    drawn = [b for b in part.content if hasattr(b, "draw")]
    assert len(drawn) == 3
    for picture, shares in zip(drawn, SHARES.values(), strict=True):
        numbers = [float(n) for n in re.findall(r"([\d.]+) %", picture.description)]
        assert numbers == pytest.approx(shares, abs=0.06)
    assert drawn[0].draw().axes


def test_the_free_disk_is_dragged_away_and_the_spring_keeps_it_near(told):
    """31 and 4 degrees, whichever way; a cart is pushed instead: 31.0 and 4.1 cm."""
    lean = f"{math.degrees(TILT):g}°"
    assert f"A lean of {lean} drags the free disk away by 31°; a soft spring keeps it within 4°." in said(told)
    cart = chapter(done(CART))
    assert "leaves the cart 31.0 cm away" in said(cart)
    assert "brings it back to 4.1 cm" in said(cart)
    assert "cannot explain" not in said(cart)


def test_the_pole_by_which_it_falls_is_that_of_the_linear_model(told):
    """By numpy's eigenvalues of A, to four digits."""
    falls = np.linalg.eigvals(DISK.plant.linear("inverted").A).real.max()
    text = " ".join(b for p in told.parts for b in p.content if isinstance(b, str))
    (printed,) = re.findall(r"falls with ([\d.]+) 1/s", text)
    assert float(printed) == pytest.approx(falls, rel=5e-4)


def test_what_goes_on_from_here_takes_the_fit_and_the_study_that_shows_something(told):
    typed = " ".join(s.command for s in told.steps)
    assert "swing/tilt_model.toml" in typed
    assert "upright predict swing/fit.json swing/level_model.toml" in typed
    assert "no_scale.toml" in " ".join(s.command for s in chapter(done(CART)).steps)


def test_an_interrupted_or_untrusted_swing_is_not_sound_and_other_programs_read_the_rest(told):
    assert not chapter(done(interrupted=True)).sound
    untrusted = done()
    answer = untrusted.answers["free_swing"]
    untrusted.answers["free_swing"] = replace(answer, fit=replace(answer.fit, trusted=False))
    assert not chapter(untrusted).sound
    bare = chapter(done(names=()))
    assert not bare.sound
    assert "stopped before the first fit" in bare.verdict
    assert (bare.findings, bare.numbers["parameters"]) == ((), {})
    true = DISK.plant.b_1
    assert told.numbers["parameters"]["b_1"] == {
        "truth": true, "value": pytest.approx(1.1 * true), "interval": pytest.approx((0.9 * true, 1.3 * true)),
        "inside": True,
    }  # fmt: skip
    fits = told.numbers["fits"]
    assert list(fits) == ["free_swing", "no_scale", *SHARES]
    assert fits["spring"]["fit_percent"]["release"] == {"psi": 98.5, "theta": 97.5}
    assert told.numbers["drift"]["pushed"]["end"] == 0.31
