"""Pages as HTML: one file, figures as SVG, formulas as MathML, style and script inside, nothing fetched."""

from __future__ import annotations

import base64
import hashlib
import math
import re
from collections.abc import Iterator, Sequence
from functools import cache
from html import unescape
from itertools import count
from pathlib import Path
from typing import TYPE_CHECKING, Any

from upright.files import replace_file
from upright.report.page import Block, Book, Chapter, KeyNumber, Live, Part, Picture, Table

if TYPE_CHECKING:
    from jinja2 import Environment
    from markupsafe import Markup

_FRAGMENTS = count(1)  # ids differ between the cells of a notebook
_ID = re.compile(r'\b(id="|url\(#|href="#)')
_SCRIPT = re.compile(r"<script>(.*?)</script>", re.S)
_SENTENCE = re.compile(r"(?<=[.!?:]) (?=[A-ZΑ-Ω0-9])")
WORDS_OF_A_VERDICT = 120
"""A chapter shows no more of them before something is opened."""

_MARKS = {
    "ok": "well determined|kept|supported|yes|inside|healthy|stabilised|finished",
    "no": "no|not supported|refused|failed|outside|unseen|lost",
    "none": "not tested|not run|not asked|given|assumed|known|left out|nuisance|–",
}
_BREADTHS = (("narrow", 62), ("medium", 84), ("broad", 112))  # letters of 15 px in 550, 740 and 990 px
SCALES = (1, 5, 20, 50, 100)
"""Half a scale of intervals in percent of the estimate."""


def html_page(page: Chapter | Book) -> str:
    """A chapter, or a whole report, as a page that can be mailed, printed and read in ten years; texts are escaped."""
    from upright._version import __version__

    chapters = page.chapters if isinstance(page, Book) else (page,)
    scripts = list(dict.fromkeys(s for c in chapters for b in _blocks(c) if (s := getattr(b, "script", ""))))
    text = _rendered("page.html", page=page, version=__version__, scripts=scripts, phone=True)
    return text.replace("<!-- policy -->", _policy(text, chapters), 1)


def _blocks(chapter: Chapter) -> Iterator[Block]:
    return (b for p in chapter.parts for b in p.content)


def _policy(text: str, chapters: Sequence[Chapter]) -> str:
    """Content-security policy: nothing but what stands in this page, and in the pages that it frames."""
    own = {f"'sha256-{base64.b64encode(hashlib.sha256(s.encode()).digest()).decode()}'" for s in _SCRIPT.findall(text)}
    framed = {
        word
        for c in chapters
        for b in _blocks(c)
        if isinstance(b, Live)
        for sources in re.findall(r"script-src ([^;\"]*)", unescape(b.markup))
        for word in sources.split()
    }
    allowed = " ".join(sorted(own | framed)) or "'none'"
    workers = " worker-src blob:;" if framed else ""
    return (
        '<meta http-equiv="Content-Security-Policy" content="'
        f"default-src 'none'; style-src 'unsafe-inline'; img-src data:; script-src {allowed};{workers}\">"
    )


def fragment(page: Chapter) -> str:
    """A chapter as part of somebody else's page, a notebook's: headline, tables, and one picture; prose is left out."""
    pictures = [b for p in page.parts if not p.aside for b in p.content if isinstance(b, Picture)]
    best = page.picture if page.picture in pictures else next(iter(pictures), None)
    return _rendered(
        "fragment.html", page=page, shown=("Table", "Points", "Facts", "Code"), picture=best,
        prefix=f"u{next(_FRAGMENTS)}-",
    )  # fmt: skip


def picture_in_notebook(picture: Picture) -> str:
    """One picture as part of somebody else's page, a notebook's, with what makes it answer."""
    return _rendered("picture.html", picture=picture, prefix=f"u{next(_FRAGMENTS)}-", scripts=[picture.script])


def rendered(package: str, template: str, **values: Any) -> str:
    """A template of a package with its values, texts escaped but for `markupsafe.Markup`."""
    return _templates_of(package).get_template(template).render(**values)


@cache
def _templates_of(package: str) -> Environment:
    from jinja2 import Environment, PackageLoader, StrictUndefined

    return Environment(
        loader=PackageLoader(package, "templates"), autoescape=True, undefined=StrictUndefined,
        trim_blocks=True, lstrip_blocks=True,
    )  # fmt: skip


def _rendered(template: str, *, phone: bool = False, **values: Any) -> str:
    from markupsafe import Markup

    def drawing(picture: Picture, prefix: str) -> Markup:
        """Mark-up of a picture, for a `phone` too, with ids that no other chapter of the page has."""
        return Markup(_ID.sub(rf"\g<1>{prefix}", picture.svg + (picture.narrow if phone else "")))

    return rendered(
        "upright.report", template, **values, phone=phone, drawing=drawing, kind=lambda block: type(block).__name__,
        framed=framed, tone=tone, breadth=breadth, brief=brief, scale=shared_scale, evidence=evidence,
    )  # fmt: skip


def framed(page: str) -> Markup:
    """A page as it stands in the attribute of a frame; only what would end the attribute or begin a tag is escaped."""
    from markupsafe import Markup

    return Markup(page.replace("&", "&amp;").replace('"', "&#34;").replace("<", "&lt;"))


def tone(state: str) -> str:
    """Class of a badge by its word: ``ok``, ``care``, ``no`` or ``none``."""
    word = state.split(" (")[0].split(",")[0]
    return next((name for name, words in _MARKS.items() if word in words.split("|")), "care")


def breadth(table: Table) -> str:
    """How wide a screen it needs to stand as a table: ``narrow``, ``medium``, ``broad``; ``vast`` never does."""
    columns = zip(table.headings, *table.rows, strict=True)
    held = [max(max(map(len, cell.split() or [""])) for cell in c) if i not in table.numbers else max(map(len, c))
            for i, c in enumerate(columns)]  # fmt: skip
    letters = sum(h + 2 for h in held)
    return next((name for name, most in _BREADTHS if letters <= most), "vast")


def split_sentences(text: str) -> list[str]:
    """A text sentence by sentence."""
    return _SENTENCE.split(text) if text else []


def brief(chapter: Chapter) -> tuple[str, str, str, str]:
    """Headline, the rest of the verdict, what of its detail is shown at once, and what is folded."""
    headline, *rest = split_sentences(chapter.verdict) or [chapter.title]
    words = len(f"{chapter.title} {chapter.question} {chapter.verdict} {chapter.first_line}".split())
    words += sum(len(f"{a.question} {a.state} {a.why}".split()) for a in chapter.assessments)
    shown: list[str] = []
    assessed = " ".join(a.why for a in chapter.assessments)
    more = [s for s in split_sentences(chapter.detail) if s not in assessed]
    while more and (words := words + len(more[0].split())) <= WORDS_OF_A_VERDICT:
        shown.append(more.pop(0))
    return headline, " ".join(rest), " ".join(shown), " ".join(more)


def shared_scale(numbers: Sequence[KeyNumber]) -> int:
    """Half a scale [%] that the intervals of several numbers share, so that widths compare; a fifth may leave it."""
    halves = sorted(100 * n.half for n in numbers if n.half is not None and math.isfinite(n.half))
    most = halves[-1 - len(halves) // 5] if halves else 0.0
    return next((s for s in SCALES if s >= most), SCALES[-1])


def evidence(chapter: Chapter) -> tuple[list[tuple[int, Part]], list[tuple[int, Part]]]:
    """Parts, with their numbers, that are shown, and those that a screen folds; without what the first screen shows."""
    best = chapter.picture
    shown: list[tuple[int, Part]] = []
    folded: list[tuple[int, Part]] = []
    for i, part in enumerate(chapter.parts, start=1):
        if part.content and all(b is best for b in part.content):
            continue
        hidden = part.folded or (part.aside and not any(isinstance(b, Live) for b in part.content))
        (folded if hidden else shown).append((i, part))
    return shown, folded


def write_html(path: Path, page: Chapter | Book) -> Path:
    """Write a page; one that exists is replaced at once or not at all."""
    return replace_file(path, html_page(page).encode("utf-8", errors="replace"))
