"""How long until something happens? Whole processes by the clock on the wall, whatever else this machine does."""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np

from benchmarks.measure import Contender, Line, Target, compare

HERE = Path(__file__).parents[1]
FIRST_RESULT = "from benchmarks import ours; print(ours.trajectory(stick_slip=True)()[-1])"


def cpu_of_children() -> float:
    """CPU seconds of all processes waited for so far."""
    times = os.times()
    return times.children_user + times.children_system


def process(*arguments: str, caches: Path | None = None) -> None:
    """Run Python with these arguments to its end; `caches` replaces every folder of compiled code."""
    environment = dict(os.environ)
    if caches is not None:
        environment |= {"UPRIGHT_CACHE": str(caches / "upright")}
    command = [sys.executable, *arguments]
    done = subprocess.run(command, capture_output=True, encoding="utf-8", env=environment, cwd=HERE, check=False)
    if done.returncode:
        raise RuntimeError(f"python {' '.join(arguments)} failed: {done.stderr.strip().splitlines()[-1]}")


def first_use() -> None:
    """First result with nothing compiled: what a new user waits for after installing."""
    with tempfile.TemporaryDirectory() as folder:
        process("-c", FIRST_RESULT, caches=Path(folder))


def run(*, quick: bool, progress: Callable[[str], None]) -> list[Line]:
    """Bare Python is the reference."""
    kinds: dict[str, tuple[Callable[[], None], float | None]] = {
        "python -c pass": (lambda: process("-c", "pass"), None),
        "import upright": (lambda: process("-c", "import upright"), None),  # 0.05 s beyond bare Python is asked
        "upright --help": (lambda: process("-m", "upright", "--help"), 0.3),
        "warm process to first result": (lambda: process("-c", FIRST_RESULT), 1.0),
        "first use after install": (first_use, 10.0),
    }
    cpu: dict[str, list[float]] = {name: [] for name in kinds}

    def contender(name: str) -> Contender:
        start, most = kinds[name]

        def run() -> None:
            before = cpu_of_children()
            start()
            cpu[name].append(cpu_of_children() - before)

        return Contender(name=name, run=run, target=None if most is None else Target(most=most, of="seconds"))

    builders = {name: lambda name=name: contender(name) for name in kinds}
    lines = compare(builders, rounds=3 if quick else 11, clock=time.perf_counter, progress=progress)
    return [replace(line, note=f"{np.median(cpu[line.contender]):.2g} s of CPU") for line in lines]
