"""A rig with its law and the rigs that its fit allows, as a page needs them to move."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from upright.control.effort import FELT
from upright.control.preflight import Task
from upright.control.score import BAND, FALLEN
from upright.control.trial import law_on_rig, steps_in_period
from upright.gains.velocity import Estimator
from upright.laws import Law
from upright.live.kernel import described
from upright.physics.outline import in_javascript
from upright.records import Array
from upright.rig import Rig
from upright.simulation import Simulator, choose

FRAME = 64
"""Samples that are recorded between two pictures: 60 frames a second leave room for 4 kHz."""
LONGEST_DELAY = 0.03
"""Delay [s] that a slider may go to."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Loop:
    """A law of state feedback as a page changes it: poles are dragged, and gains follow.

    Attributes
    ----------
    estimator : Estimator
        States from readings.
    K : array, shape (1, states)
        Gains to begin with, on the states about the equilibrium.
    law : Law
        Both together.
    """

    estimator: Estimator
    K: Array
    law: Law


def unplayable(rig: Rig) -> str | None:
    """What a rig lacks to move in a page; None where nothing is."""
    if "inverted" not in rig.plant.equilibria or len(rig.plant.inputs) != 1:
        return f"a rig with one drive and an inverted equilibrium, and {rig.name} is none"
    if not rig.plant.outline(rig.plant, [0.0] * len(rig.plant.coordinates)):
        return f"a plant that says how it is drawn; give {type(rig.plant).__name__} its outline(p, q)"
    return None


def moving(rig: Rig, loop: Loop, task: Task, *, others: Mapping[str, Array], lanes: int, seed: int) -> dict[str, Any]:
    """What the page's script takes, as JSON holds it.

    Parameters
    ----------
    rig : Rig
        Completed, as `rig.completion.completed` gives it.
    task : Task
        Where the loop is switched on, and for how long the rigs of the fit run.
    others : mapping of str to array, shape (lanes,)
        Parameters of the rigs that the fit allows.
    lanes : int
        How many of them.
    seed : int
        Of the hand that lets go.

    Raises
    ------
    BadInput
        When a kernel cannot be compiled for a page.
    """
    plant = rig.plant
    point = np.array(list(plant.equilibrium(task.at).values()))
    law = law_on_rig(rig, loop.law, point)
    model = rig.linear(task.at)
    starts = task.starts(lanes, np.random.default_rng([seed, 52]))
    coordinates = list(plant.coordinates)
    moved = [c.name for c in coordinates].index(plant.inputs[0].on)
    drive = {**rig.drive, "actuator.delay": max(rig.delay, LONGEST_DELAY)}  # room for commands on their way
    kernel = partial(_kernel, rig, law, drive, task.at)
    return {
        "name": rig.name,
        "coordinates": [{"name": c.name, "unit": c.unit, "meaning": c.meaning} for c in coordinates],
        "command": {"unit": rig.unit, "limit": rig.limit},
        "point": point.tolist(),
        "period": rig.period,
        "resolution": np.asarray(law.resolution, dtype=np.float64).tolist(),
        "delay": rig.delay,
        "dry": [n for j in plant.joints for n in (j.coulomb, j.stiction) if n],
        "start": plant.state(task.at).tolist(),
        "away": list(task.start),
        "seconds": task.seconds,
        "travel": rig.travel if np.isfinite(rig.travel) else None,
        "speed_limit": rig.speed_limit if np.isfinite(rig.speed_limit) else None,
        "fallen": FALLEN,
        "settled": BAND,
        "felt": FELT,
        "moved": moved,
        "outline": in_javascript(partial(plant.outline, plant), len(coordinates)),
        "A": model.A.tolist(),
        "B": model.B[:, 0].tolist(),
        "K": loop.K[0].tolist(),
        "poles": [[z.real, z.imag] for z in np.linalg.eigvals(model.A - model.B @ loop.K).tolist()],
        "estimator": {k: getattr(loop.estimator, k).tolist() for k in ("A", "B", "E", "C", "D", "begin")},
        "one": kernel(others={}, starts=np.array([task.start]), samples=FRAME, record=True),
        "many": kernel(
            others=others, starts=starts, samples=round(task.seconds / rig.period) + 1,
            record=bool(np.isfinite(rig.speed_limit)),
        ),
        "lanes": lanes,
    }  # fmt: skip


def _kernel(
    rig: Rig, law: Law, drive: Mapping[str, float], at: str, *, others: Mapping[str, Array], starts: ArrayLike,
    samples: int, record: bool,
) -> dict[str, Any]:  # fmt: skip
    first = np.asarray(starts, dtype=np.float64)
    values: dict[str, Any] = {**rig.plant.parameters(), **drive, **others}
    derived = rig.plant.derived_for(values)
    flavour = choose(derived, values, loop=law, record=record, strict=True)
    simulator = Simulator(derived=derived, flavour=flavour, dt=rig.period, substeps=steps_in_period(rig), loop=law)
    x0 = np.ascontiguousarray((rig.plant.state(at) + first).T)
    width = 1 if len(first) == 1 else 16
    call = simulator.call(simulator.table(values, len(first)), x0, samples=samples, width=width)
    return described(simulator, call, width=width)
