"""How many unseen samples lie inside 90 % bands, on real rigs and on twins with physics that their models lack?

Unseen samples are those that a fit only predicts:

- the runs that a study predicts, and every fitted run in turn, from a fit of the others
- of a study with one run, its last third, from a fit of the rest
- of twins (the rigs of `misfit`), a second run with other commands or another start, from a fit of one run of 8 s

Each signal that moves freely counts alike, whatever its number of samples. Required: 85 to 95 % over all real rigs.
"""

from __future__ import annotations

import functools
import os
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.asked import studies
from benchmarks.measure import Line, of_each, page, shares
from benchmarks.misfit import Flaws, moved, read
from benchmarks.real import STUDIES
from benchmarks.rigs import MAKES, Make, asked, drawn, logged, sensed
from upright.workers import HERE, Workers

ASKED = (85, 95)
"""Percent inside that is required over all real rigs."""
SLOW = ("ecp205_spinup", "ecp205_closed_loop", "qube_balance")
"""Studies that take a minute or more; they come last."""


@dataclass(frozen=True, kw_only=True)
class Seen:
    """One signal of one unseen run: percent inside its band, and half the band's width beside the signal's spread."""

    of: str
    inside: float
    width: float


def seen(of: str, runs: Mapping[str, Any]) -> list[Seen]:
    """Every signal of predicted runs."""
    return [
        Seen(of=of, inside=share, width=float(np.median(s.band[name]) / np.std(s.y[:, s.measured.index(name)])))
        for s in runs.values() if s.role == "predict" for name, share in s.inside.items()
    ]  # fmt: skip


def unseen(name: str, data: str) -> list[Seen]:
    """Every unseen signal of a study."""
    from upright.identification.estimate import identify
    from upright.identification.ladder.cross_validation import cross_validate
    from upright.study.load import load_study

    study = load_study(STUDIES / f"{name}.toml", data=Path(data))
    fitted = [run for run in study.runs if run.role == "fit"]
    if len(study.runs) == 1:
        (run,) = fitted
        first = run.first_part()
        tail = replace(run, label="tail", role="predict", score_from=float(run.t[first.t.size] - run.t[0]))
        return seen(name, identify(study.model, [first, tail]).runs)
    fit = identify(study.model, study.runs)
    left_out = cross_validate(fit, study.runs).predicted if len(fitted) > 1 else {}
    return [*seen(name, fit.runs), *seen(name, left_out)]


def twins(make: Make, place: int, count: int) -> list[tuple[Any, list[Any]]]:
    """Flawed rigs of a make with guesses, each with a run to fit and one to predict."""
    generators = [np.random.default_rng(50_000 + 1000 * place + k) for k in range(count)]
    drafts = [drawn(make, g) for g in generators]
    truths, first = [d[0] for d in drafts], [d[1] for d in drafts]
    flaws = Flaws(count, np.random.default_rng(100 + place))
    other = replace(make, start={name: 0.75 * value for name, value in make.start.items()})
    motions: list[tuple[str, str, np.ndarray, np.ndarray]] = []
    for label, role, kind, commands in (
        ("one", "fit", make, first), ("other", "predict", other, [drawn(make, g)[1] for g in generators]),
    ):  # fmt: skip
        u = np.stack([c[:, 0] for c in commands], axis=1)
        motions.append((label, role, u, moved(kind, truths, u, flaws)))
    out: list[tuple[Any, list[Any]]] = []
    for k, (truth, g) in enumerate(zip(truths, generators, strict=True)):
        memory = g.uniform(0, 0.95)
        runs = [
            logged(make, label, role, u[:, [k]], sensed(make, read(make, motion[:, :, k], flaws, k), memory, 0.003, g))
            for label, role, u, motion in motions
        ]
        off = {n: v * (1 + g.choice([-1, 1]) * g.uniform(0.2, 0.4)) for n, v in truth.items()}
        out.append((asked(make, off), runs))
    return out


def twin(make: Make, rig_and_runs: tuple[Any, list[Any]]) -> list[Seen]:
    """Every signal that a twin's fit predicts."""
    from upright.identification.estimate import identify

    rig, runs = rig_and_runs
    return seen(make.plant, identify(rig, runs).runs)


def run(
    *, quick: bool, progress: Callable[[str], None], markdown: Path | None = None, workers: Workers = HERE
) -> list[Line]:
    """Share of unseen samples inside, by study, by rig and over all, then by kind of twin."""
    real: dict[str, list[Seen]] = {}
    made: dict[str, list[Seen]] = {}
    for place, make in enumerate(MAKES[: 1 if quick else None]):
        each = 1 if quick else 12
        progress(f"{each} flawed twins like {make.plant}")
        found, _ = of_each(functools.partial(twin, make), twins(make, place, each), workers)
        made[make.plant] = [s for one in found for s in one]
    data = os.environ.get("UPRIGHT_REAL_DATA", "")
    names = studies()[:1] if quick else sorted(studies(), key=lambda name: name in SLOW)
    for name in names if data else ():
        progress(name)
        real[name] = unseen(name, data)
        if markdown is not None:  # what is done is kept, should somebody interrupt
            publish(markdown, _lines(real, made))
    lines = _lines(real, made)
    if markdown is not None:
        publish(markdown, lines)
    return lines


def publish(file: Path, lines: list[Line]) -> None:
    """Write the lines as a page."""
    body = ["", "| | |", "|---|---|", *(f"| {line.contender} | {line.note} |" for line in lines)]
    text = page("bands", "Unseen samples inside 90 % bands", __doc__, body, headline(lines))
    file.write_text(text, encoding="utf-8")


def headline(lines: Sequence[Line]) -> str:
    """The result in a sentence, from the lines of all and of each rig."""
    inside = shares(lines)
    real = {name.removeprefix("rig "): share for name, share in inside.items() if name.startswith("rig ")}
    if not real:
        return f"{inside['all twins']:.1f} % of the samples of twins lie inside; real rigs were left out."
    few = [f"{name} {share:.1f} %" for name, share in real.items() if share < ASKED[0]]
    many = [f"{name} {share:.1f} %" for name, share in real.items() if share > ASKED[1]]
    apart = "; ".join([*([f"fewer of {', '.join(few)}"] * bool(few)), *([f"more of {', '.join(many)}"] * bool(many))])
    return (
        f"{inside['all real rigs']:.1f} % of the samples of real rigs lie inside ({ASKED[0]} to {ASKED[1]} required"
        f"{f': {apart}' if apart else ''}), and {inside['all twins']:.1f} % of those of twins."
    )


def _lines(real: Mapping[str, list[Seen]], made: Mapping[str, list[Seen]]) -> list[Line]:
    rigs: dict[str, list[Seen]] = {}
    for name, found in real.items():
        rigs.setdefault(name.partition("_")[0], []).extend(found)
    kinds = {"study": real, "rig": rigs, "twins like": made}
    lines = [_line(f"{kind} {n}", found) for kind, all_ in kinds.items() for n, found in all_.items() if found]
    if real:
        lines.append(
            _line("all real rigs", [s for found in real.values() for s in found], f"asked {ASKED[0]} to {ASKED[1]} %")
        )
    else:
        lines.append(Line(contender="real rigs", note="left out: UPRIGHT_REAL_DATA names no folder"))
    return [*lines, _line("all twins", [s for found in made.values() for s in found])]


def _line(name: str, found: list[Seen], asked: str = "") -> Line:
    inside = np.array([s.inside for s in found])
    note = f"{inside.mean():.1f} % inside, of {len(found)} signals {np.mean(inside < 70):.0%} have fewer than 70 %; "
    note += f"median half width {np.median([s.width for s in found]):.1%} of the signal's spread"
    return Line(contender=name, note=note + (f"; {asked}" if asked else ""))
