"""Which log is this: what does it hold, what is wrong with it, which study fits it, which law closed its loop?"""

from __future__ import annotations

import json
import os
import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from upright.errors import BadInput
from upright.files import check_output, keeps_its_inputs, regular, replace_file
from upright.renamed import DRAWN, renamed
from upright.verbs.answer import Answer
from upright.verbs.command import command
from upright.verbs.pages import folder, folder_if_given, pdf_has_folder, write_page
from upright.verbs.values import open_log, pairs, texts

if TYPE_CHECKING:
    from upright.closed_loop import Recovery
    from upright.diagnosis import Diagnosis
    from upright.files import PathLike
    from upright.physics import Plant
    from upright.readers import Inspection
    from upright.records import Record
    from upright.report.page import Step
    from upright.rig import Rig
    from upright.study.sensors import Wiring
    from upright.verbs.forms import PlantLike
    from upright.verbs.values import Log


def read(file: Log, *, reader: str | None = None, time_unit: str | None = None) -> Record:
    """Record of a log as its program wrote it.

    Parameters
    ----------
    file : path, Record or pandas.DataFrame
        Whatever one of `upright.readers.READERS` reads, such as CSV, MATLAB or the log of a run (MCAP); recognised from
        the content.
    reader : str, optional
        Reader of the log, when it is not recognised.
    time_unit : str, optional
        Unit of a file's time column that states none, such as "ms"; seconds when omitted. Or the time between two rows
        of a log that has no such column, such as "20 ms".

    Returns
    -------
    Record
        Time [s] and columns in the log's own units.

    Raises
    ------
    BadInput
        When the log cannot be read, with the line and the column of the trouble.
    """
    return open_log(file, reader, time_unit)[0]


@renamed(DRAWN)
@keeps_its_inputs
def show(log: Log, *, out: PathLike | None = None, time_unit: str | None = None) -> Answer[Inspection]:
    """What a log holds: columns, sample rate, resolution, gaps, mislabelled columns.

    Parameters
    ----------
    log : path, Record or pandas.DataFrame
    out : path, optional
        Folder for the picture show-LOG.svg, or the picture's own name (SVG, PNG); the answer's ``plot()`` draws it
        without a file.
    time_unit : str, optional
        Unit of a file's time column that states none, such as "ms"; or the time between two rows, such as "20 ms".

    Returns
    -------
    Answer
        Of an `Inspection`.

    Raises
    ------
    BadInput
        When the log cannot be read.
    """
    from upright.readers import inspect
    from upright.report.log import chapter, draw_columns
    from upright.report.page import Step
    from upright.report.symbols import typed

    record, path = open_log(log, time_unit=time_unit)
    inspection = inspect(record)
    files: list[Path] = []
    if out is not None:
        from upright.report.drawing import save

        at = Path(out)
        files.append(at if at.suffix in (".svg", ".png") else picture_path(path, folder(at)))
        save(draw_columns(record, inspection), files[-1])
    clock = f" --time-unit {typed(time_unit)}" if time_unit else ""
    onward = Step(
        "Write a study file, filled in with what was recognised.", f"upright init {typed(path)}{clock} -o study.toml"
    )
    numbers = asdict(inspection) | {"figure": str(files[0]) if files else ""}
    return Answer(inspection, replace(chapter(record, inspection), steps=(onward,), numbers=numbers), files)


@command("Log", name="show", metavars={"time_unit": "UNIT"}, more="upright show swing.csv")
def show_logs(
    logs: Sequence[PathLike],
    *,
    out: PathLike = ".",
    plot: bool = True,
    time_unit: str | None = None,
) -> Iterator[Answer[Inspection]]:
    """Print and draw what a log holds: columns, sample rate, resolution, gaps, mislabelled columns.

    Readable are ECP exports, text with or without names (tables, serial plotters and monitors, JSON lines), MATLAB
    version 5, arrays of NumPy, CSV exports of ROS bags and upright's own logs of runs (MCAP); the format is recognised
    from the content.

    Parameters
    ----------
    logs : sequence of paths
        Logs as their programs wrote them.
    out : path
        Folder for all files.
    plot : bool
        Draw the columns to show-LOG.svg.
    time_unit : str
        Unit of a time column that states none, such as ms; or the time between two rows, such as "20 ms".

    Yields
    ------
    Answer
        Of `show`, log by log; the last says what to do next.
    """
    at, figures = folder(out), list[Path]()
    steps: tuple[Step, ...] = ()
    for k, log in enumerate(logs, start=1):
        inspection = show(log, out=picture_path(Path(log), at, figures) if plot else None, time_unit=time_unit)
        figures += inspection.files
        steps = steps or inspection.chapter.steps
        yield Answer(
            inspection.value, replace(inspection.chapter, steps=steps if k == len(logs) else ()), inspection.files
        )


def picture_path(log: Path, out: Path, used: Sequence[Path] = ()) -> Path:
    """Where the columns of a log are drawn, beside the pictures of other logs that may be called the same."""
    stem = f"show-{_stem(log)}"
    path, n = out / f"{stem}.svg", 2
    while path in used:
        path, n = out / f"{stem}-{n}.svg", n + 1
    return path


def _stem(log: Path) -> str:
    return re.sub(r"[^\w.-]+", "_", log.stem)


@command(
    "Log",
    names={"html": "-o --html"},
    metavars={"rig": "RIG", "html": "FILE"},
    helps={"rig": "Plant (furuta, torsional-2, ...), rig model, study or RIG.toml, or fit.json."},
    prepare=lambda typed: typed if typed["html"] or not typed["pdf"] else {**typed, "html": _page_of(typed["log"])},
    wrong=lambda answer: bool(answer.value.wrong),
    more="""
        upright doctor run.csv
        upright doctor run.csv --rig furuta
        upright doctor run.csv --rig study.toml -o run-doctor.html

    A plant's name tells signs; a study with known inertias, or the fit.json of
    `upright identify`, tells scales too.
    Exit code: 0 nothing looks wrong, 3 something does, 2 the log or the rig
    cannot be read.
    """,
)
@keeps_its_inputs
def doctor(
    log: Log, *, rig: PlantLike | None = None, html: PathLike | None = None, pdf: bool = False,
    reader: str | None = None,
) -> Answer[Diagnosis]:  # fmt: skip
    """Say in plain sentences what looks wrong with a log, with the evidence and what to do.

    Looks for dead, frozen, wrapping and spiking sensors, lost counts, gaps, jitter, doubled rows, resets of the clock,
    efforts that are none or at their limit, motion before the command, creeping bodies; knowing the rig, also for
    signs, scales and silent trips.

    Parameters
    ----------
    log : path, Record or pandas.DataFrame
        Log as its program wrote it.
    rig : str, path, fit, rig or plant, optional
        Name of the plant or rig model, study or RIG.toml, or fit.json of the rig, or what `identify` answered; with it
        signs, and with known inertias scales, are examined too.
    html : path, optional
        Page to write, with a picture of every finding.
    pdf : bool
        Write the page as PDF beside it.
    reader : str, optional
        Reader of the log, when it is not recognised.

    Returns
    -------
    Answer
        Of a `Diagnosis`; something is wrong when its `wrong` is not empty.

    Raises
    ------
    BadInput
        When the log or the rig cannot be read.
    """
    from upright.diagnosis import Finding, examine
    from upright.diagnosis.chapter import chapter
    from upright.verbs.handover import called

    pdf_has_folder(html, pdf)
    path = _file(log)
    page = None if html is None else Path(html)
    if page is not None and page.is_dir():
        raise BadInput(f"--html needs a file, and {page} is a folder; name one in it, such as {page / 'doctor.html'}")
    mended: tuple[Finding, ...] = ()
    known, wiring = _known(rig, str(path or ""))
    if path is not None:
        from upright.diagnosis.clock import read_mended

        record, mended = read_mended(path, reader=reader or "")
    else:
        record, path = open_log(log)
    diagnosis = examine(record, known, wiring, before=mended)
    written = chapter(
        diagnosis,
        log=path,
        rig="" if rig is None else rig if isinstance(rig, str) else called(rig),
        page=page is not None,
    )
    written = replace(written, numbers=_plain_diagnosis(diagnosis, page))
    return Answer(diagnosis, written, [] if page is None else write_page(written, page, pdf))


def _page_of(log: Path) -> Path:
    """Where a command writes the page of a log that it is asked to print."""
    return Path(f"{log.stem}-doctor.html")


def _known(rig: Any, log: str) -> tuple[Rig | type[Plant] | None, Wiring | None]:
    """The rig by a name or a file, which may say how it is wired, or as an object with its numbers.

    Of a rig model its plant, of a RIG.toml what describes it.
    """
    from upright.diagnosis.case import Wiring, read_known
    from upright.physics import Plant
    from upright.rig.makes import MAKES
    from upright.rigs.rigfile import read_rig_file
    from upright.study.text import StudyText
    from upright.verbs.handover import rig_of

    if rig is None:
        return None, None
    if isinstance(rig, str | os.PathLike):
        text = str(rig)
        if text.endswith(".toml") and "kind" in StudyText(Path(text)).root():
            described = read_rig_file(Path(text))
            text = described.make or "" if described.known is None else str(described.known)
        if text in MAKES:
            return type(MAKES[text].rig.plant), Wiring()
        return read_known(text, log) if text else (None, None)
    if isinstance(rig, type) and issubclass(rig, Plant):
        return rig, None
    return rig_of(rig, "doctor", draws=0), None


def _file(log: Log) -> Path | None:
    """File of a log, None for one in memory."""
    if not isinstance(log, str | os.PathLike):
        return None
    path = Path(log)
    if not path.exists():
        from upright.readers.source import neighbour

        raise BadInput(f"There is no file '{path}';{neighbour(path)}")
    regular(path)
    return path


def _plain_diagnosis(diagnosis: Diagnosis, html: Path | None) -> dict[str, Any]:
    """A diagnosis as plain dicts, lists, text and numbers; pictures stay in the page."""
    names = ("kind", "columns", "severity", "sentence", "evidence", "advice", "key")
    return {
        "file": diagnosis.file,
        "rig": diagnosis.rig,
        "rigs": list(diagnosis.rigs),
        "samples": diagnosis.samples,
        "duration": diagnosis.duration,
        "wrong": bool(diagnosis.wrong),
        "findings": [{name: getattr(f, name) for name in names} for f in diagnosis.findings],
        "checked": list(diagnosis.checked),
        "unchecked": dict(diagnosis.unchecked),
        "page": str(html) if html is not None else "",
    }


@command(
    "Log",
    metavars={"out": "STUDY.toml", "plant": "NAME", "time_unit": "UNIT", "scale": "COLUMN=SCALE"},
    helps={
        "out": "Study to write, or a folder for LOG.toml.",
        "plant": "Plant, when the columns do not tell: pendulum, furuta, torsional-2, ...",
        "scale": 'What one unit of a sensor\'s voltage stands for, as in CH2="30 deg/V".',
    },
    defaults={"out": "."},
    more="""
        upright show swing.csv
        upright init swing.csv -o swing.toml
        upright identify swing.toml -o swing-fit

    Lines marked MEASURE hold placeholders: weigh, measure, or look them up.
    """,
)
@keeps_its_inputs
def init(
    log: Log, *, out: PathLike | None = None, plant: str | None = None, reader: str | None = None,
    time_unit: str | None = None, scale: Mapping[str, str] | Sequence[str] | str | None = None,
    force: bool = False,
) -> Answer[str]:  # fmt: skip
    """Write a commented study file from a log, filled in with what could be recognised; or from a MuJoCo model (.xml).

    It guesses the plant, which columns measure and which one drives, units, encoder counts, rest levels, the sign of
    the drive, the window in which something happens, and where to start each parameter. For a pendulum let go from some
    angle nothing has to be added.

    Parameters
    ----------
    log : path, Record or pandas.DataFrame
        Log of a rig: CSV, MATLAB, ECP export, ROS bag as CSV; or its MJCF, ending in .xml.
    out : path, optional
        Study to write, or a folder for LOG.toml; the draft is only answered when omitted. A log that is no file is
        written beside the study, as CSV, for the study to name.
    plant : str, optional
        Plant, when the columns do not tell.
    reader : str, optional
        Reader of the log, when it is not recognised.
    time_unit : str, optional
        Unit of a file's time column that states none, such as "ms"; or the time between two rows, such as "20 ms".
    scale : mapping of str to str, optional
        By column: what one unit of a sensor's voltage, or of any other reading, stands for, as in "30 deg/V"; or texts
        COLUMN=SCALE.
    force : bool
        Replace a study that exists.

    Returns
    -------
    Answer
        Of the study's text; lines marked MEASURE hold placeholders.

    Raises
    ------
    BadInput
        When the log cannot be read, the study exists, or there is no such plant.
    """
    from upright.report.page import Chapter, Part, Points, Step
    from upright.report.symbols import typed

    path = _file(log)
    if path is not None and path.suffix.lower() == ".xml":
        return _init_from_mjcf(path, out, force)
    record = None
    if path is None:
        record, path = open_log(log)
    study = Path(f"{path.stem}.toml") if out is None else Path(out)
    if study.is_dir():
        study = study / f"{path.stem}.toml"
    beside = None if record is None or out is None else study.with_suffix(".csv")
    for file in (study, beside) if out is not None else ():
        if file is not None and record is None:
            check_output(file, path)
        if file is not None and file.exists() and not force:
            raise BadInput(f"{file} exists already; name another file with -o, or replace it with --force")
    from upright.physics import find
    from upright.readers import inspect
    from upright.study.draft.draft import draft

    if plant:
        find(plant)
    if record is None:
        record, _ = open_log(path, reader, time_unit)
    text = draft(record, inspect(record), beside or path, study, plant=plant or "", scales=pairs(scale, "--scale"))
    for key, value in (("reader", reader), ("time_unit", time_unit)):
        if value:
            text = text.replace("[defaults]\n", f'[defaults]\n{key} = "{value}"\n')
    files: list[Path] = []
    if out is not None:
        files.append(replace_file(study, text.encode()))
    if beside is not None:
        record.to_csv(beside)
        files.append(beside)
    marks = ("# Fits ", "# GUESSED")
    guessed = [line.removeprefix("# ") for line in text.splitlines() if line.startswith(marks)]
    marked = (
        line.removeprefix("# ").split(" =")[0] for line in text.splitlines() if "MEASURE" in line and " = " in line
    )
    measure = list(dict.fromkeys(marked))
    if measure:
        guessed.append(f"Placeholders to replace by what you measured: {', '.join(measure)}")
    onward = Step(
        "Read it, then fit it.",
        f"upright identify {typed(study)} -o {typed(study.with_name(f'{study.stem}-fit'))}",
    )
    parts = (Part("Recognised", (Points(tuple(guessed)),)),) if guessed else ()
    numbers = {"study": text}
    return Answer(
        text, Chapter(title=f"Draft of {study.name}", verdict="", parts=parts, steps=(onward,), numbers=numbers), files
    )


def _init_from_mjcf(path: Path, out: PathLike | None, force: bool) -> Answer[str]:
    """Study of the rig that an MJCF file describes."""
    from upright.report.page import Chapter, Part, Points, Step
    from upright.report.symbols import typed
    from upright.rig.mjcf import read_mjcf
    from upright.study.mjcf import study_of_mjcf

    study = Path(f"{path.stem}.toml") if out is None else Path(out)
    study = study / f"{path.stem}.toml" if study.is_dir() else study
    if out is not None and study.exists() and not force:
        raise BadInput(f"{study} exists already; name another file with -o, or replace it with --force")
    read = read_mjcf(path)
    text = study_of_mjcf(read, path.name)
    files = [] if out is None else [replace_file(study, text.encode())]
    limit = "" if "limit" in read.rig.hardware.entries else " --limit 10"
    see = f'upright play {typed(study)}{limit} --period "2 ms" --counts 4096'
    page = Chapter(
        title=f"Rig of {path.name}", verdict="", numbers={"study": text},
        parts=(Part("Recognised", (Points((read.coordinates, *read.left_out)),)),),
        steps=(Step("See it move, with your servo period and encoders.", f"{see} -o play.html"),),
    )  # fmt: skip
    return Answer(text, page, files)


@command(
    "Log",
    metavars=dict.fromkeys(("measured", "reference", "feedforward"), "COLUMN") | {"every": "N"},
    ranges={"every": (1, None)},
    defaults={"out": "."},
    more="upright law run.csv --command u --measured theta --reference target",
)
@keeps_its_inputs
def law(
    log: Log, *, command: str | None = None, measured: Sequence[str] | str | None = None,
    reference: Sequence[str] | str | None = None, feedforward: Sequence[str] | str | None = None,
    every: int | None = None, out: PathLike | None = None, pdf: bool = False,
) -> Answer[Recovery]:  # fmt: skip
    """Recover the control law from a closed-loop log: structure, gains, limit, and what it leaves unexplained.

    P, PI, PD and PID are tried on error and measurement, with plain, two-tap and low-passed differences; the simplest
    that predicts rows held out wins.

    Parameters
    ----------
    log : path, Record or pandas.DataFrame
        Log as its program wrote it.
    command : str
        Column that the law put out.
    measured : str or sequence of str
        Column that it read; once for each.
    reference : str or sequence of str, optional
        What a measured column followed, in the same order.
    feedforward : str or sequence of str, optional
        Column that was added to the law's output.
    every : int, optional
        Samples of the servo per row, when it is known.
    out : path, optional
        Folder for law-LOG.json, its picture and its page.
    pdf : bool
        Write the page as PDF too.

    Returns
    -------
    Answer
        Of a `Recovery`.

    Raises
    ------
    BadInput
        When the log cannot be read, columns are missing, or the log is too short.
    """
    from upright.closed_loop import recover_law
    from upright.closed_loop.recovery import as_json
    from upright.report.law import chapter, draw_law
    from upright.report.symbols import typed

    at = folder_if_given(out, pdf)
    if every is not None and every < 1:
        raise BadInput(f"--every needs a whole number of at least 1, got {every}.")
    record, path = open_log(log)
    if not command or not texts(measured):
        raise BadInput(
            f"{path.name} holds the columns {', '.join(record.names)}; say which one the law put out (--command) and"
            " which it read (--measured, and --reference if it followed one)."
        )
    recovery = recover_law(
        record, measured=texts(measured), references=texts(reference), command=command,
        feedforward=texts(feedforward), every=every,
    )  # fmt: skip
    plain = as_json(recovery)
    page = replace(chapter(record, recovery, typed(path.name)), numbers=json.loads(plain))
    files: list[Path] = []
    if at is not None:
        from upright.report.drawing import save

        files = [at / f"law-{_stem(path)}.{ending}" for ending in ("json", "svg")]
        replace_file(files[0], f"{plain}\n".encode())
        save(draw_law(record, recovery), files[1])
        files += write_page(page, at / f"law-{_stem(path)}.html", pdf)
    return Answer(recovery, page, files)
