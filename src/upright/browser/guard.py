"""Who may speak to the bench at all? This machine, and with a token those to whom its owner gave it.

A page of somebody else's in the same browser can send requests here, and a name of theirs can lead here (DNS
rebinding): both are known by the headers Host, Origin and Sec-Fetch-Site, which no page can write.
"""

from __future__ import annotations

import asyncio
import hmac
from collections.abc import Awaitable, Callable, MutableMapping
from contextlib import suppress
from http.cookies import CookieError, SimpleCookie
from typing import Any
from urllib.parse import parse_qs

COOKIE, OF_CLASS = "upright-bench", "upright-class"
INSTRUCTOR = "upright.instructor"
"""Of a request's scope: whether it comes from the instructor of a class."""
POLICY = (
    "default-src 'none'; script-src 'self' 'wasm-unsafe-eval'; style-src 'self'; img-src 'self' data:; "
    "connect-src 'self'; worker-src 'self'; frame-src 'self'; base-uri 'none'; form-action 'none'; "
    "frame-ancestors 'self'"
)
HEADERS = {
    "content-security-policy": POLICY,
    "x-content-type-options": "nosniff",
    "referrer-policy": "no-referrer",
    "cache-control": "no-store",
    "cross-origin-resource-policy": "same-origin",
    "cross-origin-opener-policy": "same-origin",
}
"""Of every answer that has none of its own."""

Scope = MutableMapping[str, Any]
Receive = Callable[[], Awaitable[MutableMapping[str, Any]]]
Send = Callable[[MutableMapping[str, Any]], Awaitable[None]]
App = Callable[[Scope, Receive, Send], Awaitable[None]]


class Guard:
    """An application behind the checks.

    Parameters
    ----------
    hosts : frozenset of str
        Values of Host that are this machine.
    token : str
        Needed of everybody, once as ``?token=...`` and then as a cookie; nothing is where it is empty.
    instructor : str
        Token of the instructor of a class, once as ``?instructor=...`` and then as a cookie; it stands for the other
        one too. Paths below ``/class`` answer nobody else.
    """

    def __init__(self, app: App, *, hosts: frozenset[str], token: str = "", instructor: str = "") -> None:
        self._app, self._hosts, self._token, self._instructor = app, hosts, token, instructor
        self._closing = asyncio.Event()
        self._loop: asyncio.AbstractEventLoop | None = None

    def close(self) -> None:
        """Let nobody wait any more, whose answer takes a process some seconds; from any thread."""
        if self._loop is not None:
            with suppress(RuntimeError):  # it has ended
                self._loop.call_soon_threadsafe(self._closing.set)

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Pass on what may pass."""
        if scope["type"] not in ("http", "websocket"):
            self._loop = asyncio.get_running_loop()
            await self._app(scope, receive, send)
            return
        headers = {name.decode("latin-1"): value.decode("latin-1") for name, value in scope["headers"]}
        if not self._from_here(headers):
            await _refuse(scope, send, 403, "This bench answers its own page only; open the address that it printed.")
        elif scope["type"] == "http" and _right(_query(scope, "instructor"), self._instructor):
            await _welcome(send, {OF_CLASS: self._instructor, COOKIE: self._token}, "/#/class")
        elif not self._known(headers):
            if scope["type"] == "http" and _right(_query(scope, "token"), self._token):
                await _welcome(send, {COOKIE: self._token}, "/")
            else:
                await _refuse(scope, send, 403, "This bench needs the address with the token that it printed.")
        else:
            scope[INSTRUCTOR] = _right(_cookie(headers, OF_CLASS), self._instructor)
            if scope["path"].startswith("/class") and not scope[INSTRUCTOR]:
                await _refuse(scope, send, 403, "This is for the instructor, who has the address that was printed.")
            elif scope["type"] == "http":
                await self._answered(scope, receive, _with_headers(send))
            else:
                await self._app(scope, receive, send)

    async def _answered(self, scope: Scope, receive: Receive, send: Send) -> None:
        """The application's answer, or why there is none where the bench closes before it has begun."""
        begun = False

        async def sent(message: MutableMapping[str, Any]) -> None:
            nonlocal begun
            begun = True
            await send(message)

        async def answers() -> None:
            await self._app(scope, receive, sent)

        answer, closing = asyncio.create_task(answers()), asyncio.create_task(self._closing.wait())
        try:
            await asyncio.wait({answer, closing}, return_when=asyncio.FIRST_COMPLETED)
            if begun or answer.done():
                await answer
            else:
                answer.cancel()
                await asyncio.wait({answer})
                await _refuse(scope, send, 503, "The bench is closing.")
        finally:
            answer.cancel()
            closing.cancel()

    def _from_here(self, headers: dict[str, str]) -> bool:
        origin = headers.get("origin")
        return (
            headers.get("host", "").lower() in self._hosts
            and headers.get("sec-fetch-site", "none") in ("none", "same-origin")
            and (origin is None or origin.lower() == f"http://{headers['host'].lower()}")
        )

    def _known(self, headers: dict[str, str]) -> bool:
        return not self._token or _right(_cookie(headers, COOKIE), self._token)


def _right(given: str, token: str) -> bool:
    return bool(token) and hmac.compare_digest(given.encode(), token.encode())


def _cookie(headers: dict[str, str], name: str) -> str:
    try:
        cookie = SimpleCookie(headers.get("cookie", "")).get(name)
    except CookieError:
        return ""
    return "" if cookie is None else cookie.value


def _query(scope: Scope, name: str) -> str:
    return parse_qs(scope["query_string"].decode("latin-1")).get(name, [""])[0]


async def _welcome(send: Send, tokens: dict[str, str], page: str) -> None:
    """Keep the tokens where no script sees them, and lead on to the page without them."""
    cookies = [
        ("set-cookie", f"{name}={token}; Path=/; HttpOnly; SameSite=Strict") for name, token in tokens.items() if token
    ]
    await _answer(send, 303, "", [("location", page), *cookies])


async def _refuse(scope: Scope, send: Send, status: int, sentence: str) -> None:
    if scope["type"] == "websocket":
        await send({"type": "websocket.close", "code": 4403, "reason": sentence})
    else:
        await _answer(send, status, sentence, [("content-type", "text/plain; charset=utf-8")])


async def _answer(send: Send, status: int, text: str, headers: list[tuple[str, str]]) -> None:
    fields = [(n.encode(), v.encode()) for n, v in [*HEADERS.items(), *headers]]
    await send({"type": "http.response.start", "status": status, "headers": fields})
    await send({"type": "http.response.body", "body": text.encode()})


def _with_headers(send: Send) -> Send:
    async def sent(message: MutableMapping[str, Any]) -> None:
        if message["type"] == "http.response.start":
            own = {name.lower() for name, _ in message["headers"]}
            more = [(n.encode(), v.encode()) for n, v in HEADERS.items() if n.encode() not in own]
            message = {**message, "headers": [*message["headers"], *more]}
        await send(message)

    return sent
