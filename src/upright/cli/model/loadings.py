"""How stiff, how heavy? Step responses with known added masses or inertias."""

from __future__ import annotations

import re
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from upright.cli.terminal import AsJson, Out, Pdf, tell, write_page
from upright.errors import BadInput, NotIdentifiable

if TYPE_CHECKING:
    from upright.identification.loadings import Loaded
    from upright.records import Record
    from upright.report.page import Chapter

_MASSES = re.compile(r"\s*(\d+)\s+at\s+(.+)")


def loadings(
    logs: Annotated[
        list[Path] | None, typer.Argument(metavar="LOG...", help="One log of steps for each loading; repeats welcome.")
    ] = None,
    added: Annotated[
        list[str] | None,
        typer.Option(
            metavar="INERTIA",
            help="What was added, log by log: '1.5 kg', '4e-3 kg m^2', or '2 at 6.5 cm' (500 g each).",
        ),
    ] = None,
    signal: Annotated[str, typer.Option(metavar="COLUMN", help="Column of the position, in any unit.")] = "",
    command: Annotated[str, typer.Option(metavar="COLUMN", help="Column of the command that steps.")] = "",
    tolerance: Annotated[str, typer.Option(help="Standard uncertainty of one added piece.")] = "0 %",
    free: Annotated[
        bool, typer.Option("--free", help="Count swings at zero command only, with the drive silent.")
    ] = False,
    twin: Annotated[str, typer.Option(metavar="KIND", help="No logs: step a twin, rectilinear or torsional.")] = "",
    seed: Annotated[int, typer.Option(min=0, help="Which twin of the make; 0 is the one as designed.")] = 0,
    out: Out = Path("loadings"),
    pdf: Pdf = False,
    as_json: AsJson = False,
) -> None:
    r"""Find stiffness and bare inertia from step responses with known added masses (experiment 1a).

    Each swing gives a damped period, and its extremes viscous and dry friction; 1/omega_n^2 over the added inertia is
    a line whose slope is 1/k.

    \b
    upright loadings --twin rectilinear -o out
    upright loadings bare.csv one.csv two.csv --added "0 kg" --added "0.5 kg" --added "1 kg" --signal x --command u
    """
    if twin:
        if logs or added:
            raise BadInput("--twin steps a simulated rig and takes no logs; leave out either.")
        told = _of_twin(twin, seed, out)
    else:
        told = _of_logs(logs or [], added or [], signal, command, tolerance, free)
    written = write_page(told, out / "report.html", pdf)
    tell(told, written, {**told.numbers, "report": str(written[0])} if as_json else None)


def _of_logs(logs: list[Path], added: list[str], signal: str, command: str, tolerance: str, free: bool) -> Chapter:
    if not logs or len(added) != len(logs):
        raise BadInput(
            f"Every log needs its --added, in the same order: {len(logs)} logs came with {len(added)};"
            ' write --added "0 kg" for the bare one, or try --twin rectilinear.'
        )
    from upright.experiments.makes import OSCILLATORS
    from upright.experiments.weighing_1a.chapter import loading_chapter
    from upright.identification.loadings import fit_loadings, swings
    from upright.readers import read
    from upright.report.page import Step
    from upright.units import parse

    values = [inertia(text) for text in added]
    kinds = {kind for _, kind in values if kind}
    if len(kinds) > 1:
        raise BadInput("Masses in kg and inertias in kg m^2 cannot be mixed; carts take masses, disks inertias.")
    kind = kinds.pop() if kinds else "rectilinear"
    records: dict[str, Record] = {}
    signals: dict[str, str] = {}
    found: list[Loaded] = []
    left_out: list[str] = []
    for log, (value, _) in zip(logs, values, strict=True):
        record = read(log)
        label = log.name if log.name not in records else f"{log.name} ({len(records) + 1})"
        column = _column(record, signal, record.outputs, "--signal")
        drive = _column(record, command, record.inputs, "--command") if command or record.inputs else ""
        records[label], signals[label] = record, column
        try:
            seen = swings(record, added=value, label=label, signal=column, command=drive)
        except NotIdentifiable as error:
            left_out.append(str(error))
            continue
        found += [s for s in seen if not free or s.command == 0]
    if left_out and len({s.added for s in found}) < 2:
        raise NotIdentifiable(left_out[0])
    weighed = fit_loadings(found, tolerance=parse(tolerance, "1"))
    steps = [
        Step(
            "Fit the same logs with the equations of motion; give m_1 and k_1 these values as guesses.",
            f"upright init {logs[0].name} -o study.toml",
        ),
        Step(
            "Plan the next loadings with the error of a frequency that these swings show.",
            f'upright plan-inertias --rig {kind} --bare "{weighed.bare.value:.4g} {OSCILLATORS[kind].unit}"',
        ),
    ]
    return loading_chapter(weighed, kind=kind, title="Stiffness and bare inertia from added loads", logs=records,
                           signals=signals, left_out=left_out, steps=steps)  # fmt: skip


def _of_twin(kind: str, seed: int, out: Path) -> Chapter:
    from upright.experiments.makes import OSCILLATORS
    from upright.experiments.weighing_1a.chapter import loading_chapter
    from upright.experiments.weighing_1a.run import drawn_twin, measure_body, truth
    from upright.report.page import Step

    if kind not in OSCILLATORS:
        raise BadInput(f"--twin is {' or '.join(OSCILLATORS)}, got '{kind}'.")
    done = measure_body(drawn_twin(seed, kind))
    column = next(iter(done.logs.values())).outputs[0]
    files = done.write_logs(out)
    added = " ".join(f'--added "{done.added[label]:.6g} {OSCILLATORS[kind].unit}"' for label in files)
    steps = [
        Step(
            "Weigh the rig again from its logs in that folder, as you would your own.",
            f"upright loadings {' '.join(files.values())} {added}",
        ),
        Step("See which masses would have told most.", f"upright plan-inertias --rig {kind}"),
    ]
    return loading_chapter(
        done.loadings, kind=kind, title=f"Experiment 1a on a twin, {kind}, seed {seed}", logs=done.logs,
        signals=dict.fromkeys(done.logs, column), left_out=done.left_out, truth=truth(done.on), steps=steps,
    )  # fmt: skip


def inertia(text: str) -> tuple[float, str]:
    """Added inertia [SI] and the kind of rig it belongs to; none for a plain zero."""
    from upright.experiments.makes import MASS_RADIUS
    from upright.physics.oscillators import added_inertia
    from upright.units import parse, same_dimension

    if masses := _MASSES.fullmatch(text):
        return added_inertia(int(masses[1]), parse(masses[2], "m"), mass_radius=MASS_RADIUS), "torsional"
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
