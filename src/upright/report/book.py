"""Many chapters as one report, to be read, printed, mailed and graded."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

from upright.report.page import Chapter, Facts, Part, Step, Table

READING = (
    "A verdict is sound when what it says may be built on; with reservations, when its chapter says what stands in the "
    "way. Intervals are meant to hold the truth in 95 of 100 rigs. Data go one way: later experiments take what "
    "earlier ones found, with its errors. No fit sees the twin's truth, which stands beside the result to judge it."
)
"""How the cover is meant."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Book:
    """The whole report.

    Attributes
    ----------
    title : str
    facts : tuple of (str, str)
        For the cover: what was run, on which rig, when, by which program.
    chapters : tuple of Chapter
    notes : tuple of str
        What a reader must know first, such as an interruption.
    missing : tuple of (str, str)
        Key and title of experiments that were not begun.
    steps : tuple of Step
        What to do next with the whole.
    """

    title: str
    facts: tuple[tuple[str, str], ...]
    chapters: tuple[Chapter, ...]
    notes: tuple[str, ...] = ()
    missing: tuple[tuple[str, str], ...] = ()
    steps: tuple[Step, ...] = ()

    @cached_property
    def cover(self) -> tuple[Part, ...]:
        """What stands before the chapters: facts, verdicts at a glance, numbers found."""
        glance = [(c.key, c.title, c.about, c.verdict, c.state) for c in self.chapters]
        glance += [(key, title, "", "", "not run") for key, title in self.missing]
        found = [(c, f) for c in self.chapters for f in c.findings]
        verdicts = Table(
            caption="One line for each experiment; every verdict is argued in its chapter",
            headings=("", "experiment", "rig", "verdict", "it is"), rows=tuple(glance), badge=4,
            anchors=tuple(c.anchor for c in self.chapters),
        )  # fmt: skip
        numbers = Table(
            caption="Key numbers with 95 % intervals, beside the truth that only a twin can tell",
            headings=("from", "quantity", "value", "95 % interval", "truth"),
            rows=tuple((c.key, f.what, f.value, f.interval, f.truth) for c, f in found), numbers=(2, 3, 4),
            anchors=tuple(c.anchor for c, _ in found),
        )  # fmt: skip
        return (
            Part("", (Facts(self.facts),)),
            Part(title="Verdicts at a glance", key="verdicts", content=(verdicts, READING)),
            *((Part(title="What was found", key="numbers", content=(numbers,)),) if found else ()),
        )
