"""What stands between a law and a plant? A drive with its limit, encoders with their counts, a servo period."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from upright.errors import BadInput
from upright.physics import Linear, Plant

Array = NDArray[np.float64]


@dataclass(frozen=True, kw_only=True)
class ServoRig:
    """A plant with one input as a servo sees it.

    Attributes
    ----------
    name : str
        As a reader of the report knows it.
    plant : Plant
    gain : float
        Force per unit of command.
    limit : float
        Largest command, in its unit.
    converter : float
        Smallest step of the command.
    delay : float
        From a sample of the encoders to its command at work, computation included [s].
    lag : float
        Time constant of the drive [s].
    offset : float
        Command that the drive adds by itself.
    unit : str
        Of the command.
    counts : tuple of float
        Encoder counts per m or rad, one for each coordinate.
    scales : tuple of float
        What the encoders show over what is true; 1 where the counts per unit are as said.
    period : float
        Servo period [s].
    travel : float
        How far the driven coordinate may go either way before a stop or a cable ends it [m or rad].
    seed : int
        Which rig of the make; 0 is the one as designed.
    """

    name: str
    plant: Plant
    gain: float
    limit: float
    counts: tuple[float, ...]
    period: float
    converter: float = 0.0
    delay: float = 0.0
    lag: float = 0.0
    offset: float = 0.0
    unit: str = "V"
    scales: tuple[float, ...] = ()
    travel: float = math.inf
    seed: int = 0

    def __post_init__(self) -> None:
        n = len(self.plant.coordinates)
        if len(self.plant.inputs) != 1:
            raise BadInput(f"a rig is driven by one input; {self.name} has {len(self.plant.inputs)}.")
        if len(self.counts) != n or any(not c > 0 for c in self.counts):
            raise BadInput(f"a rig with {n} coordinates needs {n} positive numbers of counts, got {self.counts}.")
        if self.scales and len(self.scales) != n:
            raise BadInput(f"a rig with {n} coordinates needs {n} scales of its encoders, got {self.scales}.")
        for name in ("limit", "period"):
            if not (getattr(self, name) > 0 and math.isfinite(getattr(self, name))):
                raise BadInput(f"the {name} of a rig must be positive and finite, got {getattr(self, name):g}.")

    @property
    def drive(self) -> Mapping[str, float]:
        """The actuator by the names of `upright.simulation.simulate`."""
        return {
            "actuator.gain": self.gain,
            "actuator.limit": self.limit,
            "actuator.delay": self.delay,
            "actuator.lag": self.lag,
            "actuator.offset": self.offset,
        }

    @property
    def quantum(self) -> Array:
        """Resolution of each encoder [m or rad], shape (coordinates,)."""
        return 1.0 / np.array(self.counts)

    @property
    def shown(self) -> Array:
        """What each encoder shows over what is true, shape (coordinates,)."""
        return np.array(self.scales) if self.scales else np.ones(len(self.counts))

    def linear(self, at: str) -> Linear:
        """Model about an equilibrium, from the command to the coordinates; dry friction, drive and counts left out."""
        model = self.plant.linear(at)
        return replace(model, B=model.B * self.gain)

    def changed(self, **parameters: float) -> ServoRig:
        """The same rig with other parameters of its plant."""
        return replace(self, plant=self.plant.replace(**parameters))
