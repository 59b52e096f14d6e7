"""Experiment 1a on logs of a rig of one's own, or on those of a twin: what was added is told log by log."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from pathlib import Path

from upright.errors import BadInput, NotIdentifiable
from upright.experiments.weighing_1a.chapter import loading_chapter
from upright.experiments.weighing_1a.run import drawn_twin, measure_body, truth
from upright.identification.loadings import Loaded, Loadings, fit_loadings, swings
from upright.physics.oscillators import added_inertia
from upright.records import Record
from upright.report.page import Chapter, Step
from upright.rig.makes import MASS_RADIUS, OSCILLATORS, check_radius
from upright.units import parse, same_dimension

_MASSES = re.compile(r"\s*(\d+)\s+at\s+(.+)")


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
        When logs and loadings do not match, or a column is not told.
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
            f'upright plan-inertias --rig {kind} --bare "{weighed.bare.value:.4g} {OSCILLATORS[kind].unit}"',
        ),
    ]
    told = loading_chapter(weighed, kind=kind, title="Stiffness and bare inertia from added loads", logs=records,
                           signals=signals, left_out=left_out, steps=steps)  # fmt: skip
    return weighed, told


def weigh(
    logs: Mapping[str, Record], added: Sequence[float], signals: Mapping[str, str], commands: Mapping[str, str], *,
    tolerance: float = 0.0, free: bool = False,
) -> tuple[Loadings, tuple[str, ...]]:  # fmt: skip
    """Stiffness and bare inertia of a rig from labelled logs, and why some of them did not count.

    Parameters
    ----------
    logs : mapping of str to Record
        By label.
    added : sequence of float
        Inertia that was on, log by log [kg or kg m^2].
    signals, commands : mapping of str to str
        Columns of position and command of each, the command's empty where there is none.
    tolerance, free
        See `weigh_logs`.

    Raises
    ------
    NotIdentifiable
        When too few swings can be seen.
    """
    found: list[Loaded] = []
    left_out: list[str] = []
    for (label, record), value in zip(logs.items(), added, strict=True):
        try:
            seen = swings(record, added=value, label=label, signal=signals[label], command=commands[label])
        except NotIdentifiable as error:
            left_out.append(str(error))
            continue
        found += [s for s in seen if not free or s.command == 0]
    if left_out and len({s.added for s in found}) < 2:
        raise NotIdentifiable(left_out[0])
    return fit_loadings(found, tolerance=tolerance), tuple(left_out)


def weigh_twin(kind: str, seed: int, folder: Path | None) -> tuple[Loadings, Chapter]:
    """The same of a twin that is stepped here; its logs go into the folder, where one is named."""
    if kind not in OSCILLATORS:
        raise BadInput(f"--twin is {' or '.join(OSCILLATORS)}, got '{kind}'.")
    done = measure_body(drawn_twin(seed, kind))
    column = next(iter(done.logs.values())).outputs[0]
    files = {} if folder is None else done.write_logs(folder)
    added = " ".join(f'--added "{done.added[label]:.6g} {OSCILLATORS[kind].unit}"' for label in files)
    steps = [Step("See which masses would have told most.", f"upright plan-inertias --rig {kind}")]
    if files:
        again = f"upright loadings {' '.join(files.values())} {added}"
        steps.insert(0, Step("Weigh the rig again from its logs in that folder, as you would your own.", again))
    told = loading_chapter(
        done.loadings, kind=kind, title=f"Experiment 1a on a twin, {kind}, seed {seed}", logs=done.logs,
        signals=dict.fromkeys(done.logs, column), left_out=done.left_out, truth=truth(done.on), steps=steps,
    )  # fmt: skip
    return done.loadings, told


def inertia_of(text: str) -> tuple[float, str]:
    """Added inertia [SI] and the kind of rig it belongs to; none for a plain zero.

    Raises
    ------
    BadInput
        When it is no inertia.
    """
    if masses := _MASSES.fullmatch(text):
        radius = check_radius(parse(masses[2], "m"))
        return added_inertia(int(masses[1]), radius, mass_radius=MASS_RADIUS), "torsional"
    if text.strip() in ("0", "none"):
        return 0.0, ""
    unit = text.lstrip("+-0123456789.eE ").strip()
    torsional = bool(unit) and same_dimension(unit, "kg m^2")
    value = parse(text, "kg m^2" if torsional else "kg")
    if value < 0:
        raise BadInput(f"--added needs what was put on, got '{text}'; take the heaviest rig's bare body as zero.")
    return value, "torsional" if torsional else "rectilinear"


def _column(record: Record, asked: str, known: tuple[str, ...], option: str) -> str:
    if asked:
        _ = record[asked]
        return asked
    if len(known) == 1:
        return known[0]
    raise BadInput(f"The log holds the columns {', '.join(record.names)}; say which one is meant with {option}.")
