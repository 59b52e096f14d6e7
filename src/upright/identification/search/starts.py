"""Start values by arithmetic: from inverse dynamics, then friction from the energy that a swing loses.

The model's accelerations, computed from the smoothed motion, are compared with the measured ones; both have gone
through the same smoothing. Masses and forces that only scale together are left where the guess put them.

Between its turning points a swing loses Coulomb's level times the path, the viscous coefficient times the integral of
the squared speed, and the drag times the integral of the cubed speed: a linear regression gives friction within a few
percent.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, lru_cache

import numpy as np
from numpy.typing import NDArray

from upright.identification.model.grey_box import GreyBox, base_values
from upright.identification.model.runs import Run
from upright.identification.problem.normal_equations import Normal, finite
from upright.identification.problem.unknowns import Unknown, shared_unknowns
from upright.identification.search.descent import Descent, descend
from upright.physics.actuator import ACTUATOR, drive_force
from upright.physics.equations import Derived, evaluated, mass_and_force
from upright.physics.plant import Plant
from upright.signals.smoothing import (
    dominant_period,
    middle,
    scatter,
    smoothed,
    smoothing_width,
)
from upright.signals.stretches import turning_points

Array = NDArray[np.float64]


@dataclass(frozen=True, kw_only=True)
class Sample:
    """Smoothed motion of one run: `q`, `v`, `a`, (coordinates, N) each, commands `u` (inputs, N), free coordinates.

    `fades` are speeds [SI] below which the sign of a speed is not believed; `width` samples were smoothed over.
    """

    run: Run
    dt: float
    q: Array
    v: Array
    a: Array
    u: Array
    free: tuple[int, ...]
    fades: Array
    width: int
    edge: int
    period: float

    @cached_property
    def kept(self) -> slice:
        """Samples away from the ends, whose polynomials are one-sided."""
        edge = min(self.edge, self.q.shape[1] // 4)
        return slice(edge, self.q.shape[1] - edge)

    @cached_property
    def measured(self) -> tuple[Array, Array]:
        """Accelerations of the free coordinates that are kept, (free, T), and how much each scatters, (free, 1)."""
        a = self.a[list(self.free)]
        return a[:, self.kept], np.array([[scatter(row)] for row in a])

    @cached_property
    def force(self) -> Callable[[type[Plant], tuple[tuple[str, float], ...]], Array]:
        """Force of every input (inputs, N) for a plant and its drive's numbers: slopes by others need none afresh."""

        @lru_cache(maxsize=4)
        def forced(plant: type[Plant], drive: tuple[tuple[str, float], ...]) -> Array:
            return drive_force(plant, dict(drive), self.u, self.v, self.dt)

        return forced


def observe(rig: GreyBox, run: Run, *, flips: Mapping[str, float] | None = None,
            turns: Mapping[str, float] | None = None) -> Sample | None:  # fmt: skip
    """Smoothed motion of a run, None when a coordinate that moves freely was not measured.

    `flips` multiplies measured coordinates, `turns` is added to them: what if the sensor's convention were another?
    """
    plant, dt, n = rig.plant, run.period, run.t.size
    coordinates = [c.name for c in plant.coordinates]
    free = tuple(i for i, c in enumerate(coordinates) if c not in run.held)
    if not free or any(coordinates[i] not in run.measured for i in free) or n < 30:
        return None
    resolution = dict(zip(run.measured, run.quanta, strict=True))
    signal = {c: run.y[:, k] for k, c in enumerate(run.measured)}
    period = min(dominant_period(signal[coordinates[i]], dt) for i in free)
    width = max(smoothing_width(signal[coordinates[i]], dt, period, resolution[coordinates[i]]) for i in free)

    def counted(c: str) -> Array:
        if c in run.held and np.ndim(run.held[c]) == 0:
            return np.full(n, run.held[c], dtype=np.float64)
        y = np.asarray(run.held[c]) if c in run.held else signal[c]
        return (flips or {}).get(c, 1.0) * y + (turns or {}).get(c, 0.0)

    motion = smoothed([counted(c) for c in coordinates], dt, width)
    since = run.t - run.t[0]
    acting = (since >= run.guesses.get("input_start", -math.inf)) & (since < run.guesses.get("input_end", math.inf))
    u = np.where(acting, run.u.T, 0.0)
    if run.loop is not None:
        u = u + run.loop.follow(motion.q.T, coordinates)[0]
    return Sample(run=run, dt=dt, q=motion.q, v=motion.v, a=motion.a, u=u, free=free, fades=motion.fades, width=width,
                  edge=motion.edge, period=period)  # fmt: skip


def samples_of(
    rig: GreyBox,
    runs: Sequence[Run],
    *,
    most: int | None = None,
    flips: Mapping[str, float] | None = None,
    turns: Mapping[str, float] | None = None,
) -> list[Sample]:
    """Smoothed motion of every run that allows it, long runs thinned to at most `most` samples, 1500 or more each."""
    samples: list[Sample] = []
    most = max(1500, 6000 // max(len(runs), 1)) if most is None else most
    for run in runs:
        k = -(-run.t.size // most)
        thin = run
        if k > 1:
            loop = run.loop and replace(run.loop, every=k * run.loop.every)
            thin = replace(run.samples(slice(None, None, k)), loop=loop)
        sample = observe(rig, thin, flips=flips, turns=turns)
        if sample is not None:
            samples.append(sample)
    return samples


def model_accelerations(plant: type[Plant], values: Mapping[str, float], sample: Sample) -> Array:
    """Accelerations (free coordinates, N) of the model at the measured states, those of held coordinates given."""
    derived = plant.derived_for(values)
    force = sample.force(plant, tuple((n, values[n]) for n in ACTUATOR))
    states = {n: x for i, c in enumerate(derived.coordinates) for n, x in ((c, sample.q[i]), (f"{c}_dot", sample.v[i]))}
    M, f = mass_and_force(derived, {**states, **values, **dict(zip(derived.inputs, force, strict=True))})
    n = f.shape[1]
    for joint in derived.joints:
        direction = np.array(joint.direction)
        v, fade = direction @ sample.v, float(np.linalg.norm(direction * sample.fades))
        if joint.coulomb and fade > 0:
            f -= values[joint.coulomb] * np.outer(np.tanh(v / fade), direction)
        if joint.quadratic:
            f -= values[joint.quadratic] * np.outer(v * np.abs(v), direction)
    free = list(sample.free)
    held = [i for i in range(n) if i not in free]
    if held:
        f = f - np.einsum("tij,jt->ti", M[:, :, held], sample.a[held])
        M, f = M[:, free][:, :, free], f[:, free]
    return np.asarray(np.linalg.solve(M, f[:, :, None])[:, :, 0].T, dtype=np.float64)


def disagreement(rig: GreyBox, values: Mapping[str, float], sample: Sample) -> Array:
    """Weighted difference (free coordinates, T) between the model's accelerations and the measured ones."""
    a = model_accelerations(rig.plant, {**values, **sample.run.known}, sample)
    measured, size = sample.measured
    return (_same_smoothing(a, sample.width)[:, sample.kept] - measured) / size


def _same_smoothing(a: Array, width: int) -> Array:
    """Rows of `a` through the polynomials that smoothed the motion; the ends are not used."""
    from scipy.ndimage import correlate1d

    return correlate1d(a, middle(width - (1 - width % 2)), axis=1, mode="nearest")


@dataclass(frozen=True, kw_only=True)
class Agreement:
    """Numbers that agree best with the accelerations, and the share of their variance left unexplained, 0 to 1."""

    values: dict[str, float]
    unexplained: float


def regress(rig: GreyBox, samples: list[Sample], *, tolerance: float = 1e-5) -> Agreement:
    """Least squares on the accelerations over the numbers to estimate, to a relative `tolerance` of their squares."""
    unknowns = [u for u in shared_unknowns(rig) if u.estimated]
    base = base_values(rig)
    count = sum(s.measured[0].size for s in samples)
    lower, upper = (np.array([u.bounds[k] for u in unknowns]) for k in (0, 1))
    scale = np.array([u.scale for u in unknowns])
    log = np.array([u.log for u in unknowns], dtype=bool)

    def values(x: Array) -> dict[str, float]:
        return base | {u.name: math.exp(z) if u.log else float(z) for u, z in zip(unknowns, x, strict=True)}

    def residual(x: Array) -> Array:
        try:
            with np.errstate(all="ignore"):
                return np.concatenate([disagreement(rig, values(x), s).ravel() for s in samples])
        except np.linalg.LinAlgError:
            return np.full(count, np.inf)

    def descended(start: Mapping[str, float], scale: Array) -> Descent:
        x0 = np.clip([_coordinate(u, start[u.name]) for u in unknowns], lower, upper)

        def pulled(x: Array) -> Array:
            # a faint pull towards the start keeps numbers that the accelerations cannot see where they were
            return np.concatenate([residual(x), 1e-3 * math.sqrt(count) * (x - x0) / scale])

        def normal(x: Array) -> Normal:
            return Normal.by_differences(pulled, x, 1e-5 * np.where(log, 1.0, np.maximum(np.abs(x), scale)))

        return descend(normal, x0, lower, upper, tolerance=tolerance, limit=40)

    end = descended(base, scale)
    sized = _proportionate(rig, samples[0])
    if sized:
        sizes = [1.0 if u.log else abs(sized.get(u.name, 0.0)) for u in unknowns]
        other = descended(base | sized, np.where(sizes, sizes, scale))
        end = other if other.normal.cost < PLAINLY * end.normal.cost else end
    r = residual(end.x)
    return Agreement(values=values(end.x), unexplained=float(np.mean(r * r)) if finite(r) else math.inf)


PLAINLY = 0.9
"""Share of the squares that another start must leave at most to be followed."""
BESIDE = 30.0
"""Factor by which a guess may be larger or smaller than what the motion asks for."""


def _proportionate(rig: GreyBox, sample: Sample) -> dict[str, float]:
    """Inertias, springs, friction and gain of one size, as the sample's period, speeds and accelerations have it.

    Nothing where the guesses are of that size. Where one is thousands of times beside the inertia that is given, the
    descent from there ends in a valley.
    """
    held = {p.unit: p.value for p in rig.parameters.values() if not p.estimate and p.value > 0}
    w, a = 2 * math.pi / sample.period, float(np.sqrt(np.mean(sample.measured[0] ** 2)))
    u = float(np.sqrt(np.mean(sample.u**2)))
    sizes, friction = dict[str, float](), dict[str, float]()
    for inertia, force, spring, damping in (
        ("kg", "N", "N/m", "N s/m"), ("kg m^2", "N m", "N m/rad", "N m s/rad"),
    ):  # fmt: skip
        if m := held.get(inertia):
            sizes |= {inertia: m, spring: m * w**2}
            sizes |= {f"{of}/{unit}": m * a / u for of in (force, f"({force})") for unit in ("V", "A") if u}
            friction |= {damping: 0.1 * m * w, force: 0.1 * m * a}
    sizes |= friction
    sought = {p.name: p for p in rig.parameters.values() if p.estimate and p.unit in sizes}
    firm = [p for p in sought.values() if p.unit not in friction]  # which may be as small as it likes
    if all(sizes[p.unit] / BESIDE < abs(p.value) < sizes[p.unit] * BESIDE for p in firm):
        return {}
    return {name: math.copysign(sizes[p.unit], p.value or 1.0) for name, p in sought.items()}


def _coordinate(u: Unknown, value: float) -> float:
    return math.log(value) if u.log and value > 0 else min(max(value, u.lower), u.upper)


def friction_from_energy(rig: GreyBox, samples: list[Sample], values: Mapping[str, float]) -> dict[str, float]:
    """Friction terms to estimate, from the energy lost between turning points; empty when no run can tell.

    Masses and stiffnesses are taken from `values`; what comes back scales with them.
    """
    from scipy.optimize import nnls

    plant, derived = rig.plant, rig.plant.derived_for(values)
    estimated = set(rig.estimated)
    kinds: list[tuple[str, tuple[float, ...], int]] = []
    for joint in derived.joints:
        kinds += [(joint.coulomb, joint.direction, 1), (joint.quadratic, joint.direction, 3)]
    kinds = [k for k in kinds if k[0]]
    viscous = viscous_terms(derived)
    sought = [n for n in (*viscous, *(k[0] for k in kinds)) if n in estimated]
    if not sought:
        return {}
    matrix: list[Array] = []
    lost: list[Array] = []
    for s in samples:
        if any(np.ndim(h) for h in s.run.held.values()) or s.run.known.keys() & set(sought):
            continue
        here = {**values, **s.run.known}
        scope = dict(here)
        for i, c in enumerate(derived.coordinates):
            scope[c], scope[f"{c}_dot"] = s.q[i], s.v[i]  # type: ignore[assignment]
        energy = np.broadcast_to(evaluated(derived.kinetic, scope) + evaluated(derived.potential, scope), s.q.shape[1:])
        drives = [list(derived.coordinates).index(d.on) for d in plant.inputs]
        power = np.einsum("kt,kt->t", drive_force(plant, here, s.u, s.v, s.dt), s.v[drives])
        cuts = _cuts(s)
        if cuts.size < 5:
            continue
        columns: dict[str, Array] = {}
        for n in viscous:
            columns[n] = evaluated(derived.power_lost, {**scope, **dict.fromkeys(viscous, 0.0), n: 1.0}) + 0 * power
        for name, direction, order in kinds:
            columns[name] = np.abs(np.array(direction) @ s.v) ** order
        known = sum((here[n] * columns[n] for n in columns if n not in estimated), np.zeros_like(power))
        size = float(np.ptp(energy[cuts])) or 1.0

        def between(p: Array, cuts: NDArray[np.int64] = cuts, dt: float = s.dt) -> Array:
            path = np.concatenate([[0.0], np.cumsum((p[1:] + p[:-1]) * dt / 2)])
            return np.diff(path[cuts])

        lost.append((between(power - known) - np.diff(energy[cuts])) / size)
        matrix.append(np.stack([between(columns[n]) for n in sought], axis=1) / size)
    if not lost:
        return {}
    A, b = np.concatenate(matrix), np.concatenate(lost)
    norms = np.linalg.norm(A, axis=0)
    moves = norms > 0
    if not moves.any():
        return {}
    solution = nnls(A[:, moves] / norms[moves], b)[0] / norms[moves]
    return dict(zip([n for n, k in zip(sought, moves, strict=True) if k], (float(z) for z in solution), strict=True))


def _cuts(s: Sample) -> NDArray[np.int64]:
    """Where the energy balance is drawn: at turning points of a lone coordinate, every half period otherwise."""
    n = s.q.shape[1]
    edge = min(s.edge, n // 4)
    if len(s.free) == 1:
        i = s.free[0]
        cuts = turning_points(s.q[i], 0.01 * float(np.ptp(s.q[i])))
        cuts = cuts[cuts > 0]
        cuts -= (s.v[i][cuts] > 0) != (s.v[i][cuts - 1] > 0)  # the last sample on the way there
        return cuts[(cuts >= edge) & (cuts < n - edge)]
    return np.arange(edge, n - edge, max(1, int(s.period / 2 / s.dt)), dtype=np.int64)


def viscous_terms(derived: Derived) -> list[str]:
    """Parameters that Rayleigh's dissipation mentions."""
    return [n for n in derived.parameters if _mentions(derived.power_lost, n)]


def _mentions(expression: str, name: str) -> bool:
    import re

    return re.search(rf"\b{re.escape(name)}\b", expression) is not None
