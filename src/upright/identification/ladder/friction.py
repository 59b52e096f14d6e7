"""Choice of the friction model inside a fit: viscous, with Coulomb, with drag, with stiction, with presliding.

The rungs are those with which every ladder begins; `growth` climbs them one by one, refits all runs for each and asks
whether the held-out error falls by more than chance. Inside a fit there is no time for that: every rung is fitted once
to the first part of every run, all of them are tried, and the one with the least squared error over the rest is taken.
Richer rungs start from where the poorer one ended, or they can end with a larger cost (seen: 1083 against 314).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from upright.identification.ladder.decision import by_chance, stalled
from upright.identification.ladder.rungs import friction_rungs, rig_at
from upright.identification.model.rig import Rig
from upright.identification.model.runs import FITTED_SHARE, Run
from upright.identification.problem.formulation import formulate
from upright.identification.problem.normal_equations import finite
from upright.identification.problem.residuals import noise_level
from upright.identification.search.descent import SearchLog, descend_progressively, first_horizon
from upright.identification.search.strategy import better, closed_form_starts, search

Array = NDArray[np.float64]


@dataclass(frozen=True, kw_only=True)
class Candidate:
    """A friction model fitted to the first part of every run.

    `values` are its numbers by key, those of single runs that ended at a bound left out, `noise` the level of its
    residuals, `held_out` its mean squared residual over what it has not seen.
    """

    rig: Rig
    cost: float
    noise: float
    values: dict[str, float]
    held_out: float


def choose_friction(rig: Rig, runs: Sequence[Run], log: SearchLog) -> tuple[Rig, list[Array]]:
    """Rig of the friction that predicts best, and coordinates to start the final fit from."""
    rungs = friction_rungs(rig)
    # levels of friction and of noise are sought together, dearly; whether friction predicts better a study may ask
    filtered = any(run.filtered for run in runs)
    if filtered or len(rungs) == 1:
        problem = formulate(rig, runs)
        starts = [problem.start, *(problem.place(s) for s in closed_form_starts(rig, runs))]
        if filtered:
            starts = [min(starts, key=lambda x: problem.cost(x, first_horizon(problem)))]
        return rig, starts
    seen = [run.first_part() for run in runs]
    tried: list[Candidate] = []
    for k, rung in enumerate(rungs):
        here = rig_at(rig, rungs, rungs[: k + 1])
        part = formulate(here, seen)
        starts = [part.place(s) for s in closed_form_starts(here, seen)]
        if tried:
            starts = [part.place(tried[-1].values | rung.seeds(rig)), *starts[:1]]
        else:
            starts = [part.start, *starts]
        found = search(part, starts, log, patient=not tried)
        if tried and found.normal.cost > tried[-1].cost and not found.interrupted:
            # another start looked better over the first seconds and led astray; the poorer fit's end cannot
            found = better(found, descend_progressively(part, starts[0], log, horizon=np.inf))
        if found.interrupted:
            raise KeyboardInterrupt
        cost = found.normal.cost
        if tried and cost > tried[-1].cost * (1 + 1e-6):
            log.warnings.append(stalled(rung.name, cost, tried[-1].cost))
        level, v = noise_level(part, found.x), part.value(found.x)
        values = {part.key(i): float(v[i]) for i, u in enumerate(part.unknowns) if u.shared or u.lower < v[i] < u.upper}
        held_out = _held_out(here, runs, found.x)
        log.note(f"{rung.name}: held-out cost", held_out, part)
        tried.append(Candidate(rig=here, cost=cost, noise=level, values=values, held_out=held_out))
    k = min(range(len(tried)), key=lambda i: tried[i].held_out)
    _note_rival(tried[k:], [n for rung in rungs[k + 1 :] for n in rung.adds], log)
    return tried[k].rig, [formulate(tried[k].rig, runs).place(tried[k].values)]


def _note_rival(tried: Sequence[Candidate], left_out: Sequence[str], log: SearchLog) -> None:
    """Note what a richer model would have said otherwise, where it explains its part of the runs better.

    That the rest is predicted worse then means that something else is missing, not that the richer model is wrong.
    The chosen model comes first.
    """
    chosen, rival = tried[0], min(tried, key=lambda c: c.cost)
    if chosen.cost - rival.cost <= by_chance(len(left_out), rival.noise):
        return
    for n in chosen.rig.estimated:
        a, b = chosen.values.get(n, 0.0), rival.values.get(n, 0.0)
        if abs(a - b) > 0.5 * max(abs(a), abs(b)):
            log.rivals[n] = b
    if log.rivals:
        log.warnings.append(
            f"The first part of the runs is explained better with {', '.join(left_out)} (cost {rival.cost:.3g} against "
            f"{chosen.cost:.3g}), the rest is predicted better without, so something else is missing from the model; "
            f"until it is found, the intervals of {', '.join(log.rivals)} hold what both models say."
        )


def _held_out(rig: Rig, runs: Sequence[Run], x: Array) -> float:
    """Mean squared residual of what the fit on the first parts has not seen."""
    whole = formulate(rig, runs)
    total, samples = 0.0, 0
    for index, track in enumerate(whole.tracks):
        e = whole.residuals(index, x)
        if track.windowed:
            e = e[int(FITTED_SHARE * track.restarts.size) :]
        else:
            e = e[0].reshape(-1, len(track.columns))[int(FITTED_SHARE * track.length) :]
        # one run that slips a cycle should not outvote all others
        total += float(np.sum(np.minimum(e * e, 4.0))) if finite(e) else 4.0 * e.size
        samples += e.size
    return total / max(samples, 1)
