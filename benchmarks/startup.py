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
SHIPPED = """
from upright.physics import Furuta
from upright.simulation import simulate
rig = Furuta(m_p=0.135, l_cg=0.19, r=0.16, J_d=0.011, J_p=6e-4)
print(simulate(rig, {}, [0.3, 0.0, 1.2, -0.5], None, 1e-3, samples=1001)[-1])
"""
OF_THE_USER = """
import sys
sys.path.insert(0, "examples/plants")
from double_pendulum import DoublePendulum
from upright.simulation import simulate
rig = DoublePendulum(m_1=0.2, m_2=0.1, l_1=0.2, a_1=0.1, a_2=0.1)
print(simulate(rig, {}, [0.3, 0.0, 1.2, -0.5], None, 1e-3, samples=1001)[-1])
"""
RULE = """
from upright.laws import Rule
from upright.physics import Furuta
from upright.simulation import simulate
rig = Furuta(m_p=0.135, l_cg=0.19, r=0.16, J_d=0.011, J_p=6e-4)

def hop(t, y, r, z, p):
    push = p[0] if y[0] < z[0] else -p[0]
    if abs(y[1]) > 1.0:
        push = 0.0
    return (push,), (y[0],)

loop = Rule(function=hop, initial=[0.0], parameters=[0.02])
print(simulate(rig, {}, [0.3, 0.0, 1.2, -0.5], None, 1e-3, samples=1001, loop=loop)[-1])
"""


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


def first_use(*arguments: str) -> None:
    """A process with nothing compiled: what a new user waits for after installing."""
    with tempfile.TemporaryDirectory() as folder:
        (Path(folder) / "rule.py").write_text(RULE, encoding="utf-8")
        process(*(a.replace("{folder}", folder) for a in arguments), caches=Path(folder))


def megabyte(folder: Path) -> Path:
    """A log of 1 MB."""
    path, t = folder / "swing.csv", np.arange(26_000) * 1e-3
    table = np.column_stack([t, np.exp(-0.2 * t) * np.sin(6.0 * t), np.sign(np.sin(t))])
    np.savetxt(path, table, fmt=["%.3f", "%.15e", "%.8f"], delimiter=",", header="time,theta,u", comments="")
    return path


def run(*, quick: bool, progress: Callable[[str], None]) -> list[Line]:
    """Bare Python is the reference."""
    with tempfile.TemporaryDirectory() as folder:
        return _timed(megabyte(Path(folder)), quick=quick, progress=progress)


def _timed(log: Path, *, quick: bool, progress: Callable[[str], None]) -> list[Line]:
    kinds: dict[str, tuple[Callable[[], None], float | None]] = {
        "python -c pass": (lambda: process("-c", "pass"), None),
        "import upright": (lambda: process("-c", "import upright"), None),  # 0.05 s beyond bare Python is asked
        "upright --help": (lambda: process("-m", "upright", "--help"), 0.2),
        f"upright show, a log of {log.stat().st_size / 1e6:.1f} MB": (
            lambda: process("-m", "upright", "show", str(log), "-o", str(log.with_suffix(".png"))), 0.7,
        ),
        "warm process to first result": (lambda: process("-c", FIRST_RESULT), 1.0),
        "first motion of a shipped plant, nothing compiled": (lambda: first_use("-c", SHIPPED), 0.5),
        "first motion of a user's plant, nothing compiled": (lambda: first_use("-c", OF_THE_USER), 2.0),
        "first motion under a rule, nothing compiled": (lambda: first_use("{folder}/rule.py"), 0.5),
    }  # fmt: skip
    if not quick:
        lab = ("-m", "upright", "lab", "-o", "{folder}/lab")
        kinds["upright lab with its PDF, nothing compiled"] = (lambda: first_use(*lab), 40.0)
    cpu: dict[str, list[float]] = {name: [] for name in kinds}

    def contender(name: str) -> Contender:
        start, most = kinds[name]

        def run() -> None:
            before = cpu_of_children()
            start()
            cpu[name].append(cpu_of_children() - before)

        return Contender(name=name, run=run, target=None if most is None else Target(most=most, of="seconds"))

    builders = {name: lambda name=name: contender(name) for name in kinds}
    lines = compare(builders, rounds=1 if quick else 5, clock=time.perf_counter, progress=progress)
    return [replace(line, note=f"{np.median(cpu[line.contender]):.2g} s of CPU") for line in lines]
