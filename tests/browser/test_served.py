"""What answers at the address of a bench, and what does not: a real server, with runs that the test performs."""

from __future__ import annotations

import asyncio
import gc
import json
import random
import threading
import time
import tracemalloc
import urllib.error
import urllib.request
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager, suppress

import pytest
from websockets.exceptions import ConnectionClosed, InvalidStatus
from websockets.sync.client import connect

from tests.browser.runs import RUNNING, SOON, ByHand, felt, settled, station, twin
from tests.browser.test_frames import decoded
from upright.browser.guard import COOKIE
from upright.browser.hub import Hub
from upright.browser.identify.recording import Recording
from upright.browser.lease import PATIENCE
from upright.browser.outbox import FRAMES
from upright.browser.serve import Bench, open_bench
from upright.errors import BadInput
from upright.realtime.session import RunState
from upright.rigs import Mode


@pytest.fixture(scope="module")
def rig(tmp_path_factory):
    return twin(tmp_path_factory.mktemp("bench"))


@pytest.fixture(scope="module")
def bench(rig, tmp_path_factory):
    """Nothing runs on it."""
    with Bench([rig], tmp_path_factory.mktemp("served"), carry=ByHand()) as bench:
        yield bench


@pytest.fixture
def served(rig, tmp_path):
    carry = ByHand()
    with Bench([rig], tmp_path, carry=carry, report=lambda *_: "the verdict") as bench:
        yield bench, bench.stations[0], carry
        if not bench.stations[0].over:
            carry.end()


def got(bench, path, wait=SOON, **how):
    """Status, headers and text of an answer."""
    asked = urllib.request.Request(bench.url + path, **how)
    try:
        with urllib.request.urlopen(asked, timeout=wait) as answer:
            return answer.status, answer.headers, answer.read().decode(errors="replace")  # a log is no text
    except urllib.error.HTTPError as refused:
        text = b""
        with suppress(ConnectionError):  # who is sent away by the guard while sending may lose the sentence
            text = refused.read()
        return refused.code, refused.headers, text.decode()


class Client:
    """A page without a screen."""

    def __init__(self, socket):
        self.socket, self.frames = socket, []
        self.scene = self.note("scene")
        self.me = self.scene["you"]

    def ask(self, do, **fields):
        self.socket.send(json.dumps({"do": do, **fields}))

    def note(self, kind, **wanted):
        """The next note of a kind with these values."""
        until = time.monotonic() + SOON
        while time.monotonic() < until:
            content = self.socket.recv(timeout=SOON)
            if isinstance(content, bytes):
                self.frames.append(content)
                continue
            note = json.loads(content)
            if note["type"] == kind and wanted.items() <= note.items():
                return note
        raise AssertionError(f"no {kind} with {wanted} came")

    def samples(self, last):
        """Tick and counts of every sample that came, once that of a tick is there."""
        while not self.frames or _samples(self.frames[-1])[-1][0] < last:
            content = self.socket.recv(timeout=SOON)
            self.frames += [content] if isinstance(content, bytes) else []
        return [s for content in self.frames for s in _samples(content)]

    def closed(self):
        """With which code the server closes the connection."""
        with suppress(ConnectionClosed):
            while True:
                self.socket.recv(timeout=SOON)
        return self.socket.close_code


@contextmanager
def client(bench, me="", **how):
    address = bench.url.replace("http", "ws", 1) + "live/furuta" + (f"?me={me}" if me else "")
    # beside a bench that designs or compiles in this very process a client cannot tell a late pong from none
    with connect(address, ping_interval=None, **how) as socket:
        yield Client(socket)


def test_there_is_a_list_of_rigs_and_what_each_is_made_of(bench):
    status, headers, text = got(bench, "api/rigs")
    assert status == 200
    assert "default-src 'none'" in headers["content-security-policy"]
    rig = {"name": "furuta", "title": "furuta", "kind": "TWIN", "state": "idle", "operated": False}
    assert json.loads(text)["rigs"] == [rig]
    for name in ("drawing.js", "kernel.js", "twin.js", "tokens.css"):
        status, headers, text = got(bench, f"assets/{name}")
        assert (status, len(text) > 500) == (200, True)
        assert headers["content-type"].startswith("text/css" if name.endswith("css") else "text/javascript")
    assert got(bench, "")[0] == 200
    assert json.loads(got(bench, "api/rigs/furuta/runs")[2]) == []


def test_while_a_sweep_is_prepared_everybody_else_is_answered_and_a_stop_keeps_it_from_starting(served, monkeypatch):
    bench, _, carry = served
    begun, go = threading.Event(), threading.Event()

    def slow(*given):
        begun.set()
        assert go.wait(SOON)
        return Recording(*given)

    monkeypatch.setattr("upright.browser.station.Recording", slow)
    with client(bench) as one, client(bench) as another:
        one.ask("operate")
        one.ask("start", **{"from": "sweep"})
        assert begun.wait(SOON)
        one.ask("start", **{"from": "sweep"})
        assert "being prepared" in one.note("error")["sentence"]
        assert got(bench, "api/rigs/furuta/runs")[0] == 200
        another.ask("stop")
        another.note("state", state="stopped")
        go.set()
        assert "is stopped: Stopped by somebody who watches" in one.note("error")["sentence"]
        assert carry.orders == []
        one.ask("rearm")
        one.ask("start", **{"from": "sweep"})
        carry.go()
        assert one.note("state", state="running")["from"] == "sweep"


def test_a_bench_that_closes_lets_nobody_wait_for_a_twin_that_is_being_compiled(rig, tmp_path, monkeypatch, capfd):
    begun, go = threading.Event(), threading.Event()

    def slow(*_):
        begun.set()
        assert go.wait(SOON)
        return ""

    monkeypatch.setattr("upright.browser.app.in_own_process", slow)
    with ThreadPoolExecutor(1) as pool:
        with Bench([rig], tmp_path, carry=ByHand()) as bench:
            answer = pool.submit(got, bench, "rigs/furuta/twin.js")
            assert begun.wait(SOON)
            answer.add_done_callback(lambda _: go.set())  # compiled once nobody waits for it any more
        status, _, text = answer.result(SOON)
    assert (status, text) == (503, "The bench is closing.")
    assert "Traceback" not in capfd.readouterr().err  # a library that is first imported here may warn of its own


@pytest.mark.parametrize(
    "path",
    ["api", "api/rigs/nobody/runs", "rigs/nobody/twin.js", "assets/nothing.js", "assets/../live/drawing.js",
     "assets/..%2f..%2f__init__.py", "assets/%2fetc%2fpasswd", "rigs/furuta/runs/run.mcap",
     "rigs/furuta/runs/..%2f..%2ffuruta.toml", "rigs/furuta/runs/law.json", "rigs/..%2ffuruta/twin.js", "openapi.json"],
)  # fmt: skip
def test_nothing_else_answers(bench, path):
    assert got(bench, path)[0] == 404


@pytest.mark.parametrize("method", ["POST", "PUT", "DELETE", "PATCH", "OPTIONS"])
def test_nothing_is_changed_by_a_request(bench, method):
    assert got(bench, "api/rigs", method=method, data=b"{}")[0] == 405


def test_another_site_s_page_gets_nothing(bench):
    assert got(bench, "api/rigs", headers={"Origin": "http://evil.example"})[0] == 403
    assert got(bench, "api/rigs", headers={"Host": "evil.example"})[0] == 403
    with pytest.raises(InvalidStatus, match="403"), client(bench, origin="http://evil.example"):
        pass


def test_two_clients_see_one_run_and_each_who_operates_it(served):
    bench, _, carry = served
    with client(bench) as first, client(bench) as second:
        assert first.me != second.me
        first.ask("operate")
        assert first.note("state", operator="you")
        assert second.note("state", operator="another")
        second.ask("operate")
        assert "Somebody else operates it" in second.note("error")["sentence"]
        second.ask("start")
        assert "Somebody else operates it" in second.note("error")["sentence"]
        first.ask("start", seconds=3)
        second.note("state", state="starting")
        carry.go()
        assert second.note("state", state="running", mode="HOST")["seconds"] == 3
        second.ask("stop")
        assert "somebody who watches" in first.note("state", state="stopped")["why"]
        second.ask("rearm")
        assert "Somebody else" in second.note("error")["sentence"]
        carry.end("Stopped by hand.")
        assert first.note("state", verdict="the verdict")["late"] == 7
        first.ask("rearm")
        assert second.note("state", state="idle")


def test_every_sample_reaches_every_client_as_the_loop_showed_it(served):
    bench, station, carry = served
    with client(bench) as one, client(bench) as other:
        one.ask("operate")
        one.ask("start")
        for k in range(1, 601):
            state = RunState(phase="running", tick=k, late=k // 100, mode=Mode.HOST, counts=(7 * k, 8000 - k),
                             applied=0.5)  # fmt: skip
            carry.go(state)
            if k % 100 == 0:
                assert one.samples(k) == other.samples(k) == [(j, (7 * j, 8000 - j)) for j in range(1, k + 1)]
        assert one.frames == other.frames
        assert sum(decoded(content)[3] for content in one.frames) == 6
        assert decoded(one.frames[0])[2][0] == pytest.approx(0.5, abs=station.rig.model.converter / 2)


def _samples(content):
    first, counts, _, _ = decoded(content)
    return [(first + k, c) for k, c in enumerate(counts)]


def test_a_reload_keeps_the_place_and_a_stolen_name_is_none(served):
    bench, station, _ = served
    with client(bench) as page:
        page.ask("operate")
        page.note("state", operator="you")
        me = page.me
    with client(bench, "made-up") as stranger:
        assert stranger.me != "made-up"
    with client(bench, me) as again:
        assert again.me == me
        assert again.note("state", operator="you")
    assert settled(station, lambda s: s.lease.holder == me)


def test_ten_messages_that_nobody_understands_close_the_connection_and_change_nothing(served):
    bench, station, _ = served
    with client(bench) as page:
        for _ in range(10):
            page.socket.send("nonsense")
        assert page.closed() == 4400
    assert (station.state, station.lease.holder) == ("idle", "")
    assert got(bench, "api/rigs")[0] == 200


def test_a_message_that_is_too_long_closes_the_connection(served):
    bench, station, _ = served
    with client(bench) as page:
        page.socket.send(json.dumps({"do": "stop", "x": "x" * 10_000}))
        assert page.closed() == 1009
    assert station.state == "idle"


@pytest.mark.parametrize("seed", range(3))
def test_whatever_is_sent_the_server_answers_on_and_the_drive_is_as_it_was(served, seed):
    """Random bytes, random JSON, and messages of the table with wrong fields, from somebody who does not operate."""
    bench, station, carry = served
    rng = random.Random(seed)
    values = [None, True, -1, 1e308, "x" * 50, [], {}, [[1, 2]], "theta", 0.5]
    with client(bench) as operator:
        operator.ask("operate")
        operator.ask("start")
        carry.go()
        operator.note("state", state="running")
        for _ in range(6):
            with client(bench) as page, suppress(ConnectionClosed):
                for _ in range(12):
                    kind = rng.randrange(3)
                    if kind == 0:
                        page.socket.send(rng.randbytes(rng.randrange(200)))
                    elif kind == 1:
                        page.socket.send(json.dumps([rng.choice(values) for _ in range(rng.randrange(5))]))
                    else:
                        do = rng.choice(["start", "tap", "poles", "reference", "rearm", "release", "x"])
                        names = ["seconds", "start", "coordinate", "speed", "poles", "value", "do"]
                        fields = {rng.choice(names): rng.choice(values) for _ in range(2)}
                        page.socket.send(json.dumps({**fields, "do": do}))
        assert json.loads(got(bench, "api/rigs")[2])["rigs"][0]["state"] == "running"
        assert carry.go(RUNNING) == ""
        assert (station.lease.holder, station.desk.stopping) == (operator.me, False)
        assert felt(station.desk, station.rig.law) == ([], [], None)
        operator.ask("stop")
        operator.note("state", state="stopped")


def test_a_flood_is_refused_and_a_stop_in_it_is_not(served):
    bench, station, _ = served
    with client(bench) as page:
        for _ in range(140):  # 100 of them refused would close it, and it lets 50 more pass in a second
            page.ask("release")
        page.ask("stop")
        assert "messages a second" in page.note("error")["sentence"]
        assert page.note("state", state="stopped")
        with suppress(ConnectionClosed):
            for _ in range(400):
                page.ask("release")
        assert page.closed() == 4400
    assert station.state == "stopped"


def test_who_comes_back_is_known_and_nothing_is_kept_of_who_has_left(rig, tmp_path):
    with station(rig, tmp_path / "one") as (made, _, _), station(rig, tmp_path / "two") as (other, _, _):
        hub, another = Hub(made), Hub(other)

        def came(me):
            who, outbox = hub.join(me)
            hub.leave(outbox)
            return who

        first = came("")
        assert came(first) == first
        elsewhere, _ = another.join(first)
        for made_up in ("", "made-up", elsewhere, f"x{first}", f"{first}0", first.partition(".")[0], "é.\udc80"):
            assert came(made_up) not in {first, made_up}
        for _ in range(100):
            came("")
        tracemalloc.start()
        before, _ = tracemalloc.get_traced_memory()
        for _ in range(1000):
            came("")
        gc.collect()
        kept = tracemalloc.get_traced_memory()[0] - before
        tracemalloc.stop()
        assert kept < 30_000  # bytes; a name of each would be 100,000


def test_who_takes_nothing_holds_nobody_up(rig, tmp_path):
    """One outbox is never emptied, the other after every turn: it misses nothing."""

    async def scenario(made, carry):
        hub = Hub(made)
        (_, slow), (_, quick) = hub.join(""), hub.join("")
        made.start("operator")
        frames = []
        for k in range(1, 301):
            carry.go(RunState(phase="running", tick=k, mode=Mode.HOST, counts=(k, k)))
            if k % 10 == 0:
                hub.turn()
                while not frames or _samples(frames[-1])[-1][0] < k:
                    content = await quick.next()
                    frames += [content] if isinstance(content, bytes) else []
        assert [s[0] for content in frames for s in _samples(content)] == list(range(1, 301))
        assert (quick.lost, slow.lost) == (0, 30 - FRAMES)
        kept = []
        while len(kept) < FRAMES:
            content = await slow.next()
            kept += [content] if isinstance(content, bytes) else []
        assert kept == frames[-FRAMES:]

    with station(rig, tmp_path) as (made, carry, _):
        asyncio.run(scenario(made, carry))


def test_an_operator_is_missed_when_the_last_of_their_connections_ends(rig, tmp_path):
    """As after a reload, when the old connection ends behind the new one."""

    async def scenario(made, carry, clock):
        hub = Hub(made)
        who, old = hub.join("")
        made.lease.give("operator")
        made.lease.take(who)
        made.start(who)
        carry.go()
        same, new = hub.join(who)
        assert same == who
        hub.leave(old)
        clock.now += 2 * PATIENCE
        hub.turn()
        assert made.state == "running"
        hub.leave(new)
        clock.now += PATIENCE
        hub.turn()
        assert made.state == "running"
        clock.now += 0.1
        hub.turn()
        assert made.state == "stopped"

    with station(rig, tmp_path) as (made, carry, clock):
        asyncio.run(scenario(made, carry, clock))


def test_a_network_needs_the_token(rig, tmp_path):
    with Bench([rig], tmp_path, lan=True, carry=ByHand()) as bench:
        address, _, token = bench.url.partition("?token=")
        assert len(token) >= 32
        here = f"http://127.0.0.1:{address.rsplit(':', 1)[1]}"
        bench.url = here
        assert got(bench, "api/rigs")[0] == 403
        assert got(bench, "api/rigs", headers={"Cookie": f"{COOKIE}={token}"})[0] == 200
        with pytest.raises(InvalidStatus, match="403"), client(bench):
            pass
        with client(bench, additional_headers={"Cookie": f"{COOKIE}={token}"}) as page:
            assert page.scene["name"] == "furuta"


def test_a_port_that_is_taken_is_named(bench):
    port = int(bench.url.rsplit(":", 1)[1].strip("/"))
    with pytest.raises(BadInput, match=f"port {port} cannot be had"):
        open_bench([], [], bench.folder, port=port)
