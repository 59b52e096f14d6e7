"""Do the chapters of several experiments make one report, on a screen and on paper?"""

import json
import re
from dataclasses import replace
from html import unescape
from html.parser import HTMLParser
from io import StringIO

import pytest
from rich.console import Console

from upright.errors import BadInput
from upright.report import pdf
from upright.report.drawing import figure
from upright.report.html import write_html
from upright.report.page import (
    Book,
    Chapter,
    Code,
    Facts,
    Formula,
    KeyNumber,
    Part,
    Picture,
    Points,
    Step,
    Symbol,
    Table,
    as_plain,
    from_plain,
)
from upright.report.terminal import print_book

HOSTILE = '<script>alert(1)</script> & "quotes" *bold* #let x = 1 $y$ \\ `raw` @ref ~ [b] // no'


def drawn(name):
    def draw():
        drawing = figure(2.0, 3.7)
        axes = drawing.subplots()
        axes.plot([0, 1, 2], [0, 1, 4], label="curve")
        axes.set_title("torque [N m]")
        axes.legend()
        return drawing

    return Picture(name=name, draw=draw, caption="A curve.", description="It rises.")


def chapter(key, about, *, sound=True):
    table = Table(
        caption=f"Table of {HOSTILE}",
        headings=("symbol", "value"),
        rows=((Symbol("J_d"), "7.2·10⁻³"), (HOSTILE, "1")),
        numbers=(1,),
    )
    motion = Formula(
        markup='<math display="block"><mtable><mtr><mtd><mi>θ</mi></mtd><mtd><mo>=</mo></mtd>'
        "<mtd><mfrac><mn>1</mn><msqrt><mi>k</mi></msqrt></mfrac></mtd></mtr></mtable></math>"
    )
    return Chapter(
        key=key, about=about, title=f"Chapter {key}", question=f"Why {key}?", verdict=f"Verdict of {key} stands.",
        detail=HOSTILE, sound=sound, warnings=(HOSTILE,),
        parts=(
            Part("Data", (HOSTILE, table, drawn("same"))),
            Part("Fit", (motion, Points((HOSTILE,)), Facts(((HOSTILE, HOSTILE),)), Code(HOSTILE))),
            Part("Rest", (drawn("other"),), aside=True),
        ),
        steps=(Step("Do it again.", 'upright lab -o "a b"'),),
        findings=(KeyNumber(what="pole [rad/s]", value="7.98", interval="7.9 to 8.1", truth="7.97"),),
        numbers={"pole": 7.98, "kind": "a word", "list": [1, 2]},
    )  # fmt: skip


@pytest.fixture(scope="module")
def book():
    return Book(
        title="Report",
        facts=(("Rig", HOSTILE), ("Made", "2006-06-18")),
        chapters=(
            chapter("1a", "cart"),
            chapter("4", "disk", sound=False),
        ),
        first_line="SIMULATED: no rig was driven.",
        notes=("Stopped by Ctrl-C.",),
        missing=(("3", "Tracking"),),
        steps=(Step("Next.", "upright lab --seed 1"),),
    )


class Page(HTMLParser):
    """Ids, links, references and what stands in the text."""

    def __init__(self, text):
        super().__init__()
        self.ids, self.links, self.tags, self.said = [], [], [], []
        self.feed(text)

    def handle_starttag(self, tag, attrs):
        self.tags.append(tag)
        values = dict(attrs)
        self.ids += [values["id"]] if "id" in values else []
        self.links += [v for k, v in attrs if k in ("href", "xlink:href") and v.startswith("#")]

    def handle_data(self, data):
        self.said.append(data)


@pytest.fixture(scope="module")
def page(book, tmp_path_factory):
    return write_html(tmp_path_factory.mktemp("book") / "report.html", book).read_text(encoding="utf-8")


def test_every_id_is_the_only_one_and_every_link_leads_somewhere(page):
    read = Page(page)
    assert len(set(read.ids)) == len(read.ids)
    assert {link[1:] for link in read.links} <= set(read.ids)
    assert set(re.findall(r"url\(#([^)]+)\)", page)) <= set(read.ids)
    assert len(read.links) > 10


def test_nothing_a_person_wrote_becomes_markup_and_nothing_is_fetched(page):
    read = Page(page)
    assert read.tags.count("script") == 1  # the page's own
    assert "".join(read.said).count(HOSTILE) >= 19  # cover, and nine in each chapter
    assert "://" not in unescape(page)


def test_the_cover_says_what_was_run_what_it_showed_and_what_is_missing(page):
    cover = " ".join(" ".join(Page(page[: page.index('class="chapter"')]).said).split())
    for needed in ("Verdict of 1a stands.", "with reservations", "3 Tracking", "not run", "7.9 to 8.1", "Stopped by"):
        assert needed in cover


def test_that_no_rig_was_driven_stands_before_every_verdict(book, page, tmp_path):
    pypdf = pytest.importorskip("pypdf")
    pytest.importorskip("typst")
    screen = Console(file=StringIO(), width=100)
    print_book(screen, book)
    paper = pypdf.PdfReader(pdf.write_pdf(tmp_path / "report.pdf", book)).pages[0].extract_text()
    for text in (page[page.index("<main>") :], screen.file.getvalue(), paper):
        read = " ".join(text.split())
        assert read.index("SIMULATED") < read.index("1 of 2 experiments" if "1 of 2" in read else "Verdict of 1a")


def test_on_paper_it_says_the_same(book, tmp_path):
    pypdf = pytest.importorskip("pypdf")
    pytest.importorskip("typst")
    path = pdf.write_pdf(tmp_path / "report.pdf", book)
    pages = pypdf.PdfReader(path).pages
    assert len(pages) >= 3  # cover, and each chapter from a page of its own
    text = " ".join(" ".join(p.extract_text() for p in pages).split())
    for needed in ("Verdict of 1a stands.", "Verdict of 4 stands.", "not run", "7.9 to 8.1", "upright lab --seed 1"):
        assert needed in text
    assert "torque [N m]" in text  # words in pictures stay words
    assert text.replace(" ", "").count(HOSTILE.replace(" ", "")) >= 7  # lines may break inside the others


def test_a_heading_over_pictures_alone_goes_where_they_float(tmp_path):
    pypdf = pytest.importorskip("pypdf")
    drawn = Picture(name="p", draw='<svg viewBox="0 0 9 9"></svg>', caption="Its caption.", description="nothing")
    parts = (Part("Logged", (drawn,)), Part("Discussed", tuple(["A sentence."] * 40)), Part("Last", ("An end.",)))
    path = pdf.write_pdf(tmp_path / "c.pdf", Chapter(title="A title", verdict="A verdict.", parts=parts))
    text = "".join(p.extract_text() for p in pypdf.PdfReader(path).pages)
    assert "Its caption." in text.split("Logged")[1].split("Discussed")[0].split("Last")[0]


def test_without_the_extra_there_is_no_pdf_but_a_way_out(book, tmp_path, monkeypatch):
    monkeypatch.setattr(pdf, "find_spec", lambda name: None)
    assert not pdf.available()
    with pytest.raises(BadInput, match=r"pip install 'upright\[pdf\]'"):
        pdf.write_pdf(tmp_path / "report.pdf", book)
    assert not (tmp_path / "report.pdf").exists()


def test_a_chapter_is_read_as_it_was_kept(book):
    first = book.chapters[0]
    plain = json.loads(json.dumps(as_plain(first), allow_nan=False))
    again = from_plain(plain)
    assert as_plain(again) == plain
    assert again.numbers == first.numbers
    assert (again.parts[1], again.steps, again.findings) == (first.parts[1], first.steps, first.findings)
    cell = again.parts[0].content[1].rows[0][0]
    assert isinstance(cell, Symbol)
    assert cell == "J_d"
    assert not isinstance(again.parts[0].content[0], Symbol)


@pytest.mark.parametrize(
    ("sound", "headline"),
    [
        ((), "No experiment was run."),
        ((True, True), "All 2 experiments support their verdicts."),
        ((True, False, True), "2 of 3 experiments support their verdicts; read the caveats of e1."),
        ((False, False), "0 of 2 experiments support their verdicts; read the caveats of e0, e1."),
    ],
)
def test_the_headline_of_a_report_counts_what_its_verdicts_rest_on(sound, headline):
    chapters = tuple(replace(chapter(f"e{i}", "cart", sound=s), warnings=()) for i, s in enumerate(sound))
    assert Book(title="Report", facts=(), chapters=chapters).headline == headline


def test_the_first_screen_has_a_number_of_every_chapter_and_five_in_all():
    """Of each the first that has an interval; then others, chapter by chapter."""

    def of(key, *numbers):
        found = tuple(KeyNumber(what=what, value="1", interval="0 to 2" * known) for what, known in numbers)
        return replace(chapter(key, "cart"), findings=found)

    one = of("1", ("bare", False), ("a", True), ("b", True), ("c", True))
    two, three = of("2", ("d", True), ("e", True), ("f", True)), of("3", ("bare", False))
    shown = Book(title="Report", facts=(), chapters=(one, two, three)).numbers
    assert [number.what for number in shown] == ["a", "d", "b", "c", "e"]
