"""Is the drive off, and the loop's process gone, whenever the server, an operator or the loop dies? Real processes."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import threading
import urllib.request
from contextlib import contextmanager
from pathlib import Path

import pytest
from websockets.sync.client import connect

from tests.browser.test_class import children
from tests.realtime.rigs import BLANK, put_out
from tests.realtime.test_process import ours, until
from upright.browser.serve import open_bench
from upright.logs import read_log
from upright.logs.replay import replay

pytestmark = [pytest.mark.slow, pytest.mark.skipif(sys.platform == "win32", reason="signals of POSIX")]
ROOT = Path(__file__).parents[2]
SERVER = """
import os
import sys
from dataclasses import replace
from functools import partial
from pathlib import Path
from tests.realtime.rigs import witnessed
from upright.browser.serve import open_bench
from upright.realtime.process import run_in_process

def carry(order, **more):
    return run_in_process(replace(order, make=partial(witnessed, out, os.getpid()), check=False), **more)

if __name__ == "__main__":
    out = Path(sys.argv[1]) / "out"
    bench = open_bench([], [], out.parent, carry=carry, report=lambda *_: "", fifo=False)
    print(bench.url, flush=True)
    bench.wait()
"""


@pytest.fixture
def server(tmp_path):
    """A server whose rig writes what it puts out where it outlives everybody."""
    (tmp_path / "out").write_bytes(BLANK)
    (tmp_path / "server.py").write_text(SERVER, encoding="utf-8")
    process = subprocess.Popen(
        [sys.executable, str(tmp_path / "server.py"), str(tmp_path)], env=ours(), cwd=ROOT, stdout=subprocess.PIPE,
        text=True, preexec_fn=_hears,
    )  # fmt: skip
    process.url = process.stdout.readline().strip()
    yield process, tmp_path / "out"
    process.send_signal(signal.SIGCONT)
    process.kill()
    if not process.stdout.closed:
        process.communicate(timeout=240)  # ends with the last process that holds its output, which is the loop's


def _hears() -> None:
    """Ctrl-C and a terminal that closes, also where these tests run in a shell's background or under nohup."""
    for each in (signal.SIGINT, signal.SIGHUP):
        signal.signal(each, signal.SIG_DFL)


@contextmanager
def started(process):
    """An operator who has asked for a run."""
    with connect(process.url.replace("http", "ws", 1) + "live/furuta") as socket:
        socket.send(json.dumps({"do": "operate"}))
        socket.send(json.dumps({"do": "start", "seconds": 600}))
        yield socket


def state_of(socket, *wanted):
    """The next state that is one of these."""
    while True:
        content = socket.recv(timeout=60)
        if isinstance(content, str) and (note := json.loads(content))["type"] == "state" and note["state"] in wanted:
            return note


@pytest.mark.parametrize("after", [0.0, 0.3, 0.6, 0.9, 1.2, 1.5, 2.0, 3.0])
def test_a_server_that_is_killed_at_any_instant_of_the_start_leaves_the_drive_off(server, after):
    process, out = server
    with started(process) as socket:
        state_of(socket, "starting", "running")  # a note of the start is passed over where the next one is there
        threading.Event().wait(after)
        process.kill()
        process.communicate(timeout=240)  # the loop's process has ended too
    command, enabled, _, driven = put_out(out)
    assert (command, enabled) == (0.0, 0)
    assert driven <= 1  # the tick that was on its way


@pytest.mark.parametrize("name", ["SIGKILL", "SIGTERM", "SIGHUP"])
def test_a_drive_that_is_on_goes_off_with_the_server(server, name):
    process, out = server
    with started(process) as socket:
        state_of(socket, "running")
        assert until(lambda: put_out(out)[1] == 1)
        process.send_signal(getattr(signal, name))
        process.communicate(timeout=240)
    assert put_out(out)[:2] == (0.0, 0)


def test_a_server_that_stands_still_cannot_stop_anything_so_the_loop_ends_itself(server):
    process, out = server
    with started(process) as socket:
        state_of(socket, "running")
        assert until(lambda: put_out(out)[1] == 1)
        process.send_signal(signal.SIGSTOP)
        assert until(lambda: put_out(out)[:2] == (0.0, 0), 10.0)
        process.send_signal(signal.SIGCONT)
        assert "not looked" in state_of(socket, "stopped")["why"]


def test_a_stop_of_somebody_who_watches_turns_the_drive_off(server):
    process, out = server
    with started(process) as socket, connect(process.url.replace("http", "ws", 1) + "live/furuta") as watcher:
        state_of(socket, "running")
        assert until(lambda: put_out(out)[1] == 1)
        watcher.send(json.dumps({"do": "stop"}))
        assert until(lambda: put_out(out)[:2] == (0.0, 0), 5.0)
        assert "watches" in state_of(socket, "stopped")["why"]


def test_an_operator_whose_page_is_killed_is_missed_after_ten_seconds(server):
    process, out = server
    page = subprocess.Popen(
        [sys.executable, "-c", PAGE, process.url.replace("http", "ws", 1) + "live/furuta"], stdout=subprocess.PIPE
    )
    assert page.stdout.readline() == b"running\n"
    assert until(lambda: put_out(out)[1] == 1)
    with connect(process.url.replace("http", "ws", 1) + "live/furuta") as watcher:
        page.kill()
        page.communicate(timeout=240)
        assert put_out(out)[1] == 1
        assert "gone" in state_of(watcher, "stopped")["why"]
        assert until(lambda: put_out(out)[:2] == (0.0, 0), 5.0)


PAGE = """
import json, sys
from websockets.sync.client import connect
socket = connect(sys.argv[1])
socket.send(json.dumps({"do": "operate"}))
socket.send(json.dumps({"do": "start", "seconds": 600}))
running = False
while True:
    note = socket.recv()
    if not running and isinstance(note, str) and json.loads(note).get("state") == "running":
        running = True
        print("running", flush=True)
"""


def test_a_loop_that_is_killed_is_a_stop_with_a_sentence(server):
    process, _ = server
    with started(process) as socket:
        state_of(socket, "running")
        for pid in children(process.pid, b"spawn_main"):
            os.kill(pid, signal.SIGKILL)
        assert "was killed" in state_of(socket, "stopped")["why"]


def test_the_command_prints_its_address_and_ctrl_c_ends_it_with_every_rig_at_rest(tmp_path):
    process = subprocess.Popen(
        [sys.executable, "-m", "upright", "bench", "--port", "0", "--no-browser", "--no-fifo", "-o", "out"],
        env=ours(), cwd=tmp_path, stdout=subprocess.PIPE, text=True, preexec_fn=_hears,
    )  # fmt: skip
    process.url = process.stdout.readline().split()[-1]
    with started(process) as socket:
        state_of(socket, "running")
        process.send_signal(signal.SIGINT)
        assert "closed" in state_of(socket, "stopped")["why"]
    process.communicate(timeout=240)
    assert process.returncode == 0
    log = read_log(tmp_path / "out" / "furuta" / "run.mcap")
    assert not log.complaint
    assert log.events[-1].kind == "fault"


def test_a_run_in_the_browser_is_kept_with_a_report_and_replays_to_the_last_bit(tmp_path):
    """Tapped, given other poles and another reference, then ended by its operator."""
    with open_bench([], [], tmp_path, fifo=False) as bench:
        with started(bench) as socket:
            poles = bench.stations[0].rig.scene["poles"]
            state_of(socket, "running")
            for message in (
                {"do": "tap", "coordinate": "theta", "speed": 0.2},
                {"do": "poles", "poles": [[1.1 * re, 1.1 * im] for re, im in poles]},
                {"do": "reference", "value": 0.3},
            ):
                socket.send(json.dumps(message))
                state_of(socket, "running")
            socket.send(json.dumps({"do": "end"}))
            while not (note := state_of(socket, "ended"))["verdict"]:
                pass
        runs = json.loads(urllib.request.urlopen(bench.url + "api/rigs/furuta/runs").read())
        assert [run["verdict"] for run in runs] == [note["verdict"]]
        page = urllib.request.urlopen(bench.url.rstrip("/") + runs[0]["report"]).read().decode()
        assert "other gains" in page
        content = urllib.request.urlopen(bench.url.rstrip("/") + runs[0]["log"]).read()
    (tmp_path / "fetched.mcap").write_bytes(content)
    log = read_log(tmp_path / "fetched.mcap")
    assert "law" in [event.kind for event in log.events]
    assert max(log.columns["reference"]) == 0.3
    assert replay(log).identical


# with reports, and closed as the command closes it
CLOSED = (
    SERVER.replace(' report=lambda *_: "",', "")
    .replace("    print(bench.url, flush=True)\n", "")
    .replace("    bench.wait()", "    for line in _until_closed(bench):\n        print(line, flush=True)")
    .replace("if __name__", "from upright.verbs.control.bench import _until_closed\n\nif __name__")
)


@pytest.mark.parametrize("when", ["starting", "running", "ended"])
def test_ctrl_c_on_the_whole_group_ends_the_bench_in_order_and_prints_no_traceback(tmp_path, when):
    """As a terminal sends it: to the loop's process and to that of the report too; and once more, by impatience."""
    (tmp_path / "out").write_bytes(BLANK)
    (tmp_path / "server.py").write_text(CLOSED, encoding="utf-8")
    process = subprocess.Popen(
        [sys.executable, str(tmp_path / "server.py"), str(tmp_path)], env=ours(), cwd=ROOT, stdout=subprocess.PIPE,
        stderr=subprocess.PIPE, text=True, start_new_session=True, preexec_fn=_hears,
    )  # fmt: skip
    try:
        process.url, _, _ = [process.stdout.readline().split()[-1] for _ in range(3)]
        with started(process) as socket:
            state_of(socket, *(["starting"] if when == "starting" else []), "running")
            if when == "ended":
                socket.send(json.dumps({"do": "end"}))
                state_of(socket, "ended")
            os.killpg(process.pid, signal.SIGINT)
            while "Stopping every rig." not in (line := process.stdout.readline()):
                assert line
            os.killpg(process.pid, signal.SIGINT)
            _, errors = process.communicate(timeout=240)
    finally:
        process.kill()
        process.communicate(timeout=240)
    assert errors == ""
    assert process.returncode == 0
    assert put_out(tmp_path / "out")[:2] == (0.0, 0)
