"""Experiment 1a on logs of a rig of one's own, or on those of a twin: what was added is named log by log."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from upright.errors import BadInput
from upright.experiments.weighing_1a.chapter import added_options, loading_chapter
from upright.experiments.weighing_1a.loadings import inertia_of, weigh
from upright.experiments.weighing_1a.run import drawn_twin, measure_body
from upright.identification.loadings import Loadings
from upright.records import Record
from upright.report.page import Chapter, Step
from upright.rig.makes import BODIES


def weigh_logs(
    logs: Sequence[tuple[Record, str]], added: Sequence[str], *, signal: str = "", command: str = "",
    tolerance: float = 0.0, free: bool = False,
) -> tuple[Loadings, Chapter]:  # fmt: skip
    """Stiffness and bare inertia of a rig from its logs, and the chapter on them.

    Parameters
    ----------
    logs : sequence of (Record, str)
        Each with its name.
    added : sequence of str
        What was added, log by log.
    signal, command : str
        Columns of position and command; as the log says when empty.
    tolerance : float
        Standard uncertainty of one added piece, as a share.
    free : bool
        Count swings at zero command only.

    Raises
    ------
    BadInput
        When logs and loadings do not match, or a column is not named.
    NotIdentifiable
        When too few swings can be seen.
    """
    values = [inertia_of(text) for text in added]
    kinds = {kind for _, kind in values if kind}
    if len(kinds) > 1:
        raise BadInput("Masses in kg and inertias in kg m^2 cannot be mixed; carts take masses, disks inertias.")
    kind = kinds.pop() if kinds else "rectilinear"
    records: dict[str, Record] = {}
    signals: dict[str, str] = {}
    drives: dict[str, str] = {}
    for record, name in logs:
        label = name if name not in records else f"{name} ({len(records) + 1})"
        records[label], signals[label] = record, _column(record, signal, record.outputs, "--signal")
        drives[label] = _column(record, command, record.inputs, "--command") if command or record.inputs else ""
    weighed, left_out = weigh(records, [v for v, _ in values], signals, drives, tolerance=tolerance, free=free)
    steps = [
        Step(
            "Fit the same logs with the equations of motion; give m_1 and k_1 these values as guesses.",
            f"upright init {logs[0][1]} -o study.toml",
        ),
        Step(
            "Plan the next loadings with the error of a frequency that these swings show.",
            f'upright plan-inertias --rig {kind} --bare "{weighed.bare.value:.4g} {BODIES[kind].unit}"',
        ),
    ]
    page = loading_chapter(weighed, kind=kind, title="Stiffness and bare inertia from added loads", logs=records,
                           signals=signals, left_out=left_out, steps=steps)  # fmt: skip
    return weighed, page


def weigh_twin(kind: str, seed: int, folder: Path | None) -> tuple[Loadings, Chapter]:
    """The same of a twin that is stepped here; its logs go into the folder, where one is named."""
    if kind not in BODIES:
        raise BadInput(f"--rig is {' or '.join(BODIES)}, got '{kind}'.")
    result = measure_body(drawn_twin(seed, kind))
    column = next(iter(result.logs.values())).outputs[0]
    result = result if folder is None else result.written(folder)
    files = result.files
    steps = [Step("See which masses are most informative.", f"upright plan-inertias --rig {kind}")]
    if files:
        again = f"upright loadings {' '.join(files.values())} {added_options(result, files)}"
        steps.insert(0, Step("Weigh the rig again from its logs in that folder, as you would your own.", again))
    page = loading_chapter(
        result.loadings, kind=kind, title=f"Experiment 1a on a twin, {kind}, seed {seed}", logs=result.logs,
        signals=dict.fromkeys(result.logs, column), left_out=result.left_out, truth=result.truth, steps=steps,
    )  # fmt: skip
    return result.loadings, page


def _column(record: Record, requested: str, known: tuple[str, ...], option: str) -> str:
    if requested:
        _ = record[requested]
        return requested
    if len(known) == 1:
        return known[0]
    raise BadInput(f"The log holds the columns {', '.join(record.names)}; say which one is meant with {option}.")
