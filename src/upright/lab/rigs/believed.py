"""What does an identification make of the rig that is to be controlled, and what else does it allow?"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from upright.control import Rig
from upright.errors import BadInput
from upright.lab.rigs.makes import MAKES, PLANTS, Make, make_rig
from upright.lab.rigs.rig_file import GAIN, RigFile

Array = NDArray[np.float64]

DAILY = 0.13
"""Relative spread of dry friction from one run to the next, as between two runs of one day on an ECP 205."""


def make_of(file: RigFile) -> Make:
    """The make whose plant this is.

    Raises
    ------
    BadInput
        When none of the makes has such a plant.
    """
    for make in MAKES:
        if type(PLANTS[make]) is type(file.plant):
            return make
    raise BadInput(
        f"none of the makes {', '.join(MAKES)} is a '{file.name}'; its drive and encoders are not known, so design "
        "for it (upright design) and simulate with control.Rig."
    )


def believed(file: RigFile, said: Rig | None = None) -> Rig:
    """The rig as identified, with drive and encoders as said in its data sheet.

    Dry friction, delay and lag that the fit leaves at zero are taken as said, too: nobody's rig is without.

    Parameters
    ----------
    file : RigFile
    said : Rig, optional
        The make's own as designed when omitted.
    """
    said = said or make_rig(make_of(file))
    dry = [n for n in ("b_1c", "b_2c") if n in file.plant.names()]
    plant = file.plant
    if dry and not any(getattr(plant, n) for n in dry):
        plant = plant.replace(**{n: getattr(said.plant, n) for n in dry})
    return replace(
        said, plant=plant, gain=file.gain, unit=file.unit or said.unit, delay=file.late or said.delay,
        lag=file.lag or said.lag, scales=(),
    )  # fmt: skip


def allowed(file: RigFile, rig: Rig, lanes: int, seed: int) -> Mapping[str, Array]:
    """Parameters of `lanes` rigs that the fit's covariance allows, dry friction as it may be on the day.

    Parameters
    ----------
    file : RigFile
        With its draws; where it has none, friction alone varies.
    rig : Rig
        As `believed`.
    lanes : int
    seed : int
    """
    rng = np.random.default_rng([seed, 53])
    out: dict[str, Array] = {}
    if file.others:
        rows = [file.others[i % len(file.others)] for i in range(lanes)]
        for name in rig.plant.names():
            values = np.array([getattr(plant, name) for plant, _ in rows])
            if np.ptp(values) > 0:
                out[name] = values
        gains = np.array([gain for _, gain in rows])
        if np.ptp(gains) > 0:
            out[GAIN] = gains
    for name in ("b_1c", "b_2c"):
        if name in rig.plant.names() and getattr(rig.plant, name):
            today = np.exp(rng.normal(0, DAILY, lanes))
            out[name] = today * out.get(name, np.full(lanes, getattr(rig.plant, name)))
    return out
