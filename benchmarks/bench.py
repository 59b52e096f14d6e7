"""What does a browser cost the loop? Bytes of every sample, from click to plant, and late ticks with 120 watchers.

The twin of the Furuta pendulum runs by the clock on the wall, 1131 ticks a second, with the law and all supervision of
a run; its server is this process, its loop another, and all who look on are a third. Taps and poles are timed from
their sending to the tick that takes them, on one clock; poles are placed in between. Bytes are those of frames and
notes with their headers, for each sample, at 1 kHz. Late ticks are those of the whole run with so many watchers.
At last a class of sixty, see `benchmarks.classroom`.
"""

from __future__ import annotations

import asyncio
import json
import threading
import time
from collections.abc import Callable
from multiprocessing import get_context
from multiprocessing.connection import Connection
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from benchmarks.classroom import class_lines
from benchmarks.measure import Line, Target, spread
from upright.browser.serve import open_bench
from upright.realtime.process import run_in_process

KILOBYTES, COMMAND, WATCHERS = 15.0, 5e-3, 120
"""Asked: kB/s of a client for all samples of 1 kHz, median from a click to the plant [s]; how many watch."""
SECONDS, QUICK = 6.0, 3.0
EVERY = 0.1
"""Time between two clicks [s]."""
HEADER = 4  # of a frame of the socket with more than 125 bytes


def run(*, quick: bool, progress: Callable[[str], None]) -> list[Line]:
    """A run with the operator alone, then one with everybody."""
    lines: list[Line] = []
    seconds = QUICK if quick else SECONDS
    for watchers in (0, WATCHERS):
        progress(f"{watchers} watchers")
        lines += _lines(watchers, *_served(watchers, seconds))
    progress("a class")
    return lines + class_lines(seconds)


def _served(watchers: int, seconds: float) -> tuple[dict[str, Any], dict[str, list[float]], Any]:
    """What the clients counted, seconds from a click to the plant, and how the run ended."""
    ends: list[Any] = []

    def carry(order: Any, **more: Any) -> Any:
        ends.append(run_in_process(order, **more))
        return ends[-1]

    context = get_context("spawn")
    ours, theirs = context.Pipe()
    with (
        TemporaryDirectory() as folder,
        open_bench([], [], Path(folder), carry=carry, report=lambda *_: "") as bench,
    ):
        clients = context.Process(target=_clients, args=(theirs, bench.url, watchers, seconds), daemon=True)
        clients.start()
        taken = _taken(bench.stations[0], ours)
        counted = ours.recv()
        clients.join()
    if len(taken) != len(counted["sent"]):
        raise RuntimeError(
            f"of {len(counted['sent'])} clicks the loop took {len(taken)}, so that no two belong together"
        )
    late: dict[str, list[float]] = {"tap": [], "poles": []}
    for (kind, sent), arrived in zip(counted["sent"], taken, strict=True):
        late[kind].append(1e-9 * arrived - sent)
    return counted, late, ends[0]


def _taken(station: Any, pipe: Connection) -> list[int]:
    """When the loop took each click [ns]."""
    out: list[int] = []
    pause = threading.Event()
    while not pipe.poll():
        if station.desk is not None and (last := station.desk.taken) and last not in out[-1:]:
            out.append(last)
        pause.wait(0.002)
    return out


def _clients(pipe: Connection, url: str, watchers: int, seconds: float) -> None:
    pipe.send(asyncio.run(_look_on(url.replace("http", "ws", 1) + "live/furuta", watchers, seconds)))


async def _look_on(address: str, watchers: int, seconds: float) -> dict[str, Any]:
    from websockets.asyncio.client import connect

    counted = {"bytes": 0, "samples": 0, "sent": list[tuple[str, float]](), "watched": 0}
    running, over = asyncio.Event(), asyncio.Event()
    poles: list[Any] = []

    async def look(mine: bool) -> None:
        async with connect(address, max_queue=None) as socket:
            if mine:
                await socket.send(json.dumps({"do": "operate"}))
                await socket.send(json.dumps({"do": "start"}))
                acting = asyncio.create_task(act(socket))
            async for content in socket:
                if mine and running.is_set():
                    counted["bytes"] += len(content) + HEADER
                counted["watched"] += isinstance(content, bytes)
                if isinstance(content, bytes):
                    if mine and running.is_set():
                        counted["samples"] += int.from_bytes(content[4:6], "little")
                elif mine:
                    note = json.loads(content)
                    poles[:] = note.get("poles", poles)
                    if note.get("state") == "running":
                        running.set()
                if over.is_set():
                    break
            if mine:
                await acting

    async def act(socket: Any) -> None:
        await running.wait()
        first, k = list(poles), 0
        until = time.monotonic() + seconds
        while time.monotonic() < until:
            await asyncio.sleep(EVERY)
            kind, k = ("poles" if k % 4 == 3 else "tap"), k + 1
            faster = 1.0 + 0.05 * (k % 8 == 0)
            fields = (
                {"poles": [[faster * re, faster * im] for re, im in first]} if kind == "poles"
                else {"coordinate": "theta", "speed": 0.01 * (-1) ** k}
            )  # fmt: skip
            counted["sent"].append((kind, time.monotonic()))
            await socket.send(json.dumps({"do": kind, **fields}))
        await asyncio.sleep(EVERY)
        await socket.send(json.dumps({"do": "stop"}))
        over.set()

    await asyncio.gather(look(True), *(look(False) for _ in range(watchers)))
    return counted


def _lines(watchers: int, counted: dict[str, Any], late: dict[str, list[float]], end: Any) -> list[Line]:
    who = f"{watchers} watchers" if watchers else "operator alone"
    rate = counted["bytes"] / counted["samples"]  # bytes a sample are kB/s at 1 kHz
    priority = end.warning or "FIFO"
    share = end.late / max(1, end.ticks + end.late)
    taps, poles = len(late["tap"]), len(late["poles"])
    return [
        Line(
            contender=f"{who}: kB/s of a client at 1 kHz by {KILOBYTES:g}", ratio=(rate / KILOBYTES,) * 3,
            target=Target(most=1.0), note=f"{rate:.2f} kB/s, {counted['samples']} samples",
        ),
        Line(
            contender=f"{who}: tap to plant", seconds=spread(late["tap"]),
            target=Target(most=COMMAND, of="seconds"), note=f"{taps} taps",
        ),
        Line(
            contender=f"{who}: poles to plant", seconds=spread(late["poles"]),
            target=Target(most=COMMAND, of="seconds"), note=f"{poles} sets of poles, placed on the way",
        ),
        Line(
            contender=f"{who}: late ticks", note=f"{end.late} late, {end.ticks} ticks ({100 * share:.2g} %); "
            f"{counted['watched']} frames sent; {priority}",
        ),
    ]  # fmt: skip
