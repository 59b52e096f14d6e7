"""Is a lying encoder found, named and measured, while sound ones on odd rigs are left in peace?"""

from __future__ import annotations

import math
import os
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from scipy.special import ellipk

from upright.control import design_swing_up
from upright.control.sensors import (
    Scales,
    _motion,
    lifted,
    probe,
    scales,
    shown_by_encoders,
)
from upright.control.trial import readings
from upright.experiments.swing_up_2b.run import scales_of_log
from upright.physics import Furuta
from upright.readers import read
from upright.records import Record
from upright.rig import Rig
from upright.rig.makes import make_rig

MAKES = ("furuta", "linear")


@cache
def command(make):
    return probe(make_rig(make), design_swing_up(make_rig(make)))


def checked(rig, make):
    return scales(make_rig(make), shown_by_encoders(rig, command(make)))


@pytest.mark.slow
@pytest.mark.parametrize("make", MAKES)
@pytest.mark.parametrize("shown", [(1.0, -1.0), (-1.0, 1.0), (1.0, 0.5), (4.0, 1.0), (1.1, 0.9)])
def test_what_an_encoder_shows_over_what_is_true_is_found_hanging(make, shown):
    rig = replace(make_rig(make, 7), scales=shown)  # another rig than the model
    found = checked(rig, make)
    assert np.abs(found.value / shown - 1).max() < 0.01
    names = [c.name for c in rig.plant.coordinates]
    assert found.wrong == tuple(n for n, s in zip(names, shown, strict=True) if s != 1.0)
    for name, s in zip(names, shown, strict=True):
        assert (f"encoder of {name}" in found.verdict) == (s != 1.0)
    assert ("the wrong way round" in found.verdict) == (min(shown) < 0)


ODD = {
    "offset of the command": lambda r: r.replace(offset=0.02),
    "a lazy amplifier": lambda r: r.replace(lag=0.01),
    "twice the dry friction": lambda r: r.changed(b_1c=2 * r.plant.b_1c),
    "a stronger drive": lambda r: replace(r, gain=1.06 * r.gain),
    "a longer rod": lambda r: r.changed(l_cg=1.05 * r.plant.l_cg),
}


@pytest.mark.parametrize("make", MAKES)
@pytest.mark.parametrize("odd", ODD)
def test_an_odd_rig_is_not_a_lying_encoder(make, odd):
    assert checked(ODD[odd](make_rig(make, 3)), make).sound


@pytest.mark.parametrize(("make", "travel"), [("linear", 0.1), pytest.param("furuta", 1.0, marks=pytest.mark.slow)])
def test_a_short_rail_is_kept_to_and_asked_all_the_same(make, travel):
    model, rig = make_rig(make), replace(make_rig(make, 1), scales=(1.1, 1.0))
    blind = probe(model, design_swing_up(model, travel=travel))
    log = shown_by_encoders(model, blind)
    assert np.abs(log[log.outputs[0]]).max() < travel
    assert scales(model, shown_by_encoders(rig, blind)).value == pytest.approx([1.1, 1.0], rel=0.01)


def test_a_drive_of_twice_the_strength_is_not_blamed_on_a_scale():
    found = checked(replace(make_rig("furuta"), gain=2 * make_rig("furuta").gain), "furuta")
    assert not found.sound
    assert "is not that of the model" in found.verdict


def test_half_a_turn_by_hand_tells_counts_per_turn():
    rig = make_rig("furuta")
    upright = [0.0, math.pi]
    assert lifted(rig, float(readings(rig, upright)[1])) == ""
    assert "90 degrees for half a turn, 0.5 times" in lifted(rig, readings(replace(rig, scales=(1, 0.5)), upright)[1])


def test_a_large_swing_is_slower_by_what_the_elliptic_integral_says():
    """What the module says of 90 and 10 degrees: T = 4 K(sin^2(A/2))/omega."""
    period = [ellipk(math.sin(a / 2) ** 2) for a in (math.radians(90), math.radians(10))]
    assert period[0] / period[1] - 1 == pytest.approx(0.18, abs=0.005)


@pytest.mark.slow
@pytest.mark.real_data
@pytest.mark.parametrize("volts", [2, 4])
def test_a_real_encoder_that_counts_the_other_way_is_found(volts):
    """A public direct-drive Furuta pendulum, hanging, shaken by a sine (examples/studies/furuta_sines.toml, whose fit
    gives these numbers): its two encoders count in opposite senses of fig. 3a."""
    plant = Furuta(
        m_p=9.801e-3, l_cg=96.608e-3, r=93.525e-3, J_d=1.35e-4, J_p=1.476e-5, b_1=1.37e-2, b_2=1.96e-5, b_1c=5.9e-3,
        tilt_x=0.051, tilt_y=0.022,
    )  # fmt: skip
    rig = Rig.known(plant, name="furuta_diy", gain=0.0526, lag=9e-3, limit=12.0, counts=4000 * math.tau, period=2e-3)
    folder = Path(os.environ["UPRIGHT_REAL_DATA"]) / "furuta_diy_odrive"
    log = read(folder / f"hardware_sin_response_{volts}V_1s.csv")
    t = np.arange(log.t[0], log.t[-1], log.period)
    held = np.searchsorted(log.t, t, side="right") - 1
    signals = {"u": np.nan_to_num(log["/effort_control/data.0"])[held]}
    for i, name in enumerate(("psi", "theta")):
        signals[name] = np.interp(t, log.t, log[f"/joint_states/joint{i}/position"])
    units = {"psi": "rad", "theta": "rad", "u": "V"}
    found = scales_of_log(
        rig, Record(t=t - t[0], signals=signals, units=units, inputs=("u",), outputs=("psi", "theta"))
    )
    assert found.wrong == ("theta",)
    assert "theta counts the wrong way round" in found.verdict
    assert np.all(np.abs(found.value - [1.0, -1.0]) < 3 * found.error)
    assert found.explained.min() > 0.99


def weighed(value, error, explained):
    return Scales(
        names=("psi", "theta"), value=np.array(value), error=np.array(error), explained=np.array(explained),
        t=np.zeros(1), shown=np.zeros((1, 2)), motion=np.zeros((1, 2)),
    )  # fmt: skip


@pytest.mark.parametrize(
    ("value", "error", "explained", "wrong"),
    [
        ((1.051, 1.0), (0.0125, 0.0), (1.0, 1.0), ("psi",)),  # beyond 5 % and beyond four standard errors
        ((1.049, 1.0), (0.001, 0.0), (1.0, 1.0), ()),  # so little is borne
        ((1.06, 1.0), (0.016, 0.0), (1.0, 1.0), ()),  # that is not sure
        ((0.9, 0.9), (0.01, 0.01), (1.0, 1.0), ("psi", "theta")),
        ((1.0, 1.0), (0.01, 0.01), (0.8, 0.79), ("theta",)),
    ],
)
def test_an_encoder_is_wrong_beyond_five_percent_if_that_is_sure_or_if_the_model_does_not_explain_it(
    value, error, explained, wrong
):
    found = weighed(value, error, explained)
    assert found.wrong == wrong
    assert found.sound == (not wrong)


def test_a_verdict_on_encoders_names_scale_error_and_remedy():
    good = weighed((1.00123, 0.99), (0.0004, 0.003), (1.0, 1.0)).verdict
    assert good == "The encoders show what is true (psi 1.0012 ± 0.0008, theta 0.9900 ± 0.006 of it, 95 %)."
    for value, words in (
        (2.0, "The encoder of theta shows 2 (± 0.02) times what is true: multiply its counts per unit by 2 before"),
        (-1.04, "The encoder of theta counts the wrong way round: swap its two channels before"),
        (-1.06, "theta counts the wrong way round, 1.06 (± 0.02) times what is true: multiply its counts per unit by "
                "-1.06 before"),
    ):  # fmt: skip
        verdict = weighed((1.0, value), (0.01, 0.01), (1.0, 1.0)).verdict
        assert words in verdict
        assert "psi" not in verdict
    bad = weighed((2.0, 2.0), (0.01, 0.01), (1.0, 0.654)).verdict
    assert "encoder of psi shows 2 " in bad
    assert "The motion of theta is not that of the model (65 % explained)" in bad


@pytest.mark.parametrize(("degrees", "fine"), [(189, True), (-171, True), (169, False), (191, False), (-190.5, False)])
def test_half_a_turn_by_hand_may_be_ten_degrees_off_either_way(degrees, fine):
    words = lifted(make_rig("furuta"), math.radians(degrees))
    assert (words == "") == fine
    if not fine:
        assert f"shows {degrees:.0f} degrees for half a turn, {abs(degrees) / 180:.3g} times" in words


def test_a_blind_command_is_logged_with_its_end_and_nothing_after_it():
    rig = make_rig("linear")
    log = shown_by_encoders(rig, np.array([1.0, -2.0, 0.5]))
    assert log["u"].tolist() == [1.0, -2.0, 0.5, 0.0]
    assert log.t == pytest.approx(np.arange(4) * rig.period)
    assert (log.t[0], log["theta"][0], log["x"][0]) == (0.0, 0.0, 0.0)


@pytest.mark.parametrize("make", MAKES)
def test_a_probe_swings_the_model_to_a_hundred_degrees_and_coasts_four_seconds(make):
    rig, blind = make_rig(make), command(make)
    coast = round(4.0 / rig.period)
    assert np.all(blind[-coast:] == 0.0)
    assert blind[-coast - 1] != 0.0
    assert blind.size - coast <= 2.5 / rig.period + 1
    log = shown_by_encoders(rig, blind)
    swing = np.degrees(np.abs(log["theta"]))
    assert 80 < swing.max() < 110  # the drive's lag and the friction of the last quarter swing
    assert np.abs(log[log.outputs[0]]).max() < 0.9 * design_swing_up(rig).travel


def test_scales_are_given_with_what_they_explain_and_the_residuals_of_that():
    """Of readings twice what is true: the motion returned is the model's times the scale, sample by sample."""
    rig = replace(make_rig("linear"), scales=(1.0, 2.0))
    log = shown_by_encoders(rig, command("linear"))
    found = scales(make_rig("linear"), log)
    every = round(7e-3 / rig.period)
    assert found.t == pytest.approx(log.t[::every])
    assert found.shown[:, 1] == pytest.approx(log["theta"][::every])
    assert found.names == ("x", "theta")
    lost = 1 - np.mean((found.shown - found.motion) ** 2, axis=0) / np.var(found.shown, axis=0)
    assert found.explained == pytest.approx(lost)
    assert found.explained.min() > 0.999
    assert found.value == pytest.approx([1.0, 2.0], rel=2e-3)
    # what is known better makes surer, if only a little where the readings themselves tell nearly all: every number of
    # the model to a tenth of the usual
    sure = dict.fromkeys((*rig.plant.names(), "gain"), 0.002)
    better = scales(make_rig("linear"), log, sure)
    assert np.all(better.error < found.error)
    assert np.all(better.error > 0)


def test_what_no_fit_says_is_known_as_well_as_the_help_of_scales_says():
    rig = replace(make_rig("furuta", 7), scales=(1.0, 1.1))
    log = shown_by_encoders(rig, command("furuta"))
    said = {"m": 0.02, "l": 0.02, "r": 0.02, "J": 0.03, "b": 0.2}
    known = {name: said[name[0]] for name in make_rig("furuta").plant.names() if name[0] in said} | {"gain": 0.03}
    words = "2 % of a mass or length, 3 % of an inertia, 20 % of friction, 3 % of the gain"
    assert words in " ".join(scales.__doc__.split())
    found, told = scales(make_rig("furuta"), log), scales(make_rig("furuta"), log, known)
    np.testing.assert_array_equal(found.value, told.value)
    np.testing.assert_array_equal(found.error, told.error)


@pytest.mark.parametrize("samples", [12, 13, 14])
def test_a_motion_seen_every_third_sample_has_a_row_for_the_last_that_is_begun(samples):
    """As many rows as every third reading of the log has, and the same motion as seen at each."""
    rig = make_rig("furuta")
    command = 0.3 * np.sin(np.arange(samples))
    logs = np.array([[0.0], [0.1], [-0.2]])
    fine, coarse = (_motion(rig, command, n, ("gain",), logs) for n in (1, 3))
    assert coarse.shape == (len(command[::3]), 2, 3)
    assert np.abs(np.diff(fine[-1])).min() > 0  # the gain moves it
    np.testing.assert_allclose(coarse, fine[::3], rtol=1e-12, atol=1e-15)
