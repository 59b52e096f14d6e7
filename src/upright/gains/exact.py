"""What do gains give when rounding is kept out of the sum? Ackermann's formula and eigenvalues with 60 digits.

On a model of ten states with poles from 1 to 10, eigenvalues in double precision are off by 4.6, whatever the gains.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Roots = NDArray[np.complex128]

DIGITS = 60


def ackermann(A: Array, b: Array, poles: Roots) -> Array | None:
    """Gains ``K = [0 ... 0 1] [b, A b, ...]^-1 p(A)`` rounded once, at the end; None where that matrix is singular.

    Parameters
    ----------
    A, b : arrays, shape (n, n) and (n,)
    poles : array, shape (n,)
        In conjugate pairs, roots of p.

    Returns
    -------
    array, shape (n,), or None
    """
    import mpmath as mp

    n = A.shape[0]
    with mp.workdps(DIGITS):
        M, column = mp.matrix(A.tolist()), mp.matrix(b.tolist())
        transposed: Any = mp.matrix(n, n)
        for i in range(n):
            transposed[i, :] = column.T
            column = M * column
        last: Any = mp.matrix(n, 1)
        last[n - 1] = 1
        try:
            row = mp.lu_solve(transposed, last).T
        except ZeroDivisionError:
            return None
        coefficients: list[Any] = [mp.mpf(1)]
        for pole in poles.tolist():
            shifted = [*coefficients, mp.mpf(0)]
            for i, c in enumerate(coefficients):
                shifted[i + 1] -= mp.mpmathify(pole) * c
            coefficients = shifted
        gains = row * 0
        for c in coefficients:  # Horner's scheme on the row
            gains = gains * M + row * mp.re(c)
        return np.array([float(g) for g in gains], dtype=np.float64)


def eigenvalues(A: Array, B: Array, K: Array) -> Roots:
    """Eigenvalues of ``A - B K``, the difference formed and solved with 60 digits; shapes (n, n), (n, m), (m, n)."""
    import mpmath as mp

    with mp.workdps(DIGITS):
        closed = mp.matrix(A.tolist()) - mp.matrix(B.tolist()) * mp.matrix(K.tolist())
        found: Any = mp.eig(closed, left=False, right=False)
        values = np.array([complex(z) for z in found], dtype=np.complex128)
        values.imag[np.abs(values.imag) < 1e-25 * np.abs(values)] = 0.0
        return values
