"""Is a scheduler that cannot do the work told so in a sentence, and one that can kept? Its package is a stand-in."""

from __future__ import annotations

import sys
from concurrent.futures import ThreadPoolExecutor
from types import SimpleNamespace

import pytest

from upright._version import __version__
from upright.errors import BadInput
from upright.workers import labour

ADDRESS = "tcp://host:8786"
HERE = f"upright {__version__} on Python {sys.version_info[0]}.{sys.version_info[1]}"


class Client:
    """A connection to a scheduler whose workers have so many threads each, and a version of this program."""

    def __init__(self, threads=(1, 1), versions=(HERE, HERE), waits=None, runs=None):
        self.threads, self.versions, self.waits, self.runs = threads, versions, waits, runs
        self.status, self.given, self.closed = "running", (), 0

    def wait_for_workers(self, number, timeout):
        assert (number, timeout) == (1, 10)
        if self.waits:
            raise self.waits

    def run(self, function):
        if self.runs:
            raise self.runs
        assert function() == HERE
        return dict(enumerate(self.versions))

    def nthreads(self):
        return dict(enumerate(self.threads))

    def get_executor(self, pure):
        assert not pure  # the same work twice is done twice
        return ThreadPoolExecutor(1)

    def close(self):
        self.closed += 1


@pytest.fixture
def distributed(monkeypatch):
    """Package whose next connections are those of a list, or what it raises."""
    monkeypatch.setattr(labour, "_clients", {})
    kit = SimpleNamespace(KilledWorker=ZeroDivisionError, clients=[])

    def connect(address, timeout, set_as_default):
        assert (address, timeout, set_as_default) == (ADDRESS, 10, False)
        following = kit.clients.pop(0)
        if isinstance(following, BaseException):
            raise following
        return following

    kit.Client = connect
    monkeypatch.setattr(labour, "import_module", lambda name: {"distributed": kit}[name])
    return kit


def test_a_scheduler_is_asked_once_until_its_connection_is_lost(distributed):
    first, second = Client(threads=(4, 8)), Client()
    distributed.clients = [first, second]
    pool = labour.Cluster(ADDRESS)
    assert (pool.width, pool.name, pool.gone, pool.hopeless) == (
        12,
        f"the cluster {ADDRESS}",
        False,
        (ZeroDivisionError,),
    )
    assert labour.Cluster(ADDRESS)._client is first
    first.status = "closed"
    assert pool.gone
    assert f"the connection to the cluster {ADDRESS} was lost" in pool.loss
    again = labour.Cluster(ADDRESS)
    assert again._client is second
    assert again.width == 8  # at least so many items are under way
    assert not again.gone


@pytest.mark.parametrize(
    ("client", "said"),
    [
        (OSError("refused\nfor a long time"), rf"no Dask scheduler answers at {ADDRESS} \(refused\); start one with"),
        (ValueError("bad"), r"no Dask scheduler answers at .* \(bad\)"),
        (Client(waits=TimeoutError()), rf"at {ADDRESS} has no workers; start some with `dask worker {ADDRESS}"),
        (Client(versions=(HERE, "upright 0.1 on Python 3.9")), rf"need {HERE} as here, and have upright 0\.1 on Pyth"),
        (Client(runs=ImportError()), rf"need {HERE} as here, and have no upright; install"),
    ],
)  # fmt: skip
def test_a_scheduler_that_cannot_do_the_work_is_left_with_what_is_missing(distributed, client, said):
    distributed.clients = [client]
    with pytest.raises(BadInput, match=said):
        labour.Cluster(ADDRESS)
    assert not isinstance(client, Client) or client.closed == 1
    distributed.clients = [Client()]
    assert not labour.Cluster(ADDRESS).gone  # the next one is asked anew


def test_without_the_package_its_extra_is_named(distributed, monkeypatch):
    def missing(name):
        raise ImportError(name)

    monkeypatch.setattr(labour, "import_module", missing)
    with pytest.raises(BadInput, match=r"pip install 'upright\[cluster\]'"):
        labour.Cluster(ADDRESS)
