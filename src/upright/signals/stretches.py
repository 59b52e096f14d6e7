"""Stretches of samples: where a condition holds, where a signal stays as it is, between gaps in time."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


def stretches(mask: NDArray[np.bool_], *, gap: int = 1) -> list[tuple[int, int]]:
    """First and last place of each stretch of a mask, stretches fewer than `gap` places apart being one."""
    places = np.flatnonzero(mask)
    if not places.size:
        return []
    cuts = np.flatnonzero(np.diff(places) > gap)
    return [(int(a), int(b)) for a, b in zip(places[np.r_[0, cuts + 1]], places[np.r_[cuts, -1]], strict=True)]


def pieces(cut: NDArray[np.bool_]) -> list[tuple[int, int]]:
    """First sample of each piece of a record, and the one after its last, longest first.

    `cut` (N - 1,) says between which neighbours it is cut.
    """
    edges = [0, *(np.flatnonzero(cut) + 1).tolist(), cut.size + 1]
    return sorted(pairwise(edges), key=lambda span: span[0] - span[1])
