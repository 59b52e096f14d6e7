"""Is what a study says already taken into account, and is a motion in counts told in counts?"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from benchmarks.doctored import batch
from upright.diagnosis import examine, read_known
from upright.physics import find
from upright.records import Provenance, Record
from upright.simulation import simulate
from upright.study.sensors import Wiring


def stated(wiring: Wiring, who: str, **convention: float) -> Wiring:
    """The wiring as a study would state it that has these keys for a coordinate, or for the effort."""
    if who == "effort":
        assert wiring.drive is not None
        return replace(wiring, drive=replace(wiring.drive, **convention))
    return replace(wiring, sensors={**wiring.sensors, who: replace(wiring.sensors[who], **convention)})


@pytest.mark.parametrize("who", ["x_1", "x_2", "effort"])
def test_a_sign_that_a_study_gives_wrongly_is_taken_out(who: str) -> None:
    sound = next(d for d in batch("rectilinear-2", "", 3, seed=5) if d.how != "free")
    (finding,) = examine(sound.record, sound.rig, stated(sound.wiring, who, sign=-1.0)).wrong
    assert finding.kind == "sign"
    assert finding.key.endswith("sign = 1")


def test_a_scale_is_corrected_on_top_of_the_one_that_is_stated() -> None:
    sound = next(d for d in batch("rectilinear-2", "", 3, seed=5) if d.how != "free")
    (finding,) = examine(sound.record, sound.rig, stated(sound.wiring, "x_1", scale=4.0)).wrong
    table, line = finding.key.splitlines()
    assert table == "[sensors.x_1]"
    # the rig's numbers are known to 3 percent each
    assert float(line.removeprefix("scale = ")) == pytest.approx(1.0, rel=0.1)


def test_the_acceleration_of_a_body_read_in_counts_is_in_counts() -> None:
    dt, n = 4e-3, 2000
    t = np.arange(n) * dt
    volts = np.where((t > 0.5) & (t < 5), 0.5, 0.0)
    shaft = find("torsional-2")(J_1=0.01, J_2=0.01, k_12=1.4, c_1=0.007, c_2=0.001)
    angle = simulate(shaft, {}, [0.0] * 4, 0.6 * volts, dt, samples=n, substeps=4)[:, ::2, 0]
    one, two = np.round(-16000 / (2 * np.pi) * angle).T
    log = {"Encoder 1 Pos": one, "Encoder 2 Pos": two, "volts": volts}
    record = Record(t=t, signals=log, provenance=Provenance(file="log.csv", reader="table"))
    (finding,) = (f for f in examine(record, *read_known("torsional-2")).findings if f.kind == "sign")
    assert "[counts/s^2]" in finding.panels[-1].label
    assert "slope found [counts]" in finding.evidence
    assert not any("rad" in p.label or "SI" in k for p in finding.panels for k in finding.evidence)


@pytest.mark.parametrize(("before", "after"), [(0.0, "180 deg"), (180.0, "0 deg"), (-90.0, "90 deg")])
def test_a_zero_that_is_upright_is_half_a_turn_from_the_one_that_is_stated(before: float, after: str) -> None:
    t = np.arange(3000) * 4e-3
    pendulum = find("pendulum")(m_p=0.2, l_cg=0.3, J_p=2e-3, b_2=2e-3)
    torque = 0.1 * np.sin(3 * t)
    theta = simulate(pendulum, {}, [0.0, 0.0], torque, 4e-3, samples=t.size, substeps=2)[:, 0, 0]
    # the stated zero is where the pendulum stands upright
    column = theta + np.radians(before) + np.pi
    record = Record(
        t=t, signals={"theta": column, "u": torque}, units={"theta": "rad", "u": "N m"},
        provenance=Provenance(file="log.csv", reader="table"),
    )  # fmt: skip
    sound = batch("pendulum", "", 3, seed=5)[0].wiring
    wiring = replace(sound, sensors={"theta": replace(sound.sensors["theta"], offset=np.radians(before))})
    (finding,) = (f for f in examine(record, find("pendulum"), wiring).wrong if "upright" in f.sentence)
    assert finding.key == f'[sensors.theta]\noffset = "{after}"'
