"""Does the chapter of a stand's fit put the estimates of its rig on the cover, beside what a twin truly is?"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

from tests.report.conftest import make_fit
from upright.experiments.stand import fits
from upright.experiments.stand.fits import fit_chapter, fit_study


def test_what_was_estimated_of_the_rig_is_on_the_cover_with_its_unit_and_its_truth():
    """Neither what was known nor what belongs to a run; a number that no twin tells has no truth beside it."""
    fit = make_fit()
    known = replace(fit.estimates["J_d"], status="known")
    beside = replace(fit.estimates["J_p"], unit="")
    fit = replace(fit, estimates={**fit.estimates, "J_d": known, "scale.theta": beside})
    study = SimpleNamespace(title="Swings", provenance={"source": "logs of a rig"}, path=Path("study.toml"))
    page = fit_chapter(study, fit, Path("out"), {"J_p": 1.2e-3})
    shown = {str(k.what).split(" ")[0]: k for k in page.findings}
    assert set(shown) == {"J_p", "b_1", "b_2", "b_1c", "b_2c"}
    assert str(shown["J_p"].what).endswith("]")
    assert shown["J_p"].truth.startswith("1.2")
    assert shown["b_1"].truth == ""
    told = page.numbers
    assert (told["trusted"], told["verdict"]) == (True, fit.verdict)
    assert told["parameters"]["J_p"]["value"] == fit.estimates["J_p"].value
    assert (told["parameters"]["J_p"]["unit"], told["parameters"]["J_d"]["status"]) == ("kg m^2", "known")
    assert page.title == "Swings"


def test_a_fit_lies_beside_its_study(tmp_path, monkeypatch):
    study = SimpleNamespace(model="model", runs="runs")
    written = []
    monkeypatch.setattr(fits, "load_study", lambda path: study)
    monkeypatch.setattr(fits, "identify", lambda model, runs, *, progress: (model, runs))
    monkeypatch.setattr(fits, "write_fit", lambda fit, of, path: written.append((fit, of, path)))
    assert fit_study(tmp_path / "study.toml", print) == (study, ("model", "runs"))
    assert written == [(("model", "runs"), study, tmp_path / "fit.json")]
