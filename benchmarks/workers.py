"""How much faster are several worker processes, and where does it stop? Closed loops of 2 s and whole fits.

One item is a block of 256 Furuta pendulums stabilised upright with exact dry friction, or the identification of one
rig. One process and two take turns within one run, and the best of several turns counts.

The machine is shared with other work, so CPU seconds stand beside seconds on the wall. The speed-up by CPU is the CPU
time of one process over half that of two, dispatch included. More workers than processors are simulated: real processes
that wait for as long as an item takes.
"""

from __future__ import annotations

import contextlib
import math
import os
import platform
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Callable, Generator, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks import problem
from benchmarks.measure import Line, Target, page
from upright.progress import Progress
from upright.workers import HERE, Workers, spread

LANES = 256
PRICE = 0.04
"""US dollars per hour of one core; an assumption, about what clouds ask for cores that may be taken away."""
ASKED = 1.8


def loops(seed: np.random.SeedSequence, _progress: Progress) -> tuple[np.ndarray, float]:
    """Share of a block of closed loops that stand at the end, and its CPU seconds; rigs drawn where they are run."""
    from benchmarks import ours

    begin = time.process_time()
    rng = np.random.default_rng(seed)
    p = problem.RIG[:, None] * np.exp(rng.normal(0, 0.05, (problem.RIG.size, LANES)))
    p[-1] = problem.RIG[-1]
    x0 = np.zeros((4, LANES))
    x0[1] = math.pi + rng.normal(0, 0.05, LANES)
    last = ours.ensemble(p, x0, samples=problem.SAMPLES, stick_slip=True)()
    return last, time.process_time() - begin


def fits(seed: int, _progress: Progress) -> tuple[Any, float]:
    """Which intervals of one rig held the truth, and the CPU seconds of its fit."""
    from benchmarks.rigs import MAKES, outcome

    begin = time.process_time()
    return outcome(MAKES[seed % len(MAKES)], seed), time.process_time() - begin


def waits(seconds: float, _item: int, _progress: Progress) -> tuple[None, float]:
    """Nothing, for as long as an item takes: a worker on a processor of its own."""
    threading.Event().wait(seconds)
    return None, 0.0


@dataclass(frozen=True)
class Turn:
    """Seconds on the wall, CPU seconds of the items, and CPU seconds of this process, of which some are items."""

    wall: float
    items: float
    parent: float
    results: list[Any]


def turn(task: Any, items: Sequence[Any], workers: Workers) -> Turn:
    """All items once."""
    wall, cpu = time.perf_counter(), time.process_time()
    done = spread(task, items, workers=workers).all()
    wall, cpu = time.perf_counter() - wall, time.process_time() - cpu
    return Turn(wall, sum(seconds for _, seconds in done), cpu, [result for result, _ in done])


def duel(name: str, task: Any, items: Sequence[Any], two: Workers, rounds: int) -> tuple[list[Line], Turn, Turn]:
    """One process and two in turn; best of each, and the speed-up."""
    for workers in (HERE, two):
        spread(task, items[:4], workers=workers)  # compiles, starts
    ones, twos = [], []
    for _ in range(rounds):
        ones.append(turn(task, items, HERE))
        twos.append(turn(task, items, two))
    one, other = (min(turns, key=lambda t: t.wall) for turns in (ones, twos))
    same = all(_equal(a, b) for a, b in zip(one.results, other.results, strict=True))
    least, least_two = (min(t.items for t in turns) for turns in (ones, twos))
    handing = min(t.parent for t in twos)
    allowed = least / (least_two / 2 + handing)
    lines = [
        Line(contender=f"{name}, this process", seconds=(one.wall,) * 3, rounds=rounds,
             note=f"{len(items)} items, {least:.3g} s of CPU, {1e3 * least / len(items):.3g} ms an item"),
        Line(contender=f"{name}, {'a Dask cluster of two' if two.cluster else 'two processes'}", rounds=rounds,
             seconds=(other.wall,) * 3, ratio=(other.wall / one.wall,) * 3, target=Target(most=1 / ASKED),
             note=f"{one.wall / other.wall:.2f} times as fast on the wall, {allowed:.2f} by CPU (required: {ASKED}): "
             f"items {least_two:.3g} s of CPU, handing out {1e3 * handing / len(items):.2g} ms an item; results "
             f"{'the same to the last bit' if same else 'NOT the same'}"),
    ]  # fmt: skip
    return lines, one, other


def _equal(a: Any, b: Any) -> bool:
    return np.array_equal(a, b) if isinstance(a, np.ndarray) else a == b


def simulated(number: int, seconds: float, count: int) -> tuple[float, float]:
    """Speed-up over one worker, and CPU seconds an item costs whoever hands out, of `number` workers that wait."""
    task, workers = partial(waits, seconds), Workers(number=number)
    spread(task, range(4 * number), workers=workers)  # starts all
    best = min((turn(task, range(count), workers) for _ in range(3)), key=lambda t: t.wall)
    return count * seconds / best.wall, best.parent / count


def stop(process: subprocess.Popen[bytes]) -> None:
    """Asks a process to end; kills one that does not, as a Dask worker that waits for a lost child may not."""
    process.terminate()
    try:
        process.wait(10)
    except subprocess.TimeoutExpired:
        process.kill()
        process.wait()


@contextlib.contextmanager
def cluster(count: int) -> Generator[str]:
    """Address of a Dask scheduler with `count` workers on this machine, processes of their own."""
    from distributed import Client

    with tempfile.TemporaryDirectory() as folder:
        where = ["--scheduler-file", str(Path(folder) / "scheduler.json"), "--no-dashboard"]
        python = [sys.executable, "-m"]
        scheduler = [*python, "distributed.cli.dask_scheduler", "--host", "127.0.0.1", "--port", "0", *where]
        worker = [*python, "distributed.cli.dask_worker", "--nthreads", "1", *where]
        quiet = {"stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL}
        started = [subprocess.Popen(command, **quiet) for command in [scheduler, *[worker] * count]]
        try:
            with Client(scheduler_file=where[1], timeout=60, set_as_default=False) as client:
                client.wait_for_workers(count, timeout=60)
                address = client.scheduler.address
            yield address
        finally:
            for process in reversed(started):  # workers before the scheduler
                stop(process)


def idle(name: str, workers: Workers, count: int) -> tuple[Line, float]:
    """What an item costs that takes no time: seconds on the wall, CPU of whoever hands out."""
    task = partial(waits, 0.0)
    spread(task, range(8), workers=workers)
    best = min((turn(task, range(count), workers) for _ in range(3)), key=lambda t: t.wall)
    note = f"{1e3 * best.parent / count:.2g} ms of CPU to hand an item out and take its result in"
    return Line(contender=f"nothing, {name}", seconds=(best.wall / count,) * 3, note=note), best.parent / count


def run(*, quick: bool, progress: Callable[[str], None], markdown: Path | None = None) -> list[Line]:
    """One worker, two, and more that only wait; what one item costs to hand out; what 1e9 closed loops would cost."""
    rounds, two = (1 if quick else 7), Workers(number=2)
    seeds = np.random.SeedSequence(1).spawn(40 if quick else 160)
    progress("closed loops")
    lines, one, _ = duel("closed loops", loops, seeds, two, rounds)
    block = one.items / len(seeds)
    progress("fits")
    lines += duel("fits", fits, range(4 if quick else 40), two, min(rounds, 5))[0]
    faster = [1 / line.ratio[0] for line in lines if line.ratio]
    progress("nothing at all")
    lines.append(idle("two processes", two, 200 if quick else 2000)[0])
    if not quick:
        lines += _cluster(seeds, progress)
    scaling: list[tuple[int, float, float, float]] = []
    for number in (4,) if quick else (2, 4, 8, 16, 32):
        progress(f"{number} workers that wait")
        for seconds in (block, 10 * block):
            count = max(min(400, round(4 * number / seconds)), 8 * number)
            faster, each = simulated(number, seconds, count)
            scaling.append((number, seconds, faster, each))
            note = (
                f"{faster:.3g} times as fast as one, {100 * faster / number:.0f} % of ideal; handing out "
                f"{1e3 * each:.2g} ms an item"
            )
            lines.append(Line(contender=f"{number} workers that wait, items of {1e3 * seconds:.3g} ms", note=note))
    hours = 1e9 / LANES * block / 3600
    bill = f"{hours:,.0f} core hours, {PRICE * hours:,.2f} USD at {PRICE} USD per core hour (assumed)"
    lines.append(Line(contender="1e9 closed loops of 2 s", note=bill))
    if markdown is not None:
        rows = [f"| {x.contender} | {'' if x.seconds is None else amount(x.seconds[0])} | {x.note} |" for x in lines]
        machine = (
            f"{os.cpu_count()} processors ({platform.machine()}) shared with others, Python {sys.version.split()[0]}"
        )
        table = ["", f"Measured on {machine}.", "", "| | best on the wall | |", "|---|---|---|", *rows, ""]
        body = [*table, *plan(block, scaling).splitlines()]
        text = page("workers", "More workers", __doc__, body, headline(*faster))
        markdown.write_text(text, encoding="utf-8")
    return lines


def _cluster(seeds: Sequence[Any], progress: Callable[[str], None]) -> list[Line]:
    progress("a Dask cluster of two")
    try:
        with cluster(2) as address:
            shared = Workers(cluster=address)
            return [duel("closed loops", loops, seeds, shared, 3)[0][1], idle("a Dask cluster of two", shared, 1000)[0]]
    except ImportError:
        return [Line(contender="a Dask cluster of two", note="left out: distributed is not installed")]


def headline(loops: float, fits: float) -> str:
    """The result in a sentence, of how many times as fast two processes are."""
    return (
        f"Two processes run closed loops {loops:.2f} times as fast as one, and whole fits {fits:.2f} times ({ASKED} "
        "required)."
    )


def amount(seconds: float) -> str:
    """Seconds with a readable unit."""
    return f"{seconds:.3g} s" if seconds >= 0.1 else f"{1e3 * seconds:.3g} ms"


def lasting(seconds: float) -> str:
    """A long time with a readable unit."""
    unit, size = next((u, n) for u, n in (("h", 3600), ("min", 60), ("s", 1)) if seconds >= n or u == "s")
    return f"{seconds / size:.3g} {unit}"


def plan(block: float, scaling: Sequence[tuple[int, float, float, float]]) -> str:
    """The plan past this machine, from what was measured."""
    handing = float(np.median([each for *_, each in scaling]))
    hours, largest = 1e9 / LANES * block / 3600, 16384 / LANES * block

    def bill(item: float, cores: int) -> str:
        """Time and price: as long as the work takes, or as handing it out takes, and the last item."""
        whole = 3600 * hours
        seconds = max(whole / cores, whole / item * handing) + item
        return f"{lasting(seconds)} | {PRICE * cores * seconds / 3600:,.2f} USD"

    rows = "\n".join(f"| {n:,} | {bill(block, n)} | {bill(largest, n)} |" for n in (1, 16, 64, 256, 1024, 4096))
    return f"""\
## A plan past this machine, on paper

A closed loop (Furuta pendulum, exact dry friction, 2 s at 1 kHz, two Runge-Kutta steps a sample) takes
{1e6 * block / LANES:.3g} µs of one core, so 1e9 of them take {hours:,.0f} core hours.
Assumed, not measured: {PRICE} USD per core hour, and cores as fast as this one; the bill is in proportion to both.
Many cores cost what few cost as long as they have work; what waits for work is paid for, too.

| cores | items of 256 lanes | | items of 16,384 lanes | |
|---|---|---|---|---|
{rows}

- **First the process that hands out.** An item costs it {1e3 * handing:.2g} ms of CPU, whoever works (median of the
  workers that wait). Items of {amount(block)} feed {block / handing:,.0f} workers at best, and fewer where that process
  has no processor to itself, as here; items of 16,384 lanes ({amount(largest)}) feed {largest / handing:,.0f}.
  `ensemble` makes its blocks larger from a million lanes on.
- **Then what travels.** Numbers of a lane are some 200 bytes there and back: 1e9 lanes are 200 GB, which one process
  neither holds nor sends. There an item is a seed of `SeedSequence.spawn`; its worker draws the lanes and returns what
  they reduce to, so that 60,000 items carry some megabytes in all.
- **Then the start.** A worker imports and fetches compiled code for seconds before its first item. With 4,096 cores the
  work lasts less than a minute, so that machines wait longer to begin than they work.
- **Then the end.** The last item keeps one worker while the others wait, for as long as one item takes; fits differ in
  length by ten, and the longest bounds the whole however many workers there are.
- Beyond what one process feeds, several take a share of the seeds each: they need nothing of one another.
- Numbers are the same to the last bit whatever the number of workers on machines of one kind; processors of another
  kind may round a product and a sum at once.
"""
