"""A drive that a positive command turns backwards: the law is for commands as the log has them."""

from __future__ import annotations

import json

import numpy as np
import pytest

import upright as up
from tests.study.test_stored_fit import FIT
from upright.simulation import simulate
from upright.study.stored_rig import read_stored_rig

RIG = up.CartPendulum(m_c=0.5, m_p=0.1, l_cg=0.25, J_p=1e-3, b_1=2.0, b_2=1e-3)
POLES = [-6.0, -7.0, -8.0, -9.0]


def stored(folder, sign, **entries):
    """A fit.json whose drive has a sign, and an offset of 0.2 V."""
    described = {"offset": {"value": 0.2, "unit": "V", "source": "measured"}}
    described |= {} if sign > 0 else {"drive_sign": {"value": -1.0, "unit": "1", "source": "known"}}
    bands = {**FIT["bands"], "names": ["actuator.gain", "J_p"], "covariance": [[0.04, 1e-6], [1e-6, 1e-9]]}
    parameters = FIT["parameters"] | {"actuator.offset": {"value": 0.2, "unit": "V", "stderr": 0.0}}
    content = {**FIT, "parameters": parameters, "bands": bands, "rig": {"name": "", "vendor": "", "entries": described}}
    path = folder / f"fit_{sign}.json"
    path.write_text(json.dumps(content), encoding="utf-8")
    return read_stored_rig(path, draws=50)


def test_a_rig_with_a_reversed_drive_is_its_mirror_image(tmp_path):
    """The force is gain (sign u + offset), whatever the numbers."""
    plain, turned = stored(tmp_path, 1), stored(tmp_path, -1)
    for u in (-2.0, 0.0, 3.0):
        assert turned.gain * (u + turned.offset) == pytest.approx(plain.gain * (-u + plain.offset))
    assert [gain for _, gain in turned.draws] == [-gain for _, gain in plain.draws]
    assert [plant for plant, _ in turned.draws] == [plant for plant, _ in plain.draws]
    assert len({gain for _, gain in turned.draws}) == len(turned.draws) == 50


def log(gain):
    """Steps of up to 0.3 V on a hanging cart-pendulum, logged at 200 Hz."""
    dt, n = 5e-3, 1600
    u = np.zeros((n, 1))
    g = np.random.default_rng(3)
    for k in range(100, 1300, 60):
        u[k : k + 60] = g.uniform(-0.3, 0.3)
    x = simulate(RIG, {"actuator.gain": gain}, RIG.state("hanging"), u, dt, samples=n)[:, :, 0]
    x += 1e-5 * g.normal(size=x.shape)
    signals = {"x": x[:, 0], "theta": x[:, 2], "u": u[:, 0]}
    return up.Record(t=dt * np.arange(n), signals=signals, units={"x": "m", "theta": "rad", "u": "V"}, inputs=("u",))


@pytest.mark.parametrize("gain", [6.0, -6.0])
def test_the_law_from_a_hanging_log_holds_the_rig_that_wrote_it(gain):
    """Poles of the true rig, its true drive and the gains designed for the fit."""
    fit = up.identify(log(gain), up.CartPendulum, known={"m_c": 0.5, "m_p": 0.1, "J_p": 1e-3})
    low, high = fit["actuator.gain"].interval
    assert low <= abs(gain) <= high
    rig = fit.rig.replace(period="5 ms", limit="10 V", counts=8192, travel=1.0)
    assert np.sign(rig.gain) == np.sign(gain)
    model = RIG.linear("inverted")
    K = np.reshape(up.design(rig, poles=POLES).K, (1, -1))
    assert np.linalg.eigvals(model.A - gain * model.B @ K).real.max() < -4


def test_a_study_says_it_by_a_negative_scale_too(tmp_path):
    """-0.5 V per count is a sign as well."""
    path = tmp_path / "study.toml"
    text = """[rig]
plant = "cart-pendulum"
[parameters]
m_c = "0.5 kg"
m_p = "0.1 kg"
l_cg = "0.25 m"
J_p = "1e-3 kg m^2"
[actuator]
gain = "6 N/V"
[drive]
column = "u"
unit = "V"
"""
    gains = {}
    for said in ("", "sign = -1\n", "scale = -0.5\n", "sign = -1\nscale = -0.5\n"):
        path.write_text(text + said, encoding="utf-8")
        gains[said] = read_stored_rig(path).gain
    assert list(gains.values()) == [6.0, -6.0, -6.0, 6.0]
