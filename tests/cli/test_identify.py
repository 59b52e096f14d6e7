"""Does a log on disk become a fit, a report and a prediction, and is a person who errs told what to do?"""

import json
import math

import numpy as np
import pytest
from typer.testing import CliRunner

from upright.cli import app
from upright.study.keys import SECTIONS

LENGTH, G = 0.35, 9.81
W = math.sqrt(G / LENGTH)
T = np.arange(1500) * 0.01


def swing(t, amplitude=0.02, phase=0.0):
    """Undamped small swing, a closed form: theta'' = -(g/l) sin(theta), to amplitude^2/16 in the period."""
    return amplitude * np.cos(W * (1 - amplitude**2 / 16) * t + phase)


STUDY = """
title = "A thread and a bob"
[rig]
plant = "pendulum"
[parameters]
m_p = "1 kg"
l_cg = { guess = "0.5 m", min = "1 cm", max = "5 m" }
[sensors.theta]
unit = "rad"
[[runs]]
label = "one"
file = "one.csv"
[[runs]]
label = "two"
file = "two.csv"
role = "predict"
"""


@pytest.fixture
def bench(tmp_path, monkeypatch):
    """A folder with a study and two logs of one pendulum."""
    monkeypatch.chdir(tmp_path)
    for name, amplitude, phase in (("one", 0.02, 0.0), ("two", 0.015, 1.0)):
        rows = np.column_stack([T, swing(T, amplitude, phase)])
        np.savetxt(f"{name}.csv", rows, "%.12g", ",", header="t,theta", comments="")
    (tmp_path / "study.toml").write_text(STUDY, encoding="utf-8")
    return tmp_path


def run(*arguments):
    return CliRunner().invoke(app, list(arguments))


@pytest.fixture
def fitted(bench):
    outcome = run("identify", "study.toml", "-o", "out")
    assert outcome.exit_code == 0, outcome.output
    return bench, outcome, json.loads((bench / "out" / "fit.json").read_text(encoding="utf-8"))


def test_the_length_of_a_pendulum_is_found_from_its_period(fitted):
    _, _, fit = fitted
    assert fit["parameters"]["l_cg"]["value"] == pytest.approx(LENGTH, rel=1e-3)
    assert fit["runs"]["two"]["fit_percent"]["theta"] > 99


def test_fit_json_has_the_promised_keys(fitted):
    _, _, fit = fitted
    assert {"parameters", "runs", "verdict", "method", "evaluations", "seconds", "provenance"} <= set(fit)
    assert {"value", "stderr", "interval", "unit", "status"} <= set(fit["parameters"]["l_cg"])
    assert {"role", "fit_percent", "horizon"} <= set(fit["runs"]["one"])
    assert (fit["runs"]["one"]["role"], fit["runs"]["two"]["role"]) == ("fit", "predict")
    assert fit["parameters"]["m_p"]["status"] == "known"
    assert fit["parameters"]["l_cg"]["unit"] == "m"
    assert "one.csv" in fit["provenance"]["runs"]["one"]


def test_a_report_is_written_and_the_terminal_says_what_next(fitted):
    folder, outcome, fit = fitted
    assert (folder / "out" / "report.html").stat().st_size > 10_000
    assert "A thread and a bob" in (folder / "out" / "report.html").read_text(encoding="utf-8")
    for words in ("l_cg", "two", fit["answers"][0]["headline"][:30], "What next", "upright predict"):
        assert words in outcome.stdout


def test_a_fit_whose_motion_runs_away_is_written_with_its_reason(bench):
    """Friction of 1000 N m s/rad stops this bob within 1 ms: steps of 10 ms are too long, as long as it may become."""
    text = STUDY.replace('m_p = "1 kg"', 'm_p = "1 kg"\nb_2 = "1000 N m s/rad"').replace("5 m", "1 m")
    (bench / "study.toml").write_text(text, encoding="utf-8")
    outcome = run("identify", "study.toml", "-o", "out")
    assert outcome.exit_code == 0, outcome.output
    assert "The fit failed" in outcome.stdout
    fit = json.loads((bench / "out" / "fit.json").read_text(encoding="utf-8"))
    assert (fit["failed"], fit["trusted"]) == (True, False)
    assert fit["parameters"]["l_cg"]["stderr"] is None
    assert fit["parameters"]["l_cg"]["status"] == "unseen"
    assert "grows beyond all bounds" in (bench / "out" / "report.html").read_text(encoding="utf-8")
    assert run("identify", "study.toml", "-o", "out", "--strict").exit_code == 3


@pytest.mark.slow
def test_a_fitted_model_scores_another_study(fitted):
    outcome = run("predict", "out/fit.json", "study.toml", "--json", "-o", "scores")
    assert outcome.exit_code == 0, outcome.output
    scores = json.loads(outcome.stdout)["runs"]
    assert {label: s["role"] for label, s in scores.items()} == {"one": "predict", "two": "predict"}
    assert min(s["fit_percent"]["theta"] for s in scores.values()) > 99
    assert json.loads((fitted[0] / "scores" / "prediction.json").read_text(encoding="utf-8"))["runs"] == scores


def test_a_log_that_was_fitted_is_no_prediction_and_one_that_was_held_out_is(fitted):
    outcome = run("predict", "out/fit.json", "one.csv")  # a log, without a study
    assert "This is no prediction: the fit has seen 'log' (as 'one')." in outcome.stdout
    assert outcome.exit_code == 3
    held_out = run("predict", "out/fit.json", "two.csv")
    assert "the fit has seen" not in held_out.stdout
    assert held_out.exit_code == 0
    both = run("predict", "out/fit.json", "study.toml")
    assert "Verdict: The fit has seen 'one'." in both.stdout
    assert both.exit_code == 0


def test_the_tail_of_a_fitted_log_is_a_prediction(bench):
    """The same file, and no second of it in common."""
    text = STUDY.replace('file = "one.csv"', 'file = "one.csv"\nwindow = [0, 8.0]').split('[[runs]]\nlabel = "two"')[0]
    (bench / "study.toml").write_text(text, encoding="utf-8")
    assert run("identify", "study.toml", "-o", "out").exit_code == 0
    for window, seen in (("[8.5, 14.9]", False), ("[7.0, 14.9]", True)):
        (bench / "tail.toml").write_text(text.replace("[0, 8.0]", window), encoding="utf-8")
        outcome = run("predict", "out/fit.json", "tail.toml", "--json")
        assert bool(json.loads(outcome.stdout)["seen_in_the_fit"]) == seen


@pytest.mark.slow
def test_prediction_needs_no_parameters_in_its_study(fitted):
    folder = fitted[0]
    head, _, tail = STUDY.partition("[parameters]")
    (folder / "other.toml").write_text(head + tail[tail.index("[sensors") :], encoding="utf-8")
    outcome = run("predict", "out/fit.json", "other.toml")
    assert outcome.exit_code == 0, outcome.output
    assert "two" in outcome.stdout


def test_json_on_the_terminal_is_the_file(bench):
    outcome = run("identify", "study.toml", "-o", "out", "--json", "--no-report")
    assert json.loads(outcome.stdout) == json.loads((bench / "out" / "fit.json").read_text(encoding="utf-8"))
    assert not (bench / "out" / "report.html").exists()


def test_ctrl_c_keeps_and_writes_the_best_so_far(bench, monkeypatch):
    from dataclasses import replace

    from upright.identification import estimate

    whole = estimate.identify
    monkeypatch.setattr(estimate, "identify", lambda *a, **k: replace(whole(*a, **k), interrupted=True))
    outcome = run("identify", "study.toml", "-o", "out", "--no-report")
    assert outcome.exit_code == 130
    assert json.loads((bench / "out" / "fit.json").read_text(encoding="utf-8"))["interrupted"] is True


def test_an_interrupted_fit_says_everywhere_what_it_did_not_evaluate(bench, monkeypatch):
    """Terminal, fit.json and page; two.csv was held out and is not predicted."""
    from contextlib import contextmanager

    from upright.cli import terminal

    @contextmanager
    def impatient(**_):
        def stop(step, share):
            raise KeyboardInterrupt

        yield stop

    monkeypatch.setattr(terminal, "progress_bar", impatient)
    (bench / "study.toml").write_text(STUDY + STUDY[STUDY.index("[[runs]]") :].replace('"one"', '"third"', 1)
                                      .replace('"two"', '"fourth"', 1), encoding="utf-8")  # fmt: skip
    outcome = run("identify", "study.toml", "-o", "out", "--hold-out", "each")
    assert outcome.exit_code == 130, outcome.output
    page = (bench / "out" / "report.html").read_text(encoding="utf-8")
    told = json.loads((bench / "out" / "fit.json").read_text(encoding="utf-8"))
    assert set(told["runs"]) == {"one", "third"}
    assert "cross-validation" in told["not_evaluated"]
    for text in (" ".join(outcome.stdout.split()), page, told["verdict"]):
        assert "Not evaluated: interrupted." in text
        for claim in ("No equilibrium of this plant is unstable", "Every run was fitted", "can be used:"):
            assert claim not in text


@pytest.mark.slow
def test_a_log_becomes_a_study_becomes_a_fit_without_an_edit(bench):
    made = run("init", "one.csv", "-o", "drafted.toml")
    assert made.exit_code == 0, made.output
    assert "upright identify drafted.toml" in made.stdout
    outcome = run("identify", "drafted.toml", "-o", "out", "--no-report", "--json")
    assert outcome.exit_code == 0, outcome.output
    assert json.loads(outcome.stdout)["parameters"]["l_cg"]["value"] == pytest.approx(LENGTH, rel=2e-3)


def test_every_key_of_a_study_is_printed_on_request():
    listing = run("identify", "--keys")
    assert listing.exit_code == 0
    assert all(f"| `{key.name}` |" in listing.stdout for _, keys in SECTIONS.values() for key in keys)


def test_init_does_not_overwrite_unless_told(bench):
    assert "exists already" in run("init", "one.csv", "-o", "study.toml").stderr
    assert (bench / "study.toml").read_text(encoding="utf-8") == STUDY
    assert run("init", "one.csv", "-o", "study.toml", "--force").exit_code == 0


@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        (["identify", "gone.toml"], "upright init LOG"),
        (["identify", "one.csv"], "upright init"),
        (["identify", "study.toml", "--method", "simplx"], "did you mean 'simplex'?"),
        (["identify", "study.toml", "-o", "one.csv"], "one.csv is a file"),
        (["identify", "study.toml", "--data", "nowhere"], "nowhere"),
        (["identify", "known.toml"], "give one a guess"),
        (["identify", "unseen.toml"], "at least one needs role"),
        (["predict", "gone.json", "study.toml"], "upright predict OUT/fit.json STUDY.toml"),
        (["predict", "study.toml", "study.toml"], "not a fit.json"),
        (["predict", "empty.json", "study.toml"], "lacks the keys"),
        (["predict", "chain.json", "study.toml"], "both must be the same plant"),
        (["init", "gone.csv"], "There is no file"),
        (["init", "."], "is a folder"),
        (["init", "one.csv", "--plant", "furutta", "-o", "x.toml"], "did you mean 'furuta'?"),
        (["init", "one.csv", "--plant", "rectilinear-1", "-o", "x.toml"], "choose another --plant"),
    ],
)
def test_a_mistake_is_answered_in_one_sentence(bench, arguments, says):
    known = STUDY.replace('{ guess = "0.5 m", min = "1 cm", max = "5 m" }', '"0.5 m"')
    (bench / "known.toml").write_text(known, encoding="utf-8")
    (bench / "unseen.toml").write_text(
        STUDY.replace('label = "one"', 'label = "one"\nrole = "predict"'), encoding="utf-8"
    )
    (bench / "empty.json").write_text("{}", encoding="utf-8")
    entry = {"plant": "rectilinear-1", "verdict": "", "format": 1, "parameters": {"m_1": {"value": 1.0}}}
    (bench / "chain.json").write_text(json.dumps(entry), encoding="utf-8")
    outcome = run(*arguments)
    assert outcome.exit_code == 2, outcome.output
    assert says in outcome.stderr
    assert outcome.stderr.count("\n") == 1


@pytest.mark.slow
def test_a_prediction_that_falls_short_exits_with_3(fitted):
    """A thread a tenth longer swings 5 % slower: after nine swings it is half a swing late."""
    slower = 0.02 * np.cos(W / np.sqrt(1.1) * T)
    np.savetxt("slow.csv", np.column_stack([T, slower]), "%.12g", ",", header="t,theta", comments="")
    study = STUDY.split("[[runs]]")[0] + '[[runs]]\nlabel = "slow"\nfile = "slow.csv"\n'
    (fitted[0] / "slow.toml").write_text(study, encoding="utf-8")
    outcome = run("predict", "out/fit.json", "slow.toml")
    assert outcome.exit_code == 3, outcome.output
    assert "worse than the fit promises" in outcome.stdout
    told = json.loads(run("predict", "out/fit.json", "slow.toml", "--json").stdout)
    assert told["as_promised"] is False
    assert told["runs"]["slow"]["inside"]["theta"] < 70


@pytest.mark.slow
def test_a_larger_swing_is_named_as_extrapolation(fitted):
    np.savetxt("wide.csv", np.column_stack([T, swing(T, 0.04)]), "%.12g", ",", header="t,theta", comments="")
    study = STUDY.split("[[runs]]")[0] + '[[runs]]\nlabel = "wide"\nfile = "wide.csv"\n'
    (fitted[0] / "wide.toml").write_text(study, encoding="utf-8")
    said = " ".join(run("predict", "out/fit.json", "wide.toml").stdout.split())
    assert "Run 'wide' extrapolates: theta reaches 0.04 rad, 2 times the 0.02 rad" in said
    assert "extrapolates" not in run("predict", "out/fit.json", "study.toml").stdout


@pytest.mark.slow
def test_a_fit_of_an_older_version_predicts_without_bands(fitted):
    path = fitted[0] / "out" / "fit.json"
    old = json.loads(path.read_text(encoding="utf-8"))
    assert old.pop("bands")["level"] == 0.9
    path.write_text(json.dumps(old), encoding="utf-8")
    outcome = run("predict", "out/fit.json", "study.toml", "-o", "old")
    assert outcome.exit_code == 0, outcome.output
    assert "holds no bands" in outcome.stdout
    assert "90 % band" not in (fitted[0] / "old" / "prediction.html").read_text(encoding="utf-8")


def test_the_page_of_a_prediction_shows_its_band(fitted):
    assert run("predict", "out/fit.json", "study.toml", "-o", "new").exit_code == 0
    for page in ("new/prediction.html", "out/report.html"):
        assert "should hold 90 % of the samples" in (fitted[0] / page).read_text(encoding="utf-8")
