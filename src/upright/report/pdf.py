"""Pages as PDF, without a browser; needs the `pdf` extra (typst)."""

from __future__ import annotations

import json
import re
from importlib.util import find_spec
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

from upright.errors import BadInput
from upright.files import replace_file
from upright.report.html import tone
from upright.report.page import Assessment, Book, Chapter, Formula, Picture, Symbol, as_plain
from upright.report.symbols import symbol

_ROOT = '<svg xmlns="http://www.w3.org/2000/svg" xmlns:xlink="http://www.w3.org/1999/xlink"'
_PROPERTY = re.compile(r"var\(--[\w-]+, ([^)]*)\)")
_FIRST = re.compile(r"<svg.*?</svg>", re.DOTALL)
_SHARE = re.compile(r'\sstyle="max-width:(\d+)%"')


def available() -> bool:
    """Whether the `pdf` extra is installed."""
    return find_spec("typst") is not None


def write_pdf(path: Path, page: Chapter | Book) -> Path:
    """Write a chapter, or a whole report, as PDF; one that exists is replaced at once or not at all.

    Raises
    ------
    BadInput
        When the `pdf` extra is not installed.
    """
    if not available():
        raise BadInput("a PDF needs the pdf extra: pip install 'upright[pdf]', or print the HTML page from a browser.")
    import matplotlib
    import typst

    from upright._version import __version__

    files: dict[str, bytes] = {}

    def instead(value: Any) -> Any:
        """Pictures as files beside the template, formulas as trees of MathML's elements, states with their tone."""
        if isinstance(value, Picture):
            name = f"figure-{len(files)}.svg"
            drawn, share = standalone(value.svg)
            files[name] = drawn.encode()
            plain = {"caption": value.caption, "description": value.description, "file": name}
            return {"kind": "Picture", **plain, "share": share}
        if isinstance(value, Formula):
            return {"kind": "Formula", "tree": _tree(ElementTree.fromstring(value.markup))}
        if isinstance(value, Symbol):
            name, rest = value.divided()
            return [_tree(ElementTree.fromstring(symbol(name))), rest]
        if isinstance(value, Assessment):
            return {**vars(value), "tone": tone(value.state)}
        return None

    content: dict[str, Any] = {"version": __version__, **as_plain(page, instead)}
    if isinstance(page, Book):
        content["cover"] = as_plain(page.cover, instead)
        content["headline"] = page.headline
        plain: list[dict[str, Any]] = content["chapters"]
        states = [{"state": c.state, "tone": tone(c.state)} for c in page.chapters]
        content["chapters"] = [p | s for p, s in zip(plain, states, strict=True)]
    files["page.json"] = json.dumps(content, ensure_ascii=False).encode()
    files["main.typ"] = (Path(__file__).parent / "templates" / "report.typ").read_bytes()
    fonts = Path(matplotlib.get_data_path()) / "fonts" / "ttf"
    to_pdf: Any = typst.compile  # its stub knows no files by name
    return replace_file(path, to_pdf(files, font_paths=[str(fonts)], ignore_system_fonts=True))


def standalone(markup: str) -> tuple[str, int]:
    """A picture's drawing, of a chart that for a desk, as a file of its own, and the share [%] of a column it takes."""
    first = _FIRST.search(markup)
    drawn = first[0] if first else markup
    share = _SHARE.search(drawn)
    return _PROPERTY.sub(r"\1", _SHARE.sub("", drawn)).replace("<svg", _ROOT, 1), int(share[1]) if share else 100


def _tree(node: ElementTree.Element) -> dict[str, Any]:
    return {"tag": node.tag, "text": (node.text or "").strip(), "kids": [_tree(child) for child in node]}
