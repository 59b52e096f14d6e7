"""Does `upright design` hand on gains that hold the rig, and say in sentences what cannot be had?"""

from __future__ import annotations

import json
import math
from pathlib import Path

import numpy as np
import pytest
from scipy.stats import norm
from typer.testing import CliRunner

from tests.gains.furuta import RIG, STUDY
from upright.cli import app
from upright.laws import Law
from upright.report.symbols import number
from upright.simulation import simulate

POLES = "-4.1484+-1.6341j, -16.8545, -3.222"


def design(*arguments: object):
    return CliRunner().invoke(app, ["design", *map(str, arguments)], terminal_width=200)


@pytest.fixture
def study(tmp_path: Path) -> Path:
    path = tmp_path / "rig.toml"
    path.write_text(STUDY, encoding="utf-8")
    return path


def fit_file(folder: Path, stderr: float) -> Path:
    """A fit of the same rig on a drive of 0.5 N m/V, whose gain is known to `stderr`."""
    entries = {n: {"value": v, "stderr": 0.0, "unit": "", "status": "known"} for n, v in RIG.parameters().items()}
    entries["actuator.gain"] = {"value": 0.5, "stderr": stderr, "unit": "N m/V", "status": "well determined"}
    content = {
        "format": 1, "plant": "furuta", "verdict": "", "trusted": True, "parameters": entries,
        "estimated": ["actuator.gain"], "correlation": [[1.0]], "rig": {"entries": {
            "servo_period": {"value": 1e-3, "unit": "s", "source": "known"},
            "counts.psi": {"value": 16_000, "unit": "1/rev", "source": "known"},
            "counts.theta": {"value": 16_000, "unit": "1/rev", "source": "known"},
        }},
    }  # fmt: skip
    path = folder / "fit.json"
    path.write_text(json.dumps(content), encoding="utf-8")
    return path


def test_a_fit_plays_from_the_command_line_as_in_python(tmp_path):
    """Options that are not typed are those of `up.play`; the number of rigs came as None and ended in a TypeError."""
    page = tmp_path / "play.html"
    words = ["play", fit_file(tmp_path, 1e-3), "--poles", POLES, "--limit", "1", "--seconds", "0.1", "-o", page]
    outcome = CliRunner().invoke(app, [*map(str, words)], terminal_width=200)
    assert outcome.exit_code in (0, 3), outcome.stderr
    assert "of 200 rigs" in " ".join(outcome.stdout.split())
    assert page.exists()


@pytest.mark.slow
def test_the_gains_hold_the_nonlinear_rig(study, tmp_path):
    outcome = design(study, "--poles", POLES, "--limit", "0.6", "-o", tmp_path)
    assert outcome.exit_code == 0, outcome.stderr
    told = " ".join(outcome.stdout.split())
    assert "Stable with margin" in told
    assert "What next" in told
    found = json.loads((tmp_path / "design.json").read_text(encoding="utf-8"))
    matrices = {name: found["law"][name] for name in "ABCD"}
    law = Law(**matrices, target=[0.0, math.pi], references=np.zeros((2, 1)), delay=1.0)
    x = simulate(RIG, {"actuator.limit": 0.6}, RIG.state("inverted", theta=math.pi + 0.08), None, found["period"],
                 samples=4001, loop=law)[:, :4, 0]  # fmt: skip
    assert np.abs(x[-1] - RIG.state("inverted")).max() < 1e-4
    page = (tmp_path / "design.html").read_text(encoding="utf-8")
    assert "<svg" in page
    assert "open loop" in page


@pytest.mark.slow
def test_gains_from_a_fit_are_in_the_command_s_unit(study, tmp_path):
    """0.5 N m/V: twice the gains in volts."""
    design(study, "--poles", POLES, "-o", tmp_path / "force")
    outcome = design(fit_file(tmp_path, 1e-3), "--poles", POLES, "-o", tmp_path / "volts")
    assert outcome.exit_code == 0, outcome.stderr
    assert "V/rad" in outcome.stdout
    force, volts = (json.loads((tmp_path / n / "design.json").read_text()) for n in ("force", "volts"))
    np.testing.assert_allclose(volts["K"], 2 * np.array(force["K"]), rtol=1e-9)
    assert volts["chance_over_the_fit"] == 1.0


@pytest.mark.slow
def test_the_chance_of_standing_is_that_of_a_gain_within_its_margin(tmp_path):
    """Gain normal about 0.5 with 0.35: stands above the gain margin, so with the chance of the normal law.

    200 draws of a share near 0.83: standard error 0.027, four of them allowed.
    """
    outcome = design(fit_file(tmp_path, 0.35), "--poles", POLES, "-o", tmp_path)
    found = json.loads((tmp_path / "design.json").read_text())
    expected = norm.cdf(0.5 * (1 - found["margins"]["least_gain"]) / 0.35)
    assert found["chance_over_the_fit"] == pytest.approx(expected, abs=0.11)
    assert "of the rigs sampled from the fit's covariance are unstable" in " ".join(outcome.stdout.split())


@pytest.mark.slow
def test_least_cost_uses_up_the_limit(study, tmp_path):
    outcome = design(study, "--lqr", "1,0,1,0", "--limit", "0.5", "--start", "theta=4 deg", "--json", "-o", tmp_path)
    assert outcome.exit_code == 0, outcome.stderr
    assert json.loads(outcome.stdout)["peak_command"] == pytest.approx(0.5, rel=1e-6)
    assert "as the effort weight falls" in (tmp_path / "design.html").read_text(encoding="utf-8")


@pytest.mark.slow
def test_every_encoder_has_its_own_counts(study, tmp_path):
    """Noise of a plain difference is its step over T sqrt 6, coordinate by coordinate."""
    outcome = design(study, "--poles", POLES, "--counts", "psi=4000, theta=20000", "--speed", "plain", "-o", tmp_path)
    assert outcome.exit_code == 0, outcome.stderr
    page = (tmp_path / "design.html").read_text(encoding="utf-8")
    for counts in (4000, 20000):
        assert number(2 * math.pi / counts / (1e-3 * math.sqrt(6)), 2) in page


@pytest.mark.slow
def test_a_lag_takes_effort_and_margin(study, tmp_path):
    told = []
    for lag in ("0 ms", "8 ms"):
        design(study, "--poles", POLES, "--lag", lag, "-o", tmp_path)
        told.append(json.loads((tmp_path / "design.json").read_text(encoding="utf-8")))
    assert told[1]["lag"] == pytest.approx(8e-3)
    assert told[1]["margins"]["delay"] < told[0]["margins"]["delay"]
    assert told[1]["peak_command"] == told[0]["peak_command"]  # continuous feedback knows no drive
    assert told[1]["peak_command_sampled"] > told[0]["peak_command_sampled"]
    # 1 ms and a fast law: nearly continuous
    assert told[0]["peak_command_sampled"] == pytest.approx(told[0]["peak_command"], rel=0.05)


@pytest.mark.parametrize(
    ("fitted", "options", "samples", "said"),
    [
        (3e-3, (), 1.5, "as the file says"),  # 3 ms of 2 ms samples, and no sample of computing besides
        (3e-3, ("--delay", "2"), 2.0, "as requested"),
        (0.0, (), 1.0, "assumed"),
        (0.0, ("--delay", "0"), 0.0, "as requested"),
    ],
)
def test_a_delay_is_counted_once_and_its_source_is_told(tmp_path, fitted, options, samples, said):
    path = fit_file(tmp_path, 0.0)
    content = json.loads(path.read_text(encoding="utf-8"))
    content["parameters"]["actuator.delay"] = {"value": fitted, "stderr": 0.0, "unit": "s", "status": "known"}
    path.write_text(json.dumps(content), encoding="utf-8")
    outcome = design(path, "--poles", POLES, "--period", "2 ms", *options, "-o", tmp_path)
    assert outcome.exit_code == 0, outcome.stderr
    found = json.loads((tmp_path / "design.json").read_text(encoding="utf-8"))
    assert found["delay_samples"] == pytest.approx(samples)
    assert found["delay_from"] == said
    assert f"{samples:.3g} sample{'s' * (samples != 1)} late ({said})" in (tmp_path / "design.html").read_text(
        encoding="utf-8"
    )


def test_sampled_gains_meet_the_poles_in_the_loop_as_it_runs(study, tmp_path):
    slow = ("--period", "10 ms", "--poles", "-4.1484+-1.6341j, -16.8545, -3.222", "-o", tmp_path)
    design(study, *slow, "--sampled")
    poles = [complex(*p) for p in json.loads((tmp_path / "design.json").read_text())["poles"]["sampled_loop"]]
    for asked in (-4.1484 + 1.6341j, -16.8545, -3.222):
        assert min(abs(p - asked) for p in poles) < 1e-6


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["--poles", "-1, -2, -3"], "needs 4 poles, got 3"),
        (["--poles", "-1, -2, -3+1j, -4"], "comes without"),
        (["--poles", "-1, -2, -3, -4", "--lqr", "1,0,1,0"], "either --poles"),
        (["--poles", POLES, "--at", "upsidedown"], "no equilibrium 'upsidedown'"),
        (["--poles", POLES, "--speed", "guess"], "--speed is plain, filtered or kalman"),
        (["--poles", POLES, "--start", "phi=1 deg"], "--start names states"),
        (["--poles", POLES, "--track", "theta"], "track another coordinate"),
        (["--lqr", "1,0,1,0"], "--limit"),
        (["--lqr", "1,0,1,0", "--limit", "0.01"], "takes at least"),
        (["--lqr", "1,0", "--effort-weight", "1"], "must be 4 weights"),
        (["--lqr", "0,0,10,1", "--effort-weight", "1"], "do not see the mode at 0 (psi)"),
        (["--lqr", "0,0,10,1", "--limit", "0.5"], "weigh psi too"),
        (["--poles", POLES, "--counts", "phi=4000"], "got 'phi'; did you mean 'psi'?"),
        (["--poles", POLES, "--counts", "psi=none"], "--counts takes numbers above 0"),
        (["--poles", POLES, "--period", "10"], "Expected a value in s"),
    ],
)
def test_what_cannot_be_had_is_said_in_a_sentence(study, tmp_path, arguments, words):
    outcome = design(study, *arguments, "-o", tmp_path)
    assert outcome.exit_code == 2
    assert words in " ".join(outcome.stderr.split())


def test_a_loop_too_slow_for_the_rig_is_said_to_fall(study, tmp_path):
    outcome = design(study, "--poles", "-12+-4j, -40, -9", "--period", "60 ms", "-o", tmp_path)
    assert outcome.exit_code == 0, outcome.stderr
    assert "The sampled loop falls" in " ".join(outcome.stdout.split())
