"""Can every kind of page be read on a phone and a desk, in the dark, on paper, without a script, and by a machine?"""

from __future__ import annotations

from dataclasses import replace

import pytest

from tests.live.browser import WIDTHS, opened, until
from tests.report.test_pages import QUICK, SLOW
from upright.report.html import write_html
from upright.report.page import PAPER, Book

pytestmark = pytest.mark.slow

CLIPPED = """[...document.querySelectorAll('main *, header *')].filter((e) => {
  if (e.closest('svg, .moving, details:not([open]) > div, thead') || !e.checkVisibility()) return false;
  const s = getComputedStyle(e), box = e.getBoundingClientRect();
  const hidden = s.overflowX !== 'visible' && e.scrollWidth > e.clientWidth + 1 && !e.classList.contains('formula');
  return hidden || (box.width > 0 && box.right > innerWidth + 0.5 && !e.closest('.formula'));
}).map((e) => e.outerHTML.slice(0, 120))"""
SMALL = """[...document.querySelectorAll('main *')].filter((e) =>
  !e.closest('svg, math, sub, sup, .moving') && e.checkVisibility()
  && [...e.childNodes].some((n) => n.nodeType === 3 && n.data.trim())
  && parseFloat(getComputedStyle(e).fontSize) < 12.9).map((e) => e.outerHTML.slice(0, 120))"""

SHEET = 680
"""Width [px] of a sheet of A4 less its margins of 15 mm, 180 mm at 96 px per inch."""
MARRED = """[...document.querySelectorAll('main *')].filter((e) => !e.closest('svg') && e.checkVisibility() && (
  e.getBoundingClientRect().right > innerWidth + 0.5
  || (e.matches('section') && [...e.children].filter((c) => c.checkVisibility()).length < 2)
  || (!e.closest('math, sub, sup') && parseFloat(getComputedStyle(e).fontSize) < 10.6)
)).map((e) => e.outerHTML.slice(0, 120))"""
"""What runs over a sheet, a heading of nothing, letters below 8 pt."""


@pytest.fixture(scope="module", params=[*QUICK, *SLOW, "book"])
def written(request, tmp_path_factory):
    folder = tmp_path_factory.mktemp("pages")
    if request.param == "book":
        chapters = tuple(replace(QUICK[name](folder), key=name) for name in ("fit", "law"))
        page = Book(title="The laboratory", facts=(("Rig", "none"),), chapters=chapters, sources=(PAPER,))
    else:
        page = (QUICK | SLOW)[request.param](folder)
    return write_html(folder / "page.html", page), page


def test_nothing_is_clipped_or_fetched_and_axe_finds_nothing(written):
    axe = pytest.importorskip("axe_playwright_python.sync_playwright")
    with opened(written[0]) as (page, wrong):
        page.evaluate("for (const d of document.querySelectorAll('details')) d.open = true")
        for width in WIDTHS:
            page.set_viewport_size({"width": width, "height": 800})
            # a plot takes its new width at the frame after the page took its own
            until(page, f"innerWidth === {width} && document.documentElement.scrollWidth <= {width}")
            assert (width, page.evaluate(CLIPPED)) == (width, [])
            assert (width, page.evaluate(SMALL)) == (width, [])
            for scheme in ("light", "dark") if width != 768 else ():
                page.emulate_media(color_scheme=scheme)
                violations = axe.Axe().run(page).response["violations"]
                assert [(width, scheme, v["id"], [n["html"][:100] for n in v["nodes"]]) for v in violations] == []
        assert wrong == []


def test_without_a_script_headline_picture_and_numbers_are_there(written):
    path, told = written
    with opened(path, width=360, script=False) as (page, _):
        assert page.locator("h1").is_visible()
        chapter = told.chapters[0] if isinstance(told, Book) else told
        shown = page.locator("figure svg:visible").count()  # a chart is drawn for a desk and for a phone
        assert bool(shown) == any((chapter.picture, chapter.drawing))
        for number in chapter.findings[:1]:
            assert page.get_by_text(number.value).first.is_visible()


def test_paper_opens_what_a_screen_folds_and_a_verdict_takes_at_most_120_words(written):
    with opened(written[0]) as (page, _):
        folded = page.locator("details:not([open])").count()
        page.evaluate("dispatchEvent(new Event('beforeprint'))")
        assert page.locator("details:not([open])").count() == 0
        page.evaluate("dispatchEvent(new Event('afterprint'))")
        assert page.locator("details:not([open])").count() == folded
        for verdict in page.locator(".words").all():
            words = verdict.evaluate(
                "(e) => { const c = e.cloneNode(true); for (const x of c.querySelectorAll('pre, .do')) x.remove();"
                " return c.textContent.split(/\\s+/).filter(Boolean).length }"
            )
            assert words <= 120


def test_on_paper_nothing_runs_over_the_sheet_stands_bare_or_is_below_8_pt(written):
    with opened(written[0], width=SHEET) as (page, _):
        page.emulate_media(media="print")
        page.evaluate("dispatchEvent(new Event('beforeprint'))")
        assert page.evaluate(MARRED) == []
