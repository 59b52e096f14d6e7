"""Is what a RIG.toml describes held where it says, within the leans and by the rig that it says?"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

import upright as up
from tests.gains.furuta import STUDY
from upright.basis import SIMULATED
from upright.laws import Law
from upright.rig.makes import make_rig
from upright.rigs.rigfile import read_rig_file
from upright.running.rig import model_and_truth, stage_of, usual_limits
from upright.running.run import _references

LIMIT = "\n[actuator]\nlimit = 0.6\n"


def rig_file(tmp_path, text):
    path = tmp_path / "RIG.toml"
    path.write_text(f'kind = "twin"\n{text}', encoding="utf-8")
    return path


@pytest.mark.parametrize(
    ("limits", "lean", "near"),
    [("", 30, 10), ('[limits]\nlean = "20 deg"\n', 20, 10), ('[limits]\nlean = "6 deg"\n', 6, 6)],
)
def test_a_pendulum_that_is_held_may_lean_as_the_file_says_or_by_thirty_degrees(tmp_path, limits, lean, near):
    """And begins within ten, or within its lean where that is less."""
    path = rig_file(tmp_path, 'make = "furuta"\n' + limits)
    duty = stage_of(path).supervisor.duty
    assert (duty.at, duty.zero, duty.watch) == ("inverted", "hanging", True)
    assert (math.degrees(duty.lean), math.degrees(duty.near)) == pytest.approx((lean, near))
    for how in ({"balance": False}, {"from_rest": True}):  # nothing is held that could fall, or not yet
        free = stage_of(path, **how).supervisor.duty
        assert (free.lean, free.near) == (math.inf, math.inf)
    assert stage_of(path, balance=False).supervisor.duty.at == "hanging"
    swung = stage_of(path, from_rest=True).supervisor.duty
    assert (swung.at, swung.watch) == ("inverted", False)


def test_carts_have_nothing_that_leans(tmp_path):
    duty = stage_of(rig_file(tmp_path, 'make = "rectilinear"\n')).supervisor.duty
    assert (duty.at, duty.zero, duty.lean, duty.near) == ("rest", "rest", math.inf, math.inf)


def test_a_twin_s_limits_are_those_of_the_driven_body_and_its_drive():
    rig = make_rig("linear")
    limits = usual_limits(rig)
    assert limits.travel == limits.start == (0.20, math.inf)
    assert limits.speed == (rig.speed_limit, math.inf)
    assert limits.command == rig.limit
    assert limits.watchdog == 0.02
    assert usual_limits(rig.replace(period="5 ms")).watchdog == pytest.approx(0.05)


@pytest.mark.parametrize("seed", [0, 3])
def test_a_described_rig_has_a_twin_of_its_own_numbers_or_of_others_by_a_seed(tmp_path, seed):
    (tmp_path / "rig.toml").write_text(STUDY + LIMIT, encoding="utf-8")
    file = read_rig_file(rig_file(tmp_path, f'study = "rig.toml"\nvendor = "ECP 205"\nseed = {seed}\n'))
    assert file.performed == SIMULATED
    model, truth = model_and_truth(file)
    assert (truth == model) == (seed == 0)
    if seed:  # of the vendor's make, as many of which can be drawn as one likes
        assert truth == make_rig("furuta", seed)
    real, same = model_and_truth(replace(file, performed=""))  # a rig itself is not drawn
    assert same == real
    named, _ = model_and_truth(replace(file, name="bench 3"))
    assert named.name == "bench 3"


def test_references_without_names_are_numbered_in_the_log_and_carry_the_driven_unit():
    rig = make_rig("linear")
    signals = np.zeros((5, 2))
    law = Law(np.zeros((0, 0)), np.zeros((0, 4)), np.zeros((1, 0)), np.zeros((1, 4)), references=signals, period=1e-3)
    assert _references(law, rig) == (("reference_1", "m"), ("reference_2", "m"))
    assert _references(replace(law, reference_names=("x", "wish")), rig) == (("x_reference", "m"), ("wish", "m"))
    assert _references(replace(law, references=None), rig) == ()


def test_a_small_pulse_is_given_unless_it_is_declined(tmp_path):
    path = rig_file(tmp_path, 'make = "furuta"\n')
    given, declined = (
        {f.what: f.good for f in up.rig_doctor(path, **how).value.findings} for how in ({}, {"pulse": False})
    )
    assert given["a small pulse"] is True
    assert "a small pulse" not in declined
    assert declined["the drive"] is None  # not tried


def test_what_the_file_states_stands_where_a_description_is_silent(tmp_path):
    """The largest command that it allows is the largest there can be, and counts are counts."""
    (tmp_path / "study.toml").write_text(STUDY.replace("counts_per_rev", "# counts_per_rev"), encoding="utf-8")
    path = tmp_path / "RIG.toml"
    path.write_text(
        'kind = "serial"\nport = "COM1"\nstudy = "study.toml"\n[limits]\ncommand = 0.4\n'
        "[counts]\npsi = -2400\ntheta = 4096\n",
        encoding="utf-8",
    )
    model, _ = model_and_truth(read_rig_file(path))
    assert model.limit == 0.4
    assert model.counts == (2400, 4096)
    assert model.hardware.entries["limit"].source == "stated in RIG.toml"
