"""Friction from the energy that a swing loses between its turning points, by arithmetic.

It falls by Coulomb's level times the path, the viscous coefficient times the integral of the squared speed, and the
drag times the integral of the cubed speed: a linear regression gives friction within a few percent.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from upright.identification.model.rig import Rig
from upright.identification.search.inverse_start import Sample
from upright.physics.actuator import drive_force
from upright.physics.equations import evaluate
from upright.signals.turning import turning_points

Array = NDArray[np.float64]


def friction_from_energy(rig: Rig, samples: list[Sample], values: Mapping[str, float]) -> dict[str, float]:
    """Friction terms to estimate, from the energy lost between turning points; empty when no run can tell.

    Masses and stiffnesses are taken from `values`; what comes back scales with them.
    """
    from scipy.optimize import nnls

    plant, derived = rig.plant, rig.plant.derived_for(values)
    estimated = set(rig.estimated)
    kinds: list[tuple[str, int, int]] = []
    for joint in derived.joints:
        kinds += [(joint.coulomb, joint.coordinate, 1), (joint.quadratic, joint.coordinate, 3)]
    kinds = [k for k in kinds if k[0]]
    viscous = [n for n in derived.parameters if _mentions(derived.power_lost, n)]
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
        energy = np.broadcast_to(evaluate(derived.kinetic, scope) + evaluate(derived.potential, scope), s.q.shape[1:])
        drives = [list(derived.coordinates).index(d.on) for d in plant.inputs]
        power = np.einsum("kt,kt->t", drive_force(plant, here, s.u, s.v, s.dt), s.v[drives])
        cuts = _cuts(s)
        if cuts.size < 5:
            continue
        columns: dict[str, Array] = {}
        for n in viscous:
            columns[n] = evaluate(derived.power_lost, {**scope, **dict.fromkeys(viscous, 0.0), n: 1.0}) + 0 * power
        for name, i, order in kinds:
            columns[name] = np.abs(s.v[i]) ** order
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
    seen = norms > 0
    if not seen.any():
        return {}
    solution = nnls(A[:, seen] / norms[seen], b)[0] / norms[seen]
    return dict(zip([n for n, k in zip(sought, seen, strict=True) if k], (float(z) for z in solution), strict=True))


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


def _mentions(expression: str, name: str) -> bool:
    import re

    return re.search(rf"\b{re.escape(name)}\b", expression) is not None
