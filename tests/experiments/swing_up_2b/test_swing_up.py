"""Does the experiment check, swing, tell, and refuse to close a loop on a lying encoder?"""

from __future__ import annotations

import json
import math
from dataclasses import replace

import numpy as np
import pytest

from upright.errors import BadInput, NotIdentifiable
from upright.experiments.stand.twin import TwinStand
from upright.experiments.swing_up_2b.chapter import chapter, check_chapter
from upright.experiments.swing_up_2b.run import FAULTS, known_of, run_swing_up, scales_of_log
from upright.files import plain_values
from upright.physics import Furuta
from upright.records import Record
from upright.report.html import write_html
from upright.rig import Rig
from upright.rig.makes import make_rig


@pytest.fixture(scope="module")
def done(tmp_path_factory):
    return run_swing_up(make_rig("furuta"), TwinStand(rig=make_rig("furuta", 3)), tmp_path_factory.mktemp("up"))


@pytest.mark.slow
def test_it_stands_and_says_so(done, tmp_path):
    assert done.caught
    told = chapter(done)
    # the law is that of the make's data sheet: caught, on numbers that nobody identified
    assert (told.sound, told.numbers["basis"]["level"]) == (False, "with reservations")
    assert f"{done.ascent.up:.2f} s" in told.verdict
    page = write_html(tmp_path / "page.html", told).read_text(encoding="utf-8")
    assert page.count("<svg") == 4  # the rig stands first
    assert "http://" not in page.replace("http://www.w3.org", "")
    json.dumps(plain_values(told.numbers), allow_nan=False)


@pytest.mark.slow
def test_the_logs_are_those_of_a_program_at_the_rig(done):
    log = Record.from_csv(done.folder / "swing_up.csv")
    assert np.allclose(
        log["theta"], np.round(log["theta"] / done.truth.resolution[1]) * done.truth.resolution[1], atol=1e-9
    )
    assert np.abs(log["u"]).max() == pytest.approx(done.ascent.peak)
    assert abs(log["theta"][0]) < 1e-9
    assert math.cos(log["theta"][-1]) < -0.99


@pytest.mark.slow
def test_every_lie_is_told_before_a_loop_is_closed_or_falls(done):
    assert len(done.faulty) == len(FAULTS)
    for lie in done.faulty:
        assert lie.refused
        assert lie.estimate == pytest.approx(lie.factor, rel=0.02)
        if math.isfinite(lie.fell):
            assert lie.spoke < lie.fell
    assert any(math.isfinite(lie.fell) for lie in done.faulty)


def test_no_loop_is_closed_on_a_lying_encoder(tmp_path):
    liar = replace(make_rig("furuta", 3), scales=(1.0, 2.0))
    done = run_swing_up(make_rig("furuta"), TwinStand(rig=liar), tmp_path)
    assert done.ascent is None
    assert not done.caught
    told = chapter(done)
    assert not told.sound
    assert "No loop was closed. The encoder of theta shows 2" in told.verdict
    assert not (tmp_path / "swing_up.csv").exists()


@pytest.mark.slow
def test_a_log_of_one_s_own_is_checked_in_any_unit(done):
    model, log = done.model, Record.from_csv(done.folder / "sensors.csv")
    counts = {"psi": np.round(log["psi"] / model.resolution[0]), "theta": np.degrees(log["theta"]) * 2, "u": log["u"]}
    found = scales_of_log(model, log.replace(signals=counts, units={"psi": "counts", "theta": "deg", "u": "V"}))
    assert found.value == pytest.approx([1.0, 2.0], rel=0.01)
    assert found.wrong == ("theta",)
    told = check_chapter(model, found, "own.csv")
    assert not told.sound
    assert "encoder of theta shows 2" in told.verdict
    with pytest.raises(BadInput, match="needs a column 'psi'"):
        scales_of_log(
            make_rig("furuta"), log.replace(signals={n: log[n] for n in ("theta", "u")}, outputs=("theta",), units={})
        )
    with pytest.raises(BadInput, match="'psi' is in m"):
        scales_of_log(model, log.replace(units={"psi": "m", "theta": "rad", "u": "V"}))
    small = {"psi": log["psi"], "theta": log["theta"], "u": 0.1 * log["u"]}
    with pytest.raises(NotIdentifiable, match="drive it to 40 or more"):
        scales_of_log(model, log.replace(signals=small))


def test_what_a_fit_knows_is_the_spread_of_the_rigs_that_it_allows():
    nominal = make_rig("furuta")
    plant = nominal.plant
    assert isinstance(plant, Furuta)
    others = tuple((plant.replace(m_p=plant.m_p * f, b_1=plant.b_1 * f), nominal.gain * f) for f in (0.98, 1.0, 1.02))
    file = Rig(plant=plant, name="furuta", gain=nominal.gain, unit="V", draws=others)
    known = known_of(file)
    spread = 0.02 * math.sqrt(2 / 3)
    assert known["m_p"] == pytest.approx(spread)
    assert known["gain"] == pytest.approx(spread)
    assert known["b_1"] == 0.2  # friction differs from day to day, however well one day knows it
    assert "l_cg" not in known


def test_a_friction_that_the_fit_puts_at_its_bound_still_lets_the_encoders_be_scales_of_log():
    plant = make_rig("furuta").plant
    some = np.random.default_rng(5)
    others = tuple((plant.replace(b_2=abs(some.normal(0, 1.5e-5))), 0.65) for _ in range(50))
    file = Rig(plant=plant.replace(b_2=1e-21), name="furuta", gain=0.65, unit="V", draws=others)
    # factors of the model's numbers are exp(z size): a size of 1e16 is no number any more
    assert max(known_of(file).values()) < 5
