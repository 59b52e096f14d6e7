"""Does the loop go on whatever becomes of its log, and is everything told that is missing?"""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import threading
import time

import pytest

from tests.logs.runs import HEADER, row, wrong
from upright.errors import BadInput
from upright.logs import LogWriter, read_log, versions

CLOCK = threading.Event()
POSIX = pytest.mark.skipif(os.name == "nt", reason="signals of POSIX")


def until(true, patience: float = 20.0) -> None:
    """Wait for another process."""
    end = time.monotonic() + patience
    while not true():
        assert time.monotonic() < end, "the other process did not get there"
        CLOCK.wait(0.005)


LINUX = pytest.mark.skipif(sys.platform != "linux", reason="/proc and prlimit of Linux")


def test_rows_and_events_come_back_in_their_order(tmp_path):
    path = tmp_path / "folder" / "run.mcap"
    with LogWriter(path, header=HEADER) as log:
        for k in range(1000):
            if k == 640:
                log.event(0.64, "fault", "OVERSPEED of theta")
            log.row(row(k))
    status = log.status()
    assert (status.rows, status.dropped, status.message) == (1000, 0, "")
    read = read_log(path)
    assert (len(read), wrong(read), read.complaint) == (1000, [], "")
    assert [(e.kind, e.row, e.t, e.text) for e in read.events] == [("fault", 640, 0.64, "OVERSPEED of theta")]
    assert read.header == HEADER
    log.row(row(0))  # a loop that has not stopped yet
    assert log.close() == status


@POSIX
def test_rows_that_find_no_place_are_counted_and_told_where(tmp_path):
    """A process that is stopped takes nothing: 64 rows wait, the other 36 are dropped, and what comes later is kept."""
    path = tmp_path / "run.mcap"
    log = LogWriter(path, header=HEADER, rows=64)
    os.kill(log.pid, signal.SIGSTOP)
    try:
        for k in range(100):
            log.row(row(k))
        assert log.status().dropped == 36
        assert "36 rows dropped: 64 waited already" in log.status().message
    finally:
        os.kill(log.pid, signal.SIGCONT)
    until(lambda: log.status().rows == 64)
    for k in range(100, 110):
        log.row(row(k))
    assert log.close().rows == 74
    read = read_log(path)
    assert read.columns["tick"].tolist() == [*range(64), *range(100, 110)]
    assert [(e.kind, e.row, e.dropped) for e in read.events] == [("dropped", 64, 36)]
    assert read.dropped == 36
    assert wrong(read) == []


@POSIX
def test_a_killed_process_leaves_its_chunks_and_the_loop_runs(tmp_path):
    path = tmp_path / "run.mcap"
    log = LogWriter(path, header=HEADER)
    for k in range(250):
        log.row(row(k))
    until(lambda: log.status().rows == 250)
    os.kill(log.pid, signal.SIGKILL)
    until(lambda: log.status().message != "")
    for k in range(250, 300):
        log.row(row(k))
    status = log.close()
    assert "ended (code -9) after 250 rows; the loop goes on" in status.message
    assert (status.rows, status.dropped) == (250, 50)
    read = read_log(path)
    assert (len(read), wrong(read)) == (250, [])
    assert "Its writer was stopped" in read.complaint


@POSIX
def test_a_killed_loop_loses_no_row_that_it_handed_over(tmp_path):
    path = tmp_path / "run.mcap"
    code = (
        "import os, signal, sys; from tests.logs.runs import HEADER, row; from upright.logs import LogWriter\n"
        "log = LogWriter(sys.argv[1], header=HEADER)\n"
        "for k in range(777): log.row(row(k))\n"
        "os.kill(os.getpid(), signal.SIGKILL)"
    )
    done = subprocess.run([sys.executable, "-c", code, str(path)], check=False)
    assert done.returncode == -signal.SIGKILL
    until(lambda: read_log(path).complaint == "")
    assert len(read_log(path)) == 777
    assert wrong(read_log(path)) == []


@LINUX
def test_a_full_disk_ends_the_log_and_not_the_loop(tmp_path):
    """The file may not pass 8 kB, which for the process is a disk that takes no more."""
    from resource import RLIMIT_FSIZE, prlimit

    path = tmp_path / "run.mcap"
    log = LogWriter(path, header=HEADER)
    prlimit(log.pid, RLIMIT_FSIZE, (8192, 8192))
    for k in range(1000):
        log.row(row(k))
    until(lambda: log.status().message != "")
    for k in range(1000, 2000):
        log.row(row(k))
    status = log.close()
    assert status.message == f"disk full after {status.rows} rows; the loop goes on"
    assert 0 < status.rows < 1000
    assert status.rows + status.dropped == 2000
    read = read_log(path)
    assert (len(read), wrong(read)) == (status.rows, [])
    assert "torn" not in read.complaint  # half a chunk was taken back


@pytest.mark.parametrize("sample", [(1.0, 2), "text", None, ("a",) * 10, (0.5,) * 10, 3.0])
def test_what_is_no_row_is_dropped_with_a_word(tmp_path, sample):
    from upright.logs.ring import Ring, shared_memory

    memory, _, files = shared_memory(Ring.size(10, 16))
    for file in files:
        os.close(file)
    ring = Ring(memory, HEADER.columns, 16)
    assert ring.put(sample) == "unfit"
    assert ring.put(row(0)) == ""
    assert list(ring.take(9)) == [(1, *row(0))]
    ring.close()


def test_the_word_for_rows_that_do_not_fit_names_the_columns(tmp_path):
    with LogWriter(tmp_path / "run.mcap", header=HEADER) as log:
        log.row((0.0, 1))
        log.event("soon", "x", "y")  # no time, and no error either
    assert "1 rows dropped that were not the 10 numbers t, tick (whole), psi_counts" in log.status().message


def test_a_run_is_not_logged_over_another(tmp_path):
    (tmp_path / "run.mcap").write_bytes(b"")
    with pytest.raises(BadInput, match="exists already"):
        LogWriter(tmp_path / "run.mcap", header=HEADER)


@LINUX
def test_a_file_that_cannot_be_made_is_said_before_the_loop_begins():
    with pytest.raises(BadInput, match="cannot be written: No such file"):
        LogWriter("/proc/upright.mcap", header=HEADER)


def test_what_wrote_a_log_is_known():
    assert versions()["upright"]
    assert set(versions()) == {"upright", "git", "python"}


def test_the_process_beside_the_loop_loads_no_numerical_library():
    code = "import sys, upright.logs.process; print([n for n in ('numpy', 'pandas', 'scipy') if n in sys.modules])"
    assert subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout == "[]\n"


@pytest.mark.slow
@POSIX
def test_kills_at_any_moment_lose_at_most_100_ms_and_no_row_is_wrong(tmp_path):
    """40 of those that `python -m benchmarks crash` does; one row is 1 ms."""
    from benchmarks.crash import busy, paced

    kills = [*paced(tmp_path, 32, 11), *busy(tmp_path, 8, 12)]
    assert all(kill.read >= kill.said > 0 for kill in kills)
    assert all(kill.wrong == 0 and "the loop goes on" in kill.message for kill in kills)
    assert max(kill.handed - kill.read for kill in kills[:32]) <= 100
