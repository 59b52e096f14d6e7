"""Are the moment of a silent trip, the drive's brakes and its torque-speed curve found from one spin-up?"""

from __future__ import annotations

import numpy as np
import pytest

from upright.identification import GreyBox, Parameter, Run
from upright.identification.estimate import identify
from upright.physics.oscillators import Torsional1
from upright.simulation import simulate

DISK = {"J_1": 2e-3, "c_1": 2e-3}
DRIVE = {
    "actuator.end": 3.137, "actuator.damping": 4e-3, "actuator.standby": 1.5e-3,
    "actuator.knee": 8.0, "actuator.fade": 1.5e-3,
}  # fmt: skip


@pytest.mark.slow
def test_a_spin_up_tells_when_the_drive_tripped_and_how_it_brakes() -> None:
    dt, n = 0.01, 500
    t = np.arange(n) * dt
    # forwards, idle, backwards, forwards; volts are logged on after the trip
    u = np.select([t < 1.0, t < 1.5, t < 2.2], [0.15, 0.0, -0.12], 0.1)[:, None]
    truth = DISK | DRIVE
    y = simulate(Torsional1(**DISK), DRIVE, [0.0, 0.0], u, dt, samples=n, substeps=2)[:, [0], 0]
    y = y + np.random.default_rng(4).normal(scale=1e-3, size=y.shape)
    guess = {"c_1": 1e-3, "actuator.end": 3.3, "actuator.damping": 1e-3, "actuator.standby": 1e-3}
    guess |= {"actuator.knee": 6.0, "actuator.fade": 1e-3}
    parameters = {n: Parameter(name=n, value=v) for n, v in DISK.items()}
    parameters |= {n: Parameter(name=n, value=v, estimate=True) for n, v in guess.items()}
    run = Run(label="spin-up", role="fit", t=t, u=u, y=y, measured=("theta_1",))
    fit = identify(GreyBox(plant=Torsional1, parameters=parameters, substeps=2), [run])
    for name in guess:
        e = fit.estimates[name]
        # four standard errors: one miss in 16,000
        assert abs(e.value - truth[name]) < 4 * e.stderr, name
        assert e.stderr < 0.1 * truth[name], name
