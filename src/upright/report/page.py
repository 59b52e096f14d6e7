"""What a page says: chapters of parts, with sentences, tables and pictures; how it looks is decided elsewhere.

The same chapter becomes HTML (`report.html`), a PDF (`report.pdf`), lines on a terminal (`report.terminal`) and plain
values, which JSON can hold, to be read again. Many chapters make a book.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, fields, is_dataclass, replace
from functools import cached_property
from typing import Any

from upright.basis import SIMULATED, Basis
from upright.files import plain_values
from upright.report.symbols import slanted


class Symbol(str):
    """Text that begins with the name of a parameter or signal, set as on paper: ``J_d``, ``J_d [kg m²]``."""

    __slots__ = ()

    def divided(self) -> tuple[str, str]:
        """The name, and what follows it."""
        name, blank, rest = self.partition(" ")
        return name, blank + rest

    def __html__(self) -> str:
        """Mark-up of it, for templates."""
        from html import escape

        name, rest = self.divided()
        return slanted(name) + escape(rest)


@dataclass(frozen=True, kw_only=True)
class Formula:
    """Equations as MathML; left to screen and paper."""

    markup: str


@dataclass(frozen=True)
class Points:
    """Sentences one below the other, each with its mark."""

    sentences: tuple[str, ...]


@dataclass(frozen=True)
class Facts:
    """Names and what belongs to each."""

    pairs: tuple[tuple[str, str], ...]


@dataclass(frozen=True)
class Code:
    """Lines to be typed: a command, or lines of a study."""

    lines: str


@dataclass(frozen=True, kw_only=True)
class Table:
    """Cells as text, row by row.

    Attributes
    ----------
    numbers : tuple of int
        Columns set flush right.
    badge : int, optional
        Column of single words that say how something turned out, such as ``kept`` or ``well determined``.
    folded : str
        Line under which a screen hides the table until it is opened; not hidden when empty.
    anchors : tuple of str
        Where on the page the first cell of each row leads; nowhere when empty.
    """

    caption: str
    headings: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]
    numbers: tuple[int, ...] = ()
    badge: int | None = None
    folded: str = ""
    anchors: tuple[str, ...] = ()


LARGEST_NARROW = 40_000
"""Bytes of a drawing that is laid out for a phone too; a page is mailed, and a second layout is a second drawing."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Picture:
    """A drawing, the caption under it, and a description for readers who cannot see it.

    Attributes
    ----------
    name : str
        Unique in its chapter; ids inside the drawing begin with it.
    draw : callable or str
        Gives the matplotlib figure or the chart when somebody looks; or its markup.
    interactive : callable or str
        Gives what a page on a screen draws in its place, from `report.interactive`; nothing when empty.
    phone : str
        Markup of the drawing for a phone, beside a `draw` that is markup.
    """

    name: str
    draw: Callable[[], Any] | str
    caption: str
    description: str
    interactive: Callable[[], str] | str = ""
    phone: str = ""

    @cached_property
    def answers(self) -> str:
        """What a page's script takes to draw it."""
        return self.interactive if isinstance(self.interactive, str) else self.interactive()

    @property
    def script(self) -> str:
        """The script that draws it, which stands once in a page."""
        if not self.answers:
            return ""
        from upright.report.interactive.script import cursor_script, script

        return cursor_script() if self.kind == "chart" else script()

    @property
    def kind(self) -> str:
        """Who takes what it answers with: ``chart`` or ``traces``."""
        return "chart" if self.answers.startswith('{"chart"') else "traces"

    @cached_property
    def _drawn(self) -> Any:
        """The figure, which is dearer than its markup; `narrow` takes its own from it and lets it go."""
        return self.draw() if callable(self.draw) else None

    @cached_property
    def svg(self) -> str:
        """Markup of the drawing."""
        if isinstance(self.draw, str):
            return self.draw
        if self.kind == "chart":
            return self.draw().svg(self.name)
        from upright.report.drawing import svg

        return svg(self._drawn, self.name)

    @cached_property
    def narrow(self) -> str:
        """Markup of the drawing for a phone; "" where the drawing, or what answers, fits, or where it is large."""
        if isinstance(self.draw, str) or self.answers:
            return self.phone
        from upright.report.drawing import narrowed, svg

        wide, drawn = len(self.svg), self._drawn
        del self.__dict__["_drawn"]
        if wide > 2 * LARGEST_NARROW or not narrowed(drawn):
            return ""
        text = svg(drawn, f"{self.name}-narrow")
        return text if len(text) < LARGEST_NARROW else ""


@dataclass(frozen=True, kw_only=True, eq=False)
class Live:
    """A page of its own that moves, framed in a report on a screen; paper, terminals and stored pages leave it out.

    Attributes
    ----------
    markup : str
        The page.
    short : bool
        Whether half the height will do.
    """

    markup: str
    description: str
    short: bool = False


Block = str | Points | Facts | Code | Formula | Table | Picture | Live
"""What stands in a part, in its order; a plain text is a paragraph, which a terminal leaves to the page."""


@dataclass(frozen=True)
class Part:
    """One heading and what stands below it.

    Attributes
    ----------
    key : str
        Anchor on the page; its number when empty.
    aside : bool
        Whether a terminal leaves all of it to the page.
    folded : bool
        Whether a screen shows only its heading until it is opened: evidence.
    result : str
        What it comes to in a few words, beside the heading.
    """

    title: str
    content: tuple[Block, ...] = ()
    key: str = ""
    aside: bool = False
    folded: bool = False
    result: str = ""


@dataclass(frozen=True, kw_only=True)
class KeyNumber:
    """A number for the first screen, as text: what it is, its value and, where there are such, interval and truth.

    `meaning` says what a symbol stands for, `half` is half the interval relative to the value.
    """

    what: str
    value: str
    unit: str = ""
    interval: str = ""
    truth: str = ""
    meaning: str = ""
    half: float | None = None


@dataclass(frozen=True, kw_only=True)
class Assessment:
    """One question that a verdict answers: how it turned out in a word or two, and why."""

    question: str
    state: str
    why: str = ""


@dataclass(frozen=True)
class Step:
    """A sentence and, where there is one, the command or the lines of a study that do it."""

    sentence: str
    command: str = ""


PAPER = (
    "B. T. Burchett, Four Hardware Experiments for Advanced Dynamics and Control, ASEE Annual Conference 2006, "
    "paper 2006-1008."
)
"""Where the experiments are from, as a bibliography has it."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Chapter:
    """Report of one log, fit, design or experiment.

    Attributes
    ----------
    verdict, detail : str
        What was learned, in a sentence; and how far it can be trusted.
    sound : bool
        Whether the verdict is one to build on.
    steps : tuple of Step
        What to do next.
    findings : tuple of KeyNumber
        The few numbers that the cover of a whole report shows.
    numbers : mapping
        The same as plain values for another program: SI.
    key, about : str
        In a report of several: the chapter's name, and what it is about.
    finished : bool
        False where the work was stopped or failed.
    first_line : str
        What stands before everything else: that it was simulated, that its model is not to be trusted.
    assessments : tuple of Assessment
        The questions that the verdict answers.
    drawing : Picture, optional
        The rig with its coordinates and signs.
    best : str
        Name of the picture for the first screen; the first of all when empty.
    sources : tuple of str
        Literature, as a bibliography has it.
    """

    title: str
    verdict: str
    detail: str = ""
    sound: bool = True
    question: str = ""
    parts: tuple[Part, ...] = ()
    warnings: tuple[str, ...] = ()
    steps: tuple[Step, ...] = ()
    findings: tuple[KeyNumber, ...] = ()
    numbers: Mapping[str, Any] = field(default_factory=dict[str, Any])
    key: str = ""
    about: str = ""
    finished: bool = True
    first_line: str = ""
    assessments: tuple[Assessment, ...] = ()
    drawing: Picture | None = None
    best: str = ""
    sources: tuple[str, ...] = ()

    @property
    def picture(self) -> Block | None:
        """The picture for the first screen."""
        named = {b.name: b for p in self.parts for b in p.content if isinstance(b, Picture)}
        return named.get(self.best, next(iter(named.values()), None))

    @property
    def anchor(self) -> str:
        """Its place on the page of a whole report."""
        return f"experiment-{self.key}"

    @property
    def state(self) -> str:
        """How far the verdict carries, in a word or two."""
        return "not finished" if not self.finished else "supported" if self.sound else "with reservations"


def resting_on(chapter: Chapter, basis: Basis, performed: str = "") -> Chapter:
    """The chapter with the verdict of its model first, and its own verdict no better than that.

    Parameters
    ----------
    basis : Basis
        The model that its results rest on.
    performed : str
        `basis.SIMULATED` or `basis.REPLAYED` where no rig was driven.
    """
    verdict, first = basis.qualified(chapter.verdict), basis.first_line(performed)
    head = {"first_line": first, "basis": basis.plain()}
    numbers = {**head, **chapter.numbers, **head}
    if "verdict" in numbers:
        numbers["verdict"] = verdict
    return replace(chapter, first_line=first, verdict=verdict, sound=chapter.sound and basis.trusted, numbers=numbers)


def simulated(chapter: Chapter) -> Chapter:
    """The chapter of something that rests on no model but was measured on a twin, which it says first."""
    return replace(chapter, first_line=SIMULATED, numbers={"first_line": SIMULATED, **chapter.numbers})


READING = (
    "Supported: rely on it. With reservations: read the caveats in its chapter. Intervals should hold the true value "
    "on 95 of 100 rigs. Later experiments use the estimates of earlier ones, with their errors."
)
"""How the cover is meant."""
TWIN = "The true values are known of simulated rigs only; no fit uses them."
"""How the truth on it is meant, where there is one."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Book:
    """The whole report.

    Attributes
    ----------
    facts : tuple of (str, str)
        For the cover: what was run, on which rig, when, by which program.
    first_line : str
        What stands before everything else: that no rig was driven.
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
    first_line: str = ""
    notes: tuple[str, ...] = ()
    missing: tuple[tuple[str, str], ...] = ()
    steps: tuple[Step, ...] = ()
    sources: tuple[str, ...] = ()

    @property
    def headline(self) -> str:
        """How many verdicts can be relied on, and which cannot."""
        reserved = [c.key for c in self.chapters if c.state != "supported"]
        if not self.chapters:
            return "No experiment was run."
        if not reserved:
            return f"All {len(self.chapters)} experiments support their verdicts."
        of = f"{len(self.chapters) - len(reserved)} of {len(self.chapters)} experiments support their verdicts"
        return f"{of}; read the caveats of {', '.join(reserved)}."

    @property
    def drawings(self) -> tuple[Picture, ...]:
        """The rigs, each once."""
        return tuple({c.drawing.caption: c.drawing for c in self.chapters if c.drawing is not None}.values())

    @property
    def numbers(self) -> tuple[KeyNumber, ...]:
        """Five for the first screen: of every chapter the first with an interval, then others of these."""
        known = [[f for f in c.findings if f.interval] for c in self.chapters]
        return tuple([*(of[0] for of in known if of), *(f for of in known for f in of[1:])][:5])

    @cached_property
    def cover(self) -> tuple[Part, ...]:
        """What stands before the chapters: facts, verdicts at a glance, numbers found."""
        glance = [(c.key, c.title, c.about, c.verdict, c.state) for c in self.chapters]
        glance += [(key, title, "", "", "not run") for key, title in self.missing]
        findings = [(c, f) for c in self.chapters for f in c.findings]
        verdicts = Table(
            caption="One line for each experiment; every verdict is argued in its chapter",
            headings=("", "experiment", "rig", "verdict", "state"), rows=tuple(glance), badge=4,
            anchors=tuple(c.anchor for c in self.chapters),
        )  # fmt: skip
        twin = any(f.truth for _, f in findings)
        numbers = Table(
            caption="Key numbers with 95 % intervals" + (", beside the true values of the simulated rigs" * twin),
            folded=f"All {len(findings)} key numbers with their intervals",
            headings=("from", "quantity", "value", "95 % interval", "truth")[: 4 + twin],
            rows=tuple((c.key, f.what, f.value, f.interval, f.truth)[: 4 + twin] for c, f in findings),
            numbers=(2, 3, 4)[: 2 + twin], anchors=tuple(c.anchor for c, _ in findings),
        )  # fmt: skip
        return (
            Part("", (Facts(self.facts),)),
            Part(
                title="Verdicts at a glance",
                key="verdicts",
                content=(verdicts, f"{READING} {TWIN}" if twin else READING),
            ),
            *((Part(title="Key numbers", key="numbers", content=(numbers,)),) if findings else ()),
        )


_KINDS: dict[str, Callable[..., Any]] = {
    kind.__name__: kind for kind in (Assessment, Chapter, Code, Facts, KeyNumber, Formula, Part, Picture, Points, Step,
                                             Table)
}  # fmt: skip


def as_plain(value: Any, instead: Callable[[Any], Any] = lambda value: None) -> Any:
    """A chapter, or what stands in one, as values that JSON can hold; each says its kind.

    `instead` may offer something else for a value, and nothing (None) for most.
    """
    if (other := instead(value)) is not None:
        return other
    if isinstance(value, Symbol):
        return {"kind": "Symbol", "text": str(value)}
    if isinstance(value, Picture):
        value = replace(value, draw=value.svg, interactive=value.answers, phone=value.narrow)
    if isinstance(value, Mapping):
        return plain_values(value)
    if is_dataclass(value):
        content = {f.name: as_plain(getattr(value, f.name), instead) for f in fields(value)}
        return {"kind": type(value).__name__, **content}
    if isinstance(value, tuple | list):
        return [as_plain(v, instead) for v in value if not isinstance(v, Live)]
    return value


def from_plain(content: Any) -> Any:
    """The chapter, or what stands in one, that `as_plain` wrote."""
    if isinstance(content, list):
        return tuple(from_plain(c) for c in content)
    if not isinstance(content, dict):
        return content
    kind = content["kind"]
    if kind == "Symbol":
        return Symbol(content["text"])
    plain = {name: from_plain(value) for name, value in content.items() if name not in ("kind", "numbers")}
    if "numbers" in content:  # columns of a table, or a chapter's values for another program, which stay as they are
        plain["numbers"] = tuple(content["numbers"]) if kind == "Table" else content["numbers"]
    return _KINDS[kind](**plain)
