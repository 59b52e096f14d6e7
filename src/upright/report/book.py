"""How do the chapters of all experiments become one report, to be read, printed, mailed and graded?"""

from __future__ import annotations

import re
from dataclasses import dataclass, replace
from pathlib import Path

from markupsafe import Markup

from upright.report.advice import Step
from upright.report.chapter import Chapter
from upright.report.document import Picture, render
from upright.report.mathml import symbol

_SYMBOL = re.compile(r"([A-Za-z]+_[A-Za-z0-9]+)\b(.*)", re.DOTALL)
_ID = re.compile(r'\b(id="|url\(#|href="#)')


READING = (
    "A verdict is sound when what it says may be built on; with reservations, when its chapter says what stands in the "
    "way. Intervals are meant to hold the truth in 95 of 100 rigs. Data go one way: later experiments take what "
    "earlier ones found, with its errors. No fit sees the twin's truth, which stands beside the result to judge it."
)
"""How the cover is meant."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Told:
    """A chapter with the rig it is about; `finished` is false where the experiment was stopped or failed."""

    chapter: Chapter
    rig: str
    finished: bool = True

    @property
    def name(self) -> str:
        """Anchor of the chapter on the page."""
        return f"experiment-{self.chapter.key}"

    @property
    def state(self) -> str:
        """How far the verdict carries, in a word or two."""
        if not self.finished:
            return "not finished"
        return "sound" if self.chapter.sound else "with reservations"


@dataclass(frozen=True, kw_only=True, eq=False)
class Book:
    """The whole report.

    Attributes
    ----------
    title : str
    facts : tuple of (str, str)
        For the cover: what was run, on which rig, when, by which program.
    chapters : tuple of Told
    notes : tuple of str
        What a reader must know first, such as an interruption.
    missing : tuple of (str, str)
        Key and title of experiments that were not begun.
    steps : tuple of Step
        What to do next with the whole.
    """

    title: str
    facts: tuple[tuple[str, str], ...]
    chapters: tuple[Told, ...]
    notes: tuple[str, ...] = ()
    missing: tuple[tuple[str, str], ...] = ()
    steps: tuple[Step, ...] = ()

    @property
    def findings(self) -> tuple[tuple[str, str, str, str, str], ...]:
        """Experiment, quantity, value, interval and truth, for the table on the cover."""
        return tuple(
            (t.chapter.key, _named(f.what), f.value, f.interval, f.truth)
            for t in self.chapters
            for f in t.chapter.findings
        )


def _named(what: str) -> str:
    """A quantity with its symbol set: ``J_d [kg m²]``."""
    symbolic = _SYMBOL.fullmatch(what)
    return Markup(symbol(symbolic[1])) + symbolic[2] if symbolic else what


def write_book(path: Path, book: Book) -> Path:
    """Write the report as one self-contained page; one that exists is replaced at once or not at all."""
    text = render(
        "book.html", title=book.title, reading=READING, book=replace(book, chapters=tuple(map(_own, book.chapters)))
    )
    path.parent.mkdir(parents=True, exist_ok=True)
    half = path.with_name(f".{path.name}.part")
    half.write_text(text, encoding="utf-8", errors="replace")
    half.replace(path)
    return path


def _own(told: Told) -> Told:
    """The chapter with ids in its pictures that no other chapter has."""
    parts = tuple(replace(p, pictures=tuple(_prefixed(x, told.name) for x in p.pictures)) for p in told.chapter.parts)
    return replace(told, chapter=replace(told.chapter, parts=parts))


def _prefixed(shown: Picture, prefix: str) -> Picture:
    return replace(shown, markup=Markup(_ID.sub(rf"\g<1>{prefix}-", str(shown.markup))))
