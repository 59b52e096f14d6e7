"""Does what a fit says against itself stand before everything that is made from it, and does a simulation say so?"""

from __future__ import annotations

import json
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from typer.testing import CliRunner

from tests.gains.furuta import STUDY
from upright.cli import app
from upright.errors import BadInput
from upright.rig.makes import make_rig

NO = {
    "question": "Does it predict?",
    "answer": "no",
    "headline": "It explains 39.4 % of the fitted runs. It is not shown to predict.",
    "advice": "",
    "reasons": ["The fitted runs are not explained (swing theta 39.4 %; 80 % is the least)."],
}
UNTRUSTED = {"trusted": False, "answers": [NO], "verdict": "Does it predict? No. And so on, for a page."}
TRUSTED = {"trusted": True, "verdict": "Does it predict? Yes."}
SAID = "Does it predict? No. It explains 39.4 % of the fitted runs. It is not shown to predict. The fitted runs are"
REFUSED = "Do not rely on this: its model is not trusted."

POLES = "-4.15+-1.63j, -16.9, -3.2"
CLOSED = ("--poles", POLES, "--limit", 5)
SHORT = ("--set", 3, "--seconds", 0.5, "--draws", 2)
VERBS = {
    "design": ("linear", CLOSED, "design.html", False),
    "regulate": ("linear", SHORT, "report.html", True),
    "swing-up": ("linear", ("--seconds", 1), "swing_up.html", True),
    "track": ("rectilinear", ("--set", 1, "--step", "2 mm", "--vendor", "ECP 210"), "track.html", True),
}  # fmt: skip
SLOW = {"regulate", "swing-up", "track"}
EACH_VERB = [pytest.param(v, marks=[pytest.mark.slow] if v in SLOW else []) for v in VERBS]


def upright(*arguments: object):
    done = CliRunner().invoke(app, [*map(str, arguments)], terminal_width=200)
    assert done.exit_code in (0, 3), done.output
    return done


def fit_of(key: str, folder: Path, said: dict[str, Any]) -> Path:
    """A fit that found a rig as designed, with this verdict."""
    rig = make_rig(key)
    names = {"linear": "cart-pendulum", "furuta": "furuta", "rectilinear": "rectilinear-2"}
    entries = {n: {"value": v, "stderr": 0.0, "unit": "", "status": "known"} for n, v in rig.plant.parameters().items()}
    unit = "N m/V" if key == "furuta" else "N/V"
    entries["actuator.gain"] = {"value": rig.gain, "stderr": 0.01 * rig.gain, "unit": unit, "status": "well determined"}
    vendor = "ECP 205" if key == "furuta" else "ECP 210"
    content = {
        "format": 1, "plant": names[key], "parameters": entries, "estimated": ["actuator.gain"],
        "correlation": [[1.0]], "rig": {"vendor": vendor}, **said,
    }  # fmt: skip
    folder.mkdir(exist_ok=True)
    path = folder / "fit.json"
    path.write_text(json.dumps(content), encoding="utf-8")
    return path


def first_line(text: str) -> str:
    return text.splitlines()[0]


@pytest.mark.parametrize("verb", EACH_VERB)
def test_a_fit_that_is_not_trusted_is_repeated_first_and_nothing_made_from_it_is_better(verb, tmp_path):
    key, options, page, simulated = VERBS[verb]
    fit = fit_of(key, tmp_path, UNTRUSTED)
    first = first_line(upright(verb, fit, *options, "-o", tmp_path).stdout)
    for words in (REFUSED, SAID):
        assert words in first
    assert ("SIMULATED" in first) == simulated
    html = (tmp_path / page).read_text(encoding="utf-8")
    assert html.index(SAID) < html.index('class="verdict')
    told = json.loads(upright(verb, fit, *options, "-o", tmp_path, "--json").stdout)
    assert list(told)[0] == "first_line"
    assert told["first_line"] == first
    assert told["basis"]["level"] == "not trusted"
    assert told["verdict"].startswith(REFUSED)


PROBABILITIES = {"chance", "interval", "quiet_chance", "chance_over_the_fit"}


def probabilities(told: Any) -> list[Any]:
    """Every probability that an answer holds, however deep."""
    if isinstance(told, dict):
        own = [value for key, value in told.items() if key in PROBABILITIES]
        return own + [p for value in told.values() for p in probabilities(value)]
    return [p for value in told for p in probabilities(value)] if isinstance(told, list) else []


@pytest.mark.parametrize("said", [UNTRUSTED, TRUSTED], ids=["not trusted", "trusted"])
@pytest.mark.parametrize("verb", ["design", pytest.param("regulate", marks=pytest.mark.slow)])
def test_no_probability_of_the_rig_is_given_by_a_model_that_is_not_trusted(verb, said, tmp_path):
    key, options, *_ = VERBS[verb]
    told = json.loads(upright(verb, fit_of(key, tmp_path, said), *options, "-o", tmp_path, "--json").stdout)
    found = probabilities(told)
    assert found
    assert all((p == "not supported") == (said is UNTRUSTED) for p in found)


@pytest.mark.parametrize("verb", EACH_VERB)
def test_a_trusted_fit_has_no_such_line_and_a_simulation_says_that_it_is_one(verb, tmp_path):
    key, options, page, simulated = VERBS[verb]
    fit = fit_of(key, tmp_path, TRUSTED)
    done = upright(verb, fit, *options, "-o", tmp_path)
    assert ("SIMULATED: no rig was driven." in first_line(done.stdout)) == simulated
    html = (tmp_path / page).read_text(encoding="utf-8")
    html = re.sub(r'srcdoc="[^"]*"', "", html)  # the live twin, a page of its own, is always simulated and says so
    for text in (done.stdout, html):
        assert "Do not rely" not in text
        assert "not trusted" not in text
        assert ("SIMULATED" in text) == simulated


@pytest.mark.slow
def test_what_is_made_from_a_design_begins_with_the_verdict_of_its_fit(tmp_path):
    """Fit, design, program and run: the sentence goes all the way."""
    fit = fit_of("furuta", tmp_path, UNTRUSTED)
    upright("design", fit, *CLOSED, "-o", tmp_path)
    for form, file in (("c", "law.h"), ("python", "law.py"), ("matlab", "law_step.m"), ("arduino", "law/law.h")):
        done = upright("export", tmp_path / "design.json", "--to", form, "-o", tmp_path / form)
        assert first_line(done.stdout).startswith(REFUSED)
        assert SAID in first_line(done.stdout)
        head = (tmp_path / form / file).read_text(encoding="utf-8")[:600]
        assert REFUSED in head
        assert SAID in head
    for name, known in (("by the law", 'make = "furuta"'), ("by both", 'fit = "fit.json"')):
        (tmp_path / "RIG.toml").write_text(f'kind = "twin"\n{known}\n', encoding="utf-8")
        done = upright(
            "run", "--rig", tmp_path / "RIG.toml", "--law", tmp_path / "design.json", "--duration", 0.2, "--no-check",
            "-o", tmp_path / "run",
        )  # fmt: skip
        first = first_line(done.stdout)
        assert first.startswith("SIMULATED"), name
        assert REFUSED in first, name
        assert first.count(SAID) == 1, name
        assert f"Verdict: {REFUSED}" in done.stdout, name
        assert done.exit_code == 0, "it ran, whatever its model is worth"


@pytest.mark.parametrize("form", ["gymnasium", "mjcf", "fmu"])
def test_an_exported_rig_says_first_that_its_fit_is_not_trusted(form, tmp_path):
    from zipfile import ZipFile

    fit = fit_of("furuta", tmp_path, UNTRUSTED)
    done = upright(
        "export", fit, "--to", form, "-o", tmp_path / "out", *(("--limit", 5) if form == "gymnasium" else ())
    )
    assert SAID in first_line(done.stdout)
    if form == "fmu":
        text = ZipFile(tmp_path / "out" / "rig.fmu").read("modelDescription.xml").decode()
    else:
        text = next((tmp_path / "out").iterdir()).read_text(encoding="utf-8")
    assert REFUSED in text
    assert SAID in text


@pytest.mark.slow
@pytest.mark.parametrize("said", [{}, {"verdict": "All is well."}, {"trusted": True}])
def test_an_old_fit_without_a_verdict_counts_as_not_trusted(said, tmp_path):
    done = upright("design", fit_of("furuta", tmp_path, said), *CLOSED, "-o", tmp_path)
    assert first_line(done.stdout) == f"{REFUSED} This fit does not say whether it can be trusted."
    assert f"Verdict: {REFUSED}" in done.stdout


@pytest.mark.slow
def test_an_old_design_that_says_nothing_of_its_fit_counts_as_not_trusted(tmp_path):
    upright("design", fit_of("furuta", tmp_path, TRUSTED), *CLOSED, "-o", tmp_path)
    content = json.loads((tmp_path / "design.json").read_text(encoding="utf-8"))
    del content["basis"]
    (tmp_path / "design.json").write_text(json.dumps(content), encoding="utf-8")
    done = upright("export", tmp_path, "--to", "c", "-o", tmp_path / "c")
    assert first_line(done.stdout) == f"{REFUSED} This design does not say whether it can be trusted."


def test_what_is_only_described_is_neither_refused_nor_trusted(tmp_path):
    (tmp_path / "rig.toml").write_text(STUDY, encoding="utf-8")
    done = upright("design", tmp_path / "rig.toml", *CLOSED, "-o", tmp_path)
    assert first_line(done.stdout) == "Parameters as described, not identified."
    assert json.loads((tmp_path / "design.json").read_text())["basis"]["level"] == "with reservations"
    assert REFUSED not in done.stdout


def test_a_fit_with_reservations_hands_them_on(tmp_path):
    reserved = {**NO, "answer": "not tested", "headline": "Every run was fitted.", "reasons": []}
    done = upright("design", fit_of("furuta", tmp_path, {**TRUSTED, "answers": [reserved]}), *CLOSED, "-o", tmp_path)
    assert first_line(done.stdout) == ("The fit has reservations: Does it predict? Not tested. Every run was fitted.")


def test_python_shows_the_line_before_the_title(tmp_path):
    import upright as up

    answer = up.design(fit_of("furuta", tmp_path, UNTRUSTED), poles=POLES, limit=5)
    assert SAID in first_line(repr(answer))
    assert not answer.chapter.sound
    assert answer.verdict.startswith(REFUSED)
    assert SAID in answer._repr_html_()


@pytest.mark.slow
def test_added_masses_on_a_twin_begin_with_simulated(tmp_path):
    done = upright("loadings", "--rig", "rectilinear", "--seed", 4, "-o", tmp_path)
    assert first_line(done.stdout) == "SIMULATED: no rig was driven."
    assert first_line(done.stdout) in (tmp_path / "report.html").read_text(encoding="utf-8")
    told = json.loads(upright("loadings", "--rig", "rectilinear", "--seed", 4, "--json").stdout)
    assert told["first_line"] == first_line(done.stdout)


@pytest.mark.slow
def test_a_chance_is_simulated_and_no_better_than_its_fit(tmp_path):
    import upright as up

    told = up.chance(fit_of("linear", tmp_path, UNTRUSTED), np.zeros(4), draws=2, seconds=0.5, vendor="ECP 210")
    first = first_line(repr(told))
    for words in ("SIMULATED", REFUSED, SAID):
        assert words in first
    assert not told.chapter.sound
    assert "%" not in told.chapter.verdict
    assert told.numbers["chance"] == told.numbers["interval"] == "not supported"
    with pytest.raises(BadInput, match="no probability of stabilisation is supported"):
        _ = told.value.chance
    assert told.value.share == 0.0  # no gain holds the simulated pendulum
