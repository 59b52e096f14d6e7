"""Does a bench that is used for hours keep its memory?

A server with the twin of the Furuta pendulum is a process of its own, its loop another, its clients a third, a page in
Chromium a fourth where there is one. An operator starts runs of a minute and taps; watchers look on, and one of them
leaves and comes back every five seconds; lists of runs and fits are asked for as pages do. Each run leaves a log and a
report. Memory is what each process has to itself (`RssAnon`), of the page its JavaScript heap after a collection.

After a first quarter, in which everything has been used once, a line is put through the means of ten parts of the rest:
MB an hour with the 95 % interval that their scatter about it gives. Asked: no more than 5 MB an hour, 40 in 8 hours.
A loop's process lives for one run, so that its line is that of the longest one.
"""

from __future__ import annotations

import asyncio
import json
import os
import shutil
import threading
import time
from collections.abc import Callable, Sequence
from contextlib import ExitStack, suppress
from multiprocessing import get_context
from multiprocessing.connection import Connection
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np

from benchmarks.measure import Line, Target

SECONDS, QUICK = 900.0, 60.0
LONG, SHORT, WATCHERS = 240.0, 20.0, 8
"""Of the longest run, which is the first, and of the others [s]; how many look on."""
OFTEN = 2.0
"""Time between two looks at the memory [s]."""
ALLOWED = 5.0
"""MB an hour."""
BLOCKS, WARM = 10, 0.25


def run(*, quick: bool, progress: Callable[[str], None]) -> list[Line]:
    """Use a bench, and look at its memory meanwhile."""
    seconds = QUICK if quick else SECONDS
    context = get_context("spawn")
    with TemporaryDirectory() as folder:
        ours, theirs = context.Pipe()
        server = context.Process(target=_serve, args=(theirs, folder))
        server.start()
        url = ours.recv()
        watched, at_page = context.Pipe(), context.Pipe()
        clients = context.Process(target=_clients, args=(watched[1], url, seconds), daemon=True)
        page = context.Process(target=_page, args=(at_page[1], url, seconds), daemon=True)
        clients.start()
        page.start()
        memory = _looked(server.pid or 0, seconds, progress)
        used = watched[0].recv()
        heap = at_page[0].recv() if at_page[0].poll(60.0) else []
        logs = len(list(Path(folder).rglob("*.mcap")))
        ours.send("close")
        for each in (clients, page, server):
            each.join(60.0)
            each.kill()
    note = f"{seconds:.0f} s, {logs} runs, {used['taps']} taps, {used['frames']} frames, {used['joined']} comings"
    return [
        _line("server", memory["server"], note),
        _line("loop, its longest run", memory["loop"], ""),
        _line("page's JavaScript heap", heap, "") if heap else Line(contender="page", note="no Chromium here"),
    ]


def _line(name: str, looks: Sequence[tuple[float, float]], note: str) -> Line:
    if len(looks) < 3 * BLOCKS:
        return Line(contender=name, note=f"only {len(looks)} looks")
    t, size = np.array(looks).T
    rest = t >= t[0] + WARM * (t[-1] - t[0])
    slope, half = trend(t[rest] / 3600, size[rest])
    about = f"{slope:+.2f} MB/h, 95 % within ±{half:.2f}; {size[rest][0]:.1f} to {size[rest][-1]:.1f} MB"
    ratio = tuple(x / ALLOWED for x in (slope, slope - half, slope + half))
    return Line(
        contender=f"{name}: MB/h by {ALLOWED:g}", ratio=(ratio[0], ratio[1], ratio[2]), target=Target(most=1.0),
        note="; ".join(filter(None, (about, note))),
    )  # fmt: skip


def trend(t: np.ndarray[Any, Any], y: np.ndarray[Any, Any]) -> tuple[float, float]:
    """Slope of a line through the means of `BLOCKS` parts, and half the width of its 95 % interval."""
    from scipy.stats import t as student

    blocks = [(float(a.mean()), float(b.mean())) for a, b in zip(
        np.array_split(t, BLOCKS), np.array_split(y, BLOCKS), strict=True
    )]  # fmt: skip
    x, z = np.array(blocks).T
    slope, level = np.polyfit(x, z, 1)
    free = len(x) - 2
    error = np.sqrt(np.sum((z - level - slope * x) ** 2) / free / np.sum((x - x.mean()) ** 2))
    return float(slope), float(student.ppf(0.975, free) * error)


def _looked(pid: int, seconds: float, progress: Callable[[str], None]) -> dict[str, list[tuple[float, float]]]:
    """Memory of the server, and of its child that lived longest, the loop of the longest run [MB], by time [s]."""
    pause = threading.Event()
    began, server, loops = time.monotonic(), list[tuple[float, float]](), dict[int, list[tuple[float, float]]]()
    told = 0.0
    while (now := time.monotonic() - began) < seconds:
        server.append((now, _anonymous(pid)))
        for child in _children(pid):
            if b"resource_tracker" not in _called(child):
                loops.setdefault(child, []).append((now, _anonymous(child)))
        if now - told > 60.0:
            told = now
            progress(f"{now:.0f} of {seconds:.0f} s, server {server[-1][1]:.1f} MB")
        pause.wait(OFTEN if seconds > QUICK else OFTEN / 4)
    longest = max(loops.values(), key=len, default=[])
    return {"server": server, "loop": [look for look in longest if look[1] > 0]}


def _anonymous(pid: int) -> float:
    """What a process has to itself [MB]; 0 where it is gone."""
    with suppress(OSError, StopIteration):
        text = Path(f"/proc/{pid}/status").read_text(encoding="utf-8")
        line = next(line for line in text.splitlines() if line.startswith("RssAnon"))
        return int(line.split()[1]) / 1024
    return 0.0


def _children(pid: int) -> list[int]:
    with suppress(OSError):
        return [
            int(child) for task in Path(f"/proc/{pid}/task").iterdir()
            for child in (task / "children").read_text(encoding="utf-8").split()
        ]  # fmt: skip
    return []


def _called(pid: int) -> bytes:
    """With which command a process began."""
    with suppress(OSError):
        return Path(f"/proc/{pid}/cmdline").read_bytes()
    return b""


def _serve(pipe: Connection, folder: str) -> None:
    from upright.browser.serve import open_bench

    with open_bench([], [], Path(folder), fifo=False) as bench:
        pipe.send(bench.url)
        pipe.recv()


def _clients(pipe: Connection, url: str, seconds: float) -> None:
    pipe.send(asyncio.run(_use(url, seconds)))


async def _use(url: str, seconds: float) -> dict[str, int]:
    from websockets.asyncio.client import connect

    address = url.replace("http", "ws", 1) + "live/furuta"
    used = {"taps": 0, "frames": 0, "joined": 0}
    until = time.monotonic() + seconds
    state = {"now": ""}

    async def look(stay: float, mine: bool) -> None:
        while time.monotonic() < until:
            used["joined"] += 1
            async with connect(address, max_queue=None) as socket:
                acting = asyncio.create_task(operate(socket)) if mine else None
                leave = min(until, time.monotonic() + stay)
                with suppress(TimeoutError):
                    async with asyncio.timeout(leave - time.monotonic()):
                        async for content in socket:
                            used["frames"] += isinstance(content, bytes)
                            if mine and isinstance(content, str):
                                state["now"] = json.loads(content).get("state", state["now"])
                if acting is not None:
                    acting.cancel()

    async def operate(socket: Any) -> None:
        await socket.send(json.dumps({"do": "operate"}))
        lasts = LONG if seconds > QUICK else seconds / 2
        while True:
            await socket.send(json.dumps({"do": "start", "seconds": lasts}))
            over = time.monotonic() + lasts + 5.0
            while time.monotonic() < over:
                await asyncio.sleep(1.0)
                if state["now"] == "running":
                    used["taps"] += 1
                    await socket.send(json.dumps({"do": "tap", "coordinate": "theta", "speed": 0.1}))
            if state["now"] == "stopped":
                await socket.send(json.dumps({"do": "rearm"}))
            lasts = SHORT if seconds > QUICK else seconds / 6

    async def read() -> None:
        from urllib.request import urlopen

        while time.monotonic() < until:
            for path in ("runs", "fits", "recording"):
                with suppress(OSError):
                    await asyncio.to_thread(lambda path=path: urlopen(f"{url}api/rigs/furuta/{path}").read())
            await asyncio.sleep(2.0)

    await asyncio.gather(look(1e9, True), look(5.0, False), *(look(1e9, False) for _ in range(WATCHERS)), read())
    return used


def _page(pipe: Connection, url: str, seconds: float) -> None:
    """Heap of a page that looks on [MB], by time [s]; nothing where there is no browser."""
    with ExitStack() as stack:
        try:
            from playwright.sync_api import sync_playwright

            browser = stack.enter_context(sync_playwright()).chromium.launch(
                executable_path=os.environ.get("CHROMIUM") or shutil.which("chromium"), args=["--no-sandbox"]
            )
        except Exception:
            pipe.send([])
            return
        page = browser.new_page()
        page.goto(url)
        session, looks, began = page.context.new_cdp_session(page), list[tuple[float, float]](), time.monotonic()
        while (now := time.monotonic() - began) < seconds:
            session.send("HeapProfiler.collectGarbage")
            looks.append((now, session.send("Runtime.getHeapUsage")["usedSize"] / 2**20))
            page.wait_for_timeout(5000 if seconds > QUICK else 500)
        browser.close()
        pipe.send(looks)
