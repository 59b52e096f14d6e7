"""A crane's log in closed form, cos(w t) and sin(w t), and the study that goes with it."""

import numpy as np

T = np.arange(2000) * 0.005
THETA = 0.3 * np.cos(6 * T)
X = 0.05 * np.sin(2 * T)

RIG = """
[rig]
plant = "cart-pendulum"
[parameters]
m_c = "0.5 kg"
m_p = "107 g"
l_cg = { value = "23 cm", uncertainty = "2 mm" }
J_p = { guess = "1.6e-3 kg m^2", max = "50 kg cm^2" }
b_1c = { guess = 0.2 }
"""
SENSORS = """
[sensors.theta]
[sensors.x]
"""
RUN = '[[runs]]\nfile = "log.csv"\n'


def one(study):
    """The only run of a study."""
    (run,) = study.runs
    return run
