"""A rotary pendulum whose gains are asked for, as a plant and as a study."""

from upright.physics import Furuta

RIG = Furuta(m_p=0.135, l_cg=0.19, r=0.16, J_d=0.011, J_p=6e-4, b_1=6e-4)
STUDY = """
[rig]
plant = "furuta"
servo_period = "1 ms"
[sensors.psi]
counts_per_rev = 16000
[sensors.theta]
counts_per_rev = 16000
[parameters]
m_p = "135 g"
l_cg = { guess = "19 cm" }
r = "16 cm"
J_d = "0.011 kg m^2"
J_p = "6e-4 kg m^2"
b_1 = 6e-4
"""
