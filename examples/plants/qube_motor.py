"""A QUBE-Servo-like Furuta pendulum with its motor circuit: the input is the voltage.

The charge through the motor is one more coordinate; its velocity is the current. The flux linkage k_t psi i in the
kinetic energy gives both halves of the motor: back-EMF k_t psi' in Kirchhoff's law and torque k_t i on the arm.
The circuit is stiff (L_m/R_m, about 0.1 ms): give it a sample or substep of 50 microseconds or less.
"""

import math

from upright.physics import Coordinate, Furuta, Input, Joint
from upright.quantities import quantity


class QubeMotor(Furuta):
    """Furuta pendulum behind a DC motor."""

    k_t: float = quantity("N m/A", "torque constant, also back-EMF constant", default=0.042, at_least=0)
    R_m: float = quantity("ohm", "resistance of the winding", default=8.4, above=0)
    L_m: float = quantity("H", "inductance of the winding", default=1.16e-3, above=0)

    coordinates = (*Furuta.coordinates, Coordinate("charge", "C", "charge through the motor; its rate is the current"))
    inputs = (Input("V_m", "V", "voltage at the motor", on="charge"),)
    joints = (Joint("psi", coulomb="b_1c"), Joint("theta", coulomb="b_2c"))
    equilibria = {"hanging": {}, "inverted": {"theta": math.pi}}

    @staticmethod
    def energies(p, q, v):
        """The pendulum's energies, the coil's, and the heat of the winding."""
        T, V, D = Furuta.energies(p, q[:2], v[:2])
        current = v[2]
        return T + p.L_m * current**2 / 2 + p.k_t * q[0] * current, V, D + p.R_m * current**2 / 2
