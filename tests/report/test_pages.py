"""Does every kind of page say the same in HTML, on paper and on a terminal, and can all three be read?"""

from __future__ import annotations

import re
from dataclasses import replace
from io import StringIO
from pathlib import Path

import numpy as np
import pytest
from rich.console import Console

from tests.pictures import unreadable
from tests.report.pages import (
    blocks,
    compare_page,
    design_page,
    doctor_page,
    fit_page,
    free_swing_page,
    frequency_page,
    ladder_page,
    law_page,
    loadings_page,
    log_page,
    measured_response_page,
    minute_page,
    own_frequency_page,
    paper_page,
    regulation_page,
    run_page,
    short_ladder_page,
    squeezed,
    survey_page,
    swing_up_page,
    tracking_page,
)
from tests.report.reader import Page
from upright.report.html import html_page
from upright.report.page import Chapter, KeyNumber, Picture, Symbol, Table, as_plain, from_plain
from upright.report.pdf import write_pdf
from upright.report.terminal import print_book, print_chapter

QUICK = {
    "fit": fit_page,
    "log": log_page,
    "doctor": doctor_page,
    "law": law_page,
    "ladder": short_ladder_page,
    "measured response": measured_response_page,
    "run": run_page,
    "compare": compare_page,
    "survey of people": survey_page("synthetic_wide.csv"),
    "survey of means": survey_page("table_4.csv", 53),
    "survey of shares": survey_page("table_3.csv", 53),
    "design of least cost": design_page(weights=(1.0, 0.0, 1.0, 0.0)),
    "paper": paper_page,
}
SLOW = {
    "design by poles": design_page(poles=np.array([-4.15 + 1.63j, -4.15 - 1.63j, -16.9, -3.2])),
    "ladder climbed": ladder_page,
    "1a": loadings_page,
    "1b": frequency_page,
    "own response": own_frequency_page,
    "a minute": minute_page,
    "2": regulation_page,
    "2b": swing_up_page,
    "3": tracking_page,
    "4": free_swing_page,
}


@pytest.fixture(
    scope="module",
    params=[
        *(pytest.param(page, id=name) for name, page in QUICK.items()),
        *(pytest.param(page, id=name, marks=pytest.mark.slow) for name, page in SLOW.items()),
    ],
)
def chapter(request, tmp_path_factory) -> Chapter:
    return request.param(tmp_path_factory.mktemp("page"))


def cells(tables: list[Table]) -> list[str]:
    """What the columns of numbers hold."""
    return [row[i] for t in tables for row in t.rows for i in t.numbers if row[i]]


def no_computer_s_word_for_nothing(text: str) -> None:
    found = re.findall(r".{20}(?<![\w.])(?:nan|NaN|inf|None(?! is to be trusted))(?![\w.]).{20}", text)
    assert found == []


@pytest.mark.slow
def test_a_page_can_be_parsed_heard_and_told_apart(chapter):
    text = html_page(chapter)
    page = Page(text)
    assert page.tags.count("h1") == 1
    assert chapter.title in page.prose
    assert chapter.verdict in page.prose
    assert len(set(page.ids)) == len(page.ids)
    assert {v[1:] for _, k, v in page.attributes if k.endswith("href")} <= set(page.ids)
    assert set(re.findall(r"url\(#([^)]+)\)", text)) <= set(page.ids)
    assert "://" not in text
    assert not {"link", "iframe", "img"} & set(page.tags)
    assert not page.named("script", "src")
    no_computer_s_word_for_nothing(page.prose)


def test_every_table_has_headings_and_every_picture_words(chapter):
    page = Page(html_page(chapter))
    tables, pictures = blocks(chapter, Table), blocks(chapter, Picture)
    assert len(page.tables) == page.tags.count("caption") == len(tables)
    for head, *rows in page.tables:
        assert {kind for kind, text in head if text} == {"th col"}
        assert rows
        for row in rows:
            assert [kind for kind, _ in row] == ["th row" if row[0][1] else "td"] + ["td"] * (len(head) - 1)
    pictures += [chapter.drawing] if chapter.drawing else []
    assert page.tags.count("figure") == page.tags.count("figcaption") == len(pictures)
    charts = sum(p.kind == "chart" for p in pictures)  # drawn for a desk and for a phone
    assert page.tags.count("svg") == len(pictures) + charts + sum(bool(p.narrow) for p in pictures)
    described = page.named("div", "aria-label")
    assert len(described) == len(pictures)
    assert all(described)


@pytest.mark.slow
def test_nothing_written_in_a_picture_is_cut_off_or_lies_on_something_else(chapter):
    for picture in blocks(chapter, Picture):
        assert (picture.name, unreadable(picture.draw())) == (picture.name, [])


@pytest.mark.slow
def test_paper_holds_the_verdict_and_every_number(chapter, tmp_path):
    pypdf = pytest.importorskip("pypdf")
    pytest.importorskip("typst")
    pages = pypdf.PdfReader(write_pdf(tmp_path / "page.pdf", chapter)).pages
    text = "".join(p.extract_text() for p in pages)
    on_paper = squeezed(text)
    for needed in (chapter.title, chapter.verdict, *(s.sentence for s in chapter.steps)):
        assert squeezed(needed) in on_paper
    for number in cells(blocks(chapter, Table)):
        assert squeezed(number) in on_paper
    no_computer_s_word_for_nothing(" ".join(text.split()))


def test_the_terminal_says_the_same_numbers(chapter):
    lines = StringIO()
    print_chapter(Console(file=lines, width=300, highlight=False), chapter, [Path("out/numbers.json")])
    said, page = lines.getvalue(), squeezed(Page(html_page(chapter)).prose)
    for table in blocks(chapter, Table, aside=False):
        assert table.caption in said
        for row in table.rows:
            assert all(cell in said for cell in row)
            assert all(isinstance(cell, Symbol) or squeezed(cell) in page for cell in row)
    for needed in (chapter.verdict, "out/numbers.json", *chapter.warnings):
        assert needed in said
    for step in chapter.steps:
        assert step.sentence in said
        assert all(line in said for line in step.command.splitlines())
    no_computer_s_word_for_nothing(said)


def test_the_terminal_names_the_evidence_that_the_page_folds_away(chapter):
    lines = StringIO()
    print_chapter(Console(file=lines, width=300, highlight=False), chapter, [Path("out/report.html")])
    said = lines.getvalue()
    folded = [part for part in chapter.parts if part.folded and not part.aside]
    assert all(part.title in said for part in folded)
    assert ("Evidence in out/report.html" in said) == bool(folded)
    captions = {b.caption for part in folded for b in part.content if isinstance(b, Table)}
    assert not [caption for caption in captions if caption in said]


@pytest.mark.parametrize("width", [80, 60])
def test_a_narrow_terminal_loses_words_before_numbers(width):
    told = fit_page(Path())
    lines = StringIO()
    print_chapter(Console(file=lines, width=width, highlight=False), told)
    assert all(number in lines.getvalue() for number in cells(blocks(told, Table, aside=False)))


HOSTILE = "<script>alert(1)</script> & [/b] [red] *bold* #let x = 1 $y$ // no"


def hostile(content):
    """A page whose every text ends with what means something to a browser, a terminal or Typst."""
    if isinstance(content, list):
        return [hostile(c) for c in content]
    if isinstance(content, dict):
        kept = ("kind", "key", "name", "draw", "phone", "interactive", "markup", "anchors", "numbers")
        return {k: c if k in kept else hostile(c) for k, c in content.items()}
    return f"{content} {HOSTILE}" if isinstance(content, str) and content else content


@pytest.mark.parametrize("page", [short_ladder_page, measured_response_page])
def test_what_a_person_wrote_is_never_taken_for_markup(page, tmp_path):
    pypdf = pytest.importorskip("pypdf")
    told = from_plain(hostile(as_plain(page(tmp_path))))
    text = html_page(told)
    charts = sum(p.kind == "chart" for p in blocks(told, Picture))  # each its values, and one script for all
    assert text.count("<script") == 1 + charts + bool(charts)
    assert Page(text).prose.count(HOSTILE) > 10
    lines = StringIO()
    print_chapter(Console(file=lines, width=2000, highlight=False), told, [Path("[red]/report.html")])
    assert lines.getvalue().count(HOSTILE) > 5
    assert "[red]/report.html" in lines.getvalue()
    paper = "".join(p.extract_text() for p in pypdf.PdfReader(write_pdf(tmp_path / "page.pdf", told)).pages)
    assert squeezed(told.title) in squeezed(paper)


@pytest.mark.slow
def test_the_laboratory_tells_every_chapter_on_all_three(tmp_path):
    from upright.experiments.laboratory import EXPERIMENTS, ExperimentResult, Session, book, date

    there = tuple(EXPERIMENTS.own.values())
    pypdf = pytest.importorskip("pypdf")
    found = (KeyNumber(what="stiffness [N/m]", value="412.5", interval="409.1 to 415.9", truth="411.2"),)
    made = [replace(page(tmp_path), key=e.name, findings=found)
            for page, e in zip((short_ladder_page, measured_response_page), there, strict=False)]  # fmt: skip
    session = Session(make="", seed=7, folder=tmp_path, requested=there[:3], interrupted=True)
    session.results.extend(
        ExperimentResult(experiment=e, make="furuta", rig="Furuta pendulum", chapter=c, state="done", seconds=1.0)
        for e, c in zip(there, made, strict=False)
    )
    told = book(session, date(2006, 6, 18))
    page = Page(html_page(told))
    lines = StringIO()
    print_book(Console(file=lines, width=300, highlight=False), told, [tmp_path / "report.html"])
    paper = "".join(p.extract_text() for p in pypdf.PdfReader(write_pdf(tmp_path / "book.pdf", told)).pages)
    for said in (squeezed(page.prose), squeezed(lines.getvalue()), squeezed(paper)):
        for needed in ("412.5", "409.1 to 415.9", "411.2", there[2].title, "Stopped by Ctrl-C"):
            assert squeezed(needed) in said
        assert all(squeezed(c.verdict) in said for c in made)
    assert len(set(page.ids)) == len(page.ids)
    assert all(page.named("div", "aria-label"))
