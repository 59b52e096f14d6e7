"""What does one experiment have to say? The same frame for all, so that they stand alone or under one roof."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from upright.report.advice import Step
from upright.report.sections import Part, write_sections


@dataclass(frozen=True, kw_only=True)
class Finding:
    """A number for the cover, as text: what it is, its value and, where there are such, interval and truth."""

    what: str
    value: str
    interval: str = ""
    truth: str = ""


@dataclass(frozen=True, kw_only=True, eq=False)
class Chapter:
    """One experiment, told.

    Attributes
    ----------
    key : str
        ``"1a"``, ``"1b"``, ``"2"``, ``"3"`` or ``"4"``.
    title, question : str
    verdict, detail : str
        What was learned, in a sentence; and how far it can be trusted.
    sound : bool
        Whether the verdict is one to build on.
    parts : tuple of Part
        In this order, as far as the experiment has them: data, fit, gains, closed loop.
    steps : tuple of Step
        What to do next.
    findings : tuple of Finding
        The few numbers that the cover of the whole report shows.
    numbers : mapping
        The same as plain values for another program: SI, finite.
    """

    key: str
    title: str
    question: str
    verdict: str
    detail: str
    sound: bool
    parts: tuple[Part, ...]
    steps: tuple[Step, ...] = ()
    findings: tuple[Finding, ...] = ()
    numbers: Mapping[str, Any] = field(default_factory=dict[str, Any])


def write_chapter(path: Path, chapter: Chapter) -> Path:
    """Write one experiment as a page of its own."""
    return write_sections(
        path,
        title=chapter.title,
        verdict=chapter.verdict,
        detail=chapter.detail,
        sound=chapter.sound,
        question=chapter.question,
        parts=chapter.parts,
        steps=chapter.steps,
    )
