"""In which coordinates are a rig's numbers sought? Sizes by their logarithm; frictions and lags may vanish."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from upright.errors import BadInput
from upright.identification.model.rig import Parameter, Rig

Array = NDArray[np.float64]


@dataclass(frozen=True, kw_only=True, eq=False)
class Coordinates:
    """Unknowns of a search, one number each: ``value = size exp(z)``, or ``size z`` for those that may vanish.

    `names` include those known within a tolerance, `expected` and `tolerance` [in z] of which are rows of the least
    squares; the others have infinite tolerance. `base` holds every number of the rig.
    """

    names: tuple[str, ...]
    size: Array
    log: NDArray[np.bool_]
    start: Array
    lower: Array
    expected: Array
    tolerance: Array
    base: Mapping[str, float]

    def values(self, z: Array) -> dict[str, float]:
        """Every number of the rig at one point."""
        there = self._there(z)
        return {**self.base, **{n: float(v) for n, v in zip(self.names, there, strict=True)}}

    def lanes(self, z: Array) -> dict[str, Any]:
        """The same at many points (lanes, n): arrays of those sought."""
        return {**self.base, **dict(zip(self.names, self._there(z).T, strict=True))}

    def slope(self, z: Array) -> Array:
        """Change of the values with z."""
        return np.where(self.log, self._there(z), self.size)

    def known(self, z: Array) -> Array:
        """Weighed distance (lanes, rows) from what was known."""
        rows = np.isfinite(self.tolerance)
        return (z[:, rows] - self.expected[rows]) / self.tolerance[rows]

    @property
    def bounded(self) -> tuple[str, ...]:
        """Names of those known within a tolerance."""
        return tuple(n for n, t in zip(self.names, self.tolerance.tolist(), strict=True) if math.isfinite(t))

    @property
    def priors(self) -> int:
        """How many of the unknowns are known within a tolerance."""
        return len(self.bounded)

    def scattered(self, rng: np.random.Generator, spread: float) -> Array:
        """Another start: every unknown off by a factor, those known by their tolerance."""
        noise = rng.normal(size=self.start.size)
        off = np.where(np.isfinite(self.tolerance), self.tolerance, spread) * noise
        moved = np.where(self.log, self.start + off, self.start * np.exp(off))
        return np.maximum(moved, np.where(self.log, -np.inf, 1e-3 * np.abs(self.start)))

    def _there(self, z: Array) -> Array:
        with np.errstate(over="ignore"):
            return self.size * np.where(self.log, np.exp(np.minimum(z, 50.0)), z)


def coordinates(rig: Rig, *, magnitude: bool = False) -> Coordinates:
    """Coordinates of a rig's unknowns; `magnitude` takes those that the magnitude of a linear model shows, all by their
    logarithm: no dry friction, no delay, nothing that is known within a tolerance.

    Raises
    ------
    BadInput
        When nothing is sought, or a guess is no size.
    """  # fmt: skip
    dry = {n for j in rig.plant.joints for n in (j.coulomb, j.quadratic, j.stiction, j.stribeck_speed, j.presliding)}
    found: list[tuple[Parameter, bool]] = []
    base = {n: p.value for n, p in rig.parameters.items()}
    for name, p in rig.parameters.items():
        if magnitude and name in dry:
            base[name] = 0.0
        if not p.estimate and (p.uncertainty <= 0 or magnitude):
            continue
        if magnitude and (name in dry or name in ("actuator.delay", "actuator.lag")):
            continue
        always = name == "actuator.gain" or (name in rig.plant.names() and rig.plant.quantity(name).open_lower)
        if not (p.value > 0 and math.isfinite(p.value)):
            raise BadInput(f"{name} is sought and needs a guess above 0, got {p.value:g}; give its order of magnitude.")
        found.append((p, always or magnitude))
    if not found:
        raise BadInput("nothing is sought; name at least one parameter to estimate.")
    size = np.array([p.value for p, _ in found])
    log = np.array([always for _, always in found])
    one = np.where(log, 0.0, 1.0)
    tolerance = np.array([p.uncertainty / p.value if p.uncertainty > 0 else math.inf for p, _ in found])
    return Coordinates(
        names=tuple(p.name for p, _ in found), size=size, log=log, start=one, lower=np.where(log, -np.inf, 0.0),
        expected=one, tolerance=tolerance, base=base,
    )  # fmt: skip
