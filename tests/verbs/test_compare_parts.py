"""What of a run is predicted, by whom, and what counts as common to two fits, each by hand."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

import upright as up
from tests.exports.rigs import fit_file
from upright.identification import Estimate, Run, RunScore
from upright.identification.model.runs import LEAST_RUN
from upright.rig.makes import make_rig
from upright.verbs.model.compare import (
    _at,
    _compared_names,
    _covariance,
    _halves,
    _in_memory,
    _logs,
    _names,
    _only_scored,
)

T = np.arange(201) * 0.05


def run(n=201, **more):
    t = 3.0 + T[:n]
    y = np.column_stack([np.sin(t), np.cos(t)])
    return Run(label="run", t=t, y=y, u=np.zeros((n, 0)), measured=("psi", "theta"), **({"role": "fit"} | more))


def test_the_equation_sees_the_first_half_and_fits_are_scored_on_the_second_having_looked_from_two_fifths_on():
    """Of 201 samples the halves part at the 101st; a fit looks for its start state from the 81st on."""
    first, rest = _halves(run(initial={"theta": 0.1}, unknown=("offset",)))
    np.testing.assert_allclose(first.t, 3.0 + T[:100])
    np.testing.assert_allclose(rest.t, 3.0 + T[80:])
    assert rest.t[0] + rest.score_from == pytest.approx(8.0)
    assert set(rest.unknown) == {"initial", "offset"}
    assert rest.initial == {}  # it begins where nobody said
    assert _halves(run(unknown=("initial",)))[1].unknown == ("initial",)


@pytest.mark.parametrize("how", [{"n": LEAST_RUN - 1}, {"unknown": ("input_start",)}, {"unknown": ("input_end",)}])
def test_a_run_that_cannot_be_parted_stays_whole(how):
    whole = run(**how)
    first, rest = _halves(whole)
    assert first is None
    assert rest is whole
    assert _halves(run(LEAST_RUN))[0].t.size == LEAST_RUN // 2


def score(t, simulated, measured=("psi", "theta"), **more):
    shape = np.shape(simulated)
    return RunScore(role="predict", fit_percent={}, horizon=None, t=np.asarray(t), y=np.zeros(shape),
                    simulated=np.asarray(simulated), measured=measured, **more)  # fmt: skip


def test_only_samples_from_where_the_score_begins_count():
    whole = score(T, np.column_stack([T, 2 * T]), band={"psi": 3 * T}, score_from=4.0)
    kept = _only_scored(whole, SimpleNamespace(t=T, score_from=4.0))
    np.testing.assert_array_equal(kept.t, T[80:])
    np.testing.assert_array_equal(kept.simulated, np.column_stack([T, 2 * T])[80:])
    np.testing.assert_array_equal(kept.band["psi"], 3 * T[80:])
    assert (kept.score_from, kept.y.shape) == (0.0, (121, 2))


def test_the_baseline_is_read_between_its_steps_as_a_cubic_and_nowhere_else():
    """A cubic is its own spline; columns go by their names, steps in any order and twice count once."""
    base_t = np.array([2.0, 1.0, 3.0, 4.0, 5.0, 5.0])

    def curves(t):
        return np.column_stack([t**3 - t, 2 * t**2])

    fine = np.arange(0.5, 5.75, 0.25)
    read = _at(score(base_t, curves(base_t), ("theta", "psi")), score(fine, np.zeros((fine.size, 2))))
    inside = (fine >= 1.0) & (fine <= 5.0)
    np.testing.assert_allclose(read.simulated[inside], curves(fine)[inside][:, ::-1], atol=1e-12)
    assert np.isnan(read.simulated[~inside]).all()
    assert read.measured == ("psi", "theta")
    one = _at(score(base_t, curves(base_t)[:, :1], ("theta",)), score(fine, np.zeros((fine.size, 2))))
    assert np.isnan(one.simulated[:, 0]).all()
    np.testing.assert_allclose(one.simulated[inside, 1], (fine**3 - fine)[inside], atol=1e-12)
    lost = curves(base_t)
    lost[2] = np.inf
    assert np.isnan(_at(score(base_t, lost), score(fine, np.zeros((fine.size, 2)))).simulated).all()
    three = _at(score(base_t[:3], curves(base_t[:3])), score(fine, np.zeros((fine.size, 2))))
    assert np.isnan(three.simulated).all()  # a cubic needs four


def estimate(value, status="well determined", half=0.1):
    return Estimate(value=value, stderr=half / 1.959964, interval=(value - half, value + half), status=status)


def test_what_neither_fit_asked_and_both_take_alike_is_not_compared():
    """Nor what both leave idle; what one asked is, and what was given differently."""
    one = {
        "m_p": estimate(0.1, "known"), "r": estimate(0.2, "known"), "b_1": estimate(1.0),
        "b_1c": estimate(0.0, "known"), "J_p": estimate(2.0, "assumed"), "actuator.gain": estimate(1.0, "known"),
    }  # fmt: skip
    two = {**one, "r": estimate(0.3, "known"), "b_1": estimate(1.5, "known"), "J_p": estimate(2.0)}
    assert set(_compared_names(one, {"a": one, "b": two})) == {"r", "b_1", "J_p"}
    assert _compared_names(one, {"a": one, "b": two})["r"].value == 0.2
    assert set(_compared_names(one, {"a": one})) == {"b_1"}


def test_the_covariance_of_common_numbers_is_as_wide_as_their_intervals_and_a_given_one_stands_alone():
    """Half intervals over 1.96 where they are wider than the standard errors; the fit's correlation between."""
    spread = np.array([[4.0, 1.0], [1.0, 1.0]])
    fit = SimpleNamespace(covariance=lambda names: (("b", "a"), spread))
    known = Estimate(value=3.0, stderr=0.5, interval=(3.0, 3.0), status="known")
    wide = Estimate(value=1.0, stderr=0.1, interval=(1.0 - 0.4 * 1.959964, 1.0 + 0.4 * 1.959964), status="good")
    C = _covariance(fit, {"a": wide, "k": known, "b": estimate(2.0, half=0.2 * 1.959964)}, ["a", "k", "b"])
    np.testing.assert_allclose(C, [[0.16, 0, 0.5 * 0.4 * 0.2], [0, 0.25, 0], [0.5 * 0.4 * 0.2, 0, 0.04]], rtol=1e-5)


def test_fits_are_called_by_their_folder_their_file_or_their_place():
    assert _names(["monday/fit.json", "old.json", "monday", object(), "other/fit.json"]) == [
        "monday", "old", "monday (3)", "fit 4", "other",
    ]  # fmt: skip


def test_a_fit_has_seen_the_logs_whose_hashes_its_runs_carry():
    runs = {"a": "x.csv (sha256 ab12), y.csv (sha256 cd34)", "b": "in memory"}
    assert _logs(SimpleNamespace(content={"provenance": {"runs": runs}})) == {"ab12", "cd34"}
    assert _logs(SimpleNamespace(content={})) == set()


def test_a_run_in_memory_was_fitted_where_its_samples_are_those_of_a_fitted_run():
    """More than ten of them, at the same times; not what was held out, another signal, or changed."""
    of_fit = run(role="fit")

    def holds(*runs, seen=None):
        return _in_memory(SimpleNamespace(study=SimpleNamespace(runs=runs)), run() if seen is None else seen)

    assert holds(of_fit)
    assert holds(run(role="predict"), of_fit)
    assert not holds(run(role="predict"))
    assert holds(of_fit, seen=run(12))
    assert not holds(of_fit, seen=run(10))
    assert not _in_memory(SimpleNamespace(study=None), run())
    assert not _in_memory(object(), run())
    other = run(role="fit")
    other.y[50, 0] += 1e-9
    assert not holds(other)


def test_fits_of_two_plants_are_not_compared(tmp_path):
    plants = {"a": make_rig("furuta").plant, "b": make_rig("linear").plant}
    for name, plant in plants.items():
        (tmp_path / name).mkdir()
        fit_file(tmp_path / name, plant, name="furuta" if name == "a" else "cart-pendulum")
    with pytest.raises(up.BadInput, match=r"fits of one plant, got a of a .*furuta.*, b of a .*cart"):
        up.compare([tmp_path / "a", tmp_path / "b"])
