"""Which runs repeat one another, and how well one predicts another: by hand."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from upright.closed_loop.structures import ClosedLoop
from upright.identification.ladder.repeats import log_error, repeats, same
from upright.identification.model.runs import Run
from upright.laws import state_feedback

DT, N = 0.01, 400


def driven(label: str, *, begin: float = 0.5, samples: int = N, lead: int = 0, **about: Any) -> Run:
    """A square wave from `begin` on, logged from `lead` samples earlier; its answer is the command's integral."""
    t = DT * np.arange(samples)
    since = t - begin - lead * DT
    u = np.where(since > -DT / 2, np.sign(np.sin(4.0 * since + 0.1)), 0.0)
    y = np.concatenate([[0.0], np.cumsum(u)[:-1]]) * DT
    base: dict[str, Any] = {"label": label, "role": "fit", "t": t, "u": u[:, None], "y": y[:, None]}
    return Run(**{**base, "measured": ("x",), **about})


ONE = driven("one")


@pytest.mark.parametrize(
    ("other", "repeated"),
    [
        (driven("two"), True),
        (driven("two", samples=201), True),  # more than half of the longer one
        (driven("two", samples=200), False),
        (driven("two", lead=30), True),  # the record began earlier
        (replace(ONE, u=1.019 * ONE.u), True),  # by less than a fiftieth of its size
        (replace(ONE, u=1.025 * ONE.u), False),
        (replace(ONE, u=-ONE.u), False),
        (replace(ONE, measured=("z",)), False),
        (replace(ONE, known={"m": 1.0}), False),
        (replace(ONE, t=ONE.t * (1 + 1.5 / N)), False),  # drifts apart by more than a sample
        (replace(ONE, t=ONE.t * (1 + 0.5 / N)), True),
        (replace(ONE, held={"z": 0.0}), False),
        (replace(ONE, repeats="x"), False),
    ],
)
def test_the_same_command_of_the_same_rig_is_a_repeat(other: Run, repeated: bool) -> None:
    assert same(ONE, other) == repeated
    assert same(other, ONE) == repeated


def test_what_never_changes_repeats_nothing_unless_it_says_so() -> None:
    still = [replace(ONE, u=0 * ONE.u + level, label=f"{level}") for level in (0.0, 0.0)]
    assert not same(*still)
    said = [replace(run, repeats="release") for run in still]
    assert same(*said)
    assert same(said[0], replace(ONE, repeats="release"))
    assert not same(said[0], replace(ONE, repeats="other"))
    assert not same(said[0], replace(said[1], measured=("z",)))
    assert not same(said[0], replace(said[1], t=2 * ONE.t))


def test_what_is_held_is_held_alike() -> None:
    z = np.sin(3 * ONE.t)
    for value, repeated in ((z, True), (1.019 * z, True), (1.03 * z, False), (0.0 * z, False), (0.3, False)):
        pair = replace(ONE, held={"z": z}), replace(ONE, held={"z": value})
        assert same(*pair) == repeated
    assert same(replace(ONE, held={"z": 0.3}), replace(ONE, held={"z": 0.3}))
    assert not same(replace(ONE, held={"z": 0.3}), replace(ONE, held={"z": 0.31}))


def test_a_law_stands_for_its_command() -> None:
    """Two runs under one law repeat each other although no command is logged; under another they do not."""
    loops = [ClosedLoop(law=state_feedback([-6.0, k], DT, measured=("x",))) for k in (-1.8, -1.8, -1.9)]
    runs = [replace(ONE, u=0 * ONE.u, loop=loop) for loop in loops]
    assert same(runs[0], runs[1])
    assert not same(runs[0], runs[2])
    assert not same(runs[0], replace(runs[1], loop=None))


def test_groups_are_told_with_what_one_run_says_of_another() -> None:
    """The second moves 1.1 times as far: it misses the first by a tenth of that, the first it by an eleventh."""
    far = driven("far")
    runs = [ONE, driven("alone", begin=0.5, repeats="x"), replace(far, y=1.1 * far.y + 3.0)]
    (group,) = repeats(runs)
    assert group.labels == ("one", "far")
    ratio = float(np.linalg.norm(ONE.y) / np.linalg.norm(ONE.y - ONE.y.mean()))
    expected = {"one": 100 * (1 - 0.1 * ratio), "far": 100 * (1 - 0.1 / 1.1 * ratio)}
    assert group.percents["x"] == pytest.approx((expected["one"], expected["far"]), rel=1e-6)
    assert group.ceiling["x"] == pytest.approx(np.mean(list(expected.values())), rel=1e-6)
    assert group.errors == pytest.approx({n: math.log(1 - p / 100) for n, p in expected.items()}, rel=1e-6)
    # with an offset of its own each is taken about its mean: a tenth of how far it moves
    free = [replace(run, unknown=("initial", "offset")) for run in (runs[0], runs[2])]
    assert repeats(free)[0].percents["x"] == pytest.approx((90.0, 100 * (1 - 0.1 / 1.1)), rel=1e-6)
    named = [replace(run, unknown=("offset.x",)) for run in (runs[0], runs[2])]
    assert repeats(named) == repeats(free)
    assert repeats(runs[:2]) == ()


def test_records_that_began_apart_are_laid_over_each_other() -> None:
    """The one that began 30 samples earlier shows the same motion that much later."""
    (group,) = repeats([ONE, driven("early", lead=30)])
    assert group.percents["x"] == pytest.approx((100.0, 100.0))
    held = [replace(run, y=np.hstack([run.y, run.y]), measured=("x", "z"), held={"z": 0.0})
            for run in (ONE, driven("early", lead=30))]  # fmt: skip
    assert set(repeats(held)[0].percents) == {"x"}


def test_a_log_error_is_that_of_what_is_missed() -> None:
    assert log_error(90.0) == pytest.approx(math.log(0.1))
    assert log_error(-100.0) == pytest.approx(math.log(2.0))
    assert log_error(100.0) == pytest.approx(math.log(1e-9))
