"""A rig: the plant, and which of its numbers are known, assumed or to be estimated."""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping
from dataclasses import MISSING, dataclass, field, fields, replace

from upright.errors import BadInput
from upright.physics import Plant
from upright.physics.actuator import ACTUATOR

NOISE = "noise."
"""Before the name of a coordinate: root of the density of a random force on it, which a Kalman filter allows for."""

SUBSTEPS = 100
"""Most integration steps within one sample; at order 4, ten make an error 10^4 times less."""


@dataclass(frozen=True, kw_only=True)
class Parameter:
    """One number of the rig: known, known to within `uncertainty` (one sigma), or to estimate from `value`.

    An `assumed` one is a convention: the report says what rests on it.
    """

    name: str
    value: float
    unit: str = "1"
    meaning: str = ""
    estimate: bool = False
    lower: float = -math.inf
    upper: float = math.inf
    uncertainty: float = 0.0
    assumed: bool = False


@dataclass(frozen=True, kw_only=True)
class GreyBox:
    """A plant with the known and the estimated parameters of itself and its actuator.

    The plant may be `guessed`: its columns suit it, and it was not specified. `assumed_scales` are counts per turn or
    metre that nobody measured, by what a study calls them, of columns in counts.
    """

    plant: type[Plant]
    parameters: Mapping[str, Parameter]
    substeps: int = 1
    guessed: bool = False
    assumed_scales: Mapping[str, float] = field(default_factory=dict[str, float])

    @property
    def estimated(self) -> tuple[str, ...]:
        """Names of the parameters to estimate, in order."""
        return tuple(n for n, p in self.parameters.items() if p.estimate)

    def bounds(self, name: str) -> tuple[float, float]:
        """Bounds of one of the `parameters`, those of the plant's own quantity included."""
        p = self.parameters[name]
        if name not in self.plant.names():
            return p.lower, p.upper
        q = self.plant.quantity(name)
        return max(p.lower, q.lower), min(p.upper, q.upper)

    def with_values(self, values: Mapping[str, float]) -> GreyBox:
        """The rig with every number known: `values` by name, the rest as it stands."""
        return self._known({n: float(values.get(n, p.value)) for n, p in self.parameters.items()})

    def without(self, names: Collection[str]) -> GreyBox:
        """The rig with some parameters known to do nothing."""
        return self._known({n: neutral(self.plant, n) for n in self.parameters if n in names})

    def _known(self, values: Mapping[str, float]) -> GreyBox:
        known = {n: replace(self.parameters[n], value=v, estimate=False, uncertainty=0.0) for n, v in values.items()}
        return replace(self, parameters={**self.parameters, **known})


def neutral(plant: type[Plant], name: str) -> float:
    """Value at which a parameter does nothing: the default of the plant or of the actuator, zero without one."""
    return _defaults(plant).get(name, 0.0)


def base_values(rig: GreyBox) -> dict[str, float]:
    """Value of every parameter of plant and actuator, defaults filled in.

    Raises
    ------
    BadInput
        When the plant needs a parameter that the rig does not name.
    """
    values = _defaults(rig.plant) | {n: p.value for n, p in rig.parameters.items()}
    missing = [n for n in rig.plant.names() if n not in values]
    if missing:
        raise BadInput(
            f"{rig.plant.__name__} needs a value or a guess of {', '.join(missing)}, none came; "
            f"add {'it' if len(missing) == 1 else 'them'} to the parameters of the rig."
        )
    return values


def _defaults(plant: type[Plant]) -> dict[str, float]:
    values = {n: what.default for n, what in ACTUATOR.items()}
    return values | {f.name: float(f.default) for f in fields(plant) if f.default is not MISSING}  # type: ignore[arg-type]
