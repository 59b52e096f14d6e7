"""What the bench answers: its page, what rigs there are, their runs, and a socket for each rig."""

from __future__ import annotations

import asyncio
import json
import time
from collections.abc import AsyncGenerator, Sequence
from contextlib import asynccontextmanager, suppress
from importlib.resources import files
from pathlib import Path
from typing import Any

from starlette.applications import Starlette
from starlette.requests import Request
from starlette.responses import FileResponse, JSONResponse, PlainTextResponse, Response
from starlette.routing import Route, WebSocketRoute
from starlette.websockets import WebSocket, WebSocketDisconnect

from upright._version import __version__
from upright.browser.answers import not_theirs, nothing, report_page, sentence_of
from upright.browser.classroom.overview import Overview
from upright.browser.classroom.room import Classroom
from upright.browser.guard import INSTRUCTOR
from upright.browser.hub import Hub
from upright.browser.identify.fits import Identifications, Shared
from upright.browser.identify.last_use import take_up
from upright.browser.identify.routes import routes as identify_routes
from upright.browser.messages import MOTIONS, ONE_STEP, SWEEP, ClientRequest, read
from upright.browser.outbox import Outbox
from upright.browser.runs import in_own_process, listed
from upright.browser.station import Station, obey
from upright.browser.twin_script import twin_script
from upright.errors import BadInput, UprightError

RATE = 40.0
"""Frames a second."""
RATE_OF_CLASS = 20.0
"""The same of each student's rig: sixty of them are encoded and sent by one processor."""
FIT_OF_CLASS = 180.0
"""Time for a fit where others of a class may wait for theirs [s]; then it ends with the best so far."""
PATIENCE = 10
"""Messages in a row that are not understood, or ten times as many that come too fast, before a connection is closed."""
SWIFTEST = 50.0
"""Messages of a client in a second."""
APART = {"poles": "the last poles are being placed.", "start": "the last start is being prepared."}
"""What each client may have one of on its way in a thread, and what the next one meets meanwhile."""
SCRIPT, STYLE = "text/javascript; charset=utf-8", "text/css; charset=utf-8"
SHARED = {
    "drawing.js": ("upright.live", "drawing.js", SCRIPT),
    "kernel.js": ("upright.live", "kernel.js", SCRIPT),
    "twin.js": ("upright.live", "twin.js", SCRIPT),
    "tokens.css": ("upright.report", "templates/tokens.css", STYLE),
    "bench.js": ("upright.browser", "page/bench.js", SCRIPT),
    "worker.js": ("upright.browser", "page/worker.js", SCRIPT),
    "bench.css": ("upright.browser", "page/bench.css", STYLE),
}
"""What the page is made of, by its name in an address: package, file, type. The scripts are those of the reports."""
NOT_BUILT = (
    "The page of the bench is not built here. In a source tree: npm --prefix bench install && npm --prefix bench run "
    "build. The server works: /api/rigs, /live/NAME."
)


ONE_FILTER = "the twins of a class have one velocity filter; upright bench by itself takes another."


def is_built() -> bool:
    """Whether the page is there."""
    return files("upright.browser").joinpath("page/index.html").is_file()


def application(stations: Sequence[Station], room: Classroom | None = None) -> Starlette:
    """The bench of some rigs, which may be those of a class."""
    shared = None if room is None else Shared(seconds=FIT_OF_CLASS)
    fits = {station.rig.name: Identifications(station.rig, station.folder, shared=shared) for station in stations}
    for station in stations if room is None else ():
        station.take_up(*take_up(station.rig, fits[station.rig.name], station.folder))
    hubs = {station.rig.name: Hub(station) for station in stations}
    grid = None if room is None else Overview(room)
    rate = RATE if grid is None else RATE_OF_CLASS
    scripts: dict[Path, asyncio.Task[str]] = {}

    async def page(_: Request) -> Response:
        content = _content("upright.browser", "page/index.html")
        return PlainTextResponse(NOT_BUILT) if content is None else Response(content, media_type="text/html")

    async def asset(request: Request) -> Response:
        package, name, kind = SHARED.get(request.path_params["name"], ("", "", ""))
        content = _content(package, name) if package else None
        return nothing() if content is None else Response(content, media_type=kind)

    async def rigs(request: Request) -> Response:
        known = [
            {"name": n, "title": h.station.rig.model.name, "kind": h.station.rig.kind, "state": h.station.state,
             "operated": bool(h.station.lease.holder)}
            for n, h in hubs.items()
        ]  # fmt: skip
        of_class: dict[str, Any] = {}
        if grid is not None:
            unit = grid.room.rig.model.plant.coordinates[-1].unit
            of_class = {"class": {"instructor": bool(request.scope.get(INSTRUCTOR)), "unit": unit}}
        return JSONResponse({"version": __version__, "rigs": known, **of_class})

    async def script(request: Request) -> Response:
        name = request.path_params["name"]
        if name not in hubs:
            return nothing()
        rig = hubs[name].station.rig  # a class knows one rig, by one law and those of its fits
        if rig.law_path not in scripts:
            scripts[rig.law_path] = asyncio.create_task(asyncio.to_thread(in_own_process, twin_script, rig))
        try:
            return Response(await asyncio.shield(scripts[rig.law_path]), media_type=SCRIPT)
        except UprightError as error:
            if not isinstance(error, BadInput):  # its process was killed, say: the next one may fare better
                scripts.pop(rig.law_path, None)
            return PlainTextResponse(str(error), status_code=404)
        finally:  # somebody has opened the rig; one after the other, since processors are few
            hubs[name].station.prepare()

    async def runs(request: Request) -> Response:
        hub = hubs.get(request.path_params["name"])
        if hub is None:
            return nothing()
        return JSONResponse(await asyncio.to_thread(listed, hub.station.folder, hub.station.rig.name))

    def readable(request: Request) -> bool:
        """Whether the files of a rig are for whoever wants them: of a class, for operator and instructor alone."""
        hub = hubs[request.path_params["name"]]
        return (
            room is None or bool(request.scope.get(INSTRUCTOR)) or hub.operated_by(request.query_params.get("me", ""))
        )

    async def result(request: Request) -> Response:
        hub = hubs.get(request.path_params["name"])
        if hub is None:
            return nothing()
        if not readable(request):
            return not_theirs()
        return await asyncio.to_thread(_result, hub.station.folder, hub.station.rig.name, request.url.path)

    async def live(socket: WebSocket) -> None:
        hub = hubs.get(socket.path_params["name"])
        joined = None if hub is None else hub.join(socket.query_params.get("me", ""))
        if hub is None or joined is None:
            await socket.close(4404, "no such rig" if hub is None else "too many look on")
            return
        who, outbox = joined
        try:
            await socket.accept()
            await _first(_listen(socket, hub, who, outbox), _speak(socket, outbox))
        finally:
            hub.leave(outbox)

    async def whole(socket: WebSocket) -> None:
        outbox = None if grid is None else grid.join()
        if grid is None or outbox is None:
            await socket.close(4404, "no class" if grid is None else "too many look on")
            return
        try:
            await socket.accept()
            await _first(_listen_to_instructor(socket, grid, outbox), _speak(socket, outbox))
        finally:
            grid.leave(outbox)

    async def pump() -> None:
        due = time.monotonic()
        while True:
            for hub in hubs.values():
                hub.turn()
            if grid is not None:
                grid.turn()
            due = max(due + 1 / rate, time.monotonic())
            await asyncio.sleep(due - time.monotonic())

    @asynccontextmanager
    async def life(_: Starlette) -> AsyncGenerator[None]:
        pumping = asyncio.create_task(pump())
        yield
        for each in fits.values():
            each.close()
        pumping.cancel()
        with suppress(asyncio.CancelledError):
            await pumping

    return Starlette(
        lifespan=life,
        routes=[
            Route("/", page), Route("/assets/{name}", asset), Route("/api/rigs", rigs),
            Route("/api/rigs/{name}/runs", runs), Route("/rigs/{name}/twin.js", script),
            Route("/rigs/{name}/runs/{file}", result), WebSocketRoute("/live/{name}", live),
            *identify_routes(hubs, fits, readable, fixed="" if room is None else ONE_FILTER),
            WebSocketRoute("/class", whole),
        ],
    )  # fmt: skip


async def _listen(socket: WebSocket, hub: Hub, who: str, outbox: Outbox) -> None:
    """Do what a client asks for, until it is gone or asks for nonsense only."""
    wrong, allowed, last, flooded = 0.0, SWIFTEST, time.monotonic(), False
    apart: dict[str, asyncio.Task[None]] = {}
    with suppress(WebSocketDisconnect):
        while wrong < PATIENCE:
            received = await socket.receive()
            if received["type"] == "websocket.disconnect":
                return
            now = time.monotonic()
            allowed, last = min(SWIFTEST, allowed + SWIFTEST * (now - last)), now
            try:
                message = read(received.get("text") or "")
                if allowed < 1.0 and message.do != "stop":
                    wrong += 0.1
                    if not flooded:
                        outbox.note(_error(BadInput(f"at most {SWIFTEST:g} messages a second.")))
                    flooded = True
                    continue
                allowed, flooded = allowed - 1.0, False
                kind = _apart(message)
                if not kind:
                    obey(hub.station, who, message)
                elif kind in apart and not apart[kind].done():
                    raise BadInput(APART[kind])
                elif kind != "poles" or not _soon(hub, who, message):
                    apart[kind] = asyncio.create_task(_obey_apart(hub, who, message, outbox))
                wrong = 0.0
            except UprightError as error:
                wrong += 1.0
                if not outbox.note(_error(error)):
                    return
        await socket.close(4400, "ten messages in a row were not understood")


async def _listen_to_instructor(socket: WebSocket, grid: Overview, outbox: Outbox) -> None:
    """The same for a whole class."""
    wrong = 0
    with suppress(WebSocketDisconnect):
        while wrong < PATIENCE:
            received = await socket.receive()
            if received["type"] == "websocket.disconnect":
                return
            try:
                grid.obey(received.get("text") or "")
                wrong = 0
            except UprightError as error:
                wrong += 1
                outbox.note(_error(error))
        await socket.close(4400, "ten messages in a row were not understood")


def _apart(message: ClientRequest) -> str:
    """What a request is called that may take a while, in which a stop must not wait; empty for others."""
    if message.do == "start" and message.fields.get("from") not in (MOTIONS, SWEEP, ONE_STEP):
        return ""
    return message.do if message.do in APART else ""


def _soon(hub: Hub, who: str, message: ClientRequest) -> bool:
    """Whether poles could be placed in a millisecond, where another thread would be waited for."""
    try:
        obey(hub.station, who, ClientRequest(do="poles", fields={**message.fields, "soon": True}))
    except TimeoutError:
        return False
    return True


async def _obey_apart(hub: Hub, who: str, message: ClientRequest, outbox: Outbox) -> None:
    try:
        await asyncio.to_thread(obey, hub.station, who, message)
    except UprightError as error:
        outbox.note(_error(error))


async def _speak(socket: WebSocket, outbox: Outbox) -> None:
    with suppress(WebSocketDisconnect, RuntimeError):
        while True:
            content = await outbox.next()
            await (socket.send_text(content) if isinstance(content, str) else socket.send_bytes(content))


async def _first(*doing: Any) -> None:
    """Do several things until the first of them ends."""
    tasks = [asyncio.create_task(each) for each in doing]
    try:
        await asyncio.wait(tasks, return_when=asyncio.FIRST_COMPLETED)
    finally:
        for task in tasks:
            task.cancel()
        await asyncio.gather(*tasks, return_exceptions=True)


def _error(error: UprightError) -> str:
    return json.dumps({"type": "error", "sentence": sentence_of(error)})


def _content(package: str, name: str) -> bytes | None:
    place = files(package).joinpath(name)
    return place.read_bytes() if place.is_file() else None


def _result(folder: Path, name: str, path: str) -> Response:
    """A log or a report that is listed."""
    for run in listed(folder, name):
        if run.get("log") == path:
            return FileResponse(folder / f"{run['id']}.mcap", filename=f"{name}-{run['id']}.mcap")
        if run.get("response") == path:
            return FileResponse(folder / f"{run['id']}.frequency.csv", filename=f"{name}-{run['id']}.frequency.csv")
        if run.get("report") == path:
            return report_page(folder / f"{run['id']}.html")
    return nothing()
