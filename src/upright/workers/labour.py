"""Who works besides this process: processes of this machine, or those of a Dask cluster."""

from __future__ import annotations

import sys
from abc import ABC, abstractmethod
from collections.abc import Iterable
from concurrent.futures import Executor, Future
from functools import cache, lru_cache
from importlib import import_module
from logging import CRITICAL, getLogger
from threading import Lock
from typing import Any

from upright.errors import BadInput
from upright.progress import silent
from upright.workers.carriage import carried, unpacked
from upright.workers.linear_algebra import limit_threads
from upright.workers.threads import one_core

IDLE = 60
"""Seconds after which processes without work end."""
PATIENCE = 10
"""Seconds in which a scheduler and its first worker have to answer."""


_TURN = Lock()


def do(order: bytes, item: bytes) -> bytes:
    """Do a task for an item, over there; one at a time in a process."""
    with _TURN, one_core():
        _one_thread()
        return carried(_task(order)(unpacked(item), silent))


@lru_cache(maxsize=4)
def _task(order: bytes) -> Any:
    return unpacked(order)


_one_thread = cache(limit_threads)


def _leave_ctrl_c_to_the_parent() -> None:
    import signal

    signal.signal(signal.SIGINT, signal.SIG_IGN)


class Pool(ABC):
    """Workers that can be handed work: an executor, and how many there are."""

    name: str
    width: int
    gone = False
    loss: str
    """Message where it is gone."""
    hopeless: tuple[type[BaseException], ...] = ()
    """What is raised when an item has killed its workers too often."""

    @abstractmethod
    def executor(self) -> Executor:
        """Executor that takes work now; another one when the last broke."""

    def stop(self, running: Iterable[Future[Any]]) -> None:
        """Take back what waits; what is under way ends by itself."""
        for future in running:
            future.cancel()


class Processes(Pool):
    """Processes of this machine, kept warm for the next call; a script needs no guard around its main part."""

    def __init__(self, number: int) -> None:
        self.width, self.name = number, f"{number} processes"

    def executor(self) -> Executor:
        """Its processes, started where none are left."""
        from loky import get_reusable_executor

        return get_reusable_executor(max_workers=self.width, timeout=IDLE, initializer=_leave_ctrl_c_to_the_parent)

    def stop(self, running: Iterable[Future[Any]]) -> None:
        """End the processes; what is under way would keep them."""
        super().stop(running)
        self.executor().shutdown(kill_workers=True)  # type: ignore[call-arg]


class Lent(Pool):
    """Somebody else's executor, of `concurrent.futures` or like it, which stays theirs."""

    def __init__(self, executor: Executor) -> None:
        self._executor = executor
        self.width = int(getattr(executor, "_max_workers", 0) or 8)
        self.name = f"the {type(executor).__name__} of the caller"
        self.loss = f"{self.name} broke; make another, with fewer workers where memory is short."

    @property
    def gone(self) -> bool:  # type: ignore[override]
        """Whether it takes no more work: nobody but its owner can make another."""
        return bool(getattr(self._executor, "_broken", False))

    def executor(self) -> Executor:
        """The caller's.

        Raises
        ------
        BadInput
            When it was shut down.
        """
        if any(getattr(self._executor, name, False) for name in ("_shutdown", "_shutdown_thread")):
            raise BadInput(f"{self.name} was shut down; call within its with block.")
        return self._executor


class Cluster(Pool):
    """Workers of a Dask cluster, which have this program installed."""

    def __init__(self, address: str) -> None:
        client = _client(address)
        self.name = f"the cluster {address}"
        self.loss = f"the connection to {self.name} was lost; see whether its scheduler still runs."
        self.hopeless = (import_module("distributed").KilledWorker,)
        self._client = client
        self._executor: Any = client.get_executor(pure=False)
        self.width = max(sum(client.nthreads().values()), 8)

    @property
    def gone(self) -> bool:  # type: ignore[override]
        """Whether the scheduler is lost."""
        return self._client.status != "running"

    def executor(self) -> Executor:
        """The scheduler, which hands work on and replaces workers that died by others."""
        return self._executor


_clients: dict[str, Any] = {}


def _client(address: str) -> Any:
    """Connection to a scheduler, with workers that can do our work.

    Raises
    ------
    BadInput
        When it cannot be had.
    """
    known = _clients.get(address)
    if known is not None and known.status == "running":
        return known
    try:
        distributed = import_module("distributed")
    except ImportError:
        raise BadInput("a Dask scheduler needs the cluster extra: pip install 'upright[cluster]'.") from None
    getLogger("distributed.client").setLevel(CRITICAL)  # what it would log is said in sentences
    try:
        client = distributed.Client(address, timeout=PATIENCE, set_as_default=False)
    except (OSError, ValueError) as error:
        raise BadInput(
            f"no Dask scheduler answers at {address} ({str(error).splitlines()[0]:.80}); start one with `dask "
            "scheduler` and look at the address it prints."
        ) from None
    try:
        client.wait_for_workers(1, timeout=PATIENCE)
    except TimeoutError:
        client.close()
        raise BadInput(
            f"the scheduler at {address} has no workers; start some with `dask worker {address} --nthreads 1`."
        ) from None
    try:
        others = set(client.run(_version).values()) - {_version()}
    except ImportError:
        others = {"no upright"}
    if others:
        client.close()
        raise BadInput(
            f"the workers at {address} need {_version()} as here, and have {', '.join(sorted(others))}; install the "
            "same there: pip install 'upright[cluster]'."
        )
    _clients[address] = client
    return client


def _version() -> str:
    from upright._version import __version__

    return f"upright {__version__} on Python {sys.version_info[0]}.{sys.version_info[1]}"
