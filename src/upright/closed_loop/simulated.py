"""How does the solver run the law of a run? The same recursion in the compiled loop, from the memory it had then."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from upright.closed_loop.feedback import Feedback
from upright.closed_loop.preparation import finer
from upright.errors import BadInput
from upright.physics import Plant
from upright.simulation import Held, Law, Simulator

if TYPE_CHECKING:
    from upright.identification.model.model import Run

Array = NDArray[np.float64]


def controller(loop: Feedback, run: Run, plant: type[Plant]) -> Law:
    """The law on all coordinates of a plant, in their order, feeding its first input.

    Raises
    ------
    BadInput
        When the law reads a coordinate that the plant does not have.
    """
    law, names = loop.law, [c.name for c in plant.coordinates]
    n, m, nu = law.C.size, len(law.references), len(plant.inputs)
    for name in law.measured:
        if name not in names:
            raise BadInput(f"the law of run '{run.label}' reads '{name}'; {plant.__name__} has {', '.join(names)}.")
    B, D = np.zeros((n, len(names) + m)), np.zeros((nu, len(names) + m))
    C = np.zeros((nu, n))
    C[0] = law.C
    for j, name in enumerate(law.measured):
        B[:, names.index(name)], D[0, names.index(name)] = law.B[:, j], law.D[j]
    B[:, len(names) :], D[0, len(names) :] = law.B[:, len(law.measured) :], law.D[len(law.measured) :]
    quantum, step = np.zeros(len(names)), 0.0
    if loop.quantized:
        for name, resolution in zip(run.measured, run.quantum, strict=False):
            quantum[names.index(name)] = resolution
        step = law.quantum
    references = np.vstack([loop.references, loop.references])[: max(2, len(loop.references))]
    return Law(
        A=law.A, B=B, C=C, D=D, references=references if m else None, quantum=quantum, delay=law.delay,
        command_quantum=step, initial=law.initial, windup=law.windup,
    )  # fmt: skip


def limited(values: Mapping[str, float | Array], loop: Feedback | None) -> Mapping[str, float | Array]:
    """Parameters with the law's limit where the actuator's own is wider."""
    if loop is None or not np.isfinite(loop.law.limit):
        return values
    return {**values, "actuator.limit": np.minimum(values.get("actuator.limit", np.inf), loop.law.limit)}


def remembering(solver: Simulator, run: Run, restarts: NDArray[np.int64], lanes: int) -> Simulator:
    """A solver whose law starts each window with the memory that the recorded motion had given it by then."""
    if run.loop is None or not isinstance(solver.loop, Law) or not run.loop.law.C.size:
        return solver
    _, z = run.loop.follow(run.y, run.measured)
    return replace(solver, loop=replace(solver.loop, initial=np.repeat(z[restarts].T, lanes, axis=1)))


def finely(held: Held, every: int) -> Held:
    """A prescribed motion at the law's rate."""
    if every == 1 or held.q is None:
        return held
    return Held(q=finer(np.asarray(held.q, dtype=np.float64), every))
