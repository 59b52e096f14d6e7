"""How long does the whole laboratory take? `upright lab`, report and PDF included, as a person waits for it.

Whole processes by the clock on the wall; cold means that no kernel is compiled yet, as after an installation.
"""

from __future__ import annotations

import tempfile
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np

from benchmarks.measure import Line, Target, spread
from benchmarks.startup import cpu_of_children, process

WARM = Target(most=30, of="seconds")


def timed(folder: Path, seed: int, caches: Path | None = None) -> tuple[float, float]:
    """Seconds on the wall and on the processors for the laboratory on one seed."""
    start, before = time.perf_counter(), cpu_of_children()
    process("-m", "upright", "lab", "--seed", str(seed), "-o", str(folder), caches=caches)
    return time.perf_counter() - start, cpu_of_children() - before


def run(*, quick: bool, progress: Callable[[str], None]) -> list[Line]:
    """Cold once, then warm on several seeds, then once more with everything kept."""
    lines: list[Line] = []
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        if not quick:
            progress("cold")
            wall, cpu = timed(folder / "cold", 0, caches=folder / "caches")
            lines.append(_line("cold, nothing compiled", [wall], [cpu], None))
        if not quick:
            timed(folder / "first", 0)
        walls, cpus = [], []
        for seed in range(1, 2 if quick else 6):
            progress(f"seed {seed}")
            wall, cpu = timed(folder / str(seed), seed)
            walls.append(wall)
            cpus.append(cpu)
        lines.append(_line("warm", walls, cpus, WARM))
        wall, cpu = timed(folder / "1", 1)
        lines.append(_line("again, everything kept", [wall], [cpu], None))
    return lines


def _line(name: str, walls: list[float], cpus: list[float], target: Target | None) -> Line:
    note = f"{np.median(cpus):.3g} s of CPU"
    return Line(contender=name, seconds=spread(walls), rounds=len(walls), target=target, note=note)
