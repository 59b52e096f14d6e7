"""Least squares of a signal, an acceleration most often, on columns of any size."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


@dataclass(frozen=True, kw_only=True, eq=False)
class LeastSquares:
    """Slopes (p,) of a target on columns, what they leave of it (N,), and the columns of length one (N, p)."""

    slopes: Array
    residual: Array
    columns: Array
    sizes: Array

    @classmethod
    def of(cls, columns: Sequence[Array] | Array, target: Array, *, rcond: float = 1e-10) -> LeastSquares:
        """A target (N,) on columns (N,) each, or on a table (N, p); directions below `rcond` are left out."""
        table = np.asarray(columns if isinstance(columns, np.ndarray) else np.column_stack(columns), dtype=np.float64)
        sizes = np.linalg.norm(table, axis=0)
        sizes = np.where(sizes > 0, sizes, 1.0)
        unit = table / sizes
        slopes = np.linalg.lstsq(unit, target, rcond=rcond)[0]
        return cls(slopes=slopes / sizes, residual=target - unit @ slopes, columns=unit, sizes=sizes)

    @property
    def squares(self) -> float:
        """Sum of squares that is left."""
        return float(self.residual @ self.residual)

    def errors(self, independent: float) -> Array:
        """Standard errors (p,) of the slopes, of so many independent samples."""
        variance = self.squares / max(independent - self.slopes.size, 1.0)
        unit = np.diag(np.linalg.pinv(self.columns.T @ self.columns))
        return np.sqrt(np.maximum(unit * variance, 0.0)) / self.sizes
