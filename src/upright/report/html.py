"""Pages as HTML: one file, figures as SVG, formulas as MathML, style and script inside, nothing fetched."""

from __future__ import annotations

import base64
import hashlib
import re
from collections.abc import Iterator, Sequence
from html import unescape
from itertools import count
from pathlib import Path
from typing import Any

from upright.files import replace_file
from upright.report.page import Block, Book, Chapter, Live, Picture

_FRAGMENTS = count(1)  # ids differ between the cells of a notebook
_ID = re.compile(r'\b(id="|url\(#|href="#)')
_SCRIPT = re.compile(r"<script>(.*?)</script>", re.S)


def html_page(page: Chapter | Book) -> str:
    """A chapter, or a whole report, as a page that can be mailed, printed and read in ten years; texts are escaped."""
    from upright._version import __version__

    chapters = page.chapters if isinstance(page, Book) else (page,)
    scripts = list(dict.fromkeys(s for c in chapters for b in _blocks(c) if (s := getattr(b, "script", ""))))
    text = _rendered("page.html", page=page, version=__version__, scripts=scripts)
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
        for found in re.findall(r"script-src ([^;\"]*)", unescape(b.markup))
        for word in found.split()
    }
    allowed = " ".join(sorted(own | framed)) or "'none'"
    workers = " worker-src blob:;" if framed else ""
    return (
        '<meta http-equiv="Content-Security-Policy" content="'
        f"default-src 'none'; style-src 'unsafe-inline'; img-src data:; script-src {allowed};{workers}\">"
    )


def fragment(page: Chapter) -> str:
    """A chapter as part of somebody else's page, a notebook's: headline, tables, and one picture; prose is left out."""
    pictures = (b for p in page.parts if not p.aside for b in p.content if isinstance(b, Picture))
    return _rendered(
        "fragment.html", page=page, shown=("Table", "Points", "Facts", "Code"), picture=next(pictures, None),
        prefix=f"u{next(_FRAGMENTS)}-",
    )  # fmt: skip


def rendered(package: str, template: str, **values: Any) -> str:
    """A template of a package with its values, texts escaped but for `markupsafe.Markup`."""
    from jinja2 import Environment, PackageLoader, StrictUndefined

    templates = Environment(
        loader=PackageLoader(package, "templates"), autoescape=True, undefined=StrictUndefined,
        trim_blocks=True, lstrip_blocks=True,
    )  # fmt: skip
    return templates.get_template(template).render(**values)


def _rendered(template: str, **values: Any) -> str:
    from markupsafe import Markup

    def drawing(picture: Picture, prefix: str) -> Markup:
        """Mark-up of a picture, with ids that no other chapter of the page has."""
        return Markup(_ID.sub(rf"\g<1>{prefix}", picture.svg))

    return rendered("upright.report", template, **values, drawing=drawing, kind=lambda block: type(block).__name__)


def write_html(path: Path, page: Chapter | Book) -> Path:
    """Write a page; one that exists is replaced at once or not at all."""
    return replace_file(path, html_page(page).encode("utf-8", errors="replace"))
