"""What to do after a fit: what would make the model wrong first, what would make it better last."""

from __future__ import annotations

import math
from collections.abc import Collection, Iterator

import numpy as np

from upright.identification.model.fit import Fit
from upright.identification.model.runs import SPREADS
from upright.report.fit.figures import autocorrelation
from upright.report.page import Step
from upright.report.prose import chapter_of
from upright.report.symbols import plain

FOLLOWED = 80.0
"""Fit percent below which a free run counts as lost."""
REVERSED = (-160.0, -40.0)
"""Fit percents about -100: of a signal that is the measured one with the other sign, somewhat off."""


def fit_steps(fit: Fit, *, study: str = "STUDY.toml", folder: str = "OUT", crossed: bool = False) -> tuple[Step, ...]:
    """Steps in order of weight; `crossed` says that every run was predicted by the others already."""
    stopped = [n for n, e in fit.estimates.items() if e.status == "at bound"]
    needless = [n for n in stopped if fit.estimates[n].value == 0]
    return chapter_of(
        __name__, fit=fit, study=study, folder=folder, missed=tuple(_missed(fit)), lost=_lost(fit),
        weak=[n for n, e in fit.estimates.items() if e.status in ("poorly determined", "unseen")],
        idle=_idle(fit), chosen=next(_chosen(fit), None), offered=tuple(_offered(fit)),
        coloured=_coloured(fit), frictions=_frictions_left_out(fit), needless=needless,
        stopped=[n for n in stopped if n not in needless],
        untested=not (crossed or fit.interrupted) and all(s.role == "fit" for s in fit.runs.values()),
    ).steps  # fmt: skip


def _missed(fit: Fit) -> Iterator[tuple[str, dict[str, float], bool]]:
    """Signals that are explained worse than by their mean, in which runs, and whether as by a reversed sign."""
    for name in dict.fromkeys(n for s in fit.runs.values() for n in s.fit_percent):
        missed = {label: s.fit_percent[name] for label, s in fit.runs.items() if s.fit_percent.get(name, 0.0) < 0}
        if missed:
            yield name, missed, all(REVERSED[0] < value < REVERSED[1] for value in missed.values())


def _lost(fit: Fit) -> list[str]:
    """Fitted runs whose simulation, free from its start, does not follow."""
    return [
        label
        for label, s in fit.runs.items()
        if s.role == "fit" and s.horizon is None and any(v < FOLLOWED for v in s.fit_percent.values())
    ]


def _idle(fit: Fit) -> list[str]:
    """Factors of runs and groups that nothing shows."""
    homes = {f"group {group}": own for group, own in fit.groups.items()} | dict(fit.per_run)
    return [f"{n} of {home}" for home, own in homes.items() for n, e in own.items() if e.status == "unseen"]


def _chosen(fit: Fit) -> Iterator[tuple[str, list[str]]]:
    """Predicted runs with the factors that they chose for themselves."""
    for label, score in fit.runs.items():
        chosen = [n for n in score.adapted if n.partition(".")[0] in SPREADS]
        if chosen and score.role != "fit":
            yield label, chosen


def _offered(fit: Fit) -> Iterator[tuple[str, str, Collection[str]]]:
    """Runs that another unknown would explain: what it would gain, and all unknowns of the run with it."""
    for label, score in fit.runs.items():
        if score.offer is not None:
            own = dict.fromkeys([*score.adapted, score.offer.name])
            yield label, score.offer.sentence(label, score.fit_percent), own


def _coloured(fit: Fit) -> list[str]:
    """Fitted signals whose residuals are autocorrelated."""
    coloured: list[str] = []
    for label, score in fit.runs.items():
        for j, name in enumerate(score.measured):
            rest = score.y[:, j] - score.simulated[:, j]
            rest = rest[np.isfinite(rest)]
            lags = max(1, rest.size // 10)
            if rest.size < 20 or score.role != "fit":
                continue
            r = autocorrelation(rest, lags)[1:]
            if np.mean(np.abs(r) > 1.96 / math.sqrt(rest.size)) > 0.3:
                coloured.append(f"{plain(name)} of '{label}'")
    return coloured


def _frictions_left_out(fit: Fit) -> dict[str, str]:
    """Friction terms that were not estimated, by parameter: those of a joint whose motion was not given."""
    return {
        name: f"{term} of {joint.on} ({name})"
        for joint in fit.model.plant.joints
        for term, name in (("Coulomb friction", joint.coulomb), ("quadratic drag", joint.quadratic))
        if name and name not in fit.model.estimated and joint.on not in _prescribed(fit)
    }


def _prescribed(fit: Fit) -> set[str]:
    """Coordinates whose motion every fitted run was given: whatever rubs there, these logs do not show it."""
    fitted = [s for s in fit.runs.values() if s.role == "fit"]
    return set[str]().union(*(s.measured for s in fitted)) - {n for s in fitted for n in s.fit_percent}
