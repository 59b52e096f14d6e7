"""How do the fits run between the frequencies that were measured?"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from upright.identification.frequency.answer import Answer
from upright.identification.frequency.balance import Balance
from upright.identification.frequency.response import FrequencyResponse

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]


def curves(answer: Answer, count: int = 240) -> tuple[tuple[Array, Complex], tuple[Array, Complex]]:
    """Frequencies and responses (F, n) of least squares and of the simplex on a close grid.

    Least squares knows dry friction at the amplitudes measured; between frequencies these are taken from both sides.
    """
    data = answer.used
    w = np.geomspace(data.omega[0], data.omega[-1], count)
    dry = np.column_stack([_between(w, data.omega, data.dry[:, j]) for j in range(len(data.outputs))])
    close = FrequencyResponse(
        omega=w, response=np.ones((w.size, len(data.outputs)), dtype=np.complex128), outputs=data.outputs,
        drive=np.full(w.size, 1e-9, dtype=np.complex128), dry=dry, hold=data.hold,
    )  # fmt: skip
    out: list[Any] = []
    for values, linear in ((answer.squares.way.values, False), (answer.simplex.values, True)):
        balance = Balance(plant=answer.rig.plant, at=answer.at, data=close, linear=linear)
        out.append((w, balance.response(values)[0]))
    return out[0], out[1]


def _between(w: Array, at: Array, values: Complex) -> Complex:
    """Sizes by their logarithm, phases as they are."""
    safe = np.where(np.abs(values) > 0, values, 1e-300)
    size = np.interp(np.log(w), np.log(at), np.log(np.abs(safe)))
    phase = np.interp(np.log(w), np.log(at), np.unwrap(np.angle(safe)))
    return np.asarray(np.exp(size + 1j * phase), dtype=np.complex128)
