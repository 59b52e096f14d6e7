"""How finely is a column written? The smallest step between any two of its values."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray


def smallest_step(x: NDArray[np.float64]) -> float:
    """Smallest difference of two values of a column (N,), 0 of a constant."""
    steps = np.diff(np.unique(x))
    return float(steps.min()) if steps.size else 0.0
