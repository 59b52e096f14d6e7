"""Does a Dask cluster, its scheduler and workers processes of their own, say what this process says?"""

from __future__ import annotations

import os

import numpy as np
import pytest

from benchmarks.workers import cluster as started
from upright.errors import BadInput
from upright.workers import Workers, spread

pytestmark = pytest.mark.slow
pytest.importorskip("distributed", reason="the cluster extra is not installed")


@pytest.fixture(scope="module")
def cluster():
    """Address of a scheduler with two workers, each a process as a person starts it."""
    with started(2) as address:
        yield address


def test_a_cluster_says_what_one_process_says_to_the_last_bit(cluster):
    def walk(seed, _progress):
        rng = np.random.default_rng(seed)
        A = rng.normal(size=(200, 200))
        return np.linalg.solve(A, rng.normal(size=200)) @ A, os.getpid()

    seeds = np.random.SeedSequence(7).spawn(24)
    here = spread(walk, seeds).all()
    there = spread(walk, seeds, workers=Workers(cluster=cluster)).all()
    assert all(np.array_equal(a, b) for (a, _), (b, _) in zip(here, there, strict=True))
    assert len({pid for _, pid in there}) == 2
    assert os.getpid() not in {pid for _, pid in there}


def test_a_worker_of_a_cluster_that_dies_once_loses_nothing(cluster, tmp_path):
    marker = tmp_path / "died"

    def fatal_once(item, _progress):
        if item == 3 and not marker.exists():
            marker.touch()
            os._exit(1)
        return item + 1

    assert spread(fatal_once, range(12), workers=Workers(cluster=cluster)).all() == list(range(1, 13))
    assert marker.exists()


def test_ctrl_c_keeps_what_a_cluster_has_finished(cluster):
    def stop(_step, share):
        if share >= 0.5:
            raise KeyboardInterrupt

    done = spread(lambda item, _: item, range(12), workers=Workers(cluster=cluster), progress=stop)
    assert done.interrupted
    assert len(done.results) >= 6
    assert all(k == v for k, v in done.results.items())


def test_nobody_at_the_address_is_said_in_a_sentence():
    with pytest.raises(BadInput, match=r"no Dask scheduler answers at tcp://127\.0\.0\.1:1 "):
        spread(lambda item, _: item, range(2), workers=Workers(cluster="tcp://127.0.0.1:1"))
