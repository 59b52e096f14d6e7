"""Which tests run which lines of the package, and how long they take: quick or slow tests once under `coverage`.

Only the files that are changed are traced. The map is kept in a folder by the text of the tree and by what is traced,
some files of tests at a time, so that one that was interrupted goes on where it stopped. Lines that run when a module
is imported belong to no test, whichever imported it first; neither does the text of kernels, which is compiled. For
them the tests of the whole function stand in, else those of the module.
"""

from __future__ import annotations

import ast
import hashlib
import json
import os
import subprocess
import sys
import tempfile
from collections.abc import Callable, Collection, Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from benchmarks.mutants import watch

SOURCE = "src/upright"
KEPT = 250
"""Tests kept for a line, the nearest and cheapest."""
START = 0.02
"""Seconds that the shortest test costs all the same."""
BATCH = 110
"""Files of tests that run before the map is kept."""


@dataclass(frozen=True, kw_only=True)
class Covering:
    """Seconds of every test that passed, numbers of the tests of each line, and files of tests that ran."""

    seconds: dict[str, float]
    tests: list[str]
    files: list[str]
    lines: dict[str, dict[int, list[int]]]

    def of(self, path: str, first: int, last: int, text: str) -> list[str]:
        """Tests that run one of some lines of a file; where there are none, those that stand in for them."""
        own = self.lines.get(path, {})
        around = _around(text, first)
        spans = [*around, range(1, text.count("\n") + 2)]
        if around and first in around[0]:  # else it ran when the module was imported, by whichever test came first
            spans.insert(0, range(first, last + 1))
        for span in spans:
            if found := {test for line in span for test in own.get(line, ())}:
                return self._nearest(path, found)
        return []

    def _nearest(self, path: str, found: Iterable[int]) -> list[str]:
        return sorted((self.tests[i] for i in found), key=lambda test: cost(path, test, self.seconds[test]))

    def beside(self, path: str, chosen: Iterable[str]) -> list[str]:
        """Other tests of the same files, cheapest first: what a test computes once and keeps serves them as well."""
        chosen = list(chosen)
        files = {test.partition("::")[0] for test in chosen}
        others = [t for t in self.seconds if t.partition("::")[0] in files and t not in set(chosen)]
        return sorted(others, key=lambda test: cost(path, test, self.seconds[test]))


def cost(path: str, test: str, seconds: float) -> float:
    """Seconds of a test, fewer for one that stands nearer to a file: tests mirror the source."""
    source, mirrored = Path(path).with_suffix("").parts[2:], Path(test.partition("::")[0]).parts[1:]
    common = 0
    for a, b in zip(source, mirrored, strict=False):
        if a != b and b != f"test_{a}.py":
            break
        common += 1
    return (seconds + START) / 4**common


def _around(text: str, line: int) -> list[range]:
    """Lines of the bodies of the functions around a line, the innermost first."""
    bodies = [
        range(node.body[0].lineno, (node.end_lineno or node.lineno) + 1)
        for node in ast.walk(ast.parse(text))
        if isinstance(node, (ast.FunctionDef, ast.AsyncFunctionDef))
        and node.lineno <= line <= (node.end_lineno or node.lineno)
    ]
    return sorted(bodies, key=len)


def map_of(
    root: Path, folder: Path, workers: int, progress: Callable[[str], None], traced: Collection[str], *,
    slow: bool = False,
) -> Covering:  # fmt: skip
    """The map of some files of a tree by its quick tests or by its slow ones, made or completed where there is none."""
    name = "slow" if slow else "covering"
    of = hashlib.sha256(json.dumps(sorted(traced)).encode()).hexdigest()[:8]
    kept = folder / f"{name}-{digest(root)}-{of}.json"
    folder.mkdir(parents=True, exist_ok=True)
    whole = _read(kept) if kept.exists() else Covering(seconds={}, tests=[], files=[], lines={})
    tests = [p for p in _listed(root, "tests") if Path(p).name.startswith("test_")]
    left = [p for p in tests if p not in whole.files]
    if left:
        progress(f"{name} map in {folder}: {len(left)} of {len(tests)} files of tests run, {len(traced)} files traced")
    for batch in [left[i : i + BATCH] for i in range(0, len(left), BATCH)]:
        with tempfile.TemporaryDirectory(prefix="upright-covering-") as place:
            run_tests(root, Path(place), batch, workers, traced, slow=slow)
            whole = joined(whole, gather(root, Path(place)), batch)
        _write(kept, whole)
    return whole


def digest(root: Path) -> str:
    """The text of a tree's sources and tests, in a few letters."""
    texts = [(path, _digest(root / path)) for path in _listed(root, "tests", "benchmarks", SOURCE)]
    return hashlib.sha256(json.dumps(texts).encode()).hexdigest()[:16]


def run_tests(
    root: Path, folder: Path, tests: Iterable[str], workers: int, traced: Collection[str], *, slow: bool = False
) -> None:
    """Run quick or slow tests with the lines they run in some files, and their outcomes, written to a folder."""
    environment = dict(os.environ) | {
        watch.REPORT: str(folder / "report.jsonl"), watch.LINES: str(folder / "lines"),
        watch.TRACED: os.pathsep.join(str(root / path) for path in traced),
    }  # fmt: skip
    (folder / "lines").mkdir()
    (folder / "report.jsonl").touch()
    command = [sys.executable, "-m", "pytest", "-q", "-p", "no:cacheprovider", "-p", "benchmarks.mutants.watch"]
    with open(folder / "log", "w", encoding="utf-8") as log:
        subprocess.run(
            [*command, "-n", str(workers), "-m", "slow" if slow else "not slow", *tests],
            cwd=root, check=False, stdout=log, stderr=subprocess.STDOUT,
            env=environment | {"PYTHONPATH": str(root / "src")},
        )  # fmt: skip


def gather(root: Path, folder: Path) -> Covering:
    """What a run of tests has written: tests that passed, and the lines of each."""
    import coverage

    seconds: dict[str, float] = {}
    failed: set[str] = set()
    for line in (folder / "report.jsonl").read_text(encoding="utf-8").splitlines():
        said = json.loads(line)
        if "test" in said:
            seconds[said["test"]] = round(said["seconds"], 4)
            failed |= {said["test"]} if said["outcome"] == "failed" else set()
    seconds = {test: s for test, s in seconds.items() if test not in failed}
    tests = list(seconds)
    number = {test: i for i, test in enumerate(tests)}
    lines: dict[str, dict[int, list[int]]] = {}
    for part in sorted((folder / "lines").iterdir()):
        data = coverage.CoverageData(basename=str(part))
        data.read()
        for file in data.measured_files():
            path = Path(file).relative_to(root).as_posix()
            own = lines.setdefault(path, {})
            for line, contexts in data.contexts_by_lineno(file).items():
                own.setdefault(line, []).extend(number[c] for c in contexts if c in number)
    for path, own in lines.items():
        for line, found in own.items():
            own[line] = sorted(set(found), key=lambda i, path=path: cost(path, tests[i], seconds[tests[i]]))[:KEPT]
    return Covering(seconds=seconds, tests=tests, files=[], lines=lines)


def joined(old: Covering, new: Covering, files: Iterable[str]) -> Covering:
    """Two maps of different tests as one; the files of tests of the second."""
    tests = [*old.tests, *new.tests]
    lines = {path: dict(own) for path, own in old.lines.items()}
    for path, own in new.lines.items():
        mine = lines.setdefault(path, {})
        for line, found in own.items():
            mine[line] = [*(i + len(old.tests) for i in found), *mine.get(line, [])]
    return Covering(seconds=old.seconds | new.seconds, tests=tests, files=[*old.files, *files], lines=lines)


def _listed(root: Path, *folders: str) -> list[str]:
    return sorted(p.relative_to(root).as_posix() for folder in folders for p in (root / folder).rglob("*.py"))


def _digest(path: Path) -> str:
    return hashlib.sha256(path.read_bytes()).hexdigest()[:16]


def _write(path: Path, found: Covering) -> None:
    aside = path.with_suffix(f".{os.getpid()}")
    aside.write_text(json.dumps(vars(found)), encoding="utf-8")
    os.replace(aside, path)


def _read(path: Path) -> Covering:
    fields: dict[str, Any] = json.loads(path.read_text(encoding="utf-8"))
    lines = {file: {int(line): found for line, found in own.items()} for file, own in fields["lines"].items()}
    return Covering(**(fields | {"lines": lines}))
