"""What does the process beside the loop put into the file, chunk by chunk, of what waits in the ring?"""

from __future__ import annotations

import io
import json
import os
import sys
from types import SimpleNamespace

import pytest

from tests.logs.runs import HEADER, row, wrong
from upright.logs import process, read_log
from upright.logs.container import Container
from upright.logs.ring import DONE, FAILED, NUMBER, STATE, WRITTEN, Ring, join, shared_memory

SIZE = Ring.size(len(HEADER.columns), 1024)


@pytest.fixture
def run(tmp_path, monkeypatch):
    """Runs the process here, on a ring that was filled before and whose loop has gone since."""
    memory, name, files = shared_memory(SIZE)
    ring = Ring(memory, HEADER.columns, 1024)

    def go(path=tmp_path / "run.mcap"):
        line = json.dumps(HEADER.as_metadata()).encode() + b"\n"
        monkeypatch.setattr(sys, "stdin", SimpleNamespace(buffer=io.BytesIO(line)))
        process.write_log(str(path), name, 1024)
        return path

    yield SimpleNamespace(ring=ring, go=go)
    ring.close()
    for file in files:
        os.close(file)


def event(ring, t, kind, text):
    assert ring.put_event(json.dumps([ring.marks[NUMBER], t, kind, text]).encode())


def chunks(path):
    """Topics of the messages of each chunk, shortened to a letter."""
    return ["".join(m.topic[1] for m in chunk) for chunk in Container().read(path.read_bytes())]


def test_a_chunk_holds_a_hundred_rows_at_most_and_the_last_what_is_left(run):
    for k in range(250):
        assert run.ring.put(row(k)) == ""
    path = run.go()
    assert chunks(path) == ["s" * 100, "s" * 100, "s" * 50]
    assert (run.ring.marks[STATE], run.ring.marks[WRITTEN]) == (DONE, 250)
    log = read_log(path)
    assert (len(log), wrong(log), log.complaint, log.dropped) == (250, [], "", 0)


def test_an_event_ends_its_chunk_behind_the_rows_before_it(run):
    event(run.ring, 0.0, "start", "asked")
    for k in range(5):
        run.ring.put(row(k))
        if k == 2:
            event(run.ring, 0.002, "fault", "OVERSPEED")
    event(run.ring, 0.005, "stop", "asked")
    path = run.go()
    assert chunks(path) == ["e", "ssse", "sse"]
    assert [(e.t, e.kind, e.text, e.row) for e in read_log(path).events] == [
        (0.0, "start", "asked", 0), (0.002, "fault", "OVERSPEED", 3), (0.005, "stop", "asked", 5),
    ]  # fmt: skip


def test_rows_that_found_no_place_are_told_where_they_are_missing(run):
    """The ring counts every row that it was offered: one is missing at first, two in between, three at the end."""
    marks = run.ring.marks
    marks[NUMBER] += 1
    run.ring.put(row(1))
    marks[NUMBER] += 2
    run.ring.put(row(4))
    marks[NUMBER] += 3
    path = run.go()
    log = read_log(path)
    assert log.columns["tick"].tolist() == [1, 4]
    assert [(e.kind, e.t, e.row, e.dropped, e.text) for e in log.events] == [
        ("dropped", 0.001, 0, 1, "1 row of the loop dropped before this"),
        ("dropped", 0.004, 1, 2, "2 rows of the loop dropped before this"),
        ("dropped", 0.004, 2, 3, "3 rows of the loop dropped before this"),
    ]
    assert log.dropped == 6


def test_a_file_that_exists_is_not_written_over_and_the_loop_hears_of_it(run, tmp_path):
    (tmp_path / "run.mcap").write_bytes(b"mine")
    run.ring.put(row(0))
    path = run.go()
    assert path.read_bytes() == b"mine"
    assert (run.ring.marks[STATE], run.ring.message()) == (FAILED, "File exists")


def test_what_fails_is_said_with_how_many_rows_are_safe(run, monkeypatch):
    for k in range(250):
        run.ring.put(row(k))
    whole, made = process.RunFile.flush, []

    def full(file):
        made.append(file)
        if len(made) == 2:
            raise OSError(28, "No space left on device")
        whole(file)

    monkeypatch.setattr(process.RunFile, "flush", full)
    run.go()
    assert (run.ring.marks[STATE], run.ring.message()) == (FAILED, "disk full after 100 rows; the loop goes on")
    assert run.ring.marks[WRITTEN] == 100
    assert run.ring.marks[9] == 150  # lost: a chunk that failed and what came after
    assert list(run.ring.take(9)) == []  # taken all the same, so that the loop goes on


def test_another_error_of_the_file_is_told_in_its_own_words(run, monkeypatch):
    def broken(file):
        raise OSError(5, "Input/output error")

    monkeypatch.setattr(process.RunFile, "flush", broken)
    run.ring.put(row(0))
    run.go()
    assert run.ring.message() == "the log's file failed (Input/output error) after 0 rows; the loop goes on"


def test_memory_is_the_same_on_both_sides(run):
    memory, name, files = shared_memory(64)
    there = join(name, 64)
    memory[:3] = b"abc"
    assert there[:4] == b"abc\0"
    there.close()
    memory.close()
    for file in files:
        os.close(file)
