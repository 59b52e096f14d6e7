"""Pages as HTML: one file, figures as SVG, formulas as MathML, style inside, nothing fetched from anywhere."""

from __future__ import annotations

import re
from itertools import count
from pathlib import Path
from typing import Any

from upright.files import replace_file
from upright.report.page import Book, Chapter, Live, Picture

_FRAGMENTS = count(1)  # ids differ between the cells of a notebook
_ID = re.compile(r'\b(id="|url\(#|href="#)')


def html_page(page: Chapter | Book) -> str:
    """A chapter, or a whole report, as a page that can be mailed, printed and read in ten years; texts are escaped."""
    from markupsafe import Markup

    from upright._version import __version__
    from upright.report.interactive.script import policy, script, style

    chapters = page.chapters if isinstance(page, Book) else (page,)
    blocks = [b for c in chapters for p in c.parts for b in p.content]
    answering = any(isinstance(b, Picture) and b.answers for b in blocks)
    scripts = [script()] if answering else []
    return _rendered(
        "page.html", page=page, version=__version__, script=Markup("".join(scripts)),
        script_style=Markup(style()) if answering else "",
        policy=policy(scripts, frames=[b.markup for b in blocks if isinstance(b, Live)]),
    )  # fmt: skip


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
