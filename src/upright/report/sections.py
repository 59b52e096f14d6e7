"""A page of sections, each with sentences, tables and pictures; written whole or not at all."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from markupsafe import Markup

from upright.report.advice import Step
from upright.report.document import Picture, render


@dataclass(frozen=True, kw_only=True)
class Table:
    """Cells as text (or MathML), row by row; `numbers` are the columns set flush right."""

    caption: str
    headings: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]
    numbers: tuple[int, ...] = ()


@dataclass(frozen=True, kw_only=True)
class Part:
    """One heading of the page and what stands below it; `formulas` are MathML."""

    title: str
    sentences: tuple[str, ...] = ()
    formulas: tuple[Markup, ...] = ()
    tables: tuple[Table, ...] = ()
    pictures: tuple[Picture, ...] = ()


def write_sections(
    path: Path, *, title: str, verdict: str, detail: str, sound: bool, question: str, parts: Sequence[Part],
    steps: Sequence[Step] = (),
) -> Path:  # fmt: skip
    """Write the page; one that exists is replaced at once or not at all."""
    text = render(
        "design.html", title=title, verdict=verdict, detail=detail, sound=sound, question=question, sections=parts,
        steps=steps,
    )  # fmt: skip
    path.parent.mkdir(parents=True, exist_ok=True)
    half = path.with_name(f".{path.name}.part")
    half.write_text(text, encoding="utf-8", errors="replace")
    half.replace(path)
    return path
