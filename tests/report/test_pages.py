"""Does every kind of page say the same in HTML, on paper and on a terminal, and can all three be read?"""

from __future__ import annotations

import re
import unicodedata
from io import StringIO
from pathlib import Path

import numpy as np
import pytest
from rich.console import Console

from tests.closed_loop.programs import Pid, closed_loop
from tests.report.conftest import make_fit
from tests.report.reader import Page
from upright.records import Record
from upright.report.html import html
from upright.report.page import Chapter, Picture, Symbol, Table
from upright.report.pdf import write_pdf
from upright.report.terminal import print_chapter

EXAMPLES = Path(__file__).parents[2] / "examples"
T = np.arange(1500) * 4e-3
SWING = np.round(0.8 * np.exp(-0.3 * T) * np.cos(7 * T), 4)


def fit_page(folder: Path) -> Chapter:
    from upright.report.fit.chapter import chapter

    return chapter(make_fit(), title="Free swing", provenance={"study": "swing.toml", "runs": {"release": "a.csv"}})


def log_page(folder: Path) -> Chapter:
    from upright.readers import inspect
    from upright.report.log import chapter

    record = Record(t=T, signals={"theta": SWING}, units={"theta": "rad"}, outputs=("theta",))
    return chapter(record, inspect(record))


def doctor_page(folder: Path) -> Chapter:
    from upright.doctor import examine
    from upright.doctor.chapter import chapter

    lost = Record(
        t=T, signals={"theta": SWING + np.where(T > 2.2, 0.15, 0.0)}, units={"theta": "rad"}, outputs=("theta",)
    )
    return chapter(examine(lost), log=Path("swing.csv"))


def law_page(folder: Path) -> Chapter:
    from upright.closed_loop import recover
    from upright.report.law import chapter

    record = closed_loop(Pid(kp=4.0, ki=3.0, kd=0.2, second=0.8, on="measurement"), rows=2000, step=0.01)
    return chapter(record, recover(record, measured=["y"], references=["r"], command="u"), "run.csv")


def survey_page(name: str, answers: int | None = None):
    def page(folder: Path) -> Chapter:
        from upright.survey import read
        from upright.survey.chapter import chapter

        return chapter(read(EXAMPLES / "survey" / name), title="Survey", source=name, answers=answers)

    return page


def design_page(**wish):
    def page(folder: Path) -> Chapter:
        from upright.lab.designing.chapter import chapter
        from upright.lab.designing.run import Wish, design_for
        from upright.lab.rigs.rig_file import RigFile
        from upright.physics import Furuta

        plant = Furuta(m_p=0.135, l_cg=0.19, r=0.16, J_d=0.011, J_p=6e-4, b_1=6e-4)
        others = tuple((plant.replace(m_p=m), 0.5) for m in (0.134, 0.136))
        rig = RigFile(plant=plant, name="furuta", gain=0.5, unit="V", late=0.0, lag=0.0, others=others)
        return chapter(design_for(rig, Wish(at="inverted", limit=1.0, **wish)))

    return page


def paper_page(folder: Path) -> Chapter:
    from upright.lab.rigs.twin import NOMINAL
    from upright.paper.chapter import chapter
    from upright.paper.reproduce import reproduce

    return chapter(reproduce(NOMINAL, seed=1))


def ladder_page(folder: Path) -> Chapter:
    from tests.identification.twins import PENDULUM, noisy, rig, swing
    from upright.identification.ladder.grow import climb
    from upright.physics import Pendulum
    from upright.report.ladder import chapter, next_steps

    guesses = {"J_p": 1.5e-3, "b_2": 1e-3, "b_2c": 1e-3}
    truth = {"b_2q": 0.0, "b_2c": 4e-3}
    runs = [noisy(swing(PENDULUM | truth, angle=a, label=f"from {a:g}"), 3e-3, seed=k) for k, a in enumerate((1.5, 1))]
    known = {n: v for n, v in (PENDULUM | truth).items() if n not in guesses}
    ladder = climb(rig(Pendulum, known, guesses), runs)
    steps = next_steps(ladder, study="swing.toml", folder="out", data="", trimmed=True)
    return chapter(ladder, title="Ladder", provenance={"study": "swing.toml"}, steps=steps)


def loadings_page(folder: Path) -> Chapter:
    from upright.lab.rigs.makes import make_rig
    from upright.lab.weighing_1a.chapter import chapter
    from upright.lab.weighing_1a.run import run

    return chapter(run(make_rig("rectilinear", 2), 2, folder))


def frequency_page(folder: Path) -> Chapter:
    from upright.lab.frequency_1b.chapter import chapter
    from upright.lab.frequency_1b.run import run

    return chapter(run("linear", 4, folder))


def own_frequency_page(folder: Path) -> Chapter:
    from upright.lab.frequency_1b.chapter import log_chapter
    from upright.lab.frequency_1b.own_log import Wish, look
    from upright.lab.frequency_1b.run import run

    run("linear", 4, folder)
    return log_chapter(look([folder / "frequency.csv"], Wish(signals={}, counts={}, known={}), folder / "own"))


def regulation_page(folder: Path) -> Chapter:
    from upright.lab.regulation_2.chapter import chapter
    from upright.lab.regulation_2.run import Wish, identified, run
    from upright.lab.rigs.makes import make_rig

    wish = Wish(draws=16, seconds=2.0)
    return chapter(run(identified("linear", 1, folder), make_rig("linear", 1), 1, folder, wish=wish))


def swing_up_page(folder: Path) -> Chapter:
    from upright.lab.rigs.makes import make_rig
    from upright.lab.swing_up_2b.chapter import chapter
    from upright.lab.swing_up_2b.run import run

    return chapter(run(make_rig("furuta"), make_rig("furuta", 3), 3, folder))


def tracking_page(folder: Path) -> Chapter:
    from upright.lab.tracking_3.chapter import chapter
    from upright.lab.tracking_3.run import run

    return chapter(run("rectilinear", 1, folder))


def free_swing_page(folder: Path) -> Chapter:
    from upright.lab.free_swing_4.chapter import chapter
    from upright.lab.free_swing_4.run import run
    from upright.lab.rigs.makes import make_rig

    return chapter(run(make_rig("furuta", 1), 1, folder))


QUICK = {
    "fit": fit_page,
    "log": log_page,
    "doctor": doctor_page,
    "law": law_page,
    "survey of people": survey_page("synthetic_wide.csv"),
    "survey of means": survey_page("table_4.csv", 53),
    "survey of shares": survey_page("table_3.csv", 53),
    "design by poles": design_page(poles=np.array([-4.15 + 1.63j, -4.15 - 1.63j, -16.9, -3.2])),
    "design of least cost": design_page(weights=(1.0, 0.0, 1.0, 0.0)),
    "paper": paper_page,
}
SLOW = {
    "ladder": ladder_page,
    "1a": loadings_page,
    "1b": frequency_page,
    "own response": own_frequency_page,
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


def blocks(chapter: Chapter, kind: type, *, aside: bool = True) -> list:
    return [b for part in chapter.parts if aside or not part.aside for b in part.content if isinstance(b, kind)]


def cells(tables: list[Table]) -> list[str]:
    """What the columns of numbers hold."""
    return [row[i] for t in tables for row in t.rows for i in t.numbers if row[i]]


def squeezed(text: str) -> str:
    """Text without blanks, ligatures and raised figures, which every medium sets in its own way."""
    return re.sub(r"\s", "", unicodedata.normalize("NFKC", text))


def no_computer_s_word_for_nothing(text: str) -> None:
    found = re.findall(r".{20}(?<![\w.])(?:nan|NaN|inf|None(?! is to be trusted))(?![\w.]).{20}", text)
    assert found == []


def test_a_page_can_be_parsed_heard_and_told_apart(chapter):
    text = html(chapter)
    page = Page(text)
    assert page.tags.count("h1") == 1
    assert chapter.title in page.prose
    assert chapter.verdict in page.prose
    assert len(set(page.ids)) == len(page.ids)
    assert {v[1:] for _, k, v in page.attributes if k.endswith("href")} <= set(page.ids)
    assert set(re.findall(r"url\(#([^)]+)\)", text)) <= set(page.ids)
    assert "http" not in text
    assert not {"script", "link", "iframe", "img"} & set(page.tags)
    no_computer_s_word_for_nothing(page.prose)


def test_every_table_has_headings_and_every_picture_words(chapter):
    page = Page(html(chapter))
    tables, pictures = blocks(chapter, Table), blocks(chapter, Picture)
    assert len(page.tables) == page.tags.count("caption") == len(tables)
    for head, *rows in page.tables:
        assert {kind for kind, _ in head} == {"th col"}
        assert rows
        for row in rows:
            assert [kind for kind, _ in row] == ["th row"] + ["td"] * (len(head) - 1)
    assert page.tags.count("figure") == page.tags.count("figcaption") == page.tags.count("svg") == len(pictures)
    described = page.named("div", "aria-label")
    assert len(described) == len(pictures)
    assert all(described)


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
    print_chapter(Console(file=lines, width=300, highlight=False), chapter, [Path("out/report.html")])
    said, page = lines.getvalue(), squeezed(Page(html(chapter)).prose)
    for table in blocks(chapter, Table, aside=False):
        assert table.caption in said
        for row in table.rows:
            assert all(cell in said for cell in row)
            assert all(isinstance(cell, Symbol) or squeezed(cell) in page for cell in row)
    for needed in (chapter.verdict, "out/report.html", *chapter.warnings):
        assert needed in said
    for step in chapter.steps:
        assert step.sentence in said
        assert all(line in said for line in step.command.splitlines())
    no_computer_s_word_for_nothing(said)


@pytest.mark.parametrize("width", [80, 60])
def test_a_narrow_terminal_loses_words_before_numbers(width):
    told = fit_page(Path())
    lines = StringIO()
    print_chapter(Console(file=lines, width=width, highlight=False), told)
    assert all(number in lines.getvalue() for number in cells(blocks(told, Table, aside=False)))
