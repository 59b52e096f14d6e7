"""An experiment 3 whose every figure is chosen, on disks that follow a step as closed forms say."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np

from upright.control import Trial
from upright.control.effort import Effort, RestEffort
from upright.control.score import StepFigures
from upright.experiments.tracking_3.laws import AT, far_pd, near_pd, paper_sets, with_sum
from upright.experiments.tracking_3.run import Chosen, Outcome, StepTrial, Tracking
from upright.records import Record
from upright.rig.makes import make_rig

RIG = make_rig("torsional")
RATE = 10.0
"""Of the far disk's way to the reference, and of the twist's decay [1/s]."""
SIZE, GIVE, TWIST = 0.25, 0.05, 0.2
SET_1, SET_4 = paper_sets(RIG, (1, 4))
SUM = with_sum(RIG, SET_4, "with a sum")
PD, STIFF, FAR = (
    near_pd(RIG, "PD, tuned", 8.0, 0.4),
    near_pd(RIG, "PD, as stiff", 30.0, 0.9),
    far_pd(RIG, "far", 8, 0.4),
)


def motion(rig=RIG, size=SIZE, give=GIVE, twist=TWIST, seconds=3.6, volts=4.0) -> Trial:
    """Rest for 0.1 s, a step, and after 2 s a push: each as ``1 - exp(-RATE t)``; the near disk goes ahead."""
    t = np.arange(round(seconds / rig.period) + 1) * rig.period
    after, pushed = np.maximum(t - 0.1, 0.0), np.maximum(t - 2.1, 0.0)
    far = size * (1 - np.exp(-RATE * after)) - give * (1 - np.exp(-RATE * pushed))
    near = far + np.where(t >= 0.1, twist * np.exp(-RATE * after), 0.0)
    u = np.where(t >= 0.1, volts * np.exp(-RATE * after), 0.0)
    x = np.column_stack([near, np.zeros_like(t), far, np.zeros_like(t)])
    signals = {"theta_1": near, "theta_2": far, "u": u}
    record = Record(t=t, signals=signals, inputs=("u",), outputs=("theta_1", "theta_2"))
    return Trial(rig=rig, at=AT, t=t, x=x, u=u, rest=np.zeros(2), record=record)


FIGURES = {
    "change": 0.24, "rise": 0.1011, "peak_time": 0.2022, "overshoot": 0.0303, "settling_2": 0.4044,
    "settling_5": 0.3505, "arrival": 0.6067, "error": 0.02 * SIZE, "resolution": 0.001,
}  # fmt: skip


def ran(
    *, tripped=math.inf, moved=True, peak=7.89, share=0.789, saturated=0.0, give=GIVE, rms=0.02, **figures
) -> StepTrial:
    """A run with these figures."""
    seen = StepFigures(**(FIGURES | figures)) if moved and math.isinf(tripped) else None
    return StepTrial(
        trial=motion(), figures=seen, effort=Effort(peak=peak, share=share, saturated=saturated),
        rest=RestEffort(rms=rms, peak=2 * rms) if math.isinf(tripped) else None, twist=0.11, travel=0.22, give=give,
        tripped=tripped,
    )  # fmt: skip


def outcome(law, predicted=None, measured=None) -> Outcome:
    """What a law was to do and what it did; the same where nothing was tried."""
    predicted = predicted or ran()
    return Outcome(law=law, predicted=predicted, measured=measured or predicted)


def tracking(*sets, **parts) -> Tracking:
    """The experiment on these sets."""
    step = Chosen(size=SIZE, reason="bounded by effort", by_effort=SIZE + 0.001, by_twist=0.3, by_travel=math.inf)
    rest = {"rig": RIG, "model": RIG, "true": RIG, "folder": Path("made"), "study": None, "fit": None, "step": step}
    return Tracking(**(rest | {"sets": sets} | parts))
