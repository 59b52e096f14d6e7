"""How fast is it, beside what? `python -m benchmarks [NAMES] [--json FILE] [--quick] [--full]`.

`python -m benchmarks mutants --sample 150 --seed N` asks which changes of the code the tests notice.
"""

from __future__ import annotations

import argparse
import json
import platform
import sys
from dataclasses import asdict
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any

from rich.console import Console
from rich.markup import escape
from rich.table import Table

from benchmarks.measure import Line
from benchmarks.measured import measured, module
from upright.errors import BadInput
from upright.workers import Workers

NAMES = (
    "trajectory", "ensemble", "fit", "nist", "coverage", "loadings", "frequency", "swing_up", "tracking", "lab",
    "doctor", "rigs", "misfit", "verdicts", "regulation", "real", "agree", "bands", "starts", "startup",
    "workers", "long", "gpu", "crash", "safety", "dying", "false_stops", "minute", "images", "soak", "jitter", "gym",
    "at_hand", "quick_lab", "first", "kept", "strangers", "live", "bench", "bench_soak", "peers", "mutants",
)  # fmt: skip
APART = ("bench_soak", "peers", "mutants")
"""Those that run when they are named, and never among all: what is asked there is not how fast we are, or lasts."""
PUBLISHED = (
    "first", "kept", "strangers", "real", "agree", "bands", "rigs", "misfit", "verdicts", "regulation", "workers",
    "starts", "crash", "safety", "dying", "false_stops", "quick_lab", "soak", "jitter", "gym", "peers", "mutants",
)  # fmt: skip
SHARED = (
    "first", "kept", "strangers", "coverage", "agree", "bands", "rigs", "misfit", "verdicts", "regulation", "starts",
    "soak", "at_hand", "quick_lab",
)  # fmt: skip
"""Those whose table is a page, and those whose work processes may share."""

LIBRARIES = ("upright", "numpy", "scipy", "llvmlite", "control", "casadi", "jax", "mujoco", "gymnasium")


def amount(seconds: float) -> str:
    """Seconds with a readable unit."""
    for unit, factor in (("s", 1.0), ("ms", 1e3), ("us", 1e6)):
        if seconds * factor >= 1 or unit == "us":
            return f"{seconds * factor:,.3g} {unit}" if seconds * factor < 1000 else f"{seconds * factor:,.0f} {unit}"
    return "0 s"


def row(line: Line) -> list[str]:
    """Cells of one line."""
    seconds = spread = ratio = ""
    if line.seconds is not None:
        seconds = amount(line.seconds[0])
        spread = f"{amount(line.seconds[1])} to {amount(line.seconds[2])}"
    if line.ratio is not None:
        middle, low, high = (f"{r:,.0f}" if r >= 100 else f"{r:.3g}" for r in line.ratio)
        ratio = middle if low == middle == high else f"{middle} ({low} to {high})"
    reached = {None: "", True: "[green]reached[/]", False: "[red]missed[/]"}[line.reached]
    error = "" if line.error is None else f"{line.error:.1e}"
    return [line.contender, seconds, spread, ratio, error, str(line.target or ""), reached, escape(line.note)]


def table(name: str, title: str, lines: list[Line]) -> Table:
    """All lines of one benchmark."""
    out = Table(title=f"[bold]{name}[/]: {title}", title_justify="left")
    out.add_column("contender")
    for heading in ("median", "quartiles", "times the first (quartiles)", "error", "target"):
        out.add_column(heading, justify="right")
    out.add_column("reached")
    out.add_column("note")
    for line in lines:
        out.add_row(*row(line))
    return out


def versions() -> dict[str, str]:
    """Versions of what was compared."""
    found = {"python": platform.python_version(), "machine": platform.machine()}
    for name in LIBRARIES:
        try:
            found[name] = version(name)
        except PackageNotFoundError:
            continue
    return found


def main(arguments: list[str] | None = None) -> int:
    """Run the benchmarks named; 1 when one of them failed with an error, else 3 when a target was missed."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks", description=__doc__)
    parser.add_argument(
        "names",
        nargs="*",
        metavar="NAMES",
        help=f"which ones, of {', '.join(NAMES)}; default: all but {', '.join(APART)}",
    )
    parser.add_argument("--json", type=Path, metavar="FILE", help="write every figure to a file too")
    parser.add_argument(
        "--quick", action="store_true", help="fewer rounds and smaller shares, some three minutes on two processors"
    )
    parser.add_argument("--full", action="store_true", help="run what is otherwise estimated from its parts")
    pages = ", ".join(PUBLISHED)
    parser.add_argument("--markdown", type=Path, metavar="FILE", help=f"write the page of one of {pages}")
    parser.add_argument("--starts", type=int, default=300, metavar="N", help="random starts of each study in `starts`")
    parser.add_argument(
        "--workers",
        type=int,
        metavar="N",
        help=f"processes for {', '.join(SHARED)}; default 1, for mutants 2",
    )
    parser.add_argument("--cluster", metavar="ADDRESS", help="Dask scheduler for them, tcp://host:8786")
    changes = parser.add_argument_group("mutants")
    changes.add_argument("--sample", type=int, default=150, metavar="N", help="changes of the code; default 150")
    changes.add_argument("--seed", type=int, default=0, metavar="N", help="which ones; default 0")
    changes.add_argument(
        "--within",
        default="",
        metavar="PATH",
        help="only changes of a room, a file or a line: identification/ladder, gains/lqr.py:141",
    )
    changes.add_argument(
        "--slow", action="store_true", help="what no quick test notices is put to the slow tests that cover it"
    )
    changes.add_argument(
        "--seconds",
        type=float,
        default=60.0,
        metavar="N",
        help="CPU time of the quick tests for one change [s], default 60, the slow ones have twice as much; that of "
        "the searches of each study in `starts`",
    )
    changes.add_argument(
        "--map",
        type=Path,
        metavar="FOLDER",
        help="where it is kept which tests cover which lines; default: mutants in UPRIGHT_CACHE",
    )
    changes.add_argument(
        "--judged",
        type=Path,
        metavar="FILE",
        help="changes that do not matter, each `file:line before -> after  # reason`; default those beside the program",
    )
    asked = parser.parse_args(arguments)
    try:
        shared = {"workers": Workers(number=asked.workers or 1, cluster=asked.cluster)}
    except BadInput as error:
        parser.error(str(error))
    if asked.markdown and (len(asked.names) != 1 or asked.names[0] not in PUBLISHED):
        parser.error(f"--markdown writes the table of one benchmark: name one of {pages}")
    if unknown := set(asked.names) - set(NAMES):
        parser.error(f"no benchmark is called {', '.join(sorted(unknown))}; there are {', '.join(NAMES)}")

    console = Console(width=None if sys.stdout.isatty() else 200)
    told = Console(stderr=True)
    results: dict[str, Any] = {"versions": versions(), "lines": []}
    missed, failed = 0, []
    options: dict[str, dict[str, Any]] = {
        "fit": {"full": asked.full},
        "starts": {"starts": asked.starts, "seconds": asked.seconds},
        "mutants": {
            "sample": asked.sample, "seed": asked.seed, "within": asked.within, "folder": asked.map,
            "verdicts": asked.judged, "workers": asked.workers or 2, "slow": asked.slow,
            "seconds": asked.seconds,
        },
    }  # fmt: skip
    names = asked.names or [name for name in NAMES if name not in APART]
    extras = {
        name: options.get(name, {})
        | ({"markdown": asked.markdown} if name in PUBLISHED else {})
        | (shared if name in SHARED else {})
        for name in names
    }
    for name, lines, seconds in measured(names, extras, quick=asked.quick):
        if lines is None:
            told.print(f"[red]{name} failed[/]")
            failed.append(name)
            continue
        console.print(table(name, (module(name).__doc__ or "").splitlines()[0], lines))
        results["lines"] += [{"benchmark": name} | asdict(line) | {"reached": line.reached} for line in lines]
        missed += sum(line.reached is False for line in lines)
        told.print(f"[dim]{name}: {seconds:.0f} s[/]")
    if asked.json:
        asked.json.write_text(json.dumps(results, indent=1) + "\n", encoding="utf-8")
    if failed:
        told.print(f"[red]ended with an error: {', '.join(failed)}[/]")
    return 1 if failed else 3 if missed else 0


if __name__ == "__main__":
    sys.exit(main())
