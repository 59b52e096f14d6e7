"""Requested poles, and whether this model can have them."""

from __future__ import annotations

import re

import numpy as np
from numpy.typing import ArrayLike, NDArray

from upright.errors import BadInput
from upright.laws.linear import Array

Roots = NDArray[np.complex128]


def read_poles(text: str) -> Roots:
    """Poles from a text such as ``"-4.15+-1.63j, -16.9, -3.2"`` [1/s]; ``+-`` (or ``±``) stands for a conjugate pair.

    Raises
    ------
    BadInput
        When a part of the text is no number.
    """
    poles: list[complex] = []
    for part in re.split(r"[,;]", text):
        plain = re.sub(r"\s+", "", part).replace("−", "-").replace("±", "+-").replace("-+", "+-").replace("i", "j")
        pair = "+-" in plain
        real, _, imaginary = plain.partition("+-")
        try:
            poles.append(complex(f"{real}+{imaginary}" if pair else plain))
        except ValueError:
            raise BadInput(
                f'poles are written as "-4.15+-1.63j, -16.9, -3.2" [1/s], and {part.strip()[:40]!r} is no pole; '
                "separate them by commas and write +- for a conjugate pair."
            ) from None
        if pair:
            poles.append(poles[-1].conjugate())
    return np.array(poles, dtype=np.complex128)


def conjugate_poles(poles: ArrayLike, states: int) -> Roots:
    """The requested poles, in order, each pair made exactly conjugate.

    Raises
    ------
    BadInput
        When there are too few or too many, one is not finite, or a complex one has no conjugate.
    """
    requested = np.atleast_1d(np.array(poles, dtype=np.complex128))
    if requested.ndim != 1 or requested.size != states:
        raise BadInput(
            f"a model of {states} states needs {states} poles, got {requested.size}: {written(requested.ravel())}; "
            "a pair such as -4+-2j counts as two."
        )
    if not np.isfinite(requested).all():
        raise BadInput(f"poles must be finite numbers, got {written(requested)}.")
    open_ones = [i for i in range(states) if requested[i].imag != 0.0]
    while open_ones:
        i = open_ones.pop(0)
        near = min(open_ones, key=lambda j: abs(requested[j] - requested[i].conjugate()), default=None)
        if near is None or abs(requested[near] - requested[i].conjugate()) > 1e-9 * abs(requested[i]):
            raise BadInput(
                f"real gains give conjugate poles only, and {written(requested[i : i + 1])} comes without "
                f"{written(requested[i : i + 1].conj())}; write the pair as {_pair(requested[i])}."
            )
        open_ones.remove(near)
        requested[near] = requested[i].conjugate()
    return requested


def checked(A: ArrayLike, B: ArrayLike) -> tuple[Array, Array]:
    """A, shape (n, n), and B, shape (n, m), of a linear model, one column for a flat B.

    Raises
    ------
    BadInput
        When the shapes do not go together or a number is not finite.
    """
    a = np.atleast_2d(np.array(A, dtype=np.float64))
    b = np.array(B, dtype=np.float64)
    b = b[:, None] if b.ndim == 1 else np.atleast_2d(b)
    if a.ndim != 2 or a.shape[0] != a.shape[1] or b.shape[0] != a.shape[0] or b.shape[1] == 0:
        raise BadInput(f"a model needs A of shape (n, n) and B of shape (n, m), got {a.shape} and {b.shape}.")
    if not (np.isfinite(a).all() and np.isfinite(b).all()):
        raise BadInput("A and B must hold finite numbers; check the parameters of the model.")
    return a, b


UNREACHED = 1e-13
"""Distance to a model with a mode out of reach, relative to its size and per state, that rounding alone explains."""


def weak_modes(A: Array, B: Array) -> list[tuple[float, complex]]:
    """How far each mode is from being out of the input's reach: Popov, Belevitch and Hautus' test.

    Parameters
    ----------
    A, B : arrays, shape (n, n) and (n, m)
        Best balanced, so that the units of the states do not matter.

    Returns
    -------
    list of (float, complex)
        Least singular value of ``[A - pole I, B]`` over the size of A and B, and the pole; the weakest first.
    """
    n = A.shape[0]
    size = float(np.linalg.norm(np.hstack([A, B]), 2)) or 1.0
    poles = poles_of(A)
    reach = [float(np.linalg.svd(np.hstack([A - p * np.eye(n), B]), compute_uv=False)[-1]) / size for p in poles]
    return sorted(zip(reach, poles.tolist(), strict=True), key=lambda mode: mode[0])


def poles_of(A: Array) -> Roots:
    """Eigenvalues, complex even where all are real."""
    return np.asarray(np.linalg.eigvals(A), dtype=np.complex128)


def matched(requested: Roots, attained: Roots) -> Roots:
    """The attained roots, each beside the requested one that it is closest to, the closest pairs first."""
    distance = np.abs(requested[:, None] - attained[None, :])
    out = np.zeros_like(requested)
    for _ in range(requested.size):
        i, j = np.unravel_index(int(np.argmin(distance)), distance.shape)
        out[i] = attained[j]
        distance[i, :] = np.inf
        distance[:, j] = np.inf
    return out


def lost_modes(A: Array, B: Array) -> list[complex]:
    """Poles of the balanced model that no input moves, a multiple one as often as it is lost."""
    n = A.shape[0]
    allowed = UNREACHED * n * float(np.linalg.norm(np.hstack([A, B]), 2))
    lost: list[complex] = []
    for reach, pole in weak_modes(A, B):
        if reach <= UNREACHED * n and not any(abs(pole - known) <= 1e-6 * abs(pole) for known in lost):
            values = np.linalg.svd(np.hstack([A - pole * np.eye(n), B]), compute_uv=False)
            lost += [pole] * int(np.sum(values <= allowed))
    return lost


def written(poles: ArrayLike, digits: int = 5) -> str:
    """Poles as a person writes them: ``-4.1484±1.6341j, -16.855``; conjugate pairs once."""
    left = [complex(p) for p in np.atleast_1d(np.asarray(poles, dtype=np.complex128))]
    nothing = 1e-13 * max((abs(p) for p in left), default=0.0)  # what rounding makes of a pole at 0
    left = [0j if abs(p) <= nothing else p for p in left]
    out: list[str] = []
    while left:
        p = left.pop(0)
        near = [i for i, q in enumerate(left) if abs(q - p.conjugate()) <= 1e-6 * abs(p)]
        real = f"{p.real:.{digits}g}"
        if p.imag == 0.0:
            out.append(real)
        elif near:
            left.pop(near[0])
            out.append(f"{real}±{abs(p.imag):.{digits}g}j")
        else:
            out.append(f"{real}{p.imag:+.{digits}g}j")
    return ", ".join(out)


def _pair(p: complex) -> str:
    return f"{p.real:g}+-{abs(p.imag):g}j"
