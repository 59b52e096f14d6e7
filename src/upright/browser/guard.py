"""Who may speak to the bench at all? This machine, and with a token those to whom its owner gave it.

A page of somebody else's in the same browser can send requests here, and a name of theirs can lead here (DNS
rebinding): both are known by the headers Host, Origin and Sec-Fetch-Site, which no page can write.
"""

from __future__ import annotations

import hmac
from collections.abc import Awaitable, Callable, MutableMapping
from http.cookies import CookieError, SimpleCookie
from typing import Any
from urllib.parse import parse_qs

COOKIE = "upright-bench"
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
    """

    def __init__(self, app: App, *, hosts: frozenset[str], token: str = "") -> None:
        self._app, self._hosts, self._token = app, hosts, token

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Pass on what may pass."""
        if scope["type"] not in ("http", "websocket"):
            await self._app(scope, receive, send)
            return
        headers = {name.decode("latin-1"): value.decode("latin-1") for name, value in scope["headers"]}
        if not self._from_here(headers):
            await _refuse(scope, send, 403, "This bench answers its own page only; open the address that it printed.")
        elif not self._known(headers):
            if scope["type"] == "http" and self._right(_query_token(scope)):
                await _welcome(scope, send, self._token)
            else:
                await _refuse(scope, send, 403, "This bench needs the address with the token that it printed.")
        else:
            await self._app(scope, receive, _with_headers(send))

    def _from_here(self, headers: dict[str, str]) -> bool:
        origin = headers.get("origin")
        return (
            headers.get("host", "").lower() in self._hosts
            and headers.get("sec-fetch-site", "none") in ("none", "same-origin")
            and (origin is None or origin.lower() == f"http://{headers['host'].lower()}")
        )

    def _known(self, headers: dict[str, str]) -> bool:
        if not self._token:
            return True
        try:
            cookie = SimpleCookie(headers.get("cookie", "")).get(COOKIE)
        except CookieError:
            return False
        return cookie is not None and self._right(cookie.value)

    def _right(self, token: str) -> bool:
        return hmac.compare_digest(token.encode(), self._token.encode())


def _query_token(scope: Scope) -> str:
    return parse_qs(scope["query_string"].decode("latin-1")).get("token", [""])[0]


async def _welcome(scope: Scope, send: Send, token: str) -> None:
    """Keep the token where no script sees it, and lead on to the page without it."""
    cookie = f"{COOKIE}={token}; Path=/; HttpOnly; SameSite=Strict"
    await _answer(send, 303, "", {"location": "/", "set-cookie": cookie})


async def _refuse(scope: Scope, send: Send, status: int, sentence: str) -> None:
    if scope["type"] == "websocket":
        await send({"type": "websocket.close", "code": 4403, "reason": sentence})
    else:
        await _answer(send, status, sentence, {"content-type": "text/plain; charset=utf-8"})


async def _answer(send: Send, status: int, text: str, headers: dict[str, str]) -> None:
    fields = [(n.encode(), v.encode()) for n, v in {**HEADERS, **headers}.items()]
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
