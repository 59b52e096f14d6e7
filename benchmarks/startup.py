"""How long until something happens? Whole processes by the clock on the wall, this machine's load included."""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

from benchmarks.measure import Contender, Line, Target, compare

NAME = "startup"
HERE = Path(__file__).parents[1]
FIRST_RESULT = "from benchmarks import ours; print(ours.trajectory(stick_slip=True)()[-1])"


def process(*arguments: str, caches: Path | None = None) -> None:
    """Run Python with these arguments to its end; `caches` replaces every folder of compiled code."""
    environment = dict(os.environ)
    if caches is not None:
        environment |= {"UPRIGHT_CACHE": str(caches / "upright"), "NUMBA_CACHE_DIR": str(caches / "numba")}
    done = subprocess.run(
        [sys.executable, *arguments], capture_output=True, text=True, env=environment, cwd=HERE, check=False
    )
    if done.returncode:
        raise RuntimeError(f"python {' '.join(arguments)} failed: {done.stderr.strip().splitlines()[-1]}")


def first_use() -> None:
    """First result with nothing compiled: what a new user waits for after installing."""
    with tempfile.TemporaryDirectory() as folder:
        process("-c", FIRST_RESULT, caches=Path(folder))


def ours(name: str, run: Callable[[], None], most: float) -> Contender:
    """One kind of start; needs the kernel."""
    import upright.simulation  # noqa: F401  (left out with the reason where it is missing)

    return Contender(name=name, run=run, target=Target(most=most, of="seconds"))


def run(*, quick: bool, progress: Callable[[str], None]) -> list[Line]:
    """Bare Python is the reference."""
    help_line, warm, first = "upright --help", "warm process to first result", "first use after install"

    builders: dict[str, Callable[[], Contender]] = {
        "python -c pass": lambda: Contender(name="python -c pass", run=lambda: process("-c", "pass")),
        help_line: lambda: ours(help_line, lambda: process("-m", "upright", "--help"), 0.3),
        warm: lambda: ours(warm, lambda: process("-c", FIRST_RESULT), 1.0),
        first: lambda: ours(first, first_use, 10.0),
    }
    return compare(NAME, builders, rounds=3 if quick else 11, clock=time.perf_counter, progress=progress)
