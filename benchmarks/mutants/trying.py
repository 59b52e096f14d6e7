"""Many changes tried beside each other, each in a copy of the tree that is free; outcomes are kept.

They are kept beside the map, by the text of the tree: a run that was interrupted goes on where it stopped, and one
that asks the slow tests as well does not ask the quick ones again.
"""

from __future__ import annotations

import json
import threading
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor, as_completed
from pathlib import Path
from queue import SimpleQueue

from benchmarks.mutants.covering import SOURCE, Covering
from benchmarks.mutants.places import Change
from benchmarks.mutants.trial import Bench, Outcome


def said(change: Change, shown: str) -> str:
    """A change as it is listed, and as a judge writes it down."""
    return f"{change.path.removeprefix(SOURCE + '/')}:{change.place.line} {shown}"


class Kept:
    """Outcomes in a file, a line of JSON each."""

    def __init__(self, file: Path) -> None:
        self.file = file
        lines = file.read_text(encoding="utf-8").splitlines() if file.exists() else []
        self.outcomes = {tuple(key): fields for key, fields in map(json.loads, lines)}

    def of(self, change: Change) -> Outcome | None:
        """What came of a change before."""
        fields = self.outcomes.get(_key(change))
        return None if fields is None else Outcome(change=change, **fields)

    def add(self, outcome: Outcome) -> None:
        """Write an outcome down at once."""
        fields = {name: value for name, value in vars(outcome).items() if name != "change"}
        with open(self.file, "a", encoding="utf-8") as file:
            file.write(json.dumps([_key(outcome.change), fields]) + "\n")


def _key(change: Change) -> tuple[str, int, int, str]:
    return change.path, change.place.start, change.place.end, change.text.decode()


def tried(
    benches: Sequence[Bench], changes: Sequence[Change], covering: Covering, seconds: float, kept: Kept,
    progress: Callable[[str], None],
) -> list[Outcome]:  # fmt: skip
    """Outcomes of all changes; those so far where Ctrl-C stops it."""
    done = [outcome for change in changes if (outcome := kept.of(change)) is not None]
    there = {outcome.change for outcome in done}
    idle: SimpleQueue[Bench] = SimpleQueue()
    for bench in benches:
        idle.put(bench)
    stop = threading.Event()

    def work(change: Change) -> Outcome | None:
        bench = idle.get()
        try:
            outcome = None if stop.is_set() else bench.outcome(change, covering, seconds)
            return None if stop.is_set() else outcome
        finally:
            idle.put(bench)

    with ThreadPoolExecutor(len(benches)) as pool:
        try:
            for future in as_completed([pool.submit(work, change) for change in changes if change not in there]):
                if (outcome := future.result()) is not None:
                    kept.add(outcome)
                    done.append(outcome)
                    heard = f"noticed by {outcome.by}" if outcome.noticed else f"NOT noticed, {outcome.ran} tests"
                    progress(f"{len(done)} of {len(changes)}: {said(outcome.change, outcome.shown)}: {heard}")
        except KeyboardInterrupt:
            progress("interrupted; what is finished is counted")
            stop.set()
            for bench in benches:
                bench.end()
    return done
