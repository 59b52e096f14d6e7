"""Many lanes cut into blocks, so that one block is one piece of work."""

from __future__ import annotations

from itertools import pairwise

SIDE_BY_SIDE = 16
"""Lanes that the kernel steps at once; a block is a multiple of them, so that no lane meets other arithmetic in it."""


def cut(lanes: int, most: int) -> list[slice]:
    """Blocks of lanes that depend on nothing but how many lanes there are.

    Parameters
    ----------
    most : int
        Lanes in a block, a multiple of 16. The last block may hold fewer, or one more: a lane alone would run through
        other code than lanes side by side.
    """
    if most % SIDE_BY_SIDE:
        raise ValueError(f"a block holds a multiple of {SIDE_BY_SIDE} lanes, got {most}")
    edges = [*range(0, lanes, most), lanes]
    if len(edges) > 2 and edges[-1] - edges[-2] == 1:
        del edges[-2]
    return [slice(a, b) for a, b in pairwise(edges)]
