"""How rich a friction does the rig have? Viscous, with Coulomb, with drag, with presliding: each rung must earn itself.

A rung is kept only if, fitted on the first part of every run, it predicts the held-out rest better than the poorer
one. Richer rungs start from where the poorer one ended, or they can end with a larger cost (seen: 1083 against 314).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from upright.identification.ladder.decision import by_chance
from upright.identification.ladder.rungs import at, friction_rungs
from upright.identification.model.model import SEEN, Rig, Run
from upright.identification.model.unknowns import SHARED
from upright.identification.problem.normal import finite
from upright.identification.problem.pose import pose
from upright.identification.problem.problem import Problem, loudness
from upright.identification.search.descent import first_horizon, grow
from upright.identification.search.strategy import Log, better, closed_form_starts, explain, placed

Array = NDArray[np.float64]


@dataclass(frozen=True, kw_only=True)
class Place:
    """A friction model: its name, the terms it adds, and the rig with all terms of higher rungs at zero."""

    name: str
    adds: tuple[str, ...]
    rig: Rig


def places(rig: Rig) -> list[Place]:
    """Nested friction models within the terms that the rig asks to estimate, poorest first."""
    ladder = friction_rungs(rig)
    return [Place(name=r.name, adds=r.adds, rig=at(rig, ladder, ladder[: k + 1])) for k, r in enumerate(ladder)]


def choose(rig: Rig, runs: Sequence[Run], log: Log) -> tuple[Rig, list[Array], tuple[str, ...]]:
    """Rig of the rung that predicts best, coordinates to start the final fit from, terms left out."""
    ladder = places(rig)
    problem = pose(rig, runs)
    # levels of friction and of noise are sought together, dearly; whether friction predicts better a study may ask
    if any(t.ahead for t in problem.tracks):
        starts = [problem.start, *(placed(problem, s) for s in closed_form_starts(rig, runs))]
        return rig, [min(starts, key=lambda x: problem.cost(x, first_horizon(problem)))], ()
    if len(ladder) == 1:
        return rig, [problem.start, *(placed(problem, s) for s in closed_form_starts(rig, runs))], ()
    seen = [run.first_part() for run in runs]
    best = (math.inf, 0, problem.start, "")
    costs: list[float] = []
    loud: list[float] = []
    tried: list[dict[str, float]] = []
    values: dict[str, float] = {}
    own: dict[tuple[tuple[int, ...], str], float] = {}
    for k, rung in enumerate(ladder):
        part = pose(rung.rig, seen)
        starts = [placed(part, s) for s in closed_form_starts(rung.rig, seen)]
        candidates = [_carry(part, values, own, rig, set(rung.adds))] if k else [part.start]
        candidates += starts if k == 0 else starts[:1]
        found = explain(part, candidates, log, patient=k == 0)
        if k and found.normal.cost > costs[-1] and not found.interrupted:
            # another start looked better over the first seconds and led astray; the poorer fit's end cannot
            other = grow(part, candidates[0], report=log.report, history=log.history, horizon=math.inf)
            found = better(found, other)
        if found.interrupted:
            raise KeyboardInterrupt
        costs.append(found.normal.cost)
        loud.append(loudness(part, found.x))
        if k and costs[k] > costs[k - 1] * (1 + 1e-6):
            log.warnings.append(
                f"With {rung.name} the first part of the runs was fitted worse (cost {costs[k]:.6g}) than without it "
                f"({costs[k - 1]:.6g}); a richer model that contains the poorer one never should be, so the search "
                "stalled; try better guesses."
            )
        v = part.value(found.x)
        values = {u.name: float(v[i]) for i, u in enumerate(part.unknowns) if u.runs == SHARED}
        tried.append(values)
        own = {
            (u.runs, u.name): float(v[i])
            for i, u in enumerate(part.unknowns)
            if u.runs != SHARED and u.lower < v[i] < u.upper
        }
        missed = _held_out(rung.rig, runs, part, found.x)
        log.history.append((f"{rung.name}: held-out cost", missed, part.evaluations))
        if missed < best[0]:
            whole = pose(rung.rig, runs)
            best = (missed, k, _carry(whole, values, own, rig, set()), rung.name)
    chosen = ladder[best[1]]
    out = tuple(n for rung in ladder[best[1] + 1 :] for n in rung.adds)
    _compare(chosen, out, tried, costs, loud, best[1], log)
    return chosen.rig, [best[2]], out


def _compare(
    chosen: Place, out: tuple[str, ...], tried: list[dict[str, float]], costs: list[float], loud: list[float], k: int,
    log: Log,
) -> None:  # fmt: skip
    """Note what a richer model would have said otherwise, where it explains its part of the runs better.

    That the rest is predicted worse then means that something else is missing, not that the richer model is wrong.
    `loud` are the residuals' loudness, rung by rung.
    """
    rival = min(range(k, len(costs)), key=lambda i: costs[i])
    if rival == k or costs[k] - costs[rival] <= by_chance(len(out), loud[rival]):
        return
    for n in chosen.rig.estimated:
        a, b = tried[k].get(n, 0.0), tried[rival].get(n, 0.0)
        if abs(a - b) > 0.5 * max(abs(a), abs(b)):
            log.rivals[n] = b
    if log.rivals:
        log.warnings.append(
            f"The first part of the runs is explained better with {', '.join(out)} (cost {costs[rival]:.3g} against "
            f"{costs[k]:.3g}), the rest is predicted better without, so something else is missing from the model; "
            f"until it is found, the intervals of {', '.join(log.rivals)} hold what both models say."
        )


def _carry(
    problem: Problem, values: dict[str, float], own: dict[tuple[tuple[int, ...], str], float], rig: Rig, new: set[str]
) -> Array:
    """Coordinates that continue a poorer fit; terms that are new begin at a tenth of their guess, or at zero."""
    start = dict(values)
    for n in new:
        start[n] = 0.1 * rig.parameters[n].value if n in rig.parameters else 0.0
    x = placed(problem, start)
    for i, u in enumerate(problem.unknowns):
        if (u.runs, u.name) in own:
            x[i] = u.inside(own[u.runs, u.name])
    return x


def _held_out(rig: Rig, runs: Sequence[Run], part: Problem, x: Array) -> float:
    """Mean squared residual of what the fit on the first parts has not seen."""
    whole = pose(rig, runs)
    whole.steps = part.steps
    total, samples = 0.0, 0
    for index, track in enumerate(whole.tracks):
        e = whole.missed(index, x)
        if track.windowed:
            e = e[int(SEEN * track.restarts.size) :]
        else:
            e = e[0].reshape(-1, len(track.columns))[int(SEEN * track.length) :]
        # one run that slips a cycle should not outvote all others
        total += float(np.sum(np.minimum(e * e, 4.0))) if finite(e) else 4.0 * e.size
        samples += e.size
    return total / max(samples, 1)
