"""A study with nothing wrong in it; the log it speaks of is written by the fixture `folder`."""

GOOD = """\
[rig]
plant = "cart-pendulum"
substeps = 2
[parameters]
m_c = "0.5 kg"
m_p = { value = "0.107 kg", uncertainty = "1 g" }
l_cg = "0.23 m"
J_p = { guess = "1.6e-3 kg m^2", min = 0 }
[actuator]
gain = { guess = "5 N/V" }
[sensors.theta]
column = "theta"
unit = "counts"
counts_per_rev = 14400
sign = -1
[sensors.x]
column = "z"
[drive]
column = "v"
unit = "V"
[[runs]]
label = "a"
file = "log.csv"
window = [1.0, 9.0]
role = "fit"
[[runs]]
label = "b"
file = "log.csv"
locked = { x = 0.0 }
"""
