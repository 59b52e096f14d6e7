"""How does the report get onto paper without a browser? As a PDF, with the `pdf` extra (typst)."""

from __future__ import annotations

import json
import re
from importlib.util import find_spec
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

from markupsafe import Markup

from upright.report.book import READING, Book, Told
from upright.report.document import Picture
from upright.report.sections import Part, Table

_ROOT = '<svg xmlns="http://www.w3.org/2000/svg" xmlns:xlink="http://www.w3.org/1999/xlink"'
_SHARE = re.compile(r'\sstyle="max-width:(\d+)%"')


def available() -> bool:
    """Whether the `pdf` extra is installed."""
    return find_spec("typst") is not None


def write_pdf(path: Path, book: Book) -> Path | None:
    """Write the report as PDF, or nothing where the `pdf` extra is not installed."""
    if not available():
        return None
    import matplotlib
    import typst

    files: dict[str, bytes] = {}
    content = _book(book, files)
    files["book.json"] = json.dumps(content, ensure_ascii=False).encode()
    files["main.typ"] = (Path(__file__).parent / "templates" / "book.typ").read_bytes()
    fonts = Path(matplotlib.get_data_path()) / "fonts" / "ttf"
    to_pdf: Any = typst.compile  # its stub knows no files by name
    made: bytes = to_pdf(files, font_paths=[str(fonts)], ignore_system_fonts=True)
    path.parent.mkdir(parents=True, exist_ok=True)
    half = path.with_name(f".{path.name}.part")
    half.write_bytes(made)
    half.replace(path)
    return path


def _book(book: Book, files: dict[str, bytes]) -> dict[str, Any]:
    """What the template reads; pictures are added to `files`."""
    glance = [[t.chapter.key, t.chapter.title, t.rig, t.chapter.verdict, t.state] for t in book.chapters]
    glance += [[key, title, "", "", "not run"] for key, title in book.missing]
    return {
        "title": book.title,
        "foot": next((fact for name, fact in book.facts if name == "Made"), ""),
        "reading": READING,
        "notes": list(book.notes),
        "facts": [list(fact) for fact in book.facts],
        "glance": {
            "caption": "One line for each experiment; every verdict is argued in its chapter",
            "headings": ["", "experiment", "rig", "verdict", "it is"],
            "rows": glance,
            "numbers": [],
        },
        "findings": {
            "caption": "Key numbers with 95 % intervals, beside the truth that only a twin can tell",
            "headings": ["from", "quantity", "value", "95 % interval", "truth"],
            "rows": [[said(cell) for cell in row] for row in book.findings],
            "numbers": [2, 3, 4],
        },
        "steps": [{"sentence": s.sentence, "command": s.command} for s in book.steps],
        "chapters": [_chapter(told, files) for told in book.chapters],
    }


def _chapter(told: Told, files: dict[str, bytes]) -> dict[str, Any]:
    c = told.chapter
    return {
        "key": c.key,
        "title": c.title,
        "rig": told.rig,
        "question": c.question,
        "verdict": c.verdict,
        "detail": c.detail,
        "sound": c.sound,
        "parts": [_part(p, files) for p in c.parts],
        "steps": [{"sentence": s.sentence, "command": s.command} for s in c.steps],
    }


def _part(part: Part, files: dict[str, bytes]) -> dict[str, Any]:
    return {
        "title": part.title,
        "sentences": [said(s) for s in part.sentences],
        "formulas": [_tree(ElementTree.fromstring(_known(str(f)))) for f in part.formulas],
        "tables": [_table(t) for t in part.tables],
        "pictures": [_picture(p, files) for p in part.pictures],
    }


def _table(t: Table) -> dict[str, Any]:
    return {
        "caption": t.caption,
        "headings": [said(h) for h in t.headings],
        "rows": [[said(cell) for cell in row] for row in t.rows],
        "numbers": list(t.numbers),
    }


def _picture(p: Picture, files: dict[str, bytes]) -> dict[str, Any]:
    name, text = f"figure-{len(files)}.svg", str(p.markup)
    share = _SHARE.search(text)
    files[name] = _SHARE.sub("", text).replace("<svg", _ROOT, 1).encode()
    return {
        "file": name,
        "caption": str(p.caption),
        "description": p.description,
        "share": int(share[1]) if share else 100,
    }


def said(text: str) -> Any:
    """A text as it stands; of markup the words, and its formulas as trees."""
    if not isinstance(text, Markup):
        return str(text)
    root = ElementTree.fromstring(f"<span>{_known(str(text))}</span>")
    return list(_pieces(root))


def _pieces(node: ElementTree.Element) -> list[Any]:
    pieces: list[Any] = [node.text or ""]
    for child in node:
        pieces += [_tree(child)] if child.tag == "math" else _pieces(child)
        pieces.append(child.tail or "")
    return [p for p in pieces if p != ""]


def _tree(node: ElementTree.Element) -> dict[str, Any]:
    return {"tag": node.tag, "text": (node.text or "").strip(), "kids": [_tree(child) for child in node]}


def _known(markup: str) -> str:
    """Markup whose named entities are characters, as XML wants them."""
    from html import unescape

    def character(m: re.Match[str]) -> str:
        return m[0] if m[1] in ("lt", "gt", "amp", "quot", "apos") else unescape(m[0])

    return re.sub(r"&(\w+);", character, markup)
