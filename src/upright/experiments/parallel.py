"""Experiments that need nothing of each other, run side by side."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from functools import partial
from typing import TypeVar

from upright.progress import Progress, part
from upright.workers import Workers, spread

T = TypeVar("T")


def run_parallel(
    seconds: Mapping[str, float], needs: Mapping[str, Sequence[str]],
    one: Callable[[str, Mapping[str, T], Progress], T], workers: Workers, progress: Progress,
) -> tuple[dict[str, T], bool]:  # fmt: skip
    """What each experiment came to, by its key, and whether Ctrl-C left some out.

    Parameters
    ----------
    seconds : mapping of str to float
        How long each takes about; the longest of those that can begin begins first.
    needs : mapping of str to sequence of str
        Those among them whose results each takes.
    one : callable
        Of a key and the results that it needs. It runs in another process.
    """
    results: dict[str, T] = {}
    behind, whole = 0.0, sum(seconds.values())
    while len(results) < len(seconds):
        ready = [k for k in seconds if k not in results and all(n in results for n in needs[k])]
        ready.sort(key=lambda k: -seconds[k])
        ahead = behind + sum(seconds[k] for k in ready)
        tell = part(progress, behind / whole, ahead / whole, f"experiments {', '.join(sorted(ready))}")
        items = [(k, {n: results[n] for n in needs[k]}) for k in ready]
        ready_results = spread(partial(_one, one), items, workers=workers, progress=tell, what="experiment")
        results |= {ready[i]: result for i, result in ready_results.results.items()}
        if ready_results.interrupted:
            return results, True
        behind = ahead
    return results, False


def _one(
    one: Callable[[str, Mapping[str, T], Progress], T], item: tuple[str, Mapping[str, T]], progress: Progress
) -> T:  # fmt: skip
    return one(*item, progress)
