"""upright: a study of text, one call; runs that are held out are predicted in the same one."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from benchmarks.peers.task import Answer, Task, spent, study_text
from upright.identification import identify
from upright.records import Record
from upright.study import load_study


def answer(task: Task) -> Answer:
    """The whole task."""
    names = ("psi", "theta") if task.plant == "furuta" else ("theta",)
    records = {
        f"{label}.csv": Record(t=run.t, signals={"u": run.u, **dict(zip(names, run.y.T, strict=True))}, units={})
        for label, run in {"fitted": task.fitted, **task.held_out}.items()
    }
    begin = spent()
    study = load_study(Path("study.toml"), text=study_text(task), records=records)
    fit = identify(study.model, study.runs)
    seconds = spent() - begin
    asked = {n: "actuator.gain" if n == "gain" else n for n in task.guesses}
    predicted: dict[str, np.ndarray] = {}
    for label, run in task.held_out.items():
        score = fit.runs[label]
        y_hat = run.y + (score.simulated - score.y)  # in the task's frame: an offset that was fitted is the sensor's
        predicted[label] = y_hat if y_hat.shape == run.y.shape else y_hat[: run.t.size]
    return Answer(
        values={n: fit.estimates[a].value for n, a in asked.items()},
        intervals={n: fit.estimates[a].interval for n, a in asked.items()},
        predicted=predicted, seconds=seconds, says=fit.verdict,
    )  # fmt: skip
