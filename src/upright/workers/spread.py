"""One function for what is many: ensembles, twins, chances, refits.

Each item of work is given to a task by itself, and tells everything in what it returns. Who computes it changes
nothing: items are cut without knowing how many workers there are, and linear algebra runs on one thread everywhere,
since its sums depend on how many share them. Machines of one kind then agree to the last bit; other processors may
round a product and a sum at once.
"""

from __future__ import annotations

import re
from collections import Counter, deque
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import FIRST_COMPLETED, BrokenExecutor, CancelledError, Executor, Future, wait
from dataclasses import dataclass
from operator import index
from typing import Any, Generic, TypeVar, cast

from upright.errors import BadInput, WorkersLost
from upright.progress import Progress, part, silent
from upright.workers.carriage import carried, unpacked
from upright.workers.labour import Cluster, Lent, Pool, Processes, do
from upright.workers.linear_algebra import one_thread

T = TypeVar("T")
R = TypeVar("R")

MOST = 1024
TRIES = 4
"""How often an item is begun, should the processes at work on it die."""
AHEAD = 2
"""Items handed out for each worker, so that none waits for the next."""


@dataclass(frozen=True, kw_only=True)
class Workers:
    """Who computes: this process, `number` processes of this machine, a Dask `cluster`, or an executor that is lent."""

    number: int = 1
    cluster: str | None = None
    executor: Executor | None = None

    @classmethod
    def of(cls, workers: int | str | Executor | Workers) -> Workers:
        """Workers by their number, the address of a Dask scheduler, or as any executor of `concurrent.futures`.

        Raises
        ------
        BadInput
            When it is none of these.
        """
        if isinstance(workers, Workers):
            return workers
        if isinstance(workers, Executor) or callable(getattr(workers, "submit", None)):
            return cls(executor=cast("Executor", workers))
        try:
            return cls(number=index(workers))  # type: ignore[arg-type]
        except TypeError:
            text = str(workers).strip()
        return cls(number=int(text)) if re.fullmatch(r"[+-]?\d+", text) else cls(cluster=text)

    def __post_init__(self) -> None:
        if not 1 <= self.number <= MOST:
            raise BadInput(f"--workers takes a whole number from 1 to {MOST}, got {self.number}.")
        if self.cluster is not None and not re.fullmatch(r"(tcp|tls|ws|wss|ucx)://[^\s/]+:\d+", self.cluster):
            raise BadInput(
                "--workers takes a number of processes of this machine, or the address that `dask scheduler` prints, "
                f"such as tcp://host:8786, got '{self.cluster:.60}'."
            )

    @property
    def alone(self) -> bool:
        """Whether this process does everything itself."""
        return self.number == 1 and self.cluster is None and self.executor is None


HERE = Workers()


@dataclass(frozen=True, kw_only=True)
class Finished(Generic[R]):
    """What came of the items: results by the place of each, and whether Ctrl-C ended it."""

    results: Mapping[int, R]
    interrupted: bool

    def so_far(self) -> list[R]:
        """What is there, in the order of the items."""
        return [self.results[i] for i in sorted(self.results)]

    def all(self) -> list[R]:
        """Every result in the order of the items.

        Raises
        ------
        KeyboardInterrupt
            When Ctrl-C came, were it after the last of them: who pressed it waits for no next step.
        """
        if self.interrupted:
            raise KeyboardInterrupt
        return self.so_far()


def spread(
    task: Callable[[T, Progress], R],
    items: Sequence[T],
    *,
    workers: Workers = HERE,
    progress: Progress = silent,
    what: str = "part",
) -> Finished[R]:
    """Do a task for every item; Ctrl-C keeps what is finished.

    Parameters
    ----------
    task : callable
        Of an item, and of a `Progress` that listens only in this process. It keeps nothing and draws no random numbers
        but those that its item holds or seeds.
    items : sequence
        Sizeable ones: handing one out takes about a millisecond.
    progress : callable, optional
        Called in one line with how many are completed.
    what : str
        Name of one item in that line.

    Returns
    -------
    Finished
        A worker that dies loses nothing: what it was at is done again.

    Raises
    ------
    BadInput
        When the cluster cannot be reached or lacks what it takes, or the task says so.
    WorkersLost
        When processes keep dying over one item.
    """
    if workers.alone or (len(items) < 2 and not workers.cluster):
        return _here(task, items, progress, what)
    return _there(_pool(workers, len(items)), task, items, progress, what)


def _pool(workers: Workers, items: int) -> Pool:
    if workers.executor is not None:
        return Lent(workers.executor)
    return Cluster(workers.cluster) if workers.cluster else Processes(min(workers.number, items))


def _here(task: Callable[[T, Progress], R], items: Sequence[T], progress: Progress, what: str) -> Finished[R]:
    results: dict[int, R] = {}
    interrupted = False
    try:
        with one_thread():
            for i, item in enumerate(items):
                progress(f"{what} {i} of {len(items)}", i / len(items))
                tell = part(progress, i / len(items), (i + 1) / len(items), f"{what} {i + 1} of {len(items)}")
                results[i] = task(item, tell)
            progress(f"{what} {len(items)} of {len(items)}", 1.0)
    except KeyboardInterrupt:
        interrupted = True
    return Finished(results=results, interrupted=interrupted)


def _there(
    pool: Pool, task: Callable[[T, Progress], R], items: Sequence[T], progress: Progress, what: str
) -> Finished[R]:
    results: dict[int, R] = {}
    running: dict[Future[bytes], int] = {}
    waiting, begun = deque(range(len(items))), Counter[int]()
    order = carried(task)
    interrupted = False

    def collect(ended: Any) -> None:
        for future in ended:
            results[running[future]] = unpacked(future.result())
            del running[future]

    try:
        progress(f"{what} 0 of {len(items)}, on {pool.name}", 0.0)
        while len(results) < len(items):
            try:
                executor = pool.executor()
                while waiting and len(running) < AHEAD * pool.width:
                    i = waiting[0]
                    running[executor.submit(do, order, carried(items[i]))] = i
                    waiting.popleft()
                    begun[i] += 1
                collect(wait(running, return_when=FIRST_COMPLETED).done)
            except (BrokenExecutor, CancelledError) as error:
                collect([f for f in running if f.done() and not f.cancelled() and f.exception() is None])
                waiting.extendleft(sorted(running.values(), reverse=True))
                running.clear()
                _give_up(pool, what, {i: begun[i] for i in waiting}, error)
            progress(f"{what} {len(results)} of {len(items)}, on {pool.name}", len(results) / len(items))
    except KeyboardInterrupt:
        interrupted = True
        collect([f for f in running if f.done() and not f.cancelled() and f.exception() is None])
    except pool.hopeless as error:
        raise WorkersLost(_lost(pool, what, min(running.values()), TRIES)) from error
    finally:
        if running:
            pool.stop(running)
    return Finished(results=results, interrupted=interrupted)


def _give_up(pool: Pool, what: str, begun: Mapping[int, int], error: BaseException) -> None:
    """Raise when an item was begun too often, or nobody is left to begin it."""
    worst = max(begun, key=lambda i: begun[i])
    if pool.gone:
        raise WorkersLost(pool.loss) from error
    if begun[worst] >= TRIES:
        raise WorkersLost(_lost(pool, what, worst, begun[worst])) from error


def _lost(pool: Pool, what: str, item: int, times: int) -> str:
    return (
        f"workers were needed to the end of {what} {item + 1} or one begun with it, and died {times} times "
        f"({pool.name}); is there enough memory for so many at once? Take fewer with --workers."
    )
