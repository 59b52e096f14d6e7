"""Harmonic balance: the response that the equations of motion give, dry friction and amplitude included.

A periodic motion q(t) that was measured is put into the equations: what they need beyond their linear part, and what
dry friction takes, is projected on the frequency. With ``Z = -omega^2 M + i omega D + K`` of small motions and N the
projection of the rest, ``Z q = G H(omega) u - N(q)`` is exact in steady state, whatever the amplitude. Coulomb friction
enters as the viscous friction that it amounts to (describing function, with the harmonics that were measured).
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from itertools import product
from typing import Any

import numpy as np
from numpy.typing import NDArray

from upright.errors import BadInput, nearest
from upright.identification.frequency.response import FrequencyResponse, describing
from upright.physics import Plant
from upright.physics.equations import needed_force, small_motions

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]

INSTANTS = 32
"""Per period of a sine; a product of up to six of its overtones is projected exactly."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Balance:
    """A kind of plant, and the response that it is to explain.

    Attributes
    ----------
    at : str
        Equilibrium about which it was measured.
    data : FrequencyResponse
        Its outputs are coordinates of the plant.
    linear : bool
        Leave out dry friction and amplitude: the plain linear model.
    plain_friction : bool
        Leave out dry friction alone.
    evaluations : list of int
        Models computed so far, one number.
    """

    plant: type[Plant]
    at: str
    data: FrequencyResponse
    linear: bool = False
    plain_friction: bool = False
    evaluations: list[int] = field(default_factory=lambda: [0])

    def __post_init__(self) -> None:
        names = [c.name for c in self.plant.coordinates]
        for name in self.data.outputs:
            if name not in names:
                raise BadInput(f"{self.plant.__name__} has no coordinate '{name}'; {nearest(name, names)}")
        if len(self.plant.inputs) != 1:
            raise BadInput(f"a frequency response is fitted for one input; this plant has {len(self.plant.inputs)}.")

    @cached_property
    def columns(self) -> list[int]:
        """Coordinate of each output."""
        names = [c.name for c in self.plant.coordinates]
        return [names.index(y) for y in self.data.outputs]

    @cached_property
    def whole(self) -> bool:
        """Whether every coordinate was measured, and how far it moved, so that amplitudes can be considered."""
        known = self.data.drive.all() and len(set(self.columns)) == len(self.plant.coordinates)
        return bool(known) and not self.linear

    @cached_property
    def _motion(self) -> tuple[Any, Any, Any, Any]:
        """Coordinates, speeds and accelerations (n, cases, instants), and what projects them on each frequency."""
        w = self.data.omega
        lines = np.zeros((w.size, len(self.columns)), dtype=np.complex128)
        lines[:, self.columns] = self.data.response * self.data.drive[:, None]
        if self.data.together:
            base = _base(w)
            count = 2 ** math.ceil(math.log2(4 * w[-1] / base))
            t = 2 * math.pi / base * np.arange(count) / count
            turn = np.exp(1j * w[:, None] * t)
            q, v, a = (np.einsum("fn,ft->nt", f * lines, turn).real[:, None] for f in _orders(w))
            return q, v, a, 2 / count * np.conj(turn)
        turn = np.exp(2j * math.pi * np.arange(INSTANTS) / INSTANTS)
        heard = np.zeros((w.size, lines.shape[1], self.data.overtones.shape[2]), dtype=np.complex128)
        heard[:, self.columns] = self.data.overtones
        q, v, a = ((f * lines).T[:, :, None] * turn for f in _orders(w))
        for k in range(heard.shape[2]):
            one = heard[:, :, k].T[:, :, None] * turn ** (k + 2)
            s = 1j * (k + 2) * w[None, :, None]
            q, v, a = q + one, v + s * one, a + s**2 * one
        return np.real(q), np.real(v), np.real(a), 2 / INSTANTS * np.conj(turn)[None, :]

    def response(self, values: Mapping[str, Any], lanes: int = 1) -> Complex:
        """Response (lanes, F, n) of plants with these numbers, `actuator.*` included, each a number or (lanes,)."""
        self.evaluations[0] += lanes
        derived = self.plant.derived_for(values)
        w, data = self.data.omega, self.data
        point = {c.name: float(self.plant.equilibria[self.at].get(c.name, 0.0)) for c in self.plant.coordinates}
        parts = small_motions(derived, {**values, **point}, (lanes,) if lanes > 1 else ())
        M, D, K, G = (part.reshape(lanes, *part.shape[-2:]) for part in parts)
        driven = int(np.argmax(np.abs(G[0, :, 0])))
        D[:, driven, driven] += values.get("actuator.slope", 0.0)
        s = 1j * w[None, :, None, None]
        Z = s**2 * M[:, None] + s * D[:, None] + K[:, None]
        force = G[:, None, :, 0] * self.drive(values, lanes)[:, :, None]
        if self.whole:
            force = force - self._beyond(derived, values, point, Z, lanes) / data.drive[None, :, None]
        if not (self.linear or self.plain_friction):
            for joint in derived.joints:
                acting = [i for i, factor in enumerate(joint.direction) if factor]
                if joint.coulomb and set(acting) <= set(self.columns):
                    level = np.reshape(np.broadcast_to(values.get(joint.coulomb, 0.0), (lanes,)), (lanes, 1))
                    dry = 1j * w * self._dry(np.array(joint.direction)) * level
                    for i, j in product(acting, acting):
                        Z[:, :, i, j] += joint.direction[i] * joint.direction[j] * dry
        answer = np.linalg.solve(Z, force[..., None])[..., 0][:, :, self.columns]
        return np.asarray(answer, dtype=np.complex128)

    def _dry(self, direction: Array) -> Complex:
        """Viscous equivalent (F,) of unit Coulomb friction at a joint, from the motion that was measured."""
        factors = direction[self.columns]
        if np.count_nonzero(factors) == 1 and factors.max() == 1.0:
            return self.data.dry[:, int(np.argmax(factors))]
        if not self.data.drive.all():
            return np.zeros(self.data.omega.size, dtype=np.complex128)
        amplitude = (self.data.response * self.data.drive[:, None]) @ factors  # overtones of a combination are not kept
        return describing(self.data.omega, np.abs(amplitude)[:, None])[:, 0]

    def drive(self, values: Mapping[str, Any], lanes: int = 1) -> Complex:
        """Force per unit of command (lanes, F): gain, delay, lag, and the hold between samples."""
        s = 1j * self.data.omega[None, :]
        gain, delay, lag = (
            np.reshape(np.broadcast_to(values.get(f"actuator.{n}", d), (lanes,)), (lanes, 1))
            for n, d in (("gain", 1.0), ("delay", 0.0), ("lag", 0.0))
        )
        held = self.data.hold * s
        hold = -np.expm1(-held) / held if self.data.hold else np.ones_like(s)
        return np.asarray(gain * hold * np.exp(-s * delay) / (1 + s * lag), dtype=np.complex128)

    def _beyond(self, derived: Any, values: Mapping[str, Any], point: Mapping[str, float], Z: Any, lanes: int) -> Any:
        """Force that this motion takes beyond what small motions and dry friction take, at each frequency."""
        q, v, a, project = self._motion
        wide = {n: np.reshape(x, (-1, 1, 1)) if np.ndim(x) else x for n, x in values.items()}
        still = np.array([point[c] for c in derived.coordinates])
        tau = needed_force(derived, wide, q[:, None] + still[:, None, None, None], v[:, None], a[:, None])
        if self.data.together:
            first = np.einsum(
                "nlt,ft->lfn", np.broadcast_to(tau[:, :, 0], (tau.shape[0], lanes, tau.shape[3])), project
            )
        else:
            first = np.moveaxis(tau @ project[0], 0, -1)
        lines = np.zeros((self.data.omega.size, len(self.columns)), dtype=np.complex128)
        lines[:, self.columns] = self.data.response * self.data.drive[:, None]
        return first - (Z @ lines[None, :, :, None])[..., 0]


def _orders(w: Array) -> tuple[Complex, Complex, Complex]:
    s = np.asarray(1j * w[:, None], dtype=np.complex128)
    return np.ones_like(s), s, np.asarray(s * s)


def _base(w: Array) -> float:
    """Largest frequency of which all are whole multiples, to a thousandth of a line."""
    for parts in range(1, 2000):
        base = float(w[0]) / parts
        if np.all(np.abs(w / base - np.round(w / base)) < 1e-3):
            return base
    raise BadInput("Frequencies driven together must be whole multiples of one; were they measured one by one?")
