"""What benchmarks measured, one after the other; with `quick`, two beside each other where no clock is read."""

from __future__ import annotations

import importlib
import time
import traceback
from collections.abc import Iterator, Mapping, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from functools import partial
from multiprocessing import get_context
from types import ModuleType
from typing import Any

from rich.console import Console
from rich.markup import escape

from benchmarks.measure import Line

TIMED = (
    "trajectory", "ensemble", "fit", "nist", "lab", "startup", "workers", "long", "gpu", "jitter", "dying", "gym",
    "live", "bench", "bench_soak", "crash",
)  # fmt: skip
"""Those whose figures are of a clock: nothing else runs beside them."""


def measured(
    names: Sequence[str], extras: Mapping[str, Mapping[str, Any]], *, quick: bool
) -> Iterator[tuple[str, list[Line] | None, float]]:
    """Lines and seconds of each benchmark, no lines where it failed; with `quick`, two at a time that time nothing."""
    beside = [name for name in names if quick and name not in TIMED]
    for name in names:
        if name not in beside:
            yield _of(name, extras[name], quick)
    if beside:
        with ProcessPoolExecutor(2, get_context("spawn")) as pool:
            running = [pool.submit(_of, name, extras[name], quick) for name in beside]
            yield from (each.result() for each in as_completed(running))


def _of(name: str, extra: Mapping[str, Any], quick: bool) -> tuple[str, list[Line] | None, float]:
    begin = time.perf_counter()
    try:
        lines = module(name).run(quick=quick, progress=partial(_progress, name), **extra)
    except Exception:
        traceback.print_exc()
        lines = None
    return name, lines, time.perf_counter() - begin


def module(name: str) -> ModuleType:
    """A benchmark by its name."""
    return importlib.import_module(f"benchmarks.{name}")


def _progress(name: str, text: str) -> None:
    Console(stderr=True).print(f"[dim]{name}: {escape(text)}[/]")
