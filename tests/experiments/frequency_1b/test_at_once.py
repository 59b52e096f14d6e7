"""All frequencies at once on a rig that is only guessed: what is asked stays within its travel, and finds the rig."""

from __future__ import annotations

import math
from itertools import pairwise

import numpy as np
import pytest
from scipy.signal import lsim

from tests.experiments.rigs import OWN, made
from upright.errors import BadInput, NotIdentifiable
from upright.experiments.frequency_1b import at_once
from upright.experiments.frequency_1b.at_once import _from_rest, _level, asking, run_at_once
from upright.experiments.stand.known import Known
from upright.experiments.stand.live import live_stand
from upright.experiments.stand.strength import SHARE, STILL
from upright.experiments.stand.twin import TwinStand
from upright.progress import silent
from upright.records import Provenance, Record
from upright.rig.makes import MAKES, make_rig

LOOSE = """
[rig]
plant = "rectilinear-1"
servo_period = "1 ms"
travel = "0.1 m"
[parameters]
m_1 = { guess = "1 kg", min = 0 }
k_1 = "0 N/m"
c_1 = { guess = "1 N s/m", min = 0 }
[actuator]
gain = { guess = "2 N/V", min = 0 }
limit = { value = "5 V", measured = true }
[sensors.x_1]
column = "x_1"
counts_per_m = { value = 20000, measured = true }
"""


@pytest.fixture
def own(tmp_path):
    """A twin of a rig that only its owner's study tells of."""
    (tmp_path / "study.toml").write_text(OWN, encoding="utf-8")
    (tmp_path / "RIG.toml").write_text('kind = "twin"\nstudy = "study.toml"\n', encoding="utf-8")
    return live_stand(tmp_path / "RIG.toml")


def test_the_band_holds_the_swing_of_a_rig_that_nobody_makes(own):
    asked = asking(own)
    p = own.rig.plant
    # arm free: the pendulum swings faster than on a fixed hinge, by the inertia that it takes along
    J, arm = p.J_p + p.m_p * p.l_cg**2, p.J_d + p.m_p * p.r**2
    swing = math.sqrt(p.m_p * p.g * p.l_cg / (J - (p.m_p * p.l_cg * p.r) ** 2 / arm))
    assert asked.band[0] < swing < asked.band[1]
    assert asked.band[0] == pytest.approx(0.4 * swing, rel=0.01)
    assert asked.reach[0] <= 0.25 * 2.0


def test_a_period_of_the_command_holds_four_of_its_slowest_frequency_and_hardly_more(own):
    """`RESOLVED`; the length is a multiple of 64 samples."""
    asked = asking(own)
    least = 4 * 2 * math.pi / asked.band[0] / own.rig.period
    assert least <= asked.wave.size < least + 64


def test_a_command_that_grows_begins_at_rest_and_never_exceeds_the_one_that_was_asked_for(own):
    wave = asking(own).wave
    samples = np.array(_from_rest(own, wave, 2))
    still = samples.size - 3 * wave.size
    growing = samples[still : still + wave.size]
    assert not samples[:still].any()
    assert still * own.rig.period == pytest.approx(STILL, abs=own.rig.period)
    assert (np.abs(growing) <= np.abs(wave) + 1e-15).all()
    assert np.sum(growing**2) == pytest.approx(np.sum(wave**2) * 3 / 8, rel=0.1)  # mean of ((1 - cos) / 2)^2
    np.testing.assert_array_equal(samples[still + wave.size :], np.tile(wave, 2))


def test_no_coordinate_is_to_go_further_than_asked(own):
    """By scipy's simulation of the model, after its transient."""
    asked = asking(own)
    level = _level(own, asked, SHARE * own.rig.limit)
    u = level * np.tile(asked.wave, 6)
    model = own.rig.linear("hanging")
    # the arm drifts freely, which is no answer to the wave: only what repeats is looked at
    t = np.arange(u.size) * own.rig.period
    _, y, _ = lsim((model.A, model.B, model.C, np.zeros((2, 1))), u, t)
    last = y[-asked.wave.size :]
    swings = np.ptp(last - np.linspace(last[0], last[-1], len(last)), axis=0) / 2
    assert np.max(swings / asked.reach) == pytest.approx(1.0, abs=0.05)


def test_a_limit_of_the_file_bounds_what_is_asked_and_the_rest_is_the_descriptions(tmp_path):
    assert asking(made(tmp_path)).reach[0] == MAKES["furuta"].reach[0]
    limited = 'kind = "twin"\nmake = "furuta"\n[limits]\ncommand = "4 V"\n'
    assert asking(made(tmp_path, limited)).reach[0] == MAKES["furuta"].reach[0]
    narrow = asking(made(tmp_path, limited + '[limits.psi]\ntravel = "1 rad"\n'))
    assert narrow.reach[0] == pytest.approx(0.25)


def test_what_does_not_swing_is_told_what_else_identifies_it(tmp_path):
    (tmp_path / "study.toml").write_text(LOOSE, encoding="utf-8")
    (tmp_path / "RIG.toml").write_text('kind = "twin"\nstudy = "study.toml"\n', encoding="utf-8")
    with pytest.raises(BadInput, match=r"does not swing.*upright identify"):
        asking(live_stand(tmp_path / "RIG.toml"))


@pytest.mark.slow
@pytest.mark.parametrize("live", [pytest.param(True, marks=pytest.mark.thorough), False])
def test_a_twin_with_dry_friction_is_identified_on_either_stand(live, tmp_path):
    truth = make_rig("rectilinear", 3)
    text = 'kind = "twin"\nmake = "rectilinear"\nseed = 3\n'
    stand = made(tmp_path, text) if live else TwinStand(rig=truth, make=MAKES["rectilinear"])
    fit = run_at_once(stand, tmp_path / "1b", silent).fit
    # not the lag, whose interval of 0.1 us is finer than that the twin steps twice a period and the fit once
    firm = {n: e for n, e in fit.estimates.items() if e.status == "well determined"}
    for name, true in {**truth.plant.parameters(), "actuator.gain": truth.gain}.items():
        if name in firm:
            assert firm[name].interval[0] <= true <= firm[name].interval[1], name
    assert firm
    assert fit.trusted


def asked_of(stand, monkeypatch, *, per, fails=False, weighed=()):
    """All that is asked of a rig whose first coordinate follows the command at once, by `per` rad for its unit."""
    runs, asked, studies, told = {}, [], {}, []

    def run(_stand, samples, _folder, stem):
        u = np.array(samples)
        t = 5.0 + np.arange(u.size) * stand.rig.period
        columns = {"u_applied": u, "psi": 3.0 + per * u, "theta": 0.0 * u}
        runs.setdefault(stem, []).append(u)
        return Record(t=t, signals=columns, provenance=Provenance(file=f"{stem}.mcap"))

    def study(_stand, path, title, runs, *, known):
        studies[path.parent.name] = (runs, known)
        return path

    def response(paths, request, folder, *, tell):
        tell("fitting", 0.5)
        if fails:
            raise NotIdentifiable("friction leaves too few frequencies.")
        return paths, request, folder

    monkeypatch.setattr(type(stand), "run", run)
    monkeypatch.setattr(type(stand), "ask", lambda _stand, sentence: asked.append(sentence))
    monkeypatch.setattr(at_once, "write_study", study)
    monkeypatch.setattr(at_once, "response_of_logs", response)
    monkeypatch.setattr(at_once, "fit_study", lambda path, tell: (tell("fitting", 1.0), "fit"))
    done = run_at_once(stand, stand.file.path.parent / "1b", lambda step, share: told.append(share), weighed)
    assert told == sorted(told)
    assert 0.0 <= told[0] <= told[-1] <= 1.0
    return done, runs, asked, studies


def test_a_rig_of_any_strength_moves_as_far_as_is_wanted_in_the_end(own, monkeypatch):
    """Probes of 0.15, 0.4 and 0.8 of what is right show it; each of two periods, the run of eight."""
    wanted, wave = asking(own).reach[0], asking(own).wave
    guess = wanted / _level(own, asking(own), SHARE * own.rig.limit)
    for per in (0.9 * guess, 1.4 * guess):
        done, runs, asked, _ = asked_of(own, monkeypatch, per=per)
        (whole,), probes = runs["multisine"], runs["probe"]
        assert per * np.ptp(whole) / 2 == pytest.approx(wanted)
        assert [per * np.ptp(u) / 2 / wanted for u in probes] == pytest.approx([0.15 * per / guess, 0.4, 0.8], rel=1e-6)
        still = math.ceil(STILL / own.rig.period)
        assert [u.size for u in (*probes, whole)] == [still + 3 * wave.size] * 3 + [still + 9 * wave.size]
        assert len(asked) == 4
        assert not any("added masses" in sentence for sentence in asked)
        assert "probe 3 of 3 follows" in asked[2]
        assert f"at once follow for {8 * wave.size * own.rig.period:.0f} s" in asked[3]
        assert done.fit == "fit"


def test_no_command_is_more_than_its_share_of_the_limit_nor_three_times_the_one_before(own, monkeypatch):
    most = SHARE * own.rig.limit
    _, runs, _, _ = asked_of(own, monkeypatch, per=1e-9)
    sizes = [np.abs(u).max() for u in (*runs["probe"], *runs["multisine"])]
    assert max(sizes) <= most * (1 + 1e-12)
    assert all(b <= 3.0 * a * (1 + 1e-12) for a, b in pairwise(sizes))
    assert sizes[1] == pytest.approx(min(3.0 * sizes[0], most))


def test_what_was_whole_is_fitted_and_the_last_probe_foreseen_while_the_response_is_of_the_run_alone(own, monkeypatch):
    weighed = (Known(name="J_d", value=0.01, stderr=1e-4),)
    done, runs, asked, studies = asked_of(own, monkeypatch, per=1.0, weighed=weighed)
    assert asked[0].startswith("Take the added masses off. Let theta hang at rest, with psi in the middle")
    size, period = asking(own).wave.size, own.rig.period
    (fitted, foreseen), known = studies["1b"]
    assert known == weighed
    for run, n, log in ((fitted, 8, runs["multisine"][0]), (foreseen, 2, runs["probe"][-1])):
        last = 5.0 + (log.size - 1) * period
        assert run["window"] == pytest.approx([last - (n * size - 1) * period, last])
    assert (fitted["file"], foreseen["file"], foreseen["role"]) == ("multisine.mcap", "probe.mcap", "predict")
    assert "role" not in fitted
    ((alone,), known) = studies["response"]
    assert (alone["file"], alone["window"], known) == ("../multisine.mcap", fitted["window"], weighed)
    ((path,), request, folder) = done.response
    assert (path.parent, path.name) == (folder, "study.toml")
    assert (request.kind, request.hold, request.band) == ("multisine", period, asking(own).band)
    assert asked_of(own, monkeypatch, per=1.0, fails=True)[0].response is None
