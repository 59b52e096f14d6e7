"""Pages as HTML: one file, figures as SVG, formulas as MathML, style inside, nothing fetched from anywhere."""

from __future__ import annotations

import re
from pathlib import Path

from upright.files import replace_file
from upright.report.page import Book, Chapter, Picture

_ID = re.compile(r'\b(id="|url\(#|href="#)')


def html(page: Chapter | Book) -> str:
    """A chapter, or a whole report, as a page that can be mailed, printed and read in ten years; texts are escaped."""
    from jinja2 import Environment, PackageLoader, StrictUndefined
    from markupsafe import Markup

    from upright import __version__

    def drawing(picture: Picture, prefix: str) -> Markup:
        """Mark-up of a picture, with ids that no other chapter of the page has."""
        return Markup(_ID.sub(rf"\g<1>{prefix}", picture.svg))

    templates = Environment(
        loader=PackageLoader("upright.report"), autoescape=True, undefined=StrictUndefined,
        trim_blocks=True, lstrip_blocks=True,
    )  # fmt: skip
    template = templates.get_template("page.html")
    return template.render(page=page, version=__version__, drawing=drawing, kind=lambda block: type(block).__name__)


def write_html(path: Path, page: Chapter | Book) -> Path:
    """Write a page; one that exists is replaced at once or not at all."""
    return replace_file(path, html(page).encode("utf-8", errors="replace"))
