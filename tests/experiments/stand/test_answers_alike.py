"""A twin that is simulated and the same behind the protocol answer alike, to a signal and to a law."""

from __future__ import annotations

import math

import numpy as np
import pytest

from upright.basis import SIMULATED
from upright.experiments.stand.live import live_stand, pushed, run_of
from upright.experiments.stand.stand import APPLIED, file_of
from upright.experiments.stand.twin import TwinStand
from upright.experiments.tracking_3.laws import AT, paper_sets
from upright.experiments.tracking_3.run import figured, levels_of
from upright.files import write_json
from upright.laws import as_values
from upright.readers import read
from upright.rig.makes import MAKES, make_rig
from upright.rigs.supervisor import _free_with
from upright.running.run import RunRequest, run_rig


@pytest.mark.parametrize(
    ("make", "at", "along"),
    [("torsional", "rest", [1.0, 1.0]), ("furuta", "inverted", [1.0, 0.0]), ("linear", "hanging", [1.0, 0.0])],
)
def test_what_nothing_pulls_back_goes_along(make, at, along):
    """A free shaft turns as a whole; an arm or a cart goes alone, its pendulum stays where gravity has it."""
    assert _free_with(make_rig(make), at, 0) == pytest.approx(along, abs=1e-12)


def test_what_a_spring_pulls_back_is_held_where_the_spring_has_it():
    assert _free_with(make_rig("torsional").changed(k_1=1.0), "rest", 0) == [0.0, 0.0]


@pytest.fixture
def stands(tmp_path):
    """A twin that is simulated, and the same behind the protocol."""
    (tmp_path / "RIG.toml").write_text('kind = "twin"\nmake = "torsional"\n', encoding="utf-8")
    return TwinStand(rig=make_rig("torsional"), make=MAKES["torsional"]), live_stand(tmp_path / "RIG.toml")


def test_a_step_and_the_push_after_it_come_alike(stands, tmp_path):
    """Without the pulse that a person is shown first, which leaves a live shaft moving."""
    rig = make_rig("torsional")
    law = paper_sets(rig, (1,))[0]
    size = 0.9 * rig.limit / abs(law.k_pf)
    reference, pushes = levels_of(rig, size)
    n = reference.size
    simulated = stands[0].hold(
        law.law, AT, tmp_path, "step", (n - 1) * rig.period, reference=reference, pushes=pushes
    ).trial  # fmt: skip
    path = write_json(tmp_path / "law.json", as_values(pushed(law.law, reference, pushes)))
    request = RunRequest(rig=tmp_path / "RIG.toml", law=path, seconds=n * rig.period, check=False)
    driven = run_of(run_rig(request, tmp_path), AT).trial
    assert simulated.t.size == driven.t.size == n
    np.testing.assert_allclose(driven.record.t, simulated.record.t, atol=1e-12)  # rounding of a clock that ran on
    np.testing.assert_allclose(driven.u, simulated.u, atol=1.01 * rig.converter)
    expected, found = figured(simulated, size), figured(driven, size)
    assert found.give == pytest.approx(expected.give, rel=1e-9)
    assert found.figures.arrival == pytest.approx(expected.figures.arrival, rel=1e-9)
    assert math.isinf(found.tripped)


def test_a_law_runs_from_its_first_sample_to_its_last(stands, tmp_path):
    law = paper_sets(stands[0].rig, (1,))[0].law
    reference = pushes = np.zeros(51)
    for stand in stands:
        run = stand.hold(law, AT, tmp_path, "rest", 50 * stand.rig.period, reference=reference, pushes=pushes)
        assert run.trial.t.size == 51
        assert run.trial.t[-1] == pytest.approx(50 * stand.rig.period)
        assert run.ended is None
        assert not run.overtravel


def test_a_signal_comes_alike_and_leaves_a_file(stands, tmp_path):
    """The log of a run begins a sample later than that of a simulation, whose first row is rest."""
    rig = make_rig("torsional")
    u = (0.5 * np.sin(np.linspace(0, 6 * math.pi, 400))).tolist()
    simulated, driven = (stand.run(u, tmp_path, "sines") for stand in stands)
    for log, stand in zip((simulated, driven), stands, strict=True):
        again = read(tmp_path / file_of(log))
        assert again.units[APPLIED] == rig.unit
        for name in stand.names:
            np.testing.assert_array_equal(again[name], log[name])
    for name, count in zip(stands[0].names, rig.resolution, strict=True):
        np.testing.assert_allclose(driven[name][-300:], simulated[name][-300:], atol=1.01 * count)


def test_both_rest_where_the_encoders_are_zeroed_and_know_their_numbers(stands):
    simulated, driven = stands
    assert simulated.resting == driven.resting == "rest"
    assert simulated.truth == driven.truth
    assert simulated.make is driven.make
    assert simulated.performed == driven.performed == SIMULATED


def test_a_simulation_waits_for_nobody_and_nothing_breaks_in_it_and_a_driven_rig_is_no_such_thing(stands):
    """What a twin behind the protocol truly is stays closed to experiments: it is run as hardware is."""
    simulated, driven = stands
    assert simulated.starts_anywhere
    assert simulated.may_fall
    assert not simulated.attended
    assert driven.attended
    assert not driven.starts_anywhere
    assert not driven.may_fall
    assert (simulated.exact, driven.exact) == (simulated.rig, None)
