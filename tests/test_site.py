"""Does the site build without a warning, and can a person read and search it on a phone, from a file, offline?"""

from __future__ import annotations

import re

import pytest

from tests.live.browser import opened, until

pytestmark = pytest.mark.slow
KINDS = (
    "index",
    "tutorials/first_log",
    "tutorials/experiment_4",
    "howto/coming_from",
    "reference/study",
    "reference/commands/identify",
    "reference/api/place",
    "explanation/intervals",
    "gallery/furuta",
    "benchmarks/rigs",
)
"""A page of each kind."""


@pytest.fixture(scope="module")
def built(tmp_path_factory):
    pytest.importorskip("sphinx")
    from docs import site

    folder = tmp_path_factory.mktemp("site") / "html"
    assert site.build(folder, quick=True) == 0, "Sphinx warns; its sentences are above"
    return folder


def test_no_page_refers_to_another_machine_for_what_it_shows(built):
    """Links that a reader follows may; scripts, styles, pictures and frames may not."""
    pages = list(built.rglob("*.html"))
    assert len(pages) > 120
    for page in pages:
        text = page.read_text(encoding="utf-8")
        fetched = re.findall(
            r"<(?:script|img|iframe|source)[^>]*src=\"([^\"]+)\"|<link rel=\"stylesheet\"[^>]*href=\"([^\"]+)\"", text
        )
        assert not [url for pair in fetched for url in pair if url.startswith(("http", "//"))], page


@pytest.mark.parametrize(("width", "dark"), [(360, False), (1280, True)])
@pytest.mark.parametrize("name", KINDS)
def test_a_page_fits_its_screen_and_axe_finds_nothing(built, name, width, dark):
    axe = pytest.importorskip("axe_playwright_python.sync_playwright")
    with opened(built / f"{name}.html", width=width, dark=dark) as (page, wrong):
        until(page, f"document.documentElement.scrollWidth <= {width}")
        assert wrong == []
        found = axe.Axe().run(page).response["violations"]
        assert [(v["id"], [n["html"][:160] for n in v["nodes"]][:4]) for v in found] == []


def test_search_works_from_a_file(built):
    with opened(built / "search.html") as (page, wrong):
        page.goto((built / "search.html").as_uri() + "?q=identifiability")
        # found pages are listed one after the other
        listed = "[...document.querySelectorAll('#search-results li a')].map(a => a.textContent)"
        until(page, f"{listed}.some(title => title.includes('cannot see'))")
        # excerpts beside the titles are fetched from files, which a browser refuses; no other machine is asked
        assert not [address for address in wrong if address.startswith("http")], wrong
