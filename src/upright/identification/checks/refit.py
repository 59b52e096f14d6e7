"""What becomes of a stretch that something else than the input moved? It is named, and fitted again without.

Both answers are told: what the numbers are without it, and what they would have been with it.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from upright.identification.checks.outliers import SELF_EXCITED, SPIKES, Outlier, cut, outliers
from upright.identification.checks.spikes import without_spikes
from upright.identification.inference.scoring import predict
from upright.identification.model.fit import Fit
from upright.identification.model.rig import Rig
from upright.identification.model.runs import Run

WORTH = 1 / 3
"""What is left of a run is fitted when it is this share of it, and"""

LEAST_SAMPLES = 50
"""so many samples, and"""

MOVES = 0.1
"""when one of its signals still spans this share of what it spans in the whole run."""


ASTRAY = 3.0
"""Percent by which a run may be explained worse once outliers of others are out: more than they could have bent it."""

STAYS = "Without that stretch the other runs were explained worse, so the fit keeps it."


def watched(fit: Fit, rig: Rig, runs: Sequence[Run], again: Callable[[Sequence[Run]], Fit]) -> Fit:
    """The fit, or `again` without what the first one found strange; at most twice, as outliers hide each other.

    Reasons are those that the last model gives: the first one was bent by what it had to explain.
    """
    found = outliers(fit, rig, runs)
    first, kept = fit, list(runs)
    for _ in range(2):
        left = without(runs, found)
        if not any(r.role == "fit" for r in left) or _same(left, kept):
            break
        kept, new = left, again(left)
        if worse(new, first):
            told = tuple(f"Outlier: {o.sentence}" for o in found)
            return replace(first, warnings=(*first.warnings, *told, STAYS))
        fit = new
        if fit.interrupted:
            break
        found = outliers(fit, rig, runs) or found
    if not found:
        return first
    told = [f"Outlier: {o.sentence}" for o in found]
    if fit is first:
        return replace(fit, warnings=(*fit.warnings, *told))
    missing = [replace(r, role="predict") for r in runs if r.label not in fit.runs]
    scores = {**fit.runs, **predict(fit, rig, missing)}
    known = [r.label for r in runs]
    order = sorted(scores, key=lambda label: next((i for i, k in enumerate(known) if label.startswith(k)), len(known)))
    names = ", ".join(dict.fromkeys(o.run for o in found))
    return replace(
        fit,
        runs={label: scores[label] for label in order},
        warnings=(*fit.warnings, *told, _compared(first, fit)),
        verdict=f"{fit.verdict} Left out of the fit as outliers, or in part: {names}; see the warnings.",
        seconds=first.seconds + fit.seconds,
        evaluations=first.evaluations + fit.evaluations,
    )


def worse(new: Fit, old: Fit) -> bool:
    """Whether runs that both were fitted to are explained worse by the new fit: its search then went astray."""
    both = [label for label, s in new.runs.items() if s.role == "fit" and label in old.runs]
    return any(
        percent < old.runs[label].fit_percent[signal] - ASTRAY
        for label in both
        for signal, percent in new.runs[label].fit_percent.items()
    )


def _same(a: Sequence[Run], b: Sequence[Run]) -> bool:
    return len(a) == len(b) and all(r.label == s.label and r.y is s.y for r, s in zip(a, b, strict=True))


def _compared(before: Fit, after: Fit) -> str:
    """What the outliers would have done to the numbers."""
    moved = [
        f"{n} {before.estimates[n].value:.4g} instead of {e.value:.4g} {e.unit}"
        for n, e in after.estimates.items()
        if n in before.estimates and not e.interval[0] <= before.estimates[n].value <= e.interval[1]
    ]
    if not moved:
        return "With the outliers in, every number stays within its interval."
    return f"With the outliers in it would have been {', '.join(moved)}."


def without(runs: Sequence[Run], found: Sequence[Outlier]) -> list[Run]:
    """The runs with spikes taken out, and fitted ones cut into what stands before and after each stretch.

    What is left of a run is dropped when it is shorter than a third of it or than 50 samples, or hardly moves. A run
    that excites itself is dropped whole: it does so before one can see it.
    """
    kept: list[Run] = []
    for run in runs:
        spans = sorted((o.start, o.stop) for o in found if o.run == run.label and o.reason != SPIKES)
        spiky = any(o.run == run.label and o.reason == SPIKES for o in found)
        clean = without_spikes(run)[0] if spiky else run
        if run.role != "fit" or not spans:
            kept.append(clean)
            continue
        if any(o.run == run.label and o.reason == SELF_EXCITED for o in found):
            continue
        edges = [float(run.t[0]) - 1, *(e for span in spans for e in span), float(run.t[-1]) + 1]
        for a, b in zip(edges[::2], edges[1::2], strict=True):
            part = np.flatnonzero((run.t > a) & (run.t < b))
            moves = part.size > 0 and np.any(np.ptp(clean.y[part], axis=0) > MOVES * np.ptp(clean.y, axis=0))
            if moves and part.size >= max(LEAST_SAMPLES, run.t.size * WORTH):
                kept.append(cut(clean, int(part[0]), int(part[-1]) + 1))
    return kept
