"""MuJoCo: the same pendulum from MJCF, integrator RK4, contacts and constraints off."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np

from benchmarks import problem


def model(p: np.ndarray, period: float) -> Any:
    """MuJoCo model of one rig; the hinge's axis points inwards, as in fig. 3a."""
    import mujoco

    m_p, r, l_cg, J_p, J_d, b_1, b_2, _, _, g = p
    return mujoco.MjModel.from_xml_string(f"""
    <mujoco>
      <option timestep="{period}" integrator="RK4" gravity="0 0 {-g}">
        <flag contact="disable" constraint="disable"/>
      </option>
      <worldbody>
        <body>
          <joint name="psi" type="hinge" axis="0 0 1" damping="{b_1}"/>
          <inertial pos="0 0 0" mass="1e-6" diaginertia="{J_d / 2} {J_d / 2} {J_d}"/>
          <body pos="{r} 0 0">
            <joint type="hinge" axis="-1 0 0" damping="{b_2}"/>
            <inertial pos="0 0 {-l_cg}" mass="{m_p}" diaginertia="{J_p} {J_p} 1e-12"/>
          </body>
        </body>
      </worldbody>
      <actuator><motor joint="psi"/></actuator>
    </mujoco>""")


def trajectory() -> Callable[[], np.ndarray]:
    """One free swing of 10 s at 1 kHz, with MuJoCo's own loop in C (rollout)."""
    import mujoco
    from mujoco import rollout

    rig = model(problem.RIG, problem.PERIOD)
    data = mujoco.MjData(rig)
    full = mujoco.mjtState.mjSTATE_FULLPHYSICS
    start = np.zeros((1, mujoco.mj_stateSize(rig, full)))
    start[0, 1:5] = problem.RELEASE
    torque = np.zeros((1, problem.STEPS, 1))

    def run() -> np.ndarray:
        states, _ = rollout.rollout(rig, data, start, torque)
        return np.vstack([problem.RELEASE, states[0, :, 1:5]])

    return run


def ensemble() -> Callable[[], np.ndarray]:
    """One closed loop: the controller in Python, two steps of MuJoCo per sample."""
    import mujoco

    p, x0 = problem.ensemble(1)
    c = problem.loop_numbers()
    rig = model(p[:, 0], problem.PERIOD / problem.SUBSTEPS)
    data = mujoco.MjData(rig)

    def run() -> np.ndarray:
        mujoco.mj_resetData(rig, data)
        data.qpos[:], data.qvel[:] = x0[:2, 0], x0[2:, 0]
        seen = problem.at_rest(math, x0[:, 0])
        for _ in range(problem.SAMPLES):
            u, seen = problem.controller(math, data.qpos.tolist(), seen, c)
            data.ctrl[0] = min(max(u, -problem.LIMIT), problem.LIMIT)
            mujoco.mj_step(rig, data, nstep=problem.SUBSTEPS)
        return np.concatenate([data.qpos, data.qvel])[:, None]

    return run
