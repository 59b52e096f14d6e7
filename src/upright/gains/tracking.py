"""Which prefilter makes the output stand where the reference does?"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from upright.errors import BadInput

Array = NDArray[np.float64]


def prefilter(A: ArrayLike, B: ArrayLike, C: ArrayLike, K: ArrayLike, *, sampled: bool = False) -> float:
    """Gain k_pf of ``u = k_pf r - K x`` for unit static gain from r to ``y = C x``: ``1/(C (B K - A)^-1 B)``.

    Parameters
    ----------
    A, B, C, K : arrays, shape (n, n), (n, 1), (n,) and (1, n)
        C is the row of the output that follows.
    sampled : bool
        A and B belong to ``x[k+1]`` instead of ``x'``.

    Raises
    ------
    BadInput
        When the output cannot be held anywhere but at zero by a constant command.
    """
    a, b = np.asarray(A, dtype=np.float64), np.asarray(B, dtype=np.float64).reshape(-1, 1)
    row, gains = np.asarray(C, dtype=np.float64).reshape(1, -1), np.asarray(K, dtype=np.float64).reshape(1, -1)
    rest = (np.eye(a.shape[0]) if sampled else 0.0) - a + b @ gains
    try:
        state = np.linalg.solve(rest, b)
    except np.linalg.LinAlgError:
        raise BadInput("the closed loop has a pole at rest, so nothing holds the output; place it elsewhere.") from None
    static = float((row @ state)[0, 0])
    if abs(static) <= 1e-10 * float(np.abs(row).max() * np.abs(state).max()):
        raise BadInput(
            "a constant command leaves this output at zero (a zero of the plant at rest), so no prefilter makes it "
            "follow; track another coordinate."
        )
    return 1.0 / static
