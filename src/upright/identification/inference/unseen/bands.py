"""Bands around predictions that hold 90 % of the samples of runs a fit has not seen.

What a free run misses grows with time and with the motion: a damping that is a little off is felt late, a stiffness
while it swings. So the width follows the variance that the uncertainty of the numbers gives this very prediction, what
the run tells of its own first state taken off, beside what the fit leaves over anyway. Uncertain they are by the
residuals' memory and by how far they move when one block of the runs is left out (a jackknife in Gauss-Newton steps).
Both matrices keep a combination that is seen well as sure as it is, which intervals widened one by one do not.

How many such widths are needed is calibrated on data that a fit did not use (conformal prediction: Vovk, Gammerman and
Shafer 2005): each block is predicted from the fit of the others, and the quantile is that of what is missed, in widths.
Whole blocks, since neighbouring samples err together (Chernozhukov, Wuethrich and Zhu 2018). Blocks lie between others
of the same motion, and a new run does not, so no quantile is less than that of normal errors. How often bands hold runs
that were not seen stands in `benchmarks/bands.md`.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from upright.identification.inference.ceiling import judged
from upright.identification.inference.covariance import Optimum, student
from upright.identification.inference.loop import matrix_root
from upright.identification.inference.unseen.days import daily_moves, log_name, of_another_day
from upright.identification.inference.unseen.reach import beyond, reached
from upright.identification.inference.unseen.slower import considered, slow_friction
from upright.identification.model.bands import LEVEL, NORMAL, Bands, SlowFriction, Spread
from upright.identification.model.fit import RunScore
from upright.identification.model.grey_box import NOISE, GreyBox, Parameter
from upright.identification.model.runs import LEAST_RUN, Run
from upright.identification.problem.normal_equations import finite, pseudo_inverse, slopes, to_one
from upright.identification.problem.residuals import ROUNDING, Problem, formulate
from upright.identification.problem.tracks import Track
from upright.physics.actuator import ACTUATOR

Array = NDArray[np.float64]

BLOCKS = 4
"""Blocks that the runs are cut into; fewer are longer, and more like a run of its own."""

MOST = 5.0
"""Widths that no prediction is worth: such a block was lost, not missed."""

CLOSE_TO_REST = 0.29
"""Root mean square of what friction at low speeds is larger by, relative: up to a half on logs of real rigs."""

LEAST = 1e-3
"""Share of how much a signal varies that nobody minds to be missed."""

DAMPED = 0.01
"""Share of all data that speaks beside the blocks that are left, lest a number seen in one block alone ran away."""


@dataclass(frozen=True, kw_only=True)
class Sensitivity:
    """A run's errors (N, outputs) and slopes of its outputs (N, outputs, sought in it), windows end to end.

    `age` (N,) are the seconds since the restart, or the first sample.
    """

    error: Array
    slope: Array
    age: Array

    @property
    def finite(self) -> bool:
        """Whether neither the motion nor one with a number moved runs away."""
        return finite(self.error) and finite(self.slope)


def sensitivity(problem: Problem, index: int, x: Array) -> Sensitivity:
    """How a run is met at coordinates `x`, in the units of its outputs; of several horizons the shortest."""
    track, sought = problem.tracks[index], problem.sought_in(index)
    samples = 1 if track.ahead else track.length
    y = problem.simulate(index, problem.lanes(x, sought, central=True), samples)
    error = y[..., 0] - track.targets(samples)
    slope = slopes(y, problem.steps[sought], central=True)
    if track.ahead:
        weight = float(track.ahead.weight[0])
        ahead = np.full(len(error[0]), track.run.horizons[0])
        return Sensitivity(error=error[0] / weight, slope=slope[0] / weight, age=ahead)
    time: Array = track.dt * np.arange(samples, dtype=np.float64)
    age = np.tile(time[1:], track.restarts.size) if track.windowed else time
    return Sensitivity(error=track.flat(error), slope=track.flat(slope), age=age)


def _as_assessed(track: Track, r: Array, J: Array) -> Sensitivity:
    """That of a run whose outputs stand for themselves, from its weighted residuals and their Jacobian."""
    age: Array = track.dt * np.arange(len(r), dtype=np.float64)
    return Sensitivity(error=r / track.weights, slope=J / track.weights[:, None], age=age)


def calibrated(best: Optimum) -> Bands | None:
    """Bands that a fit promises, from blocks of its runs predicted by fits of the others; None where one runs away."""
    if best.lost:
        return None
    horizon = judged(best.problem, best.x)
    problem = best.problem if horizon is None else best.problem.ahead(horizon.seconds)
    met = [
        _as_assessed(track, *best.rows[i]) if horizon is None and track.plain else sensitivity(problem, i, best.x)
        for i, track in enumerate(problem.tracks)
    ]
    if not all(run.finite for run in met):
        return None
    blocks = _blocks(best)
    moved = np.array([block.step for block in blocks]).reshape(-1, best.x.size)
    covariance = best.sandwich + _one_more(len(blocks)) * (moved.T @ moved)
    shared = [i for i in best.shared if not problem.unknowns[i].name.startswith(NOISE)]
    slope = np.array([best.values[i] if problem.unknowns[i].log else 1.0 for i in shared])
    bands = Bands(
        quantile=NORMAL,
        spreads=_spreads(problem.tracks, met),
        names=tuple(problem.unknowns[i].name for i in shared),
        covariance=possible(covariance[np.ix_(shared, shared)] * np.outer(slope, slope)),
        reached=reached(problem.rig, [track.run for track in best.problem.tracks]),
        slow=considered(best, shared),
        logs=tuple(dict.fromkeys(log for track in problem.tracks if (log := log_name(track.run)))),
    )
    missed = [_missed(problem, met[block.run], block, covariance, best.x, bands) for block in blocks]
    if len(blocks) < 2:
        return bands
    widths = float(np.quantile(np.concatenate(missed), LEVEL))
    return replace(bands, quantile=float(np.clip(widths, NORMAL, MOST)))


def possible(C: Array) -> Array:
    """The covariance (n, n) that is nearest to one which rounding has left asymmetric, or a little indefinite."""
    C = (C + C.T) / 2
    s = to_one(C)
    if not C.size or np.linalg.eigvalsh(C * s[:, None] * s)[0] >= 0:
        return C
    L = matrix_root(C)
    return L @ L.T


def recalibrated(bands: Bands, left_out: Sequence[RunScore]) -> Bands:
    """Bands as wide as runs ask that were each predicted, bands included, by a fit of the others.

    Of n exchangeable runs as many more, in n + 1, must lie inside as promised of the next (split conformal prediction).
    """
    missed = [
        np.abs(run.y[:, k] - run.simulated[:, k]) / run.band[c]
        for run in left_out for k, c in enumerate(run.measured) if c in run.band
    ]  # fmt: skip
    if not missed:
        return bands
    level = min(1.0, bands.level * (1 + 1 / len(left_out)))
    every = np.nan_to_num(np.concatenate(missed), nan=MOST, posinf=MOST)  # a run that runs away is lost
    widths = float(np.quantile(every, level)) * bands.quantile
    return replace(bands, quantile=float(np.clip(widths, NORMAL, MOST)))


def _one_more(blocks: int) -> float:
    """What the squares of the moves without each block are multiplied by for the spread of a run as one more block.

    Without one of B alike blocks the mean moves by ``1 / (B - 1)`` of how far that block lies from it, and another one
    lies ``1 + 1/B`` spreads, in the square, from the mean of these. So few tell a spread as well as Student's quantile
    of ``B - 1`` degrees of freedom says.
    """
    if not blocks:
        return 0.0
    few = student(blocks - 1, (1 + LEVEL) / 2) / NORMAL
    return few**2 * (blocks - 1) ** 2 / blocks * (1 + 1 / blocks)


@dataclass(frozen=True, kw_only=True)
class _Block:
    """Piece `number` of `count` of a run, and how the numbers (n,) move in a fit without it."""

    run: int
    number: int
    count: int
    step: Array


def _blocks(best: Optimum) -> list[_Block]:
    problem, free = best.problem, ~best.pinned
    blocks: list[_Block] = []
    for index, (track, rows) in enumerate(zip(problem.tracks, best.rows, strict=True)):
        count = -(-BLOCKS // len(problem.tracks)) if track.run.t.size >= LEAST_RUN else 1
        sought = problem.sought_in(index)
        for number, cut in enumerate(np.array_split(np.arange(len(rows[0])), count)):
            J = rows[1][cut].reshape(-1, sought.size)
            without, g, step = best.matrix.copy(), np.zeros(best.x.size), np.zeros(best.x.size)
            without[np.ix_(sought, sought)] -= (1 - DAMPED) * (J.T @ J)
            g[sought] = J.T @ rows[0][cut].reshape(-1)
            step[free] = pseudo_inverse(without[np.ix_(free, free)]) @ g[free]
            blocks.append(_Block(run=index, number=number, count=count, step=step))
    return blocks if len(blocks) > 1 else []


def _missed(problem: Problem, met: Sensitivity, block: _Block, covariance: Array, x: Array, bands: Bands) -> Array:
    """What a block misses (all,) when the others predict it, in widths."""
    sought, slope, start = problem.sought_in(block.run), met.slope, met.slope[..., :0]
    if block.count == 1:  # a run that is left out still says how it began
        slope, start = adapted(problem, block.run, slope, x)
    here = np.array_split(np.arange(len(met.error)), block.count)[block.number]
    error = met.error[here] + slope[here] @ block.step[sought]
    variance = _variance(slope[here], covariance[np.ix_(sought, sought)]) + _squares(start[here])
    track = problem.tracks[block.run]
    width = _width(track, bands, met.age[here], variance)
    return np.concatenate([np.abs(error[:, k]) / width[c] for k, c in _signals(track)])


def with_slow_friction(C: Array, names: Sequence[str], rig: GreyBox, slow: Sequence[SlowFriction]) -> Array:
    """The covariance (names + slow, names + slow) with friction at low speeds beside that at others."""
    follows = np.array([[float(n == each.coulomb) for n in names] for each in slow]).reshape(len(slow), len(names))
    J = np.vstack([np.eye(len(names)), follows])
    out = J @ C @ J.T
    for k, each in enumerate(slow):
        moves = np.concatenate([each.moves, np.zeros(len(names) - each.moves.size)])
        step = J @ moves
        step[len(names) + k] += 1.0
        step *= CLOSE_TO_REST * rig.parameters[each.coulomb].value
        out += np.outer(step, step)
    return out


def _signals(track: Track) -> list[tuple[int, str]]:
    return [(k, track.run.measured[k]) for k in track.run.free]


def _own(problem: Problem, index: int) -> NDArray[np.int64]:
    """Places, among the numbers that matter in a run, of those that it alone knows."""
    return np.array(
        [
            k for k, i in enumerate(problem.sought_in(index))
            if problem.unknowns[i].runs == (index,) and problem.unknowns[i].lower < problem.unknowns[i].upper
        ], dtype=np.int64,
    )  # fmt: skip


def adapted(problem: Problem, index: int, slope: Array, x: Array) -> tuple[Array, Array]:
    """Slopes (N, outputs, sought) of a run whose own numbers follow, by least squares, as they do when it is predicted.

    Those of its own numbers become zero. What else moves the run may stand behind the numbers sought. Samples before
    `score_from` alone are followed where that is set. Beside them, what an error of one sigma of each thing that is
    known of its own numbers beforehand does (N, outputs, priors): it decides the more, the worse the run is explained.
    """
    track, own = problem.tracks[index], _own(problem, index)
    if not own.size:
        return slope, slope[..., :0]
    upto = len(slope) if not track.run.score_from else max(own.size, round(track.run.score_from / track.dt))
    weighted = np.einsum("ab,tbp->tap", track.weighting, slope[:upto])
    A = weighted[..., own].reshape(-1, own.size)
    _, prior = problem.prior_rows(x)
    P = prior[:, problem.sought_in(index)[own]]
    P = P[P.any(axis=1)]
    inverse = pseudo_inverse(A.T @ A + P.T @ P)
    follow = inverse @ (A.T @ weighted.reshape(-1, slope.shape[-1]))
    follow[:, own] = np.eye(own.size)  # so that their own slopes become zero
    return slope - slope[..., own] @ follow, slope[..., own] @ (problem.noise * inverse @ P.T)


def _squares(moves: Array) -> Array:
    """Variance (N, outputs) by independent moves (N, outputs, causes) of one sigma each."""
    return np.sum(moves**2, axis=-1)


def _variance(slope: Array, covariance: Array) -> Array:
    """Variance (N, outputs) that uncertain numbers give the outputs."""
    return np.maximum(np.einsum("tap,pq,taq->ta", slope, covariance, slope, optimize=True), 0.0)


def _width(track: Track, bands: Bands, age: Array, variance: Array) -> dict[str, Array]:
    """Root of what is left over and what the numbers' uncertainty adds, (N,) by signal."""
    horizon = next(iter(track.run.horizons), None)
    widths: dict[str, Array] = {}
    for k, c in _signals(track):
        spread = bands.spread(c, horizon)
        if spread is not None:
            widths[c] = np.sqrt(spread.at(age) ** 2 + variance[:, k])
    return widths


def _spreads(tracks: Sequence[Track], met: Sequence[Sensitivity]) -> dict[str, tuple[Spread, ...]]:
    """What is left over of every signal, by horizon, and never less than counts or a line's width of its picture."""
    kinds: dict[tuple[str, float], list[tuple[Array, Array, float]]] = {}
    for track, run in zip(tracks, met, strict=True):
        horizon = next(iter(track.run.horizons), 0.0)
        for k, c in _signals(track):
            least = max(ROUNDING * track.run.quanta[k], LEAST * float(np.std(track.run.y[:, k])))
            kinds.setdefault((c, horizon), []).append((run.error[:, k], run.age, least))
    spreads: dict[str, tuple[Spread, ...]] = {}
    for (c, horizon), parts in kinds.items():
        error, age = (np.concatenate([part[i] for part in parts]) for i in (0, 1))
        least = min(part[2] for part in parts)
        spreads[c] = (*spreads.get(c, ()), _spread(error**2, age, horizon, least**2))
    return spreads


def _spread(squares: Array, age: Array, horizon: float, least: float) -> Spread:
    """Spread of errors whose `squares` (N,) grow with the square of their `age` (N,), no less than the root of `least`.

    The mean of ``start^2 + growth age^2`` over an early and a late half gives both.
    """
    early, late = squares[age <= horizon / 2], squares[age > horizon / 2]
    if not horizon or not early.size or not late.size:
        both = math.sqrt(max(float(np.mean(squares)), least))
        return Spread(horizon=horizon, start=both, end=both)
    a, b = float(np.mean(age[age <= horizon / 2] ** 2)), float(np.mean(age[age > horizon / 2] ** 2))
    growth = max(0.0, (float(late.mean()) - float(early.mean())) / (b - a))
    start = max(float(squares.mean()) - growth * float(np.mean(age**2)), least)
    return Spread(horizon=horizon, start=math.sqrt(start), end=math.sqrt(start + growth * horizon**2))


def banded(
    plain: RunScore, bands: Bands, rig: GreyBox, run: Run, groups: Mapping[str, Mapping[str, float]],
    estimated: Problem, at: Array,
) -> RunScore:  # fmt: skip
    """The score of a predicted run with the band of each signal.

    Parameters
    ----------
    plain : RunScore
        Of the run.
    rig : GreyBox
        With every number known.
    groups : mapping
        What groups of runs share, by label and name.
    estimated : Problem
        That of the run alone: what is its own was estimated from it, with prior knowledge weighed as there.
    at : array
        The coordinates that were estimated.
    """
    parameters = {n: Parameter(name=n, value=ACTUATOR[n].default) for n in bands.names if n in ACTUATOR}
    parameters |= rig.parameters
    names = [n for n in bands.names if n in parameters and math.isfinite(parameters[n].value)]
    slow = [] if run.filtered else list(slow_friction(rig, run, bands.slow))
    if run.filtered:  # what disturbs a plant between two samples counts, not its numbers
        names = []
    uncertain = {n: replace(parameters[n], estimate=True) for n in names}
    uncertain |= {p.name: p for _, *pair in slow for p in pair}
    problem = formulate(replace(rig, parameters={**rig.parameters, **uncertain}), [run], thin=False, stated=groups)
    problem.weigh_like(estimated)
    if run.filtered and plain.horizon is not None:
        problem = problem.ahead(plain.horizon)
    track, x = problem.tracks[0], problem.place(estimated.values_at(at))
    variance = np.zeros(plain.y.shape)
    age = np.full(len(plain.y), plain.horizon or 0.0)
    if not run.filtered:
        problem.settle_steps(x)
        met = sensitivity(problem, 0, x)
        age, variance = met.age, np.full(plain.y.shape, math.inf)
        if met.finite:
            daily = of_another_day(bands, run)
            moves = daily_moves(problem, x, daily) if daily else met.slope[..., :0]
            slope, start = adapted(problem, 0, np.concatenate([met.slope, moves], axis=-1), x)
            slope, moves = np.split(slope, [met.slope.shape[-1]], axis=-1)
            uncertain_by = [*bands.names, *(stiction.name for _, stiction, _ in slow)]
            C = with_slow_friction(bands.covariance, bands.names, rig, [each for each, *_ in slow])
            places = [uncertain_by.index(problem.unknowns[i].name) if problem.unknowns[i].shared else -1
                      for i in problem.sought_in(0)]  # fmt: skip
            shared = np.flatnonzero(np.array(places) >= 0)
            rows = np.array(places)[shared]
            value = problem.value(x)
            natural = np.array([1 / value[i] if problem.unknowns[i].log else 1.0 for i in problem.sought_in(0)])
            variance = _variance((slope * natural)[..., shared], C[np.ix_(rows, rows)])
            variance += _squares(moves) + _squares(start)
    width = _width(track, bands, age, np.nan_to_num(variance, nan=math.inf))
    return replace(
        plain, band={c: bands.quantile * w for c, w in width.items()}, beyond=beyond(rig, run, bands.reached)
    )
