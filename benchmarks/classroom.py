"""Can one process keep sixty twins in time while sixty students, and their instructor, look on?

Everybody of a class starts their own twin and is sent all of its samples; the instructor is sent the class. The server
is this process, the twins another, all clients a third: three on however many processors there are. A tick is late when
its slice of 16 was not through by the time of the next one.
"""

from __future__ import annotations

import asyncio
import json
import os
import time
from contextlib import suppress
from http.client import HTTPConnection
from multiprocessing import get_context
from multiprocessing.connection import Connection
from pathlib import Path
from tempfile import TemporaryDirectory
from urllib.parse import urlsplit

from benchmarks.measure import Line, Target
from upright.browser.serve import open_bench

STUDENTS, GRID = 60, 2.0
"""Asked: so many of each, and kB/s of the instructor's page at most (issue 25: "one small frame")."""


def class_lines(seconds: float) -> list[Line]:
    """Late ticks, and what it costs."""
    context = get_context("spawn")
    ours, theirs = context.Pipe()
    with TemporaryDirectory() as folder:
        roster = Path(folder) / "roster.csv"
        roster.write_text("name\n" + "\n".join(f"s{k}" for k in range(STUDENTS)), encoding="utf-8")
        with open_bench([], [], Path(folder), roster=roster, report=lambda *_: "") as bench:
            room = bench.room
            assert room is not None
            clients = context.Process(target=_clients, args=(theirs, bench.url, _cookie(bench.instructor_url), seconds))
            clients.start()
            ours.recv()  # everybody's twin runs
            late, ticks, server, twins, began = room.late, room.ticks, time.process_time(), _spent(room.pid), _now()
            counted = ours.recv()
            late, ticks, lasted = room.late - late, room.ticks - ticks, _now() - began
            server, twins = time.process_time() - server, _spent(room.pid) - twins
            standing = sum(station.state == "running" for station in room.stations)
            priority = room.priority
            ours.send("go home")
            clients.join()
    share: float = late / max(1, ticks)
    rate: float = counted["grid"] / lasted / 1e3
    grid = rate / GRID
    return [
        Line(
            contender=f"{STUDENTS} twins and {STUDENTS} clients: late ticks", ratio=(share, share, share),
            target=Target(most=0.0), note=f"{late} late, {ticks} ticks of each of {standing} twins; {priority}; twins "
            f"{100 * twins / lasted:.0f} %, server {100 * server / lasted:.0f} % of a processor",
        ),
        Line(
            contender=f"{STUDENTS} students in one frame: kB/s by {GRID:g}", ratio=(grid, grid, grid),
            target=Target(most=1.0), note=f"{rate:.2f} kB/s; a student's own {counted['own'] / lasted / 1e3:.1f} kB/s",
        ),
    ]  # fmt: skip


def _now() -> float:
    return time.monotonic()


def _spent(pid: int) -> float:
    """Time that a process has had of a processor [s]; 0 where the system does not tell."""
    with suppress(OSError):
        fields = Path(f"/proc/{pid}/stat").read_text(encoding="utf-8").rpartition(") ")[2].split()
        return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")
    return 0.0


def _cookie(url: str) -> str:
    """The instructor's, which the bench gives with a page to go on to."""
    address = urlsplit(url)
    connection = HTTPConnection(address.netloc)
    connection.request("GET", f"/?{address.query}")
    cookie = connection.getresponse().headers["set-cookie"]
    connection.close()
    return str(cookie).split(";")[0]


def _clients(pipe: Connection, url: str, cookie: str, seconds: float) -> None:
    asyncio.run(_attend(pipe, url.replace("http", "ws", 1), cookie, seconds))


async def _attend(pipe: Connection, address: str, cookie: str, seconds: float) -> None:
    from websockets.asyncio.client import connect

    counted = {"grid": 0, "own": 0}
    there = 0

    async def instructor() -> None:
        async with connect(f"{address}class", additional_headers={"Cookie": cookie}) as socket:
            async for content in socket:
                counted["grid"] += len(content) + (2 if len(content) < 126 else 4)

    async def student(k: int) -> None:
        nonlocal there
        begun = False
        async with connect(f"{address}live/s{k}", max_queue=None) as socket:
            for do in ("operate", "start"):
                await socket.send(json.dumps({"do": do}))
            async for content in socket:
                counted["own"] += (len(content) + 4) * (k == 0)
                if not begun and isinstance(content, str) and json.loads(content).get("state") == "running":
                    begun, there = True, there + 1

    everybody = [asyncio.create_task(each) for each in (instructor(), *(student(k) for k in range(STUDENTS)))]
    while there < STUDENTS:
        await asyncio.sleep(0.1)
    counted.update(grid=0, own=0)
    pipe.send("running")
    await asyncio.sleep(seconds)
    pipe.send(dict(counted))
    await asyncio.to_thread(pipe.recv)
    for task in everybody:
        task.cancel()
    await asyncio.gather(*everybody, return_exceptions=True)
