"""upright: a study of text, one call; runs that are held out are predicted in the same one."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from benchmarks.peers.task import Answer, Task, spent, study_text
from upright.identification import identify
from upright.records import Record
from upright.study import load_study


def asked(name: str) -> str:
    """What a study calls a number of a task."""
    return "actuator.gain" if name == "gain" else name


def records_of(task: Task) -> dict[str, Record]:
    """The logs of its study, by file."""
    names = ("psi", "theta") if task.plant == "furuta" else ("theta",)
    return {
        f"{label}.csv": Record(t=run.t, signals={"u": run.u, **dict(zip(names, run.y.T, strict=True))}, units={})
        for label, run in {"fitted": task.fitted, **task.held_out}.items()
    }


def answer(task: Task) -> Answer:
    """The whole task."""
    records = records_of(task)
    begin = spent()
    study = load_study(Path("study.toml"), text=study_text(task), records=records)
    fit = identify(study.model, study.runs)
    seconds = spent() - begin
    predicted: dict[str, np.ndarray] = {}
    for label, run in task.held_out.items():
        score = fit.runs[label]
        y_hat = run.y + (score.simulated - score.y)  # in the task's frame: an offset that was fitted is the sensor's
        predicted[label] = y_hat if y_hat.shape == run.y.shape else y_hat[: run.t.size]
    return Answer(
        values={n: fit.estimates[asked(n)].value for n in task.guesses},
        intervals={n: fit.estimates[asked(n)].interval for n in task.guesses},
        predicted=predicted, seconds=seconds, says=fit.verdict,
    )  # fmt: skip
