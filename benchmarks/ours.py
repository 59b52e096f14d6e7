"""The same pendulum and the same loop with upright's kernel; functions without arguments, ready to be timed."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any, Literal

import numpy as np

from benchmarks import problem

ORDER = (0, 2, 1, 3)  # psi, psi_dot, theta, theta_dot from psi, theta, psi_dot, theta_dot; its own inverse


def parameters(p: np.ndarray, *, stick_slip: bool) -> Mapping[str, np.ndarray | float]:
    """Parameters by name; without dry friction the Coulomb levels are left out, and so are their terms."""
    left_out = () if stick_slip else ("b_1c", "b_2c")
    return {name: value for name, value in zip(problem.NAMES, p, strict=True) if name not in left_out} | {
        "J_a": 0.0,
        "k_psi": 0.0,
        "tilt_x": 0.0,
        "tilt_y": 0.0,
    }


def trajectory(*, stick_slip: bool) -> Callable[[], np.ndarray]:
    """One free swing of 10 s at 1 kHz."""
    from upright.physics import Furuta
    from upright.simulation import simulate

    values = parameters(problem.RIG, stick_slip=stick_slip)
    start = problem.RELEASE[list(ORDER)]

    def run() -> np.ndarray:
        return simulate(Furuta, values, start, None, problem.PERIOD, samples=problem.STEPS + 1)[:, ORDER, 0]

    return run


def ensemble(
    p: np.ndarray, x0: np.ndarray, *, samples: int, stick_slip: bool, device: Literal["cpu", "gpu"] = "cpu"
) -> Callable[[], np.ndarray]:
    """n closed loops; last states (4, n)."""
    from upright.laws import state_feedback
    from upright.physics import Furuta
    from upright.simulation import ensemble as loops

    values = parameters(p, stick_slip=stick_slip) | {"actuator.limit": problem.LIMIT}
    start = np.ascontiguousarray(x0[list(ORDER)].T)
    loop = state_feedback(
        problem.gains()[list(ORDER)],
        problem.PERIOD,
        memory=problem.KEEP,
        target=[0.0, np.pi],
        resolution=problem.QUANTUM,
    )

    def run() -> np.ndarray:
        done = loops(
            Furuta, values, start, None, problem.PERIOD,
            samples=samples + 1, substeps=problem.SUBSTEPS, loop=loop, threads=1,
            device=device,
        )  # fmt: skip
        return done.final[list(ORDER)]

    return run


def study() -> tuple[Any, Any]:
    """Rig and run of the synthetic fit: eight unknowns, two encoders."""
    from upright.identification import GreyBox, Parameter, Run
    from upright.physics import Furuta
    from upright.simulation import simulate

    true = parameters(problem.RIG, stick_slip=True)
    start = problem.RELEASE[list(ORDER)]
    states = simulate(Furuta, true, start, problem.TORQUE, problem.PERIOD, samples=problem.STEPS + 1)[:, ORDER, 0]
    guesses = dict(zip(problem.UNKNOWN, problem.START, strict=False))
    rig = GreyBox(
        plant=Furuta,
        parameters={
            name: Parameter(name=name, value=guesses.get(name, value), estimate=name in guesses, lower=0.0)
            for name, value in true.items()
        },
    )
    run = Run(
        label="swing",
        role="fit",
        t=np.arange(problem.STEPS + 1) * problem.PERIOD,
        u=np.append(problem.TORQUE, problem.TORQUE[-1])[:, None],
        y=problem.counts(states),
        measured=("psi", "theta"),
        resolution=(problem.QUANTUM,) * 2,
        initial={"psi": 0.0, "psi_dot": 0.0, "theta_dot": 0.0},
    )
    return rig, run


def search() -> Callable[[], np.ndarray]:
    """Levenberg-Marquardt over the growing horizon, nothing else; estimates as `problem.TRUTH`."""
    from upright.identification.problem.residuals import formulate
    from upright.identification.search.descent import descend_progressively

    rig, run = study()

    def estimate() -> np.ndarray:
        posed = formulate(rig, [run])
        found = dict(
            zip([u.name for u in posed.unknowns], posed.value(descend_progressively(posed, posed.start).x), strict=True)
        )
        return np.array([found[name] for name in (*problem.UNKNOWN, "initial.theta")])

    return estimate


def fit() -> Callable[[], np.ndarray]:
    """All that `upright identify` does once the files are read: search, errors, correlations, verdict."""
    from upright.identification.estimate import identify

    rig, run = study()

    def estimate() -> np.ndarray:
        found = identify(rig, [run], method="least-squares")
        released = found.per_run["swing"]["initial.theta"].value
        return np.array([*(found.estimates[name].value for name in problem.UNKNOWN), released])

    return estimate
