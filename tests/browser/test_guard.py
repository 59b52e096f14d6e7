"""Does anything answer to another site's page, to a name that leads here, or without the token?"""

from __future__ import annotations

import asyncio

import pytest

from upright.browser.guard import COOKIE, HEADERS, OF_CLASS, Guard

HOST = "127.0.0.1:8431"


async def behind(scope, receive, send):
    """An application that answers everybody."""
    if scope["type"] == "websocket":
        await send({"type": "websocket.accept"})
    else:
        await send({"type": "http.response.start", "status": 200, "headers": []})
        await send({"type": "http.response.body", "body": b"the page"})


def asked(path="/", headers=(), *, token="", kind="http", instructor=""):
    """What is sent to a client: status and headers, or what opens or closes a socket; then the text."""
    sent = []

    async def send(message):
        sent.append(message)

    path, _, query = path.partition("?")
    fields = [(n.encode(), v.encode()) for n, v in {"host": HOST, **dict(headers)}.items()]
    scope = {"type": kind, "path": path, "query_string": query.encode(), "headers": fields}
    asyncio.run(Guard(behind, hosts=frozenset({HOST}), token=token, instructor=instructor)(scope, None, send))
    if kind == "websocket":
        return sent[0]["type"], sent[0].get("code")
    return sent[0]["status"], {n.decode(): v.decode() for n, v in sent[0]["headers"]}, sent[1]["body"].decode()


FOREIGN = [
    {"host": "evil.example:8431"}, {"host": ""}, {"origin": "http://evil.example"}, {"origin": "null"},
    {"origin": f"https://{HOST}"}, {"sec-fetch-site": "cross-site"}, {"sec-fetch-site": "same-site"},
]  # fmt: skip


@pytest.mark.parametrize("headers", FOREIGN)
def test_what_does_not_come_from_here_is_refused(headers):
    assert asked(headers=headers)[0] == 403
    assert asked("/live/a", headers, kind="websocket") == ("websocket.close", 4403)


@pytest.mark.parametrize("headers", [{}, {"origin": f"http://{HOST}"}, {"sec-fetch-site": "same-origin"}])
def test_its_own_page_is_answered(headers):
    status, had, text = asked(headers=headers)
    assert (status, text) == (200, "the page")
    assert had == HEADERS
    assert asked("/live/a", headers, kind="websocket") == ("websocket.accept", None)


def test_the_policy_allows_no_eval_and_nobody_else():
    policy = HEADERS["content-security-policy"]
    assert "'unsafe-eval'" not in policy.replace("'wasm-unsafe-eval'", "")
    assert "unsafe-inline" not in policy
    assert "http" not in policy
    assert policy.startswith("default-src 'none'")


@pytest.mark.parametrize("path", ["/", "/nothing", "/?token=", "/?token=wrong", "/?token=secre", "/?token=secret2"])
@pytest.mark.parametrize("cookie", ["wrong", "", "secret2", '"', "\x7f"])
def test_without_the_token_nothing_answers(path, cookie):
    own = {"cookie": f"{COOKIE}={cookie}"}
    assert asked(path, token="secret")[0] == 403
    assert asked(path, own, token="secret")[0] == 403
    assert asked("/live/a", own, token="secret", kind="websocket")[0] == "websocket.close"


def test_with_the_token_everything_answers_from_here_and_no_script_sees_it():
    status, headers, _ = asked("/?token=secret", token="secret")
    assert (status, headers["location"]) == (303, "/")
    kept, *how = headers["set-cookie"].split("; ")
    assert {"HttpOnly", "SameSite=Strict"} <= set(how)
    own = {"cookie": kept}
    assert asked("/", own, token="secret")[2] == "the page"
    assert asked("/live/a", own, token="secret", kind="websocket") == ("websocket.accept", None)
    assert asked("/live/a?token=secret", token="secret", kind="websocket")[0] == "websocket.close"
    assert asked("/", {**own, "origin": "http://evil.example"}, token="secret")[0] == 403


@pytest.mark.parametrize("token", ["", "lan"])
def test_the_page_of_a_class_answers_its_instructor_alone(token):
    student = {"cookie": f"{COOKIE}={token}"}
    for who in (
        student,
        {"cookie": f"{COOKIE}={token}; {OF_CLASS}=wrong"},
        {"cookie": f"{COOKIE}={token}; {OF_CLASS}="},
    ):
        assert asked("/class", who, token=token, kind="websocket", instructor="right") == ("websocket.close", 4403)
    assert asked("/", student, token=token, instructor="right")[0] == 200
    teacher = {"cookie": f"{COOKIE}={token}; {OF_CLASS}=right"}
    assert asked("/class", teacher, token=token, kind="websocket", instructor="right") == ("websocket.accept", None)
    assert asked("/class", teacher, token=token, kind="websocket")[0] == "websocket.close"  # of no class


def test_the_instructors_address_is_turned_into_cookies_once():
    status, had, _ = asked("/?instructor=right", token="lan", instructor="right")
    assert (status, had["location"]) == (303, "/#/class")
    assert asked("/?instructor=wrong", token="lan", instructor="right")[0] == 403
    assert asked("/?instructor=", instructor="")[2] == "the page"
