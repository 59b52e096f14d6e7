"""What the bench answers about logs and fits: a log is brought, a fit begun and interrupted by the operator alone."""

from __future__ import annotations

import asyncio
import json
from collections.abc import Awaitable, Callable, Mapping
from contextlib import suppress
from typing import Any

from starlette.requests import ClientDisconnect, Request
from starlette.responses import FileResponse, JSONResponse, PlainTextResponse, Response
from starlette.routing import Route

from upright.browser.answers import not_theirs, nothing, report_page, sentence_of
from upright.browser.hub import Hub
from upright.browser.identify.fits import COLUMNS, LARGEST, OWN, Identifications
from upright.browser.identify.last_use import LastUse, keep_use
from upright.browser.messages import LONGEST
from upright.browser.rig import HARDWARE, BenchRig
from upright.browser.station import Station
from upright.errors import BadInput, UprightError

WHO = "x-bench-me"
"""Header by which a page says who it is; no page of another site can send it."""
SLOWEST = 120.0
"""Time for a log to come [s]."""
_TEXT = 100
FILES = {"html": "report.html", "json": "facts.json", "fit": "fit.json"}
"""By the ending of an address."""

Answering = Callable[[Request], Awaitable[Response]]


def routes(
    hubs: Mapping[str, Hub],
    fits: Mapping[str, Identifications],
    readable: Callable[[Request], bool],
    *,
    fixed: str = "",
) -> list[Route]:
    """The addresses of some rigs.

    Parameters
    ----------
    readable : callable
        Whether the files of a request's rig are for whoever sends it.
    fixed : str
        Why all rigs have one velocity filter, where that is so.
    """
    adopting = set[str]()  # rigs for which a law is on its way, which takes a process some seconds
    designing = asyncio.Lock()  # one after the other: a class may want sixty, and processors are few

    async def described(request: Request) -> Response:
        own = fits.get(request.path_params["name"])
        return nothing() if own is None else JSONResponse(await asyncio.to_thread(own.described))

    async def picture(request: Request) -> Response:
        own = fits.get(request.path_params["name"])
        return nothing() if own is None else JSONResponse(own.picture())

    async def recorded(request: Request) -> Response:
        hub = hubs.get(request.path_params["name"])
        if hub is None:
            return nothing()
        recording = hub.station.recording
        return JSONResponse(None if recording is None else await asyncio.to_thread(recording.described))

    async def written(request: Request) -> Response:
        own = fits.get(request.path_params["name"])
        key, _, end = request.path_params["file"].rpartition(".")
        path = None if own is None or end not in FILES else await asyncio.to_thread(own.file, key, FILES[end])
        if path is None:
            return nothing()
        if not readable(request):
            return not_theirs()
        if end == "html":
            return report_page(path)
        name = f"{request.path_params['name']}-{key}.json" if end == "fit" else None
        return FileResponse(path, media_type="application/json", filename=name)

    def for_operator(answer: Callable[[Request, Identifications], Awaitable[Response]]) -> Answering:
        async def checked(request: Request) -> Response:
            name = request.path_params["name"]
            if name not in hubs:
                return nothing()
            try:
                _operates(hubs[name], request.headers.get(WHO, ""))
                return await answer(request, fits[name])
            except UprightError as error:
                await _rest(request)
                return PlainTextResponse(sentence_of(error), status_code=400)
            except ClientDisconnect:
                return nothing()

        return checked

    async def bring(request: Request, own: Identifications) -> Response:
        data = await _body(request, LARGEST, f"a log of at most {LARGEST >> 20} MB")
        name = request.query_params.get("name", "")
        return JSONResponse(await asyncio.to_thread(own.keep, name, data))

    async def begin(request: Request, own: Identifications) -> Response:
        log, of, measured = _wanted(await _body(request, LONGEST, f"a message of at most {LONGEST} bytes"))
        await asyncio.to_thread(own.begin, log, of, measured)
        return JSONResponse({})

    async def interrupt(_: Request, own: Identifications) -> Response:
        own.interrupt()
        return JSONResponse({})

    async def weigh(request: Request, own: Identifications) -> Response:
        if fixed:
            raise BadInput("in a class nobody's masses are unbolted; upright loadings weighs a twin of such a rig.")
        own.weighing.begin(hubs[request.path_params["name"]].station.rig)
        return JSONResponse({})

    async def weighed(request: Request) -> Response:
        own = fits.get(request.path_params["name"])
        return nothing() if own is None else JSONResponse(own.weighing.described())

    async def adopt(request: Request, own: Identifications) -> Response:
        key, memory, confirm = _model_named(await _body(request, LONGEST, f"a message of at most {LONGEST} bytes"))
        if fixed and memory is not None:
            raise BadInput(fixed)
        name = request.path_params["name"]
        station = hubs[name].station
        station.at_rest()
        if station.rig.kind == HARDWARE and not confirm:
            raise BadInput("this changes what drives a rig that can really move; confirm it.")
        if name in adopting:
            raise BadInput("its law is being designed for another model already; wait until that is there.")
        adopting.add(name)
        try:
            async with designing:
                rig = await asyncio.to_thread(_chosen, station, own, key, memory)
            station.describe(request.headers.get(WHO, ""), rig)
            if not fixed:  # a class begins as it came
                await asyncio.to_thread(_keep, station, own, rig)
        finally:
            adopting.discard(name)
        return JSONResponse({})

    return [
        Route("/api/rigs/{name}/model", for_operator(adopt), methods=["POST"]),
        Route("/api/rigs/{name}/fits", described, methods=["GET"]),
        Route("/api/rigs/{name}/fits/now", picture, methods=["GET"]),
        Route("/api/rigs/{name}/recording", recorded, methods=["GET"]),
        Route("/api/rigs/{name}/weighing", weighed, methods=["GET"]),
        Route("/api/rigs/{name}/weighing", for_operator(weigh), methods=["POST"]),
        Route("/api/rigs/{name}/fits", for_operator(begin), methods=["POST"]),
        Route("/api/rigs/{name}/fits", for_operator(interrupt), methods=["DELETE"]),
        Route("/api/rigs/{name}/logs", for_operator(bring), methods=["POST"]),
        Route("/rigs/{name}/fits/{file}", written, methods=["GET"]),
    ]


def _wanted(text: bytes) -> tuple[str, str, dict[str, str]]:
    """Which log a fit is to be of, who says what rig it was, and what of that was measured."""
    try:
        content: Any = json.loads(text)
        log, of, known = content["log"], content["of"], dict(content.get("known", {}))
    except (ValueError, RecursionError, KeyError, TypeError, AttributeError):
        log, of, known = None, None, {}
    if not isinstance(log, str) or of not in (OWN, COLUMNS):
        raise BadInput(f'a fit is begun by {{"log": "run", "of": "{OWN}"}}, or of its "{COLUMNS}".')
    if not all(isinstance(text, str) and len(text) <= _TEXT for pair in known.items() for text in pair):
        raise BadInput('what was measured is a text by its name, such as {"m_p": "0.22 kg"}.')
    return log, of, known


def _model_named(text: bytes) -> tuple[str | None, float | None, bool]:
    """Which fit is to describe a rig and which memory its velocities' filter is to have, None for what stays; sure?"""
    try:
        content: Any = json.loads(text)
        key, memory, confirm = content.get("fit"), content.get("memory"), content.get("confirm") is True
        number = isinstance(memory, int | float) and not isinstance(memory, bool)
        read = isinstance(key, str | None) and (memory is None or number) and (key, memory) != (None, None)
        memory = float(memory) if read and memory is not None else None
    except (ValueError, RecursionError, AttributeError, OverflowError):
        key, memory, confirm, read = None, None, False, False
    if not read:
        raise BadInput(
            'a model is chosen by {"fit": "fit-1"}, and by {"fit": ""} the one that the rig came with; the filter of '
            'its velocities by {"memory": 0.8}.'
        )
    return key, memory, confirm


def _chosen(station: Station, own: Identifications, key: str | None, memory: float | None) -> BenchRig:
    """The rig by another fit, by another filter, or both."""
    rig = station.rig if key is None else own.described_by(key)
    if memory is not None:
        rig = rig.with_memory(memory, rig.law_path.parent if rig.fit else station.folder)
    rig = station.known(rig)
    _ = rig.scene  # which is computed once, and by the server's loop if not here
    return rig


def _keep(station: Station, own: Identifications, rig: BenchRig) -> None:
    try:
        keep_use(rig, own.came, station.folder)
    except OSError as error:  # it is used so all the same
        station.last_use = LastUse(sentence=f"The next bench will not know how {rig.name} is used now: {error}.")


def _operates(hub: Hub, who: str) -> None:
    """Refuse everybody but the operator, whom the first one becomes who is at a page here."""
    if who not in hub.clients.values():
        raise BadInput("this is for the page of this bench; open it.")
    if not hub.station.lease.take(who):
        raise BadInput("somebody else operates it.")


async def _rest(request: Request) -> None:
    """Take what a client still sends of a refused request: who is sending hears no answer."""
    came = _announced(request)
    if came > LARGEST:
        return
    with suppress(ClientDisconnect, TimeoutError, RuntimeError):
        async with asyncio.timeout(SLOWEST):
            async for chunk in request.stream():
                came += len(chunk)
                if came > 2 * LARGEST:
                    return


def _announced(request: Request) -> int:
    """Bytes that are to come; 0 where nobody says."""
    length = request.headers.get("content-length", "0")
    return int(length) if length.isdecimal() and len(length) < 20 else 1 << 62


async def _body(request: Request, most: int, what: str) -> bytes:
    if _announced(request) > most:
        raise BadInput(f"this takes {what}.")
    data = bytearray()
    try:
        async with asyncio.timeout(SLOWEST):
            async for chunk in request.stream():
                data += chunk
                if len(data) > most:
                    raise BadInput(f"this takes {what}.")
    except TimeoutError:
        raise BadInput(f"it did not come within {SLOWEST:g} s.") from None
    return bytes(data)
