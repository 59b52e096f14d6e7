"""Can the page be read, by a person, a parser and a screen reader, whatever the fit says?"""

import math
import re
from dataclasses import replace

import numpy as np
import pytest

from tests.report.reader import Page
from upright.identification.model.fit import Estimate
from upright.report.fit.chapter import chapter
from upright.report.html import write_html


@pytest.fixture
def written(tmp_path):
    def write(fit, **more):
        path = write_html(tmp_path / "out" / "report.html", chapter(fit, folder="out", **more))
        text = path.read_text(encoding="utf-8")
        return text, Page(text)

    return write


def test_the_page_says_what_a_reader_asks_first(fit, written):
    _, page = written(
        fit, title="Free swing", provenance={"study": "swing.toml", "runs": {"release": {"sha256": "c0ffee"}}}
    )
    for answer in fit.answers:
        assert page.prose.index(answer.headline) < page.prose.index("Question")
    for name in fit.estimates:
        assert name in page.prose
        assert fit.model.parameters[name].meaning in page.prose
    for needed in (
        "kg m²",
        "N m s/rad",
        "release",
        "c0ffee",
        "fitted",
        "predicted",
        "93.5 %",
        "well determined",
        "poorly determined",
        "∞",
    ):
        assert needed in page.prose
    for sentence in (*fit.unseen, *fit.warnings):
        assert sentence in page.prose
    assert "upright predict out/fit.json" in page.prose


@pytest.mark.slow
def test_the_page_needs_nothing_from_anywhere(fit, written):
    text, page = written(fit)
    links = [v for _, k, v in page.attributes if k in ("src", "href", "xlink:href", "data", "action")]
    assert all(v.startswith(("#", "data:image/")) for v in links)
    assert not re.search(r"@import|url\((?!#)", text)
    assert not {"link", "iframe", "object"} & set(page.tags)


@pytest.mark.slow
def test_the_page_can_be_read_aloud(fit, written):
    _, page = written(fit)
    assert ("html", "lang", "en") in page.attributes
    assert page.tags.count("figure") == page.tags.count("figcaption") > 4
    described = [v for tag, k, v in page.attributes if k == "aria-label" and tag == "div"]
    assert len(described) == page.tags.count("figure")
    assert all(described)
    assert page.tags.count("table") == page.tags.count("caption")
    assert ("th", "scope", "row") in page.attributes
    assert page.tags.count("h1") == 1


@pytest.mark.slow
def test_ids_are_unique_although_many_figures_share_the_page(fit, written):
    text, page = written(fit)
    assert len(page.ids) == len(set(page.ids))
    assert set(re.findall(r"url\(#([^)]+)\)", text)) | {
        v[1:] for _, k, v in page.attributes if k.endswith("href")
    } <= set(page.ids)


@pytest.mark.slow
def test_the_same_fit_writes_the_same_bytes(fit, written):
    assert written(fit)[0] == written(fit)[0]


@pytest.mark.slow
def test_names_from_a_log_cannot_become_markup(changed, written, swing):
    evil = '</text><script>alert("x")</script> $\\frac{1}{$ <b>'

    def named(name):
        fit = changed(runs={name: swing()}, verdict=name, warnings=(name,), unseen=(name,), per_run={name: {}})
        return written(fit, title=name, provenance={name: name})

    (text, page), (_, harmless) = named(evil), named("run")
    assert text.count("<script") == text.count("</script>") == page.tags.count("script")
    assert page.tags.count("script") == harmless.tags.count("script") > 2
    assert page.prose.count("<script>alert(") >= 5


@pytest.mark.parametrize("label", ["Ωμέγα 振り子", "décroissance à vide", "🚀", "\u202egnorw", "a" * 300, ""])
@pytest.mark.slow
def test_labels_in_any_script_are_kept(changed, written, label, swing):
    _, page = written(changed(runs={label: swing(n=50)}))
    assert " ".join(label.split()) in page.prose


def test_intervals_without_end_and_numbers_that_are_none_are_written(changed, written):
    odd = {
        "J_d": Estimate(value=0.0, stderr=math.inf, interval=(-math.inf, math.inf), unit="kg m^2", status="unseen"),
        "J_p": Estimate(value=-1e300, stderr=math.nan, interval=(math.nan, math.nan), unit="1", status="at bound"),
        "actuator.gain": Estimate(
            value=1e-300, stderr=0.0, interval=(0.0, 0.0), unit="N m/V", status="well determined"
        ),
    }
    _, page = written(changed(estimates=odd, names=("J_d", "J_p"), correlation=np.full((2, 2), np.nan)))
    assert "−∞ to ∞" in page.prose
    assert "stopped at its bound" in page.prose


def test_a_fit_of_nothing_is_a_page_too(changed, written):
    empty = changed(runs={}, estimates={}, per_run={}, names=(), history=(), unseen=(), warnings=(),
                    correlation=np.zeros((0, 0)), singular_values=np.zeros(0), directions=np.zeros((0, 0)))  # fmt: skip
    _, page = written(empty)
    assert "No run was scored" in page.prose


@pytest.mark.slow
def test_without_a_predicted_run_the_page_asks_for_one(changed, written, swing):
    _, page = written(changed(runs={"release": swing()}))
    assert 'role = "predict"' in page.prose


@pytest.mark.slow
def test_a_model_that_ran_away_is_drawn_all_the_same(changed, written, swing):
    wild = swing(n=300)
    model = wild.simulated.copy()
    model[150:] = np.nan
    model[140:150] = 1e30
    _, page = written(
        changed(runs={"wild": replace(wild, simulated=model, fit_percent={"psi": -1e28, "theta": -math.inf})})
    )
    assert "worse than by its mean" in page.prose


@pytest.mark.slow
def test_a_doubtful_fit_says_so_before_its_verdict(changed, written):
    _, page = written(changed(trusted=False, interrupted=True))
    assert "Do not rely on this model yet" in page.prose
    assert "interrupted" in page.prose


@pytest.mark.slow
def test_long_logs_stay_a_small_page(changed, written, swing):
    runs = {f"run {i}": swing(n=60_000, seed=i) for i in range(6)}
    text, _ = written(changed(runs=runs))
    assert len(text) < 2_000_000
