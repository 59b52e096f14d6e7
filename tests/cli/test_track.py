"""Does `upright track` tell what its files hold, and say in sentences what cannot be had?"""

from __future__ import annotations

import json

import pytest
from typer.testing import CliRunner

from upright.cli import app


def track(*arguments: object):
    return CliRunner().invoke(app, ["track", *map(str, arguments)], terminal_width=200)


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["--rig", "furuta"], "--rig is rectilinear or torsional"),
        (["--set", "5"], "sets 1 to 4"),
        (["--set", "first"], "--set takes numbers"),
        (["--step", "10 deg"], "Expected a value in m"),
        (["--step", "-1 mm"], "--step needs a size above 0"),
        (["--limit", "0"], "--limit must be above 0"),
        (["nothing.json"], "nothing.json does not exist"),
        (["--poles", "-1, -2"], "needs 4 poles, got 2"),
    ],
)
def test_what_cannot_be_had_is_said_in_a_sentence(tmp_path, arguments, words):
    outcome = track(*arguments, "-o", tmp_path)
    assert outcome.exit_code == 2
    assert words in " ".join(outcome.stderr.split())


@pytest.mark.slow
def test_a_twin_is_told_and_its_fit_foretells_the_same(tmp_path):
    first = track("--seed", 3, "--set", "1,4", "-o", tmp_path / "out")
    assert first.exit_code == 0, first.stderr
    told = " ".join(first.stdout.split())
    for words in (
        "Estimates from the pulses",
        "static force per error [N/m]",
        "Verdict: All 2 pole sets follow a step of",
        "What next",
    ):
        assert words in told
    page = (tmp_path / "out" / "track.html").read_text(encoding="utf-8")
    for name in ("track-poles", "track-steps", "track-compared", "track-bargain", "track-loci"):
        assert f'id="{name}-' in page
    whole = json.loads((tmp_path / "out" / "track.json").read_text(encoding="utf-8"))
    again = track(tmp_path / "out" / "fit.json", "--set", 4, "--step", f"{whole['step']} m", "--json", "-o", tmp_path)
    assert again.exit_code == 0, again.stderr
    one = json.loads(again.stdout)
    assert one["laws"]["set 4"]["K"] == pytest.approx(whole["laws"]["set 4"]["K"], rel=1e-9)
    for name in ("rise", "overshoot", "arrival", "error", "effort_peak", "give"):
        first_told = whole["laws"]["set 4"]["foreseen"][name]
        assert one["laws"]["set 4"]["foreseen"][name] == pytest.approx(first_told, rel=1e-6)
    assert one["laws"]["set 4"]["found"] is None


@pytest.mark.slow
def test_a_step_too_large_saturates_and_is_said_to(tmp_path):
    outcome = track("--rig", "torsional", "--set", 4, "--step", "25 deg", "-o", tmp_path)
    assert outcome.exit_code == 0, outcome.stderr
    assert "is too much for set 4 (at the drive's limit in" in " ".join(outcome.stdout.split())
    assert json.loads((tmp_path / "track.json").read_text())["laws"]["set 4"]["found"]["effort_share"] == 1.0
