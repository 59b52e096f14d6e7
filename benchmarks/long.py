"""Logs of up to ten million rows: do `show` and `doctor` take 30 s, 1 GB, and no more time per row than of few?"""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
from collections.abc import Callable
from pathlib import Path

import numpy as np

from benchmarks.measure import Line, Target, spread

ROWS = (100_000, 1_000_000, 10_000_000)
SECONDS, MEGABYTES = 30.0, 1024.0
"""Asked of ten million rows."""

BLOCK = 100_000


def write_log(path: Path, rows: int) -> Path:
    """A swing in encoder counts under a command that switches, at 1 kHz: 18 bytes for each row."""
    decay = 3.0 / (1e-3 * rows)
    with open(path, "w", encoding="utf-8") as file:
        file.write("t,theta,u\n")
        for first in range(0, rows, BLOCK):
            t = np.arange(first, min(first + BLOCK, rows)) * 1e-3
            theta = np.round(2000 * np.cos(6 * t) * np.exp(-decay * t))
            u = np.where(t % 10 < 5, 0.5, -0.5)
            file.writelines(map("%.3f,%d,%.1f\n".__mod__, zip(t.tolist(), theta.tolist(), u.tolist(), strict=True)))
    return path


WATCHED = """
import atexit, sys
from pathlib import Path
out, status = Path(sys.argv.pop(1)), Path("/proc/self/status")
if status.exists():
    atexit.register(lambda: out.write_text(status.read_text().split("VmHWM:")[1].split()[0]))
from upright.cli import main
sys.argv[0] = "upright"
main()
"""


def measured(*words: str) -> tuple[float, float]:
    """Seconds of CPU and the largest memory [MB] of a command in a process of its own.

    What `wait4` says of memory begins with that of whoever started the process, so Linux is asked from inside.
    """
    with tempfile.TemporaryDirectory() as folder:
        peak = Path(folder) / "peak"
        child = subprocess.Popen([sys.executable, "-c", WATCHED, str(peak), *words], stdout=subprocess.DEVNULL)
        _, status, used = os.wait4(child.pid, 0)
        child.returncode = os.waitstatus_to_exitcode(status)
        if child.returncode not in (0, 3):  # 3: the doctor found something
            raise RuntimeError(f"upright {' '.join(words)} ended with {child.returncode}")
        memory = float(peak.read_text()) / 1024 if peak.exists() else used.ru_maxrss / (1 << 20)
    return used.ru_utime + used.ru_stime, memory


def run(*, quick: bool, progress: Callable[[str], None]) -> list[Line]:
    """One process for each, by its CPU (one thread works); too much memory misses the target too."""
    lines: list[Line] = []
    with tempfile.TemporaryDirectory() as folder:
        here = Path(folder)
        for command in ("show", "doctor"):
            for rows in ROWS[: 2 if quick else 3]:
                progress(f"{command} of {rows:,} rows")
                log = here / f"{rows}.csv"
                log = log if log.exists() else write_log(log, rows)
                out = here / ("page.html" if command == "doctor" else "pictures")
                seconds, memory = measured(command, str(log), "-o", str(out))
                over = memory > MEGABYTES
                lines.append(
                    Line(
                        contender=f"upright {command}, {rows:,} rows",
                        seconds=spread([seconds]),
                        rounds=1,
                        target=Target(most=0.0 if over else SECONDS, of="seconds"),
                        note=f"{memory:,.0f} MB of {MEGABYTES:,.0f}{', too much' if over else ''};"
                        f" {1e6 * seconds / rows:.3g} us per row",
                    )
                )
    return lines
