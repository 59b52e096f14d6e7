"""Does a comparison find the fit of the rig that a log is of, name what differs, and refuse what was seen?"""

from __future__ import annotations

import json
import math

import numpy as np
import pytest
from typer.testing import CliRunner

import upright as up
from upright.cli import app

NUMBERS = {"m_p": 0.135, "l_cg": 0.19, "r": 0.16, "J_d": 0.011, "J_p": 6e-4, "b_1": 6e-3, "b_2": 2e-4}
ASKED = ["J_p", "b_1", "b_2"]


def log(rate, seed, **changed):
    """Eight seconds of a driven Furuta, with noise of a milliradian."""
    t = np.arange(0, 8, 4e-3)
    command = 0.1 * np.sin(math.tau * (0.3 * t + rate * t**2))
    rig = up.Furuta(**{**NUMBERS, **changed})
    motion = up.simulate(rig, start={"theta": "30 deg"}, seconds=8, u=command, dt="4 ms")
    noise = np.random.default_rng(seed)
    keep = [n for n in motion.names if not n.endswith("_dot")]
    signals = {n: motion[n] + (noise.normal(0, 1e-3, t.size + 1) if n != "T" else 0.0) for n in keep}
    return motion.replace(signals=signals, units={n: motion.units[n] for n in keep})


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """Logs a and c of one rig, b of one whose arm has half as much friction again; fits of a and b."""
    at = tmp_path_factory.mktemp("compare")
    for name, record in {"a": log(0.15, 1), "b": log(0.12, 2, b_1=9e-3), "c": log(0.08, 3)}.items():
        record.to_pandas().to_csv(at / f"{name}.csv")
    known = {n: v for n, v in NUMBERS.items() if n not in ASKED}
    for name in "ab":
        up.identify(at / f"{name}.csv", up.Furuta, known=known, ask=ASKED, out=at / name)
    return at


@pytest.fixture(scope="module")
def compared(folder):
    return up.compare([folder / "a", folder / "b"], folder / "c.csv")


def test_the_fit_of_the_same_rig_predicts_best_and_what_differs_is_the_friction_that_does(compared):
    assert compared.value.best == "a"
    (by,) = compared.agree.values()
    assert {n: a.word for n, a in by.items()} == {"J_p": "agree", "b_1": "differ", "b_2": "agree"}
    assert by["b_1"].relative == pytest.approx(0.5, abs=0.02)
    assert compared.joint["b"][2] < 1e-6
    assert compared.chapter.sound
    assert compared.chapter.verdict.startswith("a predicts best.")
    assert "b1 of b by +50 %" in compared.chapter.verdict


def test_the_table_has_a_row_for_each_signal_and_a_column_for_each_that_predicts(compared):
    assert list(compared.table.columns) == ["a", "b", "black box"]
    assert [signal for _, signal in compared.table.index] == ["psi", "theta"]
    assert (compared.table["a"] > 98).all()
    assert (compared.table["a"] > compared.table["b"]).all()


def test_only_the_second_half_is_predicted_by_everybody(compared):
    (run,) = compared.runs.values()
    for score in run.scores.values():
        assert (score.t[0], score.t[-1]) == (pytest.approx(4.0, abs=5e-3), pytest.approx(8.0, abs=5e-3))


def test_a_run_that_a_fit_has_seen_tests_nothing(folder):
    compared = up.compare([folder / "a", folder / "b"], folder / "a.csv")
    assert compared.value.best == ""
    assert not compared.chapter.sound
    assert compared.chapter.verdict.startswith("Every run has been seen")
    assert "fitted by a:" in compared.chapter.warnings[-1]


def test_fits_that_share_a_log_are_not_independent(folder):
    compared = up.compare([folder / "a", folder / "a" / "fit.json"])
    assert compared.related
    assert "not independent" in " ".join(compared.chapter.warnings)


def test_the_command_writes_page_and_json_only_where_named(folder, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    words = ["compare", str(folder / "a"), str(folder / "b"), str(folder / "c.csv")]
    ended = CliRunner().invoke(app, words)
    assert ended.exit_code == 0
    assert "a predicts best" in ended.stdout
    assert list(tmp_path.iterdir()) == []
    assert CliRunner().invoke(app, [*words, "-o", "out"]).exit_code == 0
    content = json.loads((tmp_path / "out" / "comparison.json").read_text(encoding="utf-8"))
    assert content["agreement"]["b"]["b_1"]["word"] == "differ"
    assert 'class="traces"' in (tmp_path / "out" / "comparison.html").read_text(encoding="utf-8")
    assert CliRunner().invoke(app, [*words[:3], str(folder / "a.csv")]).exit_code == 3


def test_what_cannot_be_compared_is_a_sentence(folder):
    with pytest.raises(up.BadInput, match="two fits or more, or one and a log"):
        up.compare([folder / "a"])
    with pytest.raises(up.BadInput, match="does not exist"):
        up.compare([folder / "a"], folder / "none.csv")


def test_one_fit_and_a_log_stand_against_the_black_box_alone(folder):
    compared = up.compare([folder / "a"], folder / "c.csv")
    assert list(compared.table.columns) == ["a", "black box"]
    assert "Parameters differ" not in compared.chapter.verdict
