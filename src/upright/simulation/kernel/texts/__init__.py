"""Functions of a kernel that are the same for every plant, in the kernel's own language: files ``*.kernel``.

A small part of Python, see `upright.simulation.lowering`; names in capitals are places, which the layout knows.
"""

from __future__ import annotations

from functools import cache
from pathlib import Path


@cache
def kernel_text(name: str) -> str:
    """Text of one file, set off by empty lines."""
    return f"\n{(Path(__file__).parent / f'{name}.kernel').read_text(encoding='utf-8')}"
