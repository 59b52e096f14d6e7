"""Is the work done once, in order and the same to the last bit, whoever does it and whatever happens to them?"""

from __future__ import annotations

import os
import subprocess
import sys
import textwrap
from functools import partial
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from upright.errors import BadInput, WorkersLost
from upright.physics import find
from upright.simulation import ensemble
from upright.workers import HERE, Workers, cut, spread


def walk(seed, _progress):
    """What rounding, the linear algebra's order of sums and the random numbers would all change."""
    rng = np.random.default_rng(seed)
    A = rng.normal(size=(200, 200))
    return np.linalg.solve(A, rng.normal(size=200)) @ A


def seeds(count):
    return np.random.SeedSequence(7).spawn(count)


@given(st.integers(1, 5000), st.sampled_from([16, 64, 256]))
def test_blocks_hold_every_lane_once_and_no_lane_alone(lanes, most):
    blocks = cut(lanes, most)
    assert np.array_equal(np.concatenate([np.arange(lanes)[b] for b in blocks]), np.arange(lanes))
    assert all(a.stop == b.start for a, b in pairwise(blocks))
    assert all(b.stop - b.start > 1 for b in blocks) or lanes == 1


def test_a_block_is_no_part_of_what_the_kernel_steps_at_once():
    with pytest.raises(ValueError, match="multiple of 16"):
        cut(100, 24)


@pytest.mark.parametrize(
    ("asked", "said"),
    [
        ({"number": 0}, "from 1 to"),
        ({"cluster": "nearby"}, "tcp://host:8786"),
    ],
)
def test_impossible_workers_are_told_so(asked, said):
    with pytest.raises(BadInput, match=said):
        Workers(**asked)


def test_progress_is_one_line_from_nothing_to_all():
    heard = []
    done = spread(lambda item, _: item, range(4), progress=lambda *told: heard.append(told), what="rig")
    assert heard == [(f"rig {k} of 4", k / 4) for k in range(5)]
    assert not done.interrupted


def test_an_item_tells_its_share_of_the_whole():
    heard = []
    spread(lambda _, tell: tell("half-way", 0.5), range(2), progress=lambda *told: heard.append(told), what="rig")
    assert ("rig 2 of 2: half-way", 0.75) in heard


def stop_at(share, _step, here):
    if here >= share:
        raise KeyboardInterrupt


@pytest.mark.parametrize("workers", [HERE, pytest.param(Workers(number=2), marks=pytest.mark.slow)])
def test_ctrl_c_keeps_what_is_finished(workers):
    def task(item, tell):
        tell("done", 1.0)
        return item**2

    done = spread(task, range(40), workers=workers, progress=partial(stop_at, 0.5))
    assert done.interrupted
    assert 19 <= len(done.results) < 40
    assert all(done.results[i] == i**2 for i in done.results)
    with pytest.raises(KeyboardInterrupt):
        done.all()


def test_blocks_of_lanes_are_the_ensemble_to_the_last_bit():
    rig, rng = find("pendulum")(m_p=0.2, l_cg=0.3, J_p=4e-3, b_2=1e-3, b_2c=2e-3), np.random.default_rng(1)
    params, x0 = {"J_p": rng.uniform(3e-3, 5e-3, 529)}, np.stack([rng.uniform(0, 3, 529), np.zeros(529)], axis=1)
    whole = ensemble(rig, params, x0, None, 5e-3, samples=200, threads=1)
    parts = ensemble(rig, params, x0, None, 5e-3, samples=200, workers=HERE)
    for name, value in vars(whole).items():
        assert np.array_equal(value, getattr(parts, name))


def test_two_processes_say_what_one_says_to_the_last_bit():
    one, two = (spread(walk, seeds(5), workers=Workers(number=n)).all() for n in (1, 2))
    assert all(np.array_equal(a, b) for a, b in zip(one, two, strict=True))


@pytest.mark.slow
def test_three_processes_say_what_one_says_of_an_ensemble():
    rig, rng = find("furuta")(m_p=0.135, l_cg=0.19, r=0.16, J_d=0.011, J_p=6e-4, b_1c=1e-3), np.random.default_rng(2)
    params, x0 = {"J_p": rng.uniform(5e-4, 7e-4, 1000)}, rng.normal(size=(1000, 4))
    run = partial(ensemble, rig, params, x0, None, 2e-3, samples=1000)
    one, two, three = (run(workers=Workers(number=n)) for n in (1, 2, 3))
    for other in (two, three):
        assert all(np.array_equal(v, getattr(other, n)) for n, v in vars(one).items())


@pytest.mark.slow
def test_a_worker_that_dies_once_loses_nothing(tmp_path):
    marker = tmp_path / "died"

    def fatal_once(item, _progress):
        if item == 3 and not marker.exists():
            marker.touch()
            os._exit(1)
        return item + 1

    assert spread(fatal_once, range(12), workers=Workers(number=2)).all() == list(range(1, 13))
    assert marker.exists()


@pytest.mark.slow
def test_an_item_that_kills_whoever_does_it_is_given_up():
    with pytest.raises(WorkersLost, match="memory"):
        spread(lambda item, _: os._exit(1) if item == 1 else item, range(3), workers=Workers(number=2))


@pytest.mark.slow
def test_what_a_task_refuses_is_said_here():
    def refuse(item, _progress):
        if item == 2:
            raise BadInput("two is too many")
        return item

    with pytest.raises(BadInput, match="two is too many"):
        spread(refuse, range(6), workers=Workers(number=2))


@pytest.mark.slow
def test_a_script_without_a_guard_and_its_own_plant_can_be_shared(tmp_path):
    """Processes that import the script again would run it again, each of them."""
    (tmp_path / "mine.py").write_text(
        textwrap.dedent("""
        from upright.physics import Coordinate, Plant
        from upright.quantities import quantity

        class Slider(Plant):
            m: float = quantity("kg", "mass", above=0)
            c: float = quantity("N s/m", "friction", default=0.0, at_least=0)
            coordinates = (Coordinate("x", "m", "position"),)
            inputs = ()
            joints = ()
            equilibria = {"resting": {}}

            @staticmethod
            def energies(p, q, v):
                return p.m * v[0] ** 2 / 2, 0, p.c * v[0] ** 2 / 2
        """),
        encoding="utf-8",
    )
    (tmp_path / "script.py").write_text(
        textwrap.dedent("""
        from upright.physics import find
        from upright.workers import Workers, spread

        Slider = find("mine.py:Slider")
        print("begun")

        def heavier(item, _progress):
            return Slider(m=1.0 + item, c=0.5)

        rigs = spread(heavier, range(3), workers=Workers(number=2)).all()
        print([type(rig) is Slider and rig.m for rig in rigs])
        """),
        encoding="utf-8",
    )
    told = subprocess.run(
        [sys.executable, "script.py"], cwd=tmp_path, capture_output=True, text=True, timeout=120, check=True
    )
    assert told.stdout.split("\n", 1) == ["begun", "[1.0, 2.0, 3.0]\n"]
