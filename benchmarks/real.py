"""Do the studies of real rigs reach what was asked, and how long does each take warm? Needs UPRIGHT_REAL_DATA."""

from __future__ import annotations

import os
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

from benchmarks.asked import ASKED, HELD_OUT
from benchmarks.measure import Line, Target, spread

NAME = "real"
STUDIES = Path(__file__).parents[1] / "examples" / "studies"
TARGET = Target(most=10.0, of="seconds")


def run(*, quick: bool, progress: Callable[[str], None]) -> list[Line]:
    """One line per study and per held-out run."""
    data = os.environ.get("UPRIGHT_REAL_DATA", "")
    if not data:
        return [Line(benchmark=NAME, contender="all studies", note="left out: UPRIGHT_REAL_DATA names no folder")]
    lines: list[Line] = []
    cases: list[tuple[str, str | None, dict[tuple[str, str], float]]] = [(n, None, a) for n, a in ASKED.items()]
    cases += [(n, label, {(label, s): v for s, v in asked.items()}) for (n, label), asked in HELD_OUT.items()]
    for name, left_out, asked in cases:
        progress(f"{NAME}: {name}{f', {left_out} held out' if left_out else ''}")
        lines.append(_line(name, left_out, asked, data, rounds=1 if quick else 3))
    return lines


def _line(name: str, left_out: str | None, asked: dict[tuple[str, str], float], data: str, rounds: int) -> Line:
    fit, taken = _timed(name, left_out, data)  # compiles what is not compiled yet
    taken = [_timed(name, left_out, data)[1] for _ in range(rounds)]
    told: list[str] = []
    for (label, signal), least in asked.items():
        reached = fit.runs[label].fit_percent[signal]
        told.append(f"{label} {signal} {reached:.2f} % (asked {least:g}{'' if reached >= least else ', MISSED'})")
    contender = f"{name}, {left_out} held out" if left_out else name
    return Line(
        benchmark=NAME,
        contender=contender,
        seconds=spread(taken),
        rounds=rounds,
        target=TARGET,
        note="; ".join([*told, *([] if fit.trusted else ["not trusted"])]),
    )


def _timed(name: str, left_out: str | None, data: str) -> tuple[Any, float]:
    """A fit and the seconds from study file to verdict."""
    from upright.identification.estimate import identify
    from upright.identification.study import load_study

    start = time.perf_counter()
    study = load_study(STUDIES / f"{name}.toml", data=data)
    study = study.hold_out(left_out) if left_out else study
    fit = identify(study.rig, study.runs)
    return fit, time.perf_counter() - start
