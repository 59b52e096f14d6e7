"""How much of each log counts? The windows of a study's runs, beside the records that they are parts of."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence

from upright.identification.model.runs import Run

VERBS = {"fit": "fits", "predict": "predicts"}

Part = tuple[str, float, float]
"""Role, first and last second of a run."""


def windows(runs: Sequence[Run]) -> tuple[str, ...]:
    """A sentence for each log, in the order of the runs."""
    logs: dict[str, list[Run]] = {}
    for run in runs:
        if run.record is not None:
            logs.setdefault(run.source.partition(";")[0], []).append(run)  # file and hash
    sentences: list[str] = []
    for log, own in logs.items():
        parts = [(run.role, float(run.t[0]), float(run.t[-1])) for run in own]
        first, last = min(r.record[0] for r in own if r.record), max(r.record[1] for r in own if r.record)
        sentence = window_sentence(parts, first, last)
        file = log.partition(" (sha256")[0]
        sentences.append(sentence if len(logs) == 1 or not file else f"{file}: {sentence[0].lower()}{sentence[1:]}")
    return tuple(sentences)


def window_sentence(parts: Iterable[Part], first: float, last: float) -> str:
    """What is fitted and predicted of a record from `first` to `last` [s], and which share of it that is."""
    parts = sorted(parts, key=lambda part: part[1])
    clauses: list[str] = []
    digits = digits_within(4, first, last)
    for role in dict.fromkeys(role for role, _, _ in parts):
        spans = ", ".join(f"{start:.{digits}g} to {stop:.{digits}g}" for own, start, stop in parts if own == role)
        clauses.append(f"{VERBS[role]} {spans} s")
    covered, reached = 0.0, first
    for _, start, stop in parts:
        covered += max(0.0, stop - max(start, reached))
        reached = max(reached, stop)
    share = 100 * covered / (last - first) if last > first else 100.0
    text = " and ".join(clauses)
    return f"{text[0].upper()}{text[1:]}, {share:.{0 if share >= 1 else 1}f} % of the record."


def digits_within(digits: int, first: float, last: float) -> int:
    """Digits that tell instants from `first` to `last` [s] apart as `digits` do on a clock that begins at zero."""
    largest, span = max(abs(first), abs(last)), last - first
    return digits + max(0, math.ceil(math.log10(largest / span) - 1e-9)) if 0 < span < largest else digits
