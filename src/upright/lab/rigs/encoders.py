"""What does a log of a hanging rig, driven from rest, say of its encoders?"""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np

from upright.control import Rig
from upright.control.sensors import Scales, scales
from upright.errors import BadInput, NotIdentifiable, nearest
from upright.records import Record
from upright.units import same_dimension, scale

LEAST = math.radians(40)
"""Swing below which the period tells too little of the amplitude [rad]: at 40 degrees it is 3 % longer."""


def asked(model: Rig, log: Record, known: Mapping[str, float] | None = None) -> Scales:
    """Scales of the encoders from a log; see `upright.control.sensors.scales`.

    Parameters
    ----------
    model : Rig
    log : Record
        Columns named as the coordinates, in any unit or in counts, and the command ``u``, from rest.
    known : mapping of str to float, optional
        How well the model's numbers are known.

    Raises
    ------
    BadInput
        When a column is missing or has another dimension.
    NotIdentifiable
        When the model says that the commands swing the pendulum too little.
    """
    signals = {"u": log["u"]} if "u" in log.names else {}
    if not signals:
        raise BadInput(f"the check needs the command in a column 'u'; {nearest('u', log.names)}")
    for i, c in enumerate(model.plant.coordinates):
        if c.name not in log.names:
            raise BadInput(f"the check needs a column '{c.name}'; {nearest(c.name, log.names)}")
        unit = log.units.get(c.name, "") or c.unit
        if unit == "counts":
            size = float(model.quantum[i])
        elif same_dimension(unit, c.unit):
            size = scale(unit)
        else:
            raise BadInput(f"'{c.name}' is in {unit}, and {c.unit} or counts were needed; say so in the log's header.")
        signals[c.name] = (log[c.name] - log[c.name][0]) * size
    units = {c.name: c.unit for c in model.plant.coordinates} | {"u": model.unit}
    found = scales(model, log.replace(signals=signals, units=units, inputs=("u",), outputs=tuple(signals)[1:]), known)
    true = np.abs(found.motion[:, 1] / found.value[1]).max()
    if true < LEAST:
        raise NotIdentifiable(
            f"by the model the pendulum swings to {math.degrees(true):.0f} degrees only, where its period hardly tells "
            f"its amplitude; drive it to {math.degrees(LEAST):.0f} or more, 100 is best, then let it coast."
        )
    return found
