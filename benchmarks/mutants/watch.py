"""What pytest has to say about its tests: how long each took, how it ended, which lines it ran, and which one hangs.

A plugin of the pytest runs that `benchmarks.mutants` starts, set up by variables of the environment.
"""

from __future__ import annotations

import faulthandler
import json
import os
import signal
import time
from collections.abc import Generator, Sequence
from pathlib import Path
from typing import Any

import pytest

REPORT, WANTED, SECONDS = "MUTANTS_REPORT", "MUTANTS_WANTED", "MUTANTS_SECONDS"
"""File of the outcomes; file of the tests wanted, in order; limit of the whole [s]."""
LINES, TRACED = "MUTANTS_LINES", "MUTANTS_TRACED"
"""Folder of the lines that ran; the files whose lines they are."""
MEMORY = 8 * 2**30
"""Bytes that a changed program may fill: a loop without an end fills the memory before its time is over. Address space
alone is not counted, of which engines of WebAssembly reserve more."""
HANG, SLOWER = 30.0, 20.0
"""A test hangs after so many seconds of CPU and so many times its usual time: its code may have to be compiled."""
LONG, AGAIN = 90.0, 3.0
"""The same for a test of many seconds, where compiling is the smaller part."""
STANDS = 5.0
"""How many times as long by the clock on the wall: it may stand still, and others use the machine."""


class Outcomes:
    """A line of JSON for each test that begins and each that ends, written at once."""

    def __init__(self, path: str) -> None:
        self.path = path
        self.seconds: dict[str, float] = {}

    def say(self, **what: object) -> None:
        with open(self.path, "a", encoding="utf-8") as file:
            file.write(json.dumps(what) + "\n")

    def pytest_runtest_logstart(self, nodeid: str) -> None:
        self.say(begun=nodeid)

    def pytest_runtest_logreport(self, report: pytest.TestReport) -> None:
        spent = dict(report.user_properties).get(SPENT, report.duration)
        self.seconds[report.nodeid] = self.seconds.get(report.nodeid, 0.0) + float(str(spent))
        if report.outcome == "failed" or report.when == "teardown":
            outcome = "failed" if report.outcome == "failed" else "ran"
            self.say(test=report.nodeid, outcome=outcome, seconds=self.seconds[report.nodeid])


SPENT = "seconds of CPU"


class Cost:
    """Seconds of CPU of each phase of a test, its children's too: a neighbour cannot stretch them."""

    def __init__(self) -> None:
        self.before = sum(os.times()[:4])

    @pytest.hookimpl(wrapper=True)
    def pytest_runtest_makereport(self) -> Generator[None, pytest.TestReport, pytest.TestReport]:
        report = yield
        now = sum(os.times()[:4])
        report.user_properties.append((SPENT, now - self.before))
        self.before = now
        return report


class Lines:
    """Which lines of some files each test runs, by `coverage`; one file for each process."""

    def __init__(self, folder: str, traced: Sequence[str]) -> None:
        import coverage

        file = str(Path(folder) / "lines")
        self.coverage = coverage.Coverage(
            data_file=file, data_suffix=True, config_file=False, include=traced, check_preimported=False
        )
        self.coverage.start()

    @pytest.hookimpl(wrapper=True)
    def pytest_runtest_protocol(self, item: pytest.Item) -> Generator[None, Any, Any]:
        self.coverage.switch_context(item.nodeid)
        try:
            return (yield)
        finally:
            self.coverage.switch_context("")

    def pytest_sessionfinish(self) -> None:
        self.coverage.stop()
        self.coverage.save()


class Wanted:
    """Only these tests, in this order; one that hangs ends the process, and so does the limit between two tests."""

    def __init__(self, path: str, seconds: float) -> None:
        self.usual: dict[str, float] = json.loads(Path(path).read_text(encoding="utf-8"))
        self.until = time.process_time() + seconds

    def pytest_collection_modifyitems(self, items: list[pytest.Item]) -> None:
        rank = {test: i for i, test in enumerate(self.usual)}
        items[:] = sorted((item for item in items if item.nodeid in rank), key=lambda item: rank[item.nodeid])

    @pytest.hookimpl(wrapper=True)
    def pytest_runtest_protocol(self, item: pytest.Item) -> Generator[None, Any, Any]:
        if time.process_time() > self.until:
            item.session.shouldstop = "time is over"
        usual = self.usual[item.nodeid]
        limit = HANG + min(SLOWER * usual, LONG + AGAIN * usual)
        faulthandler.dump_traceback_later(STANDS * limit, exit=True)
        _end_after(limit)
        try:
            return (yield)
        finally:
            faulthandler.cancel_dump_traceback_later()
            _end_after(0)


def pytest_configure(config: pytest.Config) -> None:
    asked = os.environ.get
    worker = hasattr(config, "workerinput")
    if (path := asked(REPORT)) and not worker:
        config.pluginmanager.register(Outcomes(path))
    if folder := asked(LINES):
        config.pluginmanager.register(Lines(folder, os.environ[TRACED].split(os.pathsep)))
    config.pluginmanager.register(Cost())
    if path := asked(WANTED):
        _limit_memory()
        config.pluginmanager.register(Wanted(path, float(asked(SECONDS) or "inf")))


def _limit_memory() -> None:
    try:
        import resource
    except ImportError:  # Windows
        return
    resource.setrlimit(resource.RLIMIT_DATA, (MEMORY, MEMORY))


def _end_after(seconds: float) -> None:
    """End this process after so many seconds of CPU, whatever it computes then; never for 0."""
    if hasattr(signal, "setitimer"):  # not on Windows
        signal.setitimer(signal.ITIMER_PROF, seconds)
