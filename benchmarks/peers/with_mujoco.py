"""mujoco.sysid over an MJCF model: joint damping, frictionloss and armature as parameters, start states beside them.

Initial states are no parameters of mujoco.sysid, so a rollout of one's own sets them; what is frozen loses its
modifier, so the numbers of a prediction are written into the model instead.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

import mujoco
import numpy as np
from mujoco import sysid  # type: ignore[attr-defined]

from benchmarks.peers.least_squares import HORIZONS, started
from benchmarks.peers.task import Answer, Samples, Task, spent

OPTION = """<option timestep="{dt}" integrator="implicitfast" gravity="0 0 -{g}" iterations="50" tolerance="1e-10">
<flag contact="disable"/></option>"""
PENDULUM = """<mujoco>{option}<worldbody><body name="pend">
<inertial pos="0 0 -{l_cg}" mass="{m_p}" diaginertia="1e-3 1e-3 1e-9"/>
<joint name="theta" type="hinge" axis="-1 0 0" solreffriction="0.005 1"/></body></worldbody>
<actuator><motor name="motor" joint="theta" gear="0"/></actuator>
<sensor><jointpos name="theta" joint="theta"/></sensor></mujoco>"""
FURUTA = """<mujoco>{option}<worldbody><body name="arm">
<inertial pos="0 0 0" mass="1e-6" diaginertia="1e-9 1e-9 1e-9"/>
<joint name="psi" type="hinge" axis="0 0 1" solreffriction="0.005 1"/>
<body name="pend" pos="{r} 0 0"><inertial pos="0 0 -{l_cg}" mass="{m_p}" diaginertia="6e-4 6e-4 1e-9"/>
<joint name="theta" type="hinge" axis="-1 0 0" solreffriction="0.005 1"/></body></body></worldbody>
<actuator><motor name="motor" joint="psi"/></actuator>
<sensor><jointpos name="psi" joint="psi"/><jointpos name="theta" joint="theta"/></sensor></mujoco>"""


def _set(spec: Any, name: str, value: float) -> None:
    """Write one number into the model; the polynomial of a joint's damping has the quadratic drag second."""
    first, last = spec.joint("psi"), spec.joint("theta")
    if name == "J_p":
        spec.body("pend").inertia = [value + 1e-9, value + 1e-9, 1e-9]
    elif name == "J_d":
        first.armature = value
    elif name in ("b_1", "b_2"):
        (first if name == "b_1" else last).damping[0] = value
    elif name == "b_2q":
        last.damping[1] = value
    elif name in ("b_1c", "b_2c"):
        (first if name == "b_1c" else last).frictionloss = value
    elif name == "gain":
        spec.actuator("motor").gear[0] = value


def _physics(guesses: Mapping[str, float]) -> Any:
    parameters = sysid.ParameterDict()
    for name, guess in guesses.items():
        parameters.add(
            sysid.Parameter(
                name, guess, 0, 10 * guess, modifier=lambda spec, p, name=name: _set(spec, name, float(p.value[0]))
            )
        )
    return parameters


def _problem(task: Task, run: Samples, parameters: Any, start: np.ndarray, fixed: Mapping[str, float]) -> Callable:
    """The residual of one run; its start is added to the parameters."""
    dt = min(float(run.t[1] - run.t[0]), 2e-3)
    text = (FURUTA if task.plant == "furuta" else PENDULUM).format(
        option=OPTION.format(dt=dt, g=task.known["g"]), **task.known
    )
    spec = mujoco.MjSpec.from_string(text)
    for name, value in fixed.items():
        _set(spec, name, value)
    model = spec.compile()
    angles = run.y.shape[1]
    moving = task.plant == "pendulum"
    names = [*(f"angle_{k}" for k in range(angles)), *(["speed"] if moving else []), *(["off"] if task.offset else [])]
    for name, value in zip(names, start, strict=True):
        width = 5.0 if name == "speed" else 0.3
        parameters.add(sysid.Parameter(name, float(value), float(value) - width, float(value) + width))

    def state(p: Any) -> Any:
        q = np.array([float(p[f"angle_{k}"].value[0]) for k in range(angles)])
        v = np.array([float(p["speed"].value[0])]) if moving else np.zeros(angles)
        return sysid.create_initial_state(model, q, v)

    def rollout(
        models: Any, datas: Any, control_signal: Any, initial_states: Any, param_dicts: Any, **more: Any
    ) -> Any:
        del initial_states
        return sysid.sysid_rollout(models, datas, control_signal, [state(p) for p in param_dicts], **more)

    transform = sysid.SignalTransform()
    if task.offset:
        transform.bias("theta", parameters["off"], target="predicted")
    sequence = sysid.ModelSequences(
        "rig", spec, "run", state(parameters), sysid.TimeSeries(run.t, run.u[:, None]),
        sysid.TimeSeries.from_names(run.t, run.y, model),
    )  # fmt: skip
    return sysid.build_residual_fn(
        models_sequences=[sequence], custom_rollout=rollout, modify_residual=transform.apply, n_threads=1
    )


def _optimum(parameters: Any, residual: Callable, most: int = 40) -> tuple[Any, Any]:
    return sysid.optimize(
        initial_params=parameters, residual_fn=residual, optimizer="mujoco", verbose=False, max_iters=most,
        x_scale="jac", eps=1e-6,
    )  # fmt: skip


def _predicted(best: Any, residual: Callable, run: Samples) -> np.ndarray:
    _, predicted, _ = residual(best.as_vector(), best, return_pred_all=True)
    series = predicted[0][0]
    return np.column_stack([np.interp(run.t, series.times, column) for column in np.atleast_2d(series.data.T)])


def answer(task: Task) -> Answer:
    """The whole task, intervals by `sysid.calculate_intervals`."""
    guesses, start = dict(task.guesses), started(task, task.fitted)
    begin = spent()
    for seconds in HORIZONS if task.plant == "pendulum" else HORIZONS[-1:]:
        run = task.fitted
        part = run.part(0, min(run.t.size, round(seconds / (run.t[1] - run.t[0]))))
        parameters = _physics(guesses)
        residual = _problem(task, part, parameters, start, {})
        best, found = _optimum(parameters, residual)
        x = best.as_vector()
        guesses = {n: max(float(v), 1e-12) for n, v in zip(guesses, x, strict=False)}
        start = x[len(guesses) :]
    left, *_ = residual(x, best)
    _, half = sysid.calculate_intervals([np.ravel(r) for r in left], np.asarray(found.jac, float))
    taken = spent() - begin
    values = dict(zip(guesses, x.tolist(), strict=False))
    predicted: dict[str, np.ndarray] = {}
    for label, run in task.held_out.items():
        own = sysid.ParameterDict()
        first = start if run.score_from else started(task, run)
        again, _ = _optimum(own, _problem(task, run.before, own, first, values), 20)
        residual = _problem(task, run, sysid.ParameterDict(), first, values)
        predicted[label] = _predicted(again, residual, run)
    return Answer(
        values=values, predicted=predicted, seconds=taken, says="nothing",
        intervals={n: (v - float(h), v + float(h)) for (n, v), h in zip(values.items(), half, strict=False)},
    )  # fmt: skip
