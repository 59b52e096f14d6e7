"""lmfit over the same equations by hand; intervals of two standard errors, as its report prints them."""

from __future__ import annotations

import lmfit
import numpy as np

from benchmarks.peers.least_squares import HORIZONS, predict, residual, simulated, started
from benchmarks.peers.task import Answer, Task, spent


def answer(task: Task) -> Answer:
    """The whole task by `lmfit.minimize`, bounds as lmfit transforms them."""
    scale, run = np.array(list(task.guesses.values())), task.fitted
    simulated(task, scale, started(task, run), run.part(0, 50))
    parameters = lmfit.Parameters()
    for name in task.guesses:
        parameters.add(name, value=1.0, min=0.0)
    for k, value in enumerate(started(task, run)):
        parameters.add(f"start_{k}", value=float(value))
    begin = spent()
    for seconds in HORIZONS if task.plant == "pendulum" else HORIZONS[-1:]:
        part = run.part(0, min(run.t.size, round(seconds / (run.t[1] - run.t[0]))))
        of = residual(task, part, scale)
        found = lmfit.minimize(
            lambda p, of=of: of(np.array([v.value for v in p.values()])), parameters, method="leastsq",
            epsfcn=1e-8, max_nfev=2000,
        )  # fmt: skip
        parameters = found.params
    taken = spent() - begin
    x = np.array([v.value for v in parameters.values()])
    p, start = x[: scale.size] * scale, x[scale.size :]
    intervals = {
        n: ((v.value - 1.96 * v.stderr) * g, (v.value + 1.96 * v.stderr) * g)
        for (n, g), v in zip(task.guesses.items(), parameters.values(), strict=False)
        if v.stderr
    }
    starts = {label: start if held.score_from else started(task, held) for label, held in task.held_out.items()}
    return Answer(
        values=dict(zip(task.guesses, p.tolist(), strict=True)), intervals=intervals, seconds=taken,
        predicted={label: predict(task, p, held, starts[label]) for label, held in task.held_out.items()},
        says="" if found.errorbars else found.message.splitlines()[-1].strip()[:160],
    )  # fmt: skip
