"""Is a change noticed? The tests that cover it run in a copy of the tree with the change in it, until one fails."""

from __future__ import annotations

import contextlib
import json
import os
import shutil
import signal
import subprocess
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from benchmarks.mutants import watch
from benchmarks.mutants.covering import Covering
from benchmarks.mutants.places import Change

SECONDS, LONGER, SLOWER = 60.0, 2.0, 2.0
"""Seconds of CPU of the quick tests for one change; how many times as long the slow ones have, and both in all."""
PATIENCE = 1800.0
"""Seconds by the clock on the wall after which a run that no longer says anything hangs."""
MOST = 400
"""Tests for one change."""
KERNEL = "src/upright/simulation/kernel/compiled.py"
"""Its room is compiled from its text, which runs unseen in whatever calls this module."""
SHORT = 0.5
"""Seconds of a test that runs before the longer ones of other files."""


@dataclass(frozen=True, kw_only=True)
class Outcome:
    """Whether a change was noticed, by which test or how; tests that ran of those that cover the place."""

    change: Change
    shown: str
    noticed: bool
    by: str
    ran: int
    covering: int


def chosen(covering: Covering, change: Change, source: bytes, seconds: float = SECONDS) -> tuple[list[str], int]:
    """Tests to run for a change, in order, within their seconds; and how many cover the place."""
    text = source.decode()
    last = change.place.line + source.count(b"\n", change.place.start, change.place.end)
    direct = covering.of(change.path, change.place.line, last, text)
    more = covering.of(KERNEL, 1, 10_000, "") if Path(change.path).parent == Path(KERNEL).parent else []
    budget, tests = seconds, []
    for test in dict.fromkeys([*direct, *covering.beside(change.path, direct), *more]):
        if len(tests) < MOST and (covering.seconds[test] <= budget or not tests):
            budget -= covering.seconds[test]
            tests.append(test)
    rank: dict[tuple[bool, str], int] = {}
    for test in tests:  # the tests of a file stay together: what they share is computed once
        rank.setdefault((covering.seconds[test] > SHORT, test.partition("::")[0]), len(rank))
    tests.sort(key=lambda test: (long := covering.seconds[test] > SHORT, rank[long, test.partition("::")[0]]))
    return tests, len(direct)


class Bench:
    """A copy of the tree to change, with a cache of its own that stays warm."""

    def __init__(self, root: Path, place: Path, cache: Path | None) -> None:
        self.tree, self.cache = place / "tree", place / "cache"
        listed = subprocess.run(
            ["git", "ls-files", "-co", "--exclude-standard", "-z"], cwd=root, check=True, capture_output=True
        )
        for name in filter(None, listed.stdout.decode().split("\0")):
            if (root / name).is_file():
                (self.tree / name).parent.mkdir(parents=True, exist_ok=True)
                shutil.copy2(root / name, self.tree / name)
        self.cache.mkdir(parents=True)
        if cache is not None and (cache / "code").is_dir():
            shutil.copytree(cache / "code", self.cache / "code")
        self.report, self.wanted = place / "report.jsonl", place / "wanted.json"
        self.stamp = 0
        self.alone: dict[str, bool] = {}
        self.process: subprocess.Popen[bytes] | None = None
        self.ended = False

    def end(self) -> None:
        """Stop what is running; its outcome means nothing."""
        self.ended = True
        if self.process is not None:
            _kill(self.process)

    def outcome(self, change: Change, covering: Covering, seconds: float = SECONDS) -> Outcome:
        """Run the tests of a change; one that fails without it as well does not count."""
        file = self.tree / change.path
        source = file.read_bytes()
        tests, direct = chosen(covering, change, source, seconds)
        ran, noticed, by = 0, False, ""
        while tests and not noticed:
            by = self._with(file, change.applied(source), source, tests, covering, seconds)
            begun = self._begun()
            ran += len(begun)
            if not by:
                break
            if not begun:
                whole = [test for test in tests if self._imported(test.partition("::")[0])]
                noticed, tests = len(whole) == len(tests), whole
                continue
            noticed = self._passes(begun[-1], covering)
            tests = tests[tests.index(begun[-1]) + 1 :]
        shown = change.shown(source)
        return Outcome(
            change=change, shown=shown, noticed=noticed, by=by if noticed else "", ran=ran, covering=direct
        )  # fmt: skip

    def _with(
        self, file: Path, changed: bytes, source: bytes, tests: Sequence[str], covering: Covering, seconds: float
    ) -> str:
        """What noticed a changed file: a test, an import that fails, a hang; "" for nothing."""
        try:
            self._write(file, changed)
            return self._run(tests, covering, seconds)
        finally:
            self._write(file, source)

    def _write(self, file: Path, text: bytes) -> None:
        """Compiled code is taken for that of a file with the same time and length, so each text has its own time."""
        file.write_bytes(text)
        self.stamp += 10
        os.utime(file, (1e9 + self.stamp, 1e9 + self.stamp))

    def _passes(self, test: str, covering: Covering) -> bool:
        """Whether a test passes alone and without a change; asked once."""
        if test not in self.alone:
            kept = self.report.read_bytes()
            self.alone[test] = not self._run([test], covering, LONGER * SECONDS)
            self.report.write_bytes(kept)
        return self.alone[test]

    def _imported(self, file: str) -> bool:
        """Whether a file of tests can be imported without a change; asked once."""
        if file not in self.alone:
            command = [sys.executable, "-m", "pytest", "-q", "-n", "0", "-m", "", "-p", "no:cacheprovider"]
            environment = dict(os.environ) | {"PYTHONPATH": str(self.tree / "src"), "UPRIGHT_CACHE": str(self.cache)}
            found = subprocess.run(
                [*command, "--collect-only", file], cwd=self.tree, env=environment, check=False,
                stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL,
            )  # fmt: skip
            self.alone[file] = found.returncode == 0
        return self.alone[file]

    def _run(self, tests: Sequence[str], covering: Covering, seconds: float) -> str:
        if self.ended:
            return ""
        self.report.write_bytes(b"")
        self.wanted.write_text(json.dumps({test: covering.seconds[test] for test in tests}), encoding="utf-8")
        environment = dict(os.environ) | {
            "PYTHONPATH": str(self.tree / "src"), "UPRIGHT_CACHE": str(self.cache), watch.REPORT: str(self.report),
            watch.WANTED: str(self.wanted), watch.SECONDS: str(SLOWER * seconds), "MPLBACKEND": "Agg",
        }  # fmt: skip
        files = dict.fromkeys(test.partition("::")[0] for test in tests)
        command = [sys.executable, "-m", "pytest", "-x", "-q", "-n", "0", "-m", "", "-p", "no:cacheprovider",
                   "-p", "no:faulthandler", "-p", "benchmarks.mutants.watch", *files]  # fmt: skip
        process = self.process = subprocess.Popen(
            command, cwd=self.tree, env=environment, start_new_session=True, stdin=subprocess.DEVNULL,
            stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL,
        )  # fmt: skip
        try:
            status = process.wait(PATIENCE)
        except subprocess.TimeoutExpired:
            return "it hangs"
        finally:
            _kill(process)
            process.wait()
        said = [json.loads(line) for line in self.report.read_text(encoding="utf-8").splitlines()]
        if failed := [line["test"] for line in said if line.get("outcome") == "failed"]:
            return failed[0]
        if status in (0, 5):
            return ""
        begun, ended = self._begun(), {line["test"] for line in said if "test" in line}
        if begun and begun[-1] not in ended:
            return f"{begun[-1]} hangs or ends the process"
        if not begun:
            return "the tests cannot be imported"
        return ""  # time is over

    def _begun(self) -> list[str]:
        said = [json.loads(line) for line in self.report.read_text(encoding="utf-8").splitlines()]
        return [line["begun"] for line in said if "begun" in line]


def _kill(process: subprocess.Popen[bytes]) -> None:
    """End a process and what it has started."""
    if hasattr(os, "killpg"):
        with contextlib.suppress(OSError):
            os.killpg(process.pid, signal.SIGKILL)
    process.kill()
