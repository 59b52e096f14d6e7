"""Rigs of RIG.toml: a twin of a make, and one that only its owner's study tells of; experiments of a laboratory."""

from __future__ import annotations

from upright.declared import Declared
from upright.experiments.stand.experiment import Experiment
from upright.experiments.stand.live import live_stand


def declared(*experiments: Experiment) -> Declared[Experiment]:
    """A laboratory's experiments: these, and no package's."""
    own = {e.name: e for e in experiments}
    return Declared("experiment", "upright.none", lambda: own, lambda value: isinstance(value, Experiment))


OWN = """
[rig]
plant = "furuta"
name = "qube 7"
servo_period = "2 ms"
travel = "2 rad"
[parameters]
m_p = { value = "24 g", measured = true }
l_cg = { value = "64.5 mm", uncertainty = "0.5 mm" }
r = { value = "85 mm", measured = true }
J_d = { guess = "8e-5 kg m^2", min = 0 }
J_p = { guess = "3.3e-5 kg m^2", min = 0 }
J_a = "0 kg m^2"
b_1 = { guess = "1.5e-4 N m s/rad", min = 0 }
b_2 = { guess = "1e-5 N m s/rad", min = 0 }
[actuator]
gain = { guess = "0.005 N m/V", min = 0 }
limit = { value = "10 V", measured = true }
delay = "2 ms"
[sensors.psi]
column = "psi"
counts_per_rev = { value = 2048, measured = true }
[sensors.theta]
column = "theta"
counts_per_rev = { value = 2048, measured = true }
"""


def made(folder, text='kind = "twin"\nmake = "furuta"\nseed = 3\n'):
    (folder / "RIG.toml").write_text(text, encoding="utf-8")
    return live_stand(folder / "RIG.toml")
