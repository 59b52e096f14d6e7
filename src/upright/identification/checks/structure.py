"""Which spring, offset, lean or drag, left out of the model, would explain runs that it does not explain?

Every number that plant and drive may have and that the model leaves at nothing is tried in turn. Accelerations,
which need no simulation, say which first: what pulls slowly hardly shows in them, yet it stands before all that is not
there. The first ones are then fitted, and what they gain is reported.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, fields, replace

import numpy as np

from upright.identification.inference.assumptions import assumption_sentences
from upright.identification.inference.scoring import score_run
from upright.identification.inference.verdict.predicts import GOOD
from upright.identification.model.fit import Fit
from upright.identification.model.grey_box import GreyBox, Parameter, neutral
from upright.identification.model.runs import Run
from upright.identification.problem.residuals import formulate
from upright.identification.search.descent import SearchLog
from upright.identification.search.starts import Sample, disagreement, regress, samples_of
from upright.identification.search.strategy import closed_form_starts, search
from upright.physics.actuator import ACTUATOR

DRIVE = ("actuator.offset", "actuator.dead_zone")
TOGETHER = (("tilt_x", "tilt_y"),)
"""Numbers that are components of one thing."""
FELT = 1e-3
"""Least share of what is left of the accelerations that a number must explain to be fitted."""
STEP = 1e-6
"""By which a number that does nothing is moved to see what it does [SI]; accelerations are linear in what is small."""
FITTED = 2
"""How many are fitted, one after the other, before none is proposed."""
CLEAR = 0.5
"""A number is proposed when it leaves less than this share of the percents that are missing."""


@dataclass(frozen=True, kw_only=True)
class Proposal:
    """Numbers that the model leaves out, their estimates, and the least fit percent then."""

    values: Mapping[str, float]
    reached: float


def with_proposal(fit: Fit, runs: Sequence[Run]) -> Fit:
    """The fit, with what its model leaves out named where it does not explain its runs."""
    worst = _worst(r.fit_percent for r in fit.runs.values() if r.role == "fit")
    if fit.interrupted or fit.failed or worst >= GOOD:
        return fit
    proposal = proposed(fit.model, runs, worst)
    if proposal is None:
        return fit
    advice = sentence(proposal, fit.model, worst)
    first, *others = fit.answers
    answers = (replace(first, reasons=(advice, *first.reasons)), *others)
    verdict = " ".join([*(a.text() for a in answers), *assumption_sentences(fit.assumptions)])
    return replace(
        fit, answers=answers, verdict=verdict, warnings=(*fit.warnings, advice), proposed=dict(proposal.values)
    )  # fmt: skip


def proposed(rig: GreyBox, runs: Sequence[Run], worst: float) -> Proposal | None:
    """One or two numbers with which a model explains its runs far better than to the `worst` fit percent."""
    best: Proposal | None = None
    while best is None or (best.reached < GOOD and len(best.values) < 2):
        reached, known = (worst, {}) if best is None else (best.reached, best.values)
        tried = missing_numbers(with_numbers(rig, known), runs)[:FITTED]
        proposals = (_fitted(with_numbers(rig, {**known, **values}), (*known, *values), runs) for values in tried)
        better = next((p for p in proposals if 100 - p.reached < CLEAR * (100 - reached)), None)
        if better is None:
            break
        best = better
    return best


def missing_numbers(rig: GreyBox, runs: Sequence[Run]) -> list[dict[str, float]]:
    """What a model leaves out and the accelerations of its runs ask for, with their values; the most telling first."""
    samples = samples_of(rig, runs, most=2000)
    if not samples or not rig.estimated:
        return []
    base = regress(rig, samples)
    candidates: list[tuple[float, dict[str, float]]] = []
    for names in _left_out(rig):
        start = _start(rig, names, samples, base.values)
        if start:
            agreement = regress(with_numbers(rig, start), samples)
            candidates.append((agreement.unexplained, {n: agreement.values[n] for n in names}))
    candidates.sort(key=lambda one: one[0])
    return [values for unexplained, values in candidates if unexplained < (1 - FELT) * base.unexplained]


def _start(
    rig: GreyBox, names: Sequence[str], samples: list[Sample], values: Mapping[str, float]
) -> dict[str, float]:  # fmt: skip
    """Where the numbers may begin: what of the accelerations they explain alone; empty where they change none."""
    left = np.concatenate([disagreement(rig, values, s).ravel() for s in samples])
    columns = [
        np.concatenate([disagreement(rig, {**values, n: STEP}, s).ravel() for s in samples]) - left for n in names
    ]
    A = np.column_stack(columns) / STEP
    if not np.isfinite(A).all() or not A.any(axis=0).all():
        return {}
    alone = np.linalg.lstsq(A, -left, rcond=None)[0].tolist()
    lower = {n: with_numbers(rig, {n: 0.0}).bounds(n)[0] for n in names}
    return {n: v if v > lower[n] else 0.1 * abs(v) for n, v in zip(names, alone, strict=True)}


def with_numbers(rig: GreyBox, values: Mapping[str, float]) -> GreyBox:
    """The rig with these numbers to estimate, from these values."""
    command = rig.parameters["actuator.limit"].unit if "actuator.limit" in rig.parameters else "1"
    added = {
        n: replace(rig.parameters.get(n, Parameter(name=n, value=0.0, unit=command)), value=v, estimate=True)
        for n, v in values.items()
    }
    return replace(rig, parameters={**rig.parameters, **added})


def sentence(proposal: Proposal, rig: GreyBox, worst: float) -> str:
    """What is missing, what it gains, and what to write into the study."""
    parameters = with_numbers(rig, proposal.values).parameters
    meant = " and ".join(f"{n} ({_meaning(rig, n)})" for n in proposal.values)
    lines = " and ".join(
        f'{n.rpartition(".")[2]} = {{ guess = "{v:.3g} {parameters[n].unit}" }} under '
        f"{'[actuator]' if n in ACTUATOR else '[parameters]'}"
        for n, v in proposal.values.items()
    )
    return (
        f"Something is missing from the model: with {meant} it explains at least {proposal.reached:.1f} % of the "
        f"fitted runs instead of {worst:.1f}. Ask for it: {lines}."
    )


def _meaning(rig: GreyBox, name: str) -> str:
    return ACTUATOR[name].meaning if name in ACTUATOR else rig.plant.quantity(name).meaning


def _fitted(rig: GreyBox, names: Sequence[str], runs: Sequence[Run]) -> Proposal:
    problem = formulate(rig, runs)
    starts = [problem.place(s) for s in closed_form_starts(rig, runs)] or [problem.start]
    end = search(problem, starts, SearchLog(), patient=False)
    if not math.isfinite(end.normal.cost):
        return Proposal(values={}, reached=-math.inf)
    values = problem.values_at(end.x)
    reached = _worst(score_run(problem, i, end.x).fit_percent for i in range(len(problem.tracks)))
    return Proposal(values={n: float(values[n]) for n in names}, reached=reached)


def _worst(percents: Iterable[Mapping[str, float]]) -> float:
    return float(np.min([p for each in percents for p in each.values()] or [100.0]))


def _left_out(rig: GreyBox) -> list[tuple[str, ...]]:
    def idle(name: str) -> bool:
        p = rig.parameters.get(name)
        return p is None or not (p.estimate or p.assumed or p.uncertainty or p.value != neutral(rig.plant, name))

    optional = [f.name for f in fields(rig.plant) if f.default == 0]  # gravity has another
    names = [n for n in (*optional, *(DRIVE if rig.plant.inputs else ())) if idle(n)]
    pairs = [pair for pair in TOGETHER if set(pair) <= set(names)]
    return [*pairs, *((n,) for n in names if not any(n in pair for pair in pairs))]
