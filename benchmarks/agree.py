"""Do two parts of one rig's data give the same numbers? 95 % intervals of each, fitted alone.

Parts are halves of a run, runs of one study, and studies of one rig. Both parts are fitted for the parameters that
the study estimates. A run is halved within the stretch in which it moves, and a half may begin in mid-motion. What
cannot be halved is listed with the reason: a controller whose state at the cut is not in the log, or a half that moves
too little.

A pair agrees when its intervals share a value. Parameters that a part cannot determine, or that were known, are not
compared. A pair with an interval wider than ten times the larger value is counted apart, since it agrees with anything.
Frequencies are imaginary parts of the poles where the rig hangs or rests.

Required: at least 90 % of the pairs agree. Of honest independent pairs 95 to 99.4 % do, most where both are as wide.
"""

from __future__ import annotations

import math
import os
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import combinations
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks import measure
from benchmarks.asked import studies
from benchmarks.measure import Line, of_each
from benchmarks.real import STUDIES
from upright.errors import BadInput
from upright.workers import HERE, Workers

SAME_RIG = (
    ("aau_pendulum", "aau_pendulum_tail"),
    ("uw_pendulum", "uw_pendulum_tail"),
    ("ecp210_two_carts", "ecp210_cart_1"),
    ("furuta_fall", "furuta_sines"),
    ("ecp205_held", "ecp205_spinup"),
)
"""Studies of one rig in one state, by what their files say; numbers that both ask are compared."""

SAME_RUNS = {"aau_pendulum_tail", "uw_pendulum_tail"}
"""Studies whose runs another one has already."""

QUICK = ("furuta_fall", "aau_pendulum")
COUNTS, MOVING, LEAST = 20, 0.02, 200
"""A run moves while it is this many counts, or this share of its range, from where it ends; samples of a half."""

WHY = (
    "aau_pendulum: its first half, 2.8 to 1.3 rad, splits what rubs between b_2c and b_2q. Quarters of the log say"
    " b_2c = 0.0033, 0.0038, 0.0044 and 0.0049 with b_2q ever smaller, each too vaguely for a spread between blocks.",
    "furuta_fall: J_p of eighths of the log is 1.47, 1.48, 1.48, 1.47, 1.45, 1.45, 1.45 and 1.42e-5, and the frequency"
    " rises: below 0.7 rad something pulls back that the model has not. No block of the first half shows it.",
    "ecp210, second halves: a cart that stands while the volts are on is explained by any brake that is strong enough.",
    "ecp205_held beside ecp205_spinup: friction of disk 1 differs tenfold; they are a week apart.",
)
"""What is known of pairs that disagree."""

AGREE = 0.9
"""Share of pairs that is required."""
WIDE = 10.0
"""Intervals wider than this many times the larger of two values agree with anything."""


@dataclass(frozen=True)
class Part:
    """A study, and what of it is fitted alone: a run, a half of it (0 or 1), or all runs together."""

    study: str
    run: str = ""
    half: int | None = None

    def __str__(self) -> str:
        which = "" if self.half is None else (", first half", ", second half")[self.half]
        return f"{self.run or self.study}{which}"


@dataclass(frozen=True, kw_only=True)
class Said:
    """What the fit of one part says: values, intervals and units by name, and whether it may be trusted.

    `silent` says of the other numbers asked why they are not compared, `refused` why there is no fit.
    """

    value: dict[str, float]
    interval: dict[str, tuple[float, float]]
    unit: dict[str, str]
    silent: dict[str, str]
    trusted: bool = False
    refused: str = ""


@dataclass(frozen=True, kw_only=True)
class Pair:
    """What two parts say of one number."""

    kind: str
    parts: tuple[Part, Part]
    name: str
    values: tuple[float, float]
    intervals: tuple[tuple[float, float], tuple[float, float]]
    unit: str
    trusted: bool

    @property
    def agrees(self) -> bool:
        """Whether the intervals share a value."""
        (a, b), (c, d) = self.intervals
        return a <= d and c <= b

    @property
    def width(self) -> float:
        """Width of the wider interval, relative to the larger value; infinite when both are zero."""
        size = max(abs(v) for v in self.values)
        return max(high - low for low, high in self.intervals) / size if size else math.inf

    @property
    def frequency(self) -> bool:
        """Whether it is of a pole."""
        return self.name.startswith("frequency")


def run(
    *, quick: bool, progress: Callable[[str], None], markdown: Path | None = None, workers: Workers = HERE
) -> list[Line]:
    """Share of pairs that agree, by study; `quick`, of two."""
    if not os.environ.get("UPRIGHT_REAL_DATA"):
        return [Line(contender="all studies", note="left out: UPRIGHT_REAL_DATA names no folder")]
    pairs: list[Pair] = []
    left_out: list[str] = []
    said: dict[Part, Said] = {}
    names = [n for n in studies() if not quick or n in QUICK]
    for name in names:
        progress(name)
        together, reasons = compared(name, names)
        left_out += reasons
        parts = [p for p in dict.fromkeys(p for _, a, b in together for p in (a, b)) if p not in said]
        said |= dict(zip(parts, of_each(of_part, parts, workers)[0] if parts else [], strict=True))
        for kind, a, b in together:
            pairs += between(kind, (a, b), (said[a], said[b]), left_out)
        if markdown is not None:  # what is done is kept, should somebody interrupt
            markdown.write_text(page(pairs, left_out), encoding="utf-8")
    return [Line(contender=what, note=told(some)) for what, some in grouped(pairs)]


def compared(name: str, names: Sequence[str]) -> tuple[list[tuple[str, Part, Part]], list[str]]:
    """Kinds and pairs of parts that a study gives, and why some of its runs are not cut."""
    fitted = [r for r in loaded(name).runs if r.role == "fit"]
    found: list[tuple[str, Part, Part]] = []
    reasons: list[str] = []
    for r in fitted if name not in SAME_RUNS else ():
        try:
            for half in (0, 1):
                cut(r, half)
            found.append(("halves", Part(name, r.label, 0), Part(name, r.label, 1)))
        except BadInput as reason:
            reasons.append(f"{name}, {r.label}, halves: {reason}")
    found += [("runs", Part(name, a.label), Part(name, b.label)) for a, b in combinations(fitted, 2)]
    found += [("studies", Part(a), Part(b)) for a, b in SAME_RIG if b == name and a in names]
    return found, reasons


def loaded(name: str) -> Any:
    """A study with the logs of UPRIGHT_REAL_DATA."""
    from upright.study.load import load_study

    return load_study(STUDIES / f"{name}.toml", data=os.environ["UPRIGHT_REAL_DATA"])


def cut(run: Any, half: int) -> Any:
    """First (0) or second (1) half of the stretch in which a run moves.

    Raises
    ------
    BadInput
        When that would be no data set of its own.
    """
    if run.loop is not None:
        raise BadInput("its loop's state at the cut was not logged.")
    if {"input_start", "input_end"} & {*run.unknown, *run.shared}:
        raise BadInput("when its drive really began is sought, which one half alone can see.")
    away = np.abs(run.y - run.y[-1])[:, run.free]
    quanta = np.array(run.quanta)[run.free]
    still = np.maximum(COUNTS * quanta, MOVING * np.ptp(run.y[:, run.free], axis=0))
    moves = np.flatnonzero((away > still).any(axis=1))
    end = run.t.size if moves.size == 0 else min(int(moves[-1]) + 1, run.t.size)
    middle = end // 2
    piece = slice(0, middle) if half == 0 else slice(middle, end)
    found = run.samples(piece)
    if found.t.size < LEAST:
        raise BadInput(f"a half would have {found.t.size} samples of {LEAST} at least.")
    counts = np.ptp(found.y[:, run.free], axis=0) / np.where(quanta > 0, quanta, 1e-6)
    if counts.max() < 5 * COUNTS:
        raise BadInput(
            f"its {('first', 'second')[half]} half moves {counts.max():.0f} of {5 * COUNTS} counts at least."
        )
    found = replace(found, t=found.t - found.t[0])
    if half == 0:
        return found
    begins = () if run.horizon is not None else ("initial",)
    return replace(found, initial={}, unknown=tuple(dict.fromkeys((*run.unknown, *begins))))


def of_part(part: Part) -> Said:
    """What a fit of one part alone says."""
    from upright.identification.estimate import identify

    study = loaded(part.study)
    runs = [r for r in study.runs if r.role == "fit" and part.run in ("", r.label)]
    if part.half is not None:
        runs = [cut(runs[0], part.half)]
    try:
        fit = identify(study.model, runs)
    except BadInput as error:
        return Said(value={}, interval={}, unit={}, silent={}, refused=str(error))
    told = {n: e for n, e in fit.estimates.items() if not n.startswith("noise")}
    silent = {n: e.status for n, e in told.items() if e.status in ("known", "unseen")}
    silent |= {n: "no end" for n, e in told.items() if n not in silent and not np.isfinite(e.interval).all()}
    told = {n: e for n, e in told.items() if n not in silent}
    for at, poles in fit.poles.items():
        if not at.startswith("inverted"):
            pairs = sorted((p.imag for p in poles if p.imag.value > 0), key=lambda e: e.value)
            told |= {f"frequency {k + 1} of {len(pairs)}, {at}": e for k, e in enumerate(pairs)}
    return Said(
        value={n: e.value for n, e in told.items()},
        interval={n: e.interval for n, e in told.items()},
        unit={n: e.unit for n, e in told.items()},
        silent=silent,
        trusted=fit.trusted,
    )


def between(kind: str, parts: tuple[Part, Part], said: tuple[Said, Said], left_out: list[str]) -> Iterator[Pair]:
    """Numbers that both parts speak of; `left_out` is told of the others."""
    a, b = said
    for part, one in zip(parts, said, strict=True):
        if one.refused:
            left_out.append(f"{part.study}, {part}: no fit: {one.refused}")
    for n in a.value:
        if n in b.value:
            yield Pair(
                kind=kind, parts=parts, name=n, values=(a.value[n], b.value[n]),
                intervals=(a.interval[n], b.interval[n]), unit=a.unit[n], trusted=a.trusted and b.trusted,
            )  # fmt: skip
    for part, one in zip(parts, said, strict=True):
        if one.silent:
            what = ", ".join(f"{n} ({why})" for n, why in one.silent.items())
            left_out.append(f"{part.study}, {part}: {what}")


def grouped(pairs: Sequence[Pair]) -> Iterator[tuple[str, list[Pair]]]:
    """Pairs by study, by kind and all."""
    for name in dict.fromkeys(p.parts[1].study for p in pairs):
        yield name, [p for p in pairs if p.parts[1].study == name]
    for kind in dict.fromkeys(p.kind for p in pairs):
        yield f"all {kind}", [p for p in pairs if p.kind == kind]
    yield "all where both fits are trusted", [p for p in pairs if p.trusted]
    yield "all parameters", [p for p in pairs if not p.frequency]
    yield "all frequencies", [p for p in pairs if p.frequency]
    yield "all", list(pairs)


def counted(pairs: Sequence[Pair]) -> tuple[int, int]:
    """How many of some pairs agree, of how many whose intervals are not too wide to disagree."""
    narrow = [p for p in pairs if p.width <= WIDE]
    return sum(p.agrees for p in narrow), len(narrow)


def told(pairs: Sequence[Pair]) -> str:
    """How many of some pairs agree, and how wide their intervals are."""
    narrow = [p for p in pairs if p.width <= WIDE]
    note = "nothing to compare"
    if narrow:
        agree, of = counted(pairs)
        note = f"{agree} of {of} pairs agree, {100 * agree / of:.0f} %; "
        note += f"median width of the wider {100 * float(np.median([p.width for p in narrow])):.2g} % of its value"
    if wide := [p for p in pairs if p.width > WIDE]:
        note += f"; {len(wide)} more are too wide to disagree, {sum(p.agrees for p in wide)} agree"
    return note


def page(pairs: Sequence[Pair], left_out: Sequence[str]) -> str:
    """The published tables."""
    groups = dict(grouped(pairs))
    lines = [
        "",
        "| | |",
        "|---|---|",
        *(f"| {what} | {told(some)} |" for what, some in groups.items()),
        "",
        "Names are those of [the paper](../docs/reference/nomenclature.md), SI. *Wide*: too wide to disagree. *(?)*: a"
        " fit is not trusted.",
        "",
        "| study | parts | number | first | second | |",
        "|---|---|---|---|---|---|",
    ]
    for p in pairs:
        verdict = "wide" if p.width > WIDE else "agree" if p.agrees else "**disagree**"
        parts = " / ".join(str(part) for part in p.parts)
        spans = " | ".join(f"{low:.4g} to {high:.4g}" for low, high in p.intervals)
        lines.append(f"| {p.parts[1].study} | {parts} | {p.name} [{p.unit}] | {spans} | "
                     f"{verdict}{'' if p.trusted else ' (?)'} |")  # fmt: skip
    lines += ["", "## Why", "", *(f"- {reason}" for reason in WHY)]
    lines += ["", "## Left out", "", *(f"- {reason}" for reason in dict.fromkeys(left_out))]
    result = headline({what: counted(some) for what, some in groups.items()})
    return measure.page("agree", "Agreement", __doc__, lines, result, needs="UPRIGHT_REAL_DATA=... ")


def headline(counts: Mapping[str, tuple[int, int]]) -> str:
    """The result in a sentence, from pairs that agree, of how many, by group."""
    agree, of = counts["all"]
    few = [f"{name} ({a} of {b})" for name, (a, b) in counts.items() if a < AGREE * b and not name.startswith("all")]
    return f"{agree} of {of} pairs agree, {100 * agree / of:.0f} % ({100 * AGREE:.0f} required)" + (
        f"; fewer do of {', '.join(few)}." if few else "."
    )
