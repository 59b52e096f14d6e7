"""A class with its server and its process: who falls alone, what is kept, and what is left when one of them dies."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
from contextlib import contextmanager, suppress
from pathlib import Path
from urllib.request import HTTPRedirectHandler, build_opener

import pytest
from websockets.sync.client import connect

from tests.browser.test_fit_in_use import DESIGN, written_fit
from tests.browser.test_fits import ask
from tests.browser.test_served import got
from tests.realtime.test_process import ours, until
from upright.browser.classroom.overview import STATES
from upright.browser.guard import OF_CLASS
from upright.browser.serve import open_bench
from upright.errors import BadInput
from upright.logs import read_log
from upright.logs.replay import replay

pytestmark = pytest.mark.slow
ROOT = Path(__file__).parents[2]
ROSTER = "name,seed\nÄnne Müller,\nBob,7\nCleo,\nDora,\n"
SERVER = """
import sys
from pathlib import Path
from upright.browser.serve import open_bench

if __name__ == "__main__":
    folder = Path(sys.argv[1])
    bench = open_bench([], [], folder, roster=folder / "roster.csv", fifo=False)
    print(bench.url, flush=True)
    bench.wait()
"""


@pytest.fixture
def roster(tmp_path):
    path = tmp_path / "roster.csv"
    path.write_text(ROSTER, encoding="utf-8")
    return path


@contextmanager
def student(url, name):
    """Somebody who operates their twin."""
    # what is not read for a while must not keep the answers to pings from being read
    with connect(url.replace("http", "ws", 1) + f"live/{name}", max_queue=None) as socket:
        socket.send(json.dumps({"do": "operate"}))
        yield socket


def asks(socket, **what):
    socket.send(json.dumps(what))


def reads(socket, wanted):
    """The next note for which something is true."""
    while True:
        content = socket.recv(timeout=120)
        if isinstance(content, str) and wanted(note := json.loads(content)):
            return note


def sees(socket, *states):
    return reads(socket, lambda note: note.get("state") in states)


class Kept(HTTPRedirectHandler):
    """Follows nothing, so that a cookie is seen."""

    def redirect_request(self, *_):
        return None


def cookie_of(bench):
    try:
        build_opener(Kept).open(bench.instructor_url)
    except OSError as led_on:
        return led_on.headers["set-cookie"].split(";")[0]
    raise AssertionError("the instructor was not led on")


def looks(socket):
    """What the instructor sees of each student."""
    content = socket.recv(timeout=60)
    return [STATES[content[6 + 6 * k]] for k in range((len(content) - 6) // 6)]


def test_a_class_at_work(roster, tmp_path):
    """One falls, one goes on by other poles; the instructor sees both and stops everybody; logs replay to the bit."""
    with open_bench([], [], tmp_path, roster=roster, fifo=False) as bench:
        assert bench.rigs == ("anne-muller", "bob", "cleo", "dora")
        teacher = {"Cookie": cookie_of(bench)}
        assert OF_CLASS in teacher["Cookie"]
        address = bench.url.replace("http", "ws", 1) + "class"
        with (
            student(bench.url, "anne-muller") as anne, student(bench.url, "bob") as bob,
            student(bench.url, "cleo") as cleo, connect(address, additional_headers=teacher) as instructor,
        ):  # fmt: skip
            scene = reads(bob, lambda note: note["type"] == "scene")
            assert (scene["name"], scene["title"]) == ("bob", "Bob")
            neighbour = reads(anne, lambda note: note["type"] == "scene")["you"]
            for each, begins in ((anne, "held"), (bob, "held"), (cleo, "sweep")):
                asks(each, do="start", **{"from": begins})
                sees(each, "running")
            asks(bob, do="poles", poles=[[1.1 * re, 1.1 * im] for re, im in scene["poles"]])
            applied = reads(bob, lambda note: note["type"] in ("applied", "error"))
            assert applied["type"] == "applied"
            asks(bob, do="poles", poles=[[-1, 0], [-2, 0], [-1000, 0], [-1100, 0]])
            assert reads(bob, lambda note: note["type"] in ("applied", "error"))["type"] == "error"
            asks(anne, do="tap", coordinate="theta", speed=15.0)
            assert "it fell" in sees(anne, "stopped")["why"]
            while (seen := looks(instructor))[0] != "fell":
                pass
            assert seen == ["fell", "running", "records", "idle"]
            instructor.send('{"do": "start"}')
            assert "stopped as a whole" in reads(instructor, lambda note: True)["sentence"]
            instructor.send('{"do": "stop"}')
            assert "instructor" in sees(bob, "stopped")["why"]
            sees(cleo, "stopped")
            asks(anne, do="rearm")
            sees(anne, "idle")
            assert bench.stations[3].state == "idle"  # nobody's twin is latched who did not run
            assert until(lambda: all(s.verdict for s in bench.stations[:3]), 300.0)
            files = {end: f"rigs/bob/runs/run.{end}" for end in ("mcap", "html")}
            for wanted, served in (("", 403), (f"?me={neighbour}", 403), (f"?me={scene['you']}", 200)):
                assert [got(bench, path + wanted)[0] for path in files.values()] == [served] * 2
            assert [got(bench, path, headers=teacher)[0] for path in files.values()] == [200] * 2
        logs = [read_log(tmp_path / name / "run.mcap") for name in ("anne-muller", "bob", "cleo")]
    for log in logs:
        again = replay(log)
        assert again.identical
        assert "seed" not in log.header.rig  # by which anybody could look into the twin
        assert len(again.rows) == len(log) > 100
    assert [event.kind for event in logs[1].events] == ["law", "fault"]
    assert not list(tmp_path.glob("*/*.rows"))


def test_a_fit_in_use_gives_one_student_its_gains_and_the_twin_stays_theirs(roster, tmp_path):
    """The log replays to the bit, so that the lane had the gains of the law that was designed for the fit."""
    written_fit(tmp_path / "bob", "fit-1")
    with open_bench([], [], tmp_path, roster=roster, fifo=False) as bench, student(bench.url, "bob") as bob:
        nominal = reads(bob, lambda note: note["type"] == "scene")

        def use(**what):
            body = json.dumps(what).encode()
            return ask(bench, "api/rigs/bob/model", nominal["you"], data=body, wait=DESIGN)[::2]

        assert use(fit="fit-1") == (200, "{}")
        scene = reads(bob, lambda note: note["type"] == "scene" and note["model"]["fit"])
        assert (scene["title"], scene["K"] == nominal["K"]) == ("Bob", False)
        assert use(memory=0.9) == (
            400,
            "The twins of a class have one velocity filter; upright bench by itself takes another.",
        )
        asks(bob, do="start", seconds=0.5)
        assert sees(bob, "ended", "stopped")["state"] == "ended"
        rig = bench.stations[1].rig
        assert until(lambda: (tmp_path / "bob/run.json").exists(), 120.0)
        assert bench.stations[0].rig.loop.K[0].tolist() == nominal["K"]
        assert use(fit="")[0] == 200
        assert reads(bob, lambda note: note["type"] == "scene" and not note["model"]["fit"])["K"] == nominal["K"]
    log = read_log(tmp_path / "bob/run.mcap")
    assert replay(log).identical
    assert (log.header.law["C"], log.header.law["D"]) == (rig.law.C.tolist(), rig.law.D.tolist())
    assert "seed" not in log.header.rig


def children(process, of=b""):
    """Numbers of the processes that a process started, of those alone that have something in their command."""
    numbers = []
    for task in Path(f"/proc/{process}/task").iterdir():
        with suppress(OSError):  # a thread that has ended meanwhile
            numbers += (task / "children").read_text().split()
    return [int(n) for n in numbers if of in command_of(n)]


def command_of(process):
    try:
        return Path(f"/proc/{process}/cmdline").read_bytes()
    except OSError:
        return b""


def lives(process):
    try:
        return Path(f"/proc/{process}/stat").read_text().split(") ")[1][0] != "Z"
    except OSError:
        return False


@pytest.mark.skipif(sys.platform != "linux", reason="reads /proc")
@pytest.mark.parametrize("running", [False, True])
def test_a_server_that_is_killed_leaves_no_process_of_its_class(roster, tmp_path, running):
    (tmp_path / "server.py").write_text(SERVER, encoding="utf-8")
    server = subprocess.Popen(
        [sys.executable, str(tmp_path / "server.py"), str(tmp_path)], env=ours(), cwd=ROOT, stdout=subprocess.PIPE,
        text=True,
    )  # fmt: skip
    url = server.stdout.readline().strip()
    assert until(lambda: children(server.pid, b"spawn_main"))
    begun = children(server.pid)
    if running:
        with student(url, "bob") as bob:
            asks(bob, do="start")
            sees(bob, "running")
            begun = children(server.pid)
            server.kill()
    else:
        server.kill()
    server.wait()
    assert until(lambda: not any(map(lives, begun)))
    server.stdout.close()


@pytest.mark.skipif(sys.platform != "linux", reason="reads /proc")
def test_a_process_of_a_class_that_dies_is_told_to_everybody(roster, tmp_path):
    before = set(children(os.getpid()))
    with open_bench([], [], tmp_path, roster=roster, fifo=False) as bench, student(bench.url, "bob") as bob:
        asks(bob, do="start")
        sees(bob, "running")
        for each in set(children(os.getpid(), b"spawn_main")) - before:
            os.kill(each, signal.SIGKILL)
        assert "The process of the class has ended" in sees(bob, "stopped")["why"]
        asks(bob, do="rearm")
        sees(bob, "idle")
        asks(bob, do="start")
        assert "start the bench again" in sees(bob, "stopped")["why"]


def test_a_class_is_of_one_rig_and_a_port_that_is_taken_leaves_no_process(roster, tmp_path):
    rigs = [tmp_path / "a.toml", tmp_path / "b.toml"]
    for rig in rigs:
        rig.write_text('kind = "twin"\nmake = "furuta"\n', encoding="utf-8")
    with pytest.raises(BadInput, match="twins of one rig, got 2"):
        open_bench(rigs, [], tmp_path, roster=roster)
