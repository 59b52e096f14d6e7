"""Are the numbers on a page those of the result, in HTML, on a terminal and on paper?"""

from __future__ import annotations

import csv
import re
import unicodedata
from dataclasses import replace
from io import StringIO
from pathlib import Path

import numpy as np
import pytest
from rich.console import Console
from scipy.stats import ttest_rel

from tests.report.conftest import make_fit
from tests.report.pages import (
    ANSWER,
    EXAMPLES,
    OMEGA,
    blocks,
    design_page,
    doctor_page,
    fit_page,
    law_page,
    measured_response_page,
    short_ladder_page,
    squeezed,
    survey_page,
)
from tests.report.reader import Page
from upright.physics import Furuta
from upright.report.html import html_page
from upright.report.page import Chapter, Picture, Table
from upright.report.pdf import write_pdf
from upright.report.terminal import print_chapter


def value(cell: str) -> float:
    """A number as it is printed, read by hand: ``−6.30·10⁻³``, ``95.0 %``."""
    written = unicodedata.normalize("NFKC", cell.replace("·10", "e")).replace("\u2212", "-").removesuffix("%")
    return float(written.replace("∞", "inf"))


def without_pictures(chapter: Chapter) -> Chapter:
    """What is said and tabled; drawing takes longest, and `test_pages` looks at it."""
    parts = (replace(p, content=tuple(b for b in p.content if not isinstance(b, Picture))) for p in chapter.parts)
    return replace(chapter, parts=tuple(parts))


def read(chapter: Chapter, caption: str, folder: Path) -> dict[str, dict[str, str]]:
    """Rows of a table by the first cell, each cell by its heading, as the page has them; paper and terminal agree."""
    pypdf = pytest.importorskip("pypdf")
    chapter = without_pictures(chapter)
    (heading, *rows), *others = [
        cells
        for cells, table in zip(Page(html_page(chapter)).tables, blocks(chapter, Table), strict=True)
        if caption in table.caption
    ]
    assert others == []
    lines = StringIO()
    print_chapter(Console(file=lines, width=300, highlight=False), chapter)
    terminal = [squeezed(line) for line in lines.getvalue().splitlines()]
    pages = pypdf.PdfReader(write_pdf(folder / "page.pdf", chapter)).pages
    paper = squeezed("".join(p.extract_text() for p in pages))
    for row in rows:
        numbers = squeezed("".join(text for _, text in row[1:4]))
        assert numbers in paper
        assert any(numbers in line for line in terminal)
    return {row[0][1]: {h: text for (_, h), (_, text) in zip(heading, row, strict=True)} for row in rows}


def test_the_numbers_of_a_fit_stand_on_its_page_with_their_units(tmp_path):
    fit = make_fit()
    rows = read(fit_page(tmp_path), "Parameters of the rig", tmp_path)
    for name, e in fit.estimates.items():
        row = rows[name.replace("_", "")]
        assert value(row["value"]) == pytest.approx(e.value, rel=5e-4)
        assert value(row["std. error"]) == pytest.approx(e.stderr, rel=5e-2)
        ends = [value(end) for end in row["95 % interval"].split(" to ")]
        assert ends == pytest.approx(e.interval, rel=1e-3, abs=0.0)
        assert row["unit"] == e.unit.replace("^2", "²")
        assert row["status"].startswith(e.status)


def test_the_gains_on_the_page_are_those_of_the_program_that_closed_the_loop(tmp_path):
    rows = read(law_page(tmp_path), "PID", tmp_path)
    for name, true in {"kp": 4.0, "ki": 3.0, "kd": 0.2, "second tap": 0.8}.items():
        assert value(rows[name]["at least"]) <= true <= value(rows[name]["at most"])
        assert value(rows[name]["value"]) == pytest.approx(true, rel=1e-3)


def test_the_scores_of_a_ladder_are_means_of_its_runs(tmp_path):
    rows = read(short_ladder_page(tmp_path), "Mean fit percent", tmp_path)
    assert value(rows["viscous"]["fitted"]) == pytest.approx((96 + 97) / 2, abs=0.06)
    assert value(rows["dry"]["predicted"]) == pytest.approx((-3 + 1) / 2, abs=0.06)
    assert (rows["viscous"]["decision"], rows["dry"]["decision"]) == ("kept", "refused")


def test_a_response_stands_in_decibels_and_degrees(tmp_path):
    told = measured_response_page(tmp_path)
    read(told, "Response", tmp_path)
    (_, *rows), *_ = Page(html_page(without_pictures(told))).tables
    for (_, omega, magnitude, phase, error, _), w, h in zip(rows, OMEGA, ANSWER, strict=True):
        assert value(omega[1]) == w
        assert value(magnitude[1]) == pytest.approx(20 * np.log10(abs(h)), abs=6e-3)
        assert value(phase[1]) == pytest.approx(np.degrees(np.arctan2(h.imag, h.real)), abs=0.06)
        assert value(error[1]) == pytest.approx(100 * np.sqrt(1e-8 / 2) / abs(h), rel=0.05)


def test_a_survey_stands_as_scipy_has_it(tmp_path):
    name = "synthetic_wide.csv"
    rows = read(survey_page(name)(tmp_path), "Ratings of 24 people", tmp_path)
    with (EXAMPLES / "survey" / name).open(encoding="utf-8-sig") as file:
        answers = [(a["modeling pre"], a["modeling post"]) for a in csv.DictReader(file, delimiter=";")]
    pairs = np.array([pair for pair in answers if all(pair)], dtype=float)
    test = ttest_rel(pairs[:, 1], pairs[:, 0])
    row = rows["modeling"]
    assert value(row["n"]) == len(pairs)
    assert value(row["gain"]) == pytest.approx(np.mean(pairs[:, 1] - pairs[:, 0]), abs=6e-4)
    assert value(row["t"]) == pytest.approx(test.statistic, rel=5e-3)


def test_the_doctor_tells_the_size_of_a_jump_in_the_unit_of_the_log(tmp_path):
    told = Page(html_page(without_pictures(doctor_page(tmp_path)))).prose
    (size, unit), *_ = re.findall(r"jump ([\d.]+) (\w+)", told)
    assert float(size) == pytest.approx(0.15, rel=0.01)
    assert unit == "rad"


def test_the_gains_on_a_page_place_the_poles_that_were_asked(tmp_path):
    asked = np.array([-16.9, -4.15 - 1.63j, -4.15 + 1.63j, -3.2])
    rows = read(design_page(poles=asked)(tmp_path), "Gains of u", tmp_path)
    K = np.array([value(row["K, continuous (used)"]) for row in rows.values()])
    assert [row["unit"] for row in rows.values()] == ["V/rad", "V s/rad"] * 2
    model = Furuta(m_p=0.135, l_cg=0.19, r=0.16, J_d=0.011, J_p=6e-4, b_1=6e-4).linear("inverted")
    attained = np.linalg.eigvals(model.A - 0.5 * np.outer(model.B, K))
    assert np.abs(np.sort_complex(attained) - asked).max() < 0.02  # five figures of the gains
