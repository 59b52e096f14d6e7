"""A swing-up whose motion is a closed form: five half swings, caught after 2 s, held for 6 s."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np

from upright.basis import MEASURED
from upright.control import Trial
from upright.control.sensors import Scales
from upright.control.swing_up import HOLDING, SWINGING, TRIPPED, Ascent, body, design_swing_up
from upright.experiments.swing_up_2b.run import SwingUpRun
from upright.records import Record
from upright.rig.makes import make_rig

RIG = replace(make_rig("furuta").replace(limit=10.0), basis=MEASURED)
DT = 0.01
T = np.arange(801) * DT
LAW = SimpleNamespace(
    limit=10.0, travel=1.5, size=0.3, sure=0.4, reach=0.2, K=np.arange(4.0), P=np.eye(4), body=body(RIG), memory=0.5,
    rule=design_swing_up(RIG).rule,
)  # fmt: skip
GOOD = Scales(
    names=("psi", "theta"), value=np.array([1.001, 0.998]), error=np.array([0.002, 0.001]),
    explained=np.array([0.999, 0.98]), t=T[:50], shown=np.column_stack([T[:50], 2 * T[:50]]),
    motion=np.column_stack([1.1 * T[:50], 1.9 * T[:50]]),
)  # fmt: skip
BAD = replace(GOOD, value=np.array([1.001, 2.0]))


def climbed(*, caught=2.0, falls=(), tripped=math.inf, turns=0.0, volts=8.0, far=0.6) -> Ascent:
    """Swings of 2.5 rad at 1 Hz until `caught`, then a tremble of 0.05 rad about upright, `turns` turns on."""
    up = caught <= T
    for begin, end in falls:
        up &= ~((begin <= T) & (end > T))
    w = 2 * math.pi
    theta = np.where(up, math.pi + turns * w + 0.05 * np.cos(w * T), 2.5 * np.sin(w * T))
    speed = np.where(up, -0.05 * w * np.sin(w * T), 2.5 * w * np.cos(w * T))
    psi, psi_dot = far * np.sin(3 * T), 3 * far * np.cos(3 * T)
    mode = np.where(tripped <= T, TRIPPED, np.where(up, HOLDING, SWINGING))
    u = np.where(up, 0.05, 1.0) * volts * np.cos(5 * T)  # holding takes a twentieth
    x = np.column_stack([psi, psi_dot, theta, speed])
    record = Record(t=T, signals={"psi": psi, "theta": theta, "u": u}, inputs=("u",), outputs=("psi", "theta"))
    trial = Trial(rig=RIG, at="inverted", t=T, x=x, u=u, rest=np.array([0, math.pi]), record=record)
    return Ascent(
        trial=trial, law=LAW, mode=mode, angle=np.angle(np.exp(1j * (theta - math.pi))),
        speeds=np.column_stack([psi_dot, speed]), energy=LAW.body.energy(theta, speed),
    )  # fmt: skip


def experiment(ascent=None, **parts) -> SwingUpRun:
    """Experiment 2b with this way up."""
    rest = {
        "model": RIG, "truth": replace(RIG, seed=3), "log": None, "check": GOOD, "law": LAW, "ascent": ascent,
        "faulty": (), "source": "", "folder": Path("up"),
    }  # fmt: skip
    return SwingUpRun(**(rest | parts))
