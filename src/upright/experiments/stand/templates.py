"""Files that the owner of a rig begins with: what nobody else can know stands in them as a question."""

from __future__ import annotations

from pathlib import Path

from upright.files import replace_file
from upright.study.text import toml

RIG = """\
# What the rig is, how it is reached and how far it may go: docs/howto/rigs.md
kind = "serial"
port = {port}
study = "study.toml"

# [board]
# full_scale = 12.0        # command at full output: of an H-bridge its supply [V]

[limits]
# command = "5 V"          # largest command
watchdog = "20 ms"         # longest silence of the host
lean = "25 deg"            # how far a pendulum may be from upright

# [limits.psi]             # what the drive moves, as the plant calls it
# travel = "1.5 rad"
# speed = "15 rad/s"
# start = "0.3 rad"
"""
STUDY = """\
# The rig as far as you know it; every key: docs/reference/study.md. A number is known, known about (with an
# uncertainty), or a guess to start from. A response sees masses, frictions and the drive's gain only beside each
# other: weigh the pendulum and find where it balances.
[rig]
plant = "furuta"           # or "cart-pendulum", "torsional-2", "rectilinear-2", "my_plant.py:MyRig"
name = "my rig"
# servo_period = "1 ms"    # a tick of the firmware
# travel = "2 rad"

[parameters]
# m_p = { value = "24 g", measured = true }                # pendulum
# l_cg = { value = "64 mm", uncertainty = "1 mm" }         # from its hinge to where it balances
# r = { value = "85 mm", uncertainty = "1 mm" }            # from the arm's axis to the pendulum
# J_d = { guess = "8e-5 kg m^2", min = 0 }                 # disk and arm about their axis
# J_p = { guess = "3e-5 kg m^2", min = 0 }                 # pendulum about its centre of gravity, m_p L^2/12 of a rod
# J_a = "0 kg m^2"                                         # pendulum about its own axis
# b_1 = { guess = "1e-4 N m s/rad", min = 0 }
# b_2 = { guess = "1e-5 N m s/rad", min = 0 }
# b_1c = { guess = "5e-4 N m", min = 0 }
# b_2c = { guess = "1e-5 N m", min = 0 }

[actuator]
# gain = { guess = "5e-3 N m/V", min = 0 }
# limit = { value = "5 V", measured = true }
# delay = { guess = "1 ms", min = 0 }                      # from a sample to its command at work

[sensors.psi]
column = "psi"
# counts_per_rev = { value = 2048, measured = true }       # four times the lines of the encoder

[sensors.theta]
column = "theta"
# counts_per_rev = { value = 2048, measured = true }
"""


def write_templates(folder: Path, port: str) -> Path:
    """RIG.toml and study.toml of a rig at a port, where the folder has none; the first of them."""
    rig = folder / "RIG.toml"
    for path, text in ((rig, RIG.format(port=toml(port))), (folder / "study.toml", STUDY)):
        if not path.exists():
            replace_file(path, text.encode())
    return rig
