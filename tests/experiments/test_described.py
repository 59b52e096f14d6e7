"""Do the verbs of a loop run the rig that its owner described, and ask for what nobody said?"""

from __future__ import annotations

import json
import math
from pathlib import Path

import numpy as np
import pytest

from upright.control import trial
from upright.errors import BadInput
from upright.laws import state_feedback
from upright.physics import CartPendulum, Furuta
from upright.rig import Rig
from upright.rig.drive import full_command
from upright.rig.makes import CONVERTER, MAKES, PER_METRE, SERVO, VENDORS, hardware_of_make, make_rig, sheet
from upright.simulation import simulate
from upright.study.stored_rig import read_stored_rig
from upright.verbs.control.design import design
from upright.verbs.control.regulate import regulate
from upright.verbs.control.swing_up import swing_up

POLES = "-4+-2j, -16, -3"
RIG = """
[rig]
plant = "cart-pendulum"
name = "bench 3"
servo_period = "2 ms"
travel = { value = "30 cm", assumed = true }
[parameters]
m_c = "0.9 kg"
m_p = "0.12 kg"
l_cg = "0.2 m"
J_p = "1.5e-3 kg m^2"
b_1 = "0.8 N s/m"
b_2 = "1e-4 N m s/rad"
[actuator]
gain = "1.5 N/V"
limit = { value = "10 V", measured = true }
lag = "4 ms"
[drive]
column = "u"
unit = "V"
[sensors.x]
counts_per_m = 20000
[sensors.theta]
counts_per_rev = { value = 4096, measured = true }
"""


@pytest.fixture
def study(tmp_path: Path):
    def write(*changes: tuple[str, str]) -> Path:
        text = RIG
        for old, new in changes:
            assert old in text
            text = text.replace(old, new)
        (tmp_path / "rig.toml").write_text(text, encoding="utf-8")
        return tmp_path / "rig.toml"

    return write


def run(source, tmp_path, **options):
    return regulate(source, poles=POLES, seconds=1.0, draws=4, out=tmp_path / "out", **options)


@pytest.mark.slow
def test_the_loop_that_is_told_is_that_of_the_study_s_rig(study, tmp_path):
    """The run told beforehand against one put together by hand of the study's numbers: the command meets 10 V."""
    told = run(study(), tmp_path, start="19 deg").value
    own = Rig.known(
        CartPendulum(m_c=0.9, m_p=0.12, l_cg=0.2, J_p=1.5e-3, b_1=0.8, b_2=1e-4), gain=1.5, limit=10.0,
        counts=(20_000, 4096), period=2e-3, delay=2e-3, lag=4e-3, travel=0.3,
    )  # fmt: skip
    attempt = told.attempts[0]
    direct = trial(own, attempt.law, at="inverted", start=told.task.start, seconds=1.0)
    assert np.abs(direct.u).max() == 10.0
    np.testing.assert_array_equal(attempt.before.run.u, direct.u)
    np.testing.assert_array_equal(attempt.before.run.x, direct.x)


@pytest.mark.slow
@pytest.mark.parametrize("limit", [1.0, 10.0])
def test_the_limit_of_the_study_decides_what_holds(study, tmp_path, limit):
    """To turn back from a tilt at rest the cart needs g tan(tilt): 1.76 N at 10 degrees, where 1 V gives 1.5 N."""
    source = study(('limit = { value = "10 V", measured = true }', f'limit = "{limit} V"'))
    told = run(source, tmp_path, start="10 deg").value.attempts[0]
    assert told.before.chance == (1.0 if limit == 10 else 0.0)
    assert np.abs(told.before.run.u).max() <= limit


def test_options_come_before_the_study(study, tmp_path):
    done = run(study(), tmp_path, limit=6.0, period="1 ms", counts={"theta": 2000}, travel=0.1)
    rig = done.value.rig
    assert (rig.limit, rig.period, rig.travel) == (6.0, 1e-3, 0.1)
    np.testing.assert_allclose(rig.per_unit, (20_000, 2000 / math.tau))
    told = {row[0]: row[1:] for row in next(p for p in done.chapter.parts if p.title == "The rig").content[0].rows}
    assert told["command limit"] == ("6 V", "--limit")
    assert told["encoder counts of x"] == ("20000 1/m", "known")
    assert told["first-order lag"] == ("0.004 s", "known")
    assert any("Assumed, not measured: dead time" in w for w in done.chapter.warnings)
    steps = " ".join(step.command for step in done.chapter.steps)
    assert 'rig.toml --limit 6 --period "1 ms" --counts "theta=2000" --travel 0.1 ' in steps


def without(*lines: str) -> str:
    return "".join(line for line in RIG.splitlines(keepends=True) if not line.startswith(lines))


@pytest.mark.parametrize(
    ("lines", "words"),
    [
        (("limit",), r"command limit \(--limit 10 or \[actuator\] limit"),
        (("servo_period",), r'servo period \(--period "2 ms" or \[rig\] servo_period = "2 ms"\)'),
        (("counts_per_rev",), r"encoder counts of theta \(--counts .* or \[sensors.theta\] counts_per_rev"),
        (("limit", "counts_per_m"), r"command limit .*; encoder counts of x"),
    ],
)
def test_what_nobody_said_is_asked_for_by_option_and_key(tmp_path, lines, words):
    (tmp_path / "rig.toml").write_text(without(*lines), encoding="utf-8")
    with pytest.raises(BadInput, match=words):
        run(tmp_path / "rig.toml", tmp_path)


def test_a_design_is_that_of_the_study_s_rig(study):
    done = design(study(), poles=POLES, start={"theta": "5 deg"})
    said = done.numbers
    assert (said["period"], said["limit"], said["lag"]) == (2e-3, 10.0, 4e-3)
    # a plain difference of rounded readings: q/(T sqrt 6)
    noise = done.value.ways[0].speed_noise
    np.testing.assert_allclose(noise, np.array([1 / 20_000, math.tau / 4096]) / (2e-3 * math.sqrt(6)), rtol=1e-6)
    assert f"{100 * said['peak_command_sampled'] / 10:.0f} % of the drive's limit" in said["verdict"]
    assert design(study(), poles=POLES, limit=4.0, period="1 ms").numbers["limit"] == 4.0


def test_a_design_without_a_limit_says_that_none_is_known(tmp_path):
    (tmp_path / "rig.toml").write_text(without("limit"), encoding="utf-8")
    done = design(tmp_path / "rig.toml", poles=POLES)
    assert done.numbers["limit"] is None
    assert any("--limit 10" in w for w in done.chapter.warnings)
    with pytest.raises(BadInput, match="how hard the rig is pushed"):
        design(tmp_path / "rig.toml", poles=POLES, speed="kalman")


@pytest.mark.slow
def test_a_force_limit_is_in_the_loop_that_is_simulated(study, tmp_path):
    """1.5 N/V and 6 N: beyond 4 V the drive gives no more, and the motion is that under a command of at most 4 V."""
    source = study(('lag = "4 ms"', 'force_limit = "6 N"'))
    assert design(source, poles=POLES).numbers["limit"] == pytest.approx(4.0)
    capped = run(source, tmp_path, start="9 deg").value
    other = study(('limit = { value = "10 V", measured = true }', 'limit = "4 V"'), ('lag = "4 ms"', 'lag = "0 s"'))
    bare = run(other, tmp_path, start="9 deg").value
    first, second = (r.attempts[0].before for r in (capped, bare))
    assert np.abs(first.run.u).max() > 4.0
    np.testing.assert_allclose(first.run.x, second.run.x, atol=1e-9)
    assert first.score.at_limit > 0


def test_a_drooping_drive_meets_its_force_where_the_equation_says():
    """g u/(1 + d u) = F at u = F/(g - F d)."""
    drive = {"actuator.gain": 2.0, "actuator.droop": 0.1, "actuator.force_limit": 5.0}
    u = full_command(drive)
    assert 2.0 * u / (1 + 0.1 * u) == pytest.approx(5.0)
    assert full_command(drive | {"actuator.force_limit": 20.0}) == math.inf  # it never gives as much


def test_back_emf_is_in_the_linear_model(study):
    """A small motion under a small command, simulated with the drive's slope, moves as the linear model says."""
    known = read_stored_rig(study(('lag = "4 ms"', 'slope = "3 N s/m"')))
    model, plant = known.linear("hanging"), known.plant
    u, dt, n = 1e-3, 1e-3, 1000
    drive = {"actuator.gain": known.gain, **known.more}
    x = simulate(plant, drive, plant.state("hanging"), np.full((n, 1), u), dt, samples=n)[-1, :, 0]
    from scipy.linalg import expm

    whole = np.zeros((5, 5))
    whole[:4, :4], whole[:4, 4:] = model.A, model.B
    expected = expm(whole * dt * (n - 1))[:4, 4] * u
    np.testing.assert_allclose(x - plant.state("hanging"), expected, rtol=1e-4, atol=1e-9)


@pytest.mark.slow
def test_a_data_sheet_is_taken_by_name_and_told(tmp_path):
    (tmp_path / "rig.toml").write_text(without("limit", "servo_period", "travel"), encoding="utf-8")
    done = run(tmp_path / "rig.toml", tmp_path, vendor="ECP 210")
    rig = done.value.rig
    assert (rig.limit, rig.period, rig.travel) == (5.0, SERVO, 0.2)
    np.testing.assert_allclose(rig.per_unit, (20_000, 4096 / math.tau))  # which the study says
    told = " ".join(done.chapter.warnings)
    assert "data sheet of the ECP 210" in told
    assert "command limit" in told
    with pytest.raises(BadInput, match="there is no data sheet of 'ECP 21O'"):
        run(tmp_path / "rig.toml", tmp_path, vendor="ECP 21O")


def test_a_data_sheet_says_what_the_make_s_own_rig_is():
    for make in MAKES.values():
        assert make.vendor in VENDORS
        rig, said = make_rig(make.key), sheet(make.vendor, make.rig.plant)
        assert (said["limit"].value, said["servo_period"].value) == (rig.limit, rig.period)
        assert (said["delay"].value, said["lag"].value, said["converter"].value) == (rig.delay, rig.lag, CONVERTER)
    assert "counts.x" not in sheet("ECP 205", MAKES["linear"].rig.plant)  # it has no cart
    assert "limit" not in sheet("ECP 210", MAKES["linear"].rig.plant, unit="N")  # its limit is in V
    assert sheet("ECP 210", MAKES["linear"].rig.plant)["counts.x"].value == PER_METRE


def fit_of(seed: int, folder: Path) -> Path:
    """What a fit of one twin of the cart could hold, its gain known to one percent."""
    rig = make_rig("linear", seed)
    entries = {n: {"value": v, "stderr": 0.0, "unit": "", "status": "known"} for n, v in rig.plant.parameters().items()}
    entries["actuator.gain"] = {
        "value": rig.gain,
        "stderr": 0.01 * rig.gain,
        "unit": "N/V",
        "status": "well determined",
    }
    content = {
        "format": 1, "plant": "cart-pendulum", "verdict": "", "trusted": True, "parameters": entries,
        "estimated": ["actuator.gain"], "correlation": [[1.0]], "rig": hardware_of_make(rig).plain(),
    }  # fmt: skip
    (folder / "fit.json").write_text(json.dumps(content), encoding="utf-8")
    return folder / "fit.json"


@pytest.mark.slow
@pytest.mark.parametrize(("ran", "another"), [(3, False), (4, True)])
def test_a_fit_that_meets_another_seed_says_so(tmp_path, ran, another):
    done = run(fit_of(3, tmp_path), tmp_path, seed=ran)
    assert any("another rig" in w and "seed 3" in w and "seed 4" in w for w in done.chapter.warnings) == another


@pytest.mark.slow
def test_a_rig_of_one_s_own_runs_on_one_that_its_fit_allows(tmp_path):
    path = fit_of(0, tmp_path)
    content = json.loads(path.read_text(encoding="utf-8"))
    content["rig"] = {"name": "bench 3"}
    path.write_text(json.dumps(content), encoding="utf-8")
    given = {"limit": 10.0, "period": "1 ms", "counts": "x=20000, theta=4096"}
    truth = run(path, tmp_path, seed=3, **given).value.truth
    nominal = make_rig("linear").gain
    assert truth.gain != nominal
    assert truth.gain == pytest.approx(nominal, rel=0.05)  # drawn with one percent
    assert (truth.limit, truth.period) == (10.0, 1e-3)
    assert "seed 3" not in " ".join(run(path, tmp_path, **given).chapter.warnings)


def test_without_a_covariance_nothing_can_be_drawn(study, tmp_path):
    with pytest.raises(BadInput, match="this fit has none; give no seed"):
        run(study(), tmp_path, seed=1)


def test_a_prediction_with_the_fit_of_another_rig_says_so(study, tmp_path):
    from upright import predict

    t = np.arange(400) * 0.01
    plant = read_stored_rig(study()).plant
    x = simulate(plant, {}, plant.state("hanging", theta=0.3), None, 0.01, samples=400)[:, ::2, 0]
    np.savetxt(tmp_path / "log.csv", np.column_stack([t, x]), "%.9f", ",", header="t,x,theta", comments="")
    runs = '[[runs]]\nfile = "log.csv"\ndrive = 0\n'
    units = RIG.replace("[sensors.x]", '[sensors.x]\nunit = "m"').replace(
        "[sensors.theta]", '[sensors.theta]\nunit = "rad"'
    )
    source = tmp_path / "runs.toml"
    fit = fit_of(0, tmp_path)
    content = json.loads(fit.read_text(encoding="utf-8"))
    told = []
    for name in ("bench 3", "bench 4"):
        source.write_text(units.replace('"bench 3"', f'"{name}"') + runs, encoding="utf-8")
        counts = {"value": 1000, "unit": "1/rev", "source": "known"}
        content["rig"] = {"name": "bench 3", "entries": {"counts.theta": counts} if name == "bench 4" else {}}
        fit.write_text(json.dumps(content), encoding="utf-8")
        told.append(predict(fit, source).chapter.warnings)
    assert not any("rig" in w for w in told[0])
    said = " ".join(told[1])
    assert "of another rig (bench 3) than the study (bench 4)" in said
    assert "encoder counts of theta: 1000 1/rev in the fit, 4096 1/rev in the study" in said


def test_a_swing_up_asks_for_the_travel(tmp_path):
    (tmp_path / "rig.toml").write_text(without("travel"), encoding="utf-8")
    with pytest.raises(BadInput, match=r"how far the driven body may go either way \(--travel 0.2"):
        swing_up(tmp_path / "rig.toml", out=tmp_path / "out")


def test_a_drive_that_trips_at_a_speed_ends_the_run():
    """An arm of 0.01 kg m^2 pushed by 0.01 N m from rest turns by 1 rad/s faster every second."""
    rig = make_rig("furuta").replace(speed_limit=0.5, counts=(1e9, 1e9), converter=0.0)
    bare = Furuta(m_p=1e-6, l_cg=0.1, r=0.1, J_d=0.01, J_p=1e-9)
    rig = rig.replace(plant=bare, gain=0.01, limit=1.0, lag=0.0, delay=0.0)
    law = state_feedback(np.array([[0.0, 0.0, 1e6, 0.0]]), rig.period, target=np.zeros(2), limit=1.0)
    went = trial(rig, law, at="inverted", start=[0.0, 0.0, -1e-2, 0.0], seconds=1.0)
    from upright.control import score

    assert score(went).ran_out == pytest.approx(0.5, abs=2 * rig.period)  # 1 rad/s^2 up to 0.5 rad/s
