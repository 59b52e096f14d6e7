"""Motion of a linear model, free, driven or under gains, as a record."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from upright.errors import BadInput
from upright.records import Provenance, Record
from upright.records.record import SIMULATED_NOTE
from upright.systems import StateSpace
from upright.systems.motion import march
from upright.verbs.linear.feedback import Gains

Array = NDArray[np.float64]


def motion_of_linear(
    model: StateSpace, law: Any, start: Array, commands: Array | None, t: Array, limit: float = math.inf
) -> Record:  # fmt: skip
    """States, outputs that are no states, and commands of a model at evenly spaced times (T,) from 0 [s].

    Raises
    ------
    BadInput
        When the law is none of a linear model, its gains do not fit, or the motion grows without bound.
    """
    sampled = model.to_sampled(float(t[1] - t[0])) if model.dt is None else model
    u = np.zeros((t.size, len(model.inputs))) if commands is None else commands
    x, u = march(sampled.A, sampled.B, u, start, _gains(model, law), limit)
    check_bounded(t, x, sampled.states, "")
    y = x @ sampled.C.T + u @ sampled.D.T
    columns = dict(zip(sampled.states, x.T, strict=True))
    columns |= {n: v for n, v in zip(sampled.outputs, y.T, strict=True) if n not in columns}
    columns |= dict(zip(sampled.inputs, u.T, strict=True))
    return Record(
        t=t, signals=columns, units={n: model.units.get(n, "") for n in columns}, inputs=tuple(model.inputs),
        outputs=tuple(model.outputs), provenance=simulated_origin(model.name or "a linear model"),
    )  # fmt: skip


def simulated_origin(rig: str) -> Provenance:
    """Origin of a record of a rig that was not touched."""
    return Provenance(reader="simulation", rig=rig, notes=(SIMULATED_NOTE,))


def check_bounded(t: Array, x: Array, names: Sequence[str], so: str) -> None:
    """Refuse a motion (T, n) that left all bounds; `so` says what that means."""
    wild = ~(np.abs(x) < 1e15)
    if wild.any():
        k = int(np.argmax(wild.any(axis=1)))
        raise BadInput(
            f"the motion grows without bound: {names[int(np.argmax(wild[k]))]} is beyond 1e15 at {t[k]:.4g} s{so};"
            " change its gains or its start, or simulate fewer seconds."
        )


def read_gains(law: Any, wanted: tuple[int, int], of: str, refusal: str) -> Array:
    """Gains of a shape, for what they are `of`; `refusal` says of another law what is taken."""
    try:
        K = np.atleast_2d(np.asarray(law, dtype=np.float64))
    except (TypeError, ValueError):
        raise BadInput(refusal) from None
    if K.shape != wanted:
        raise BadInput(f"gains for {of} need shape {wanted}, got {K.shape}.")
    return K


def _gains(model: StateSpace, law: Any) -> Array | None:
    if law is None:
        return None
    K = read_gains(
        law, (len(model.inputs), len(model.states)), model.name or "this model",
        f"a linear model runs under gains, an array or what up.place answers, got {type(law).__name__}; a law reads "
        "encoders, so give simulate the rig.",
    )  # fmt: skip
    if isinstance(law, Gains) and not _same_point(law.point, model.point):
        raise BadInput("these gains are for another equilibrium than the model; linearize there, or pass the array K.")
    return K


def _same_point(one: Mapping[str, float] | None, other: Mapping[str, float] | None) -> bool:
    return one is None or other is None or all(math.isclose(one[n], other[n], abs_tol=1e-9) for n in one.keys() & other)
