"""Does `upright frequency` tell what it found, and what it cannot use?"""

from __future__ import annotations

import json
import shlex

import pytest
from typer.testing import CliRunner

from upright.cli import app


def upright(*arguments: object):
    return CliRunner().invoke(app, [*map(str, arguments)], terminal_width=200)


def said(outcome) -> str:
    return " ".join((outcome.stdout + outcome.stderr).split())


@pytest.mark.slow
def test_a_twin_is_swept_and_its_log_tells_the_same(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    first = upright("frequency", "--rig", "linear", "--seed", 4, "-o", "out")
    assert first.exit_code == 0, first.stderr
    assert "truth" in first.stdout
    page = (tmp_path / "out" / "report.html").read_text(encoding="utf-8")
    assert page.count('class="still"') == 4  # the rig, the response of either coordinate and the sweep
    shown = next(
        line for line in first.stdout.splitlines() if line.strip().startswith("upright frequency out/sweep.csv")
    )
    again = json.loads(upright(*shlex.split(shown)[1:], "--json").stdout)
    pole = json.loads((tmp_path / "out" / "fit.json").read_text())["poles"]["inverted"][0]["real"]
    # the same log; of the pendulum only the design's weight is known now, on which the pole does not depend
    assert again["pole"]["value"] == pytest.approx(pole["value"], rel=1e-3)
    read_back = json.loads(upright("frequency", "out/frequency.csv", "--rig", "linear", "--json", "-o", "b").stdout)
    assert read_back["pole"]["value"] == pytest.approx(pole["value"], rel=1e-3)
    gains = upright("design", "out/fit.json", "--at", "inverted", "--poles", "-4.15+-1.63j, -16.9, -3.2", "--json")
    assert gains.exit_code == 0, gains.stderr
    bare = json.loads(upright("frequency", "out/sweep.csv", "--json", "-o", "c").stdout)
    assert set(bare["outputs"]) == {"x", "theta"}


@pytest.mark.parametrize(
    ("arguments", "sentence"),
    [
        (["--rig", "furutta"], "did you mean 'furuta'"),
        (["--ask", "noise"], "sines, multisine, sweep"),
        (["--known", "m_p=1 kg"], "belongs to a log"),
        (["u.csv", "--command", "v"], "no column 'v'"),
        (["u.csv", "--command", "u", "--counts", "phi=3"], "which is no output"),
        (["u.csv", "--command", "u", "--rig", "linear"], "'y' is no coordinate of"),
        (["u.csv", "--command", "u", "--known", "m_p=1 kg"], "name the rig with --rig"),
        (["u.csv", "--command", "u", "--rig", "linear", "--known", "m_q=1"], "no number 'm_q'"),
        (["u.csv", "--command", "u", "--counts", "y=none"], "not 0"),
    ],
)
def test_what_cannot_be_used_is_said(tmp_path, monkeypatch, arguments, sentence):
    import numpy as np

    from upright.records import Record

    monkeypatch.chdir(tmp_path)
    t = np.arange(4000) * 1e-2
    Record(t=t, signals={"u": np.sin(5 * t) * 3, "y": np.sin(5 * t - 1)}, inputs=("u",), outputs=("y",)).to_csv("u.csv")
    outcome = upright("frequency", *arguments, "-o", tmp_path / "out")
    assert outcome.exit_code == 2, outcome.stdout
    assert sentence in said(outcome)
    assert "Traceback" not in said(outcome)
