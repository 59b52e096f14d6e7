"""What happened in this run? Logs that `upright` writes beside a loop: looked at, mended, handed on, replayed."""

from __future__ import annotations

import os
import threading
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any

from upright.errors import BadInput
from upright.files import PathLike, check_output, keeps_its_inputs
from upright.renamed import DRAWN, renamed
from upright.verbs.answer import Answer
from upright.verbs.command import Flag, command
from upright.verbs.pages import folder
from upright.verbs.values import path_of

if TYPE_CHECKING:
    from upright.logs import RunLog
    from upright.logs.replay import Replay
    from upright.logs.salvage import Salvaged
    from upright.logs.tail import Fresh
    from upright.records import Record

_CONVERTED = (".csv", ".parquet", ".mat")


def _written_as(ending: str) -> Callable[[dict[str, Any]], dict[str, Any]]:
    """What was typed, with a file that is named after the log where no other is."""
    return lambda typed: {**typed, "out": typed["out"] or Path(Path(typed["log"]).stem + ending)}


@command(
    name="log show",
    defaults={"out": "."},
    flags={"plot": Flag(help="Draw the columns to show-LOG.svg.")},
    prepare=lambda typed: {**typed, "out": typed["out"] if typed["plot"] else None},
    more="upright log show run.mcap --plot",
)
@renamed(DRAWN)
@keeps_its_inputs
def log_show(log: PathLike, *, out: PathLike | None = None) -> Answer[RunLog]:
    """Print what a run's log holds: rig, law, duration, rate, modes, faults, events, missing rows.

    Parameters
    ----------
    log : path
        Log of a run (MCAP), whole, torn, or still being written.
    out : path, optional
        Folder for the picture show-LOG.svg; the answer's ``plot()`` draws it without a file.

    Returns
    -------
    Answer
        Of a `RunLog`: header, columns, events, what is missing.

    Raises
    ------
    BadInput
        When nothing of it can be read.
    """
    from upright.logs import read_log
    from upright.report.run import chapter, draw_run
    from upright.verbs.log import picture_path

    log = path_of(log, "the log of a run")
    run = read_log(log)
    files: list[Path] = []
    if out is not None and len(run) > 1:
        from upright.report.drawing import save

        files.append(picture_path(Path(log), folder(out)))
        save(draw_run(run), files[-1])
    return Answer(run, chapter(run), files)


def _rows_as_text(chunks: Iterator[Fresh]) -> Iterator[str]:
    """Events and the last row of every chunk, with the units of its columns."""
    rows = 0
    for fresh in chunks:
        yield from (f"{event.t:10.3f} s  {event.kind}: {event.text}" for event in fresh.events)
        if new := fresh.columns["t"].size:
            rows += new
            last = {name: column[-1].item() for name, column in fresh.columns.items()}
            shown = [c for c in fresh.header.columns if c.unit not in ("s", "1", "counts")]
            values = "  ".join(f"{c.name} {last[c.name]:.5g} {c.unit}" for c in shown)
            mode = fresh.header.modes.get(last["mode"], f"mode {last['mode']}")
            state = " ".join((mode, *fresh.header.fault_names(last["faults"])))
            yield f"{last['t']:10.3f} s  {values}  {state}  ({rows} rows)"


@command(
    name="log tail",
    metavars={"patience": "SECONDS"},
    ranges={"patience": (0.0, None)},
    lines=_rows_as_text,
    more="upright log tail run.mcap",
)
def log_tail(log: PathLike, *, patience: float = 0.0) -> Iterator[Fresh]:
    """Follow a log while it is written: the last row of every chunk, and every event.

    Begins with the first chunk, and ends when the run ends its log, or with Ctrl-C.

    Parameters
    ----------
    log : path
        Log of a run (MCAP) that may still be being written.
    patience : float
        End when nothing has come for so long [s]; 0 to wait for ever.

    Returns
    -------
    iterator
        Of header, columns and events of one chunk after the other; a chunk has at most 100 rows.

    Raises
    ------
    BadInput
        When it is no log of a run, or is damaged.
    """
    from upright.logs import follow

    log = path_of(log, "the log of a run")
    if not Path(log).exists():
        raise BadInput(f"There is no file '{log}'; check the path, or start the run first.")
    clock, last = threading.Event(), time.monotonic()

    def wait() -> bool:
        clock.wait(0.05)
        return not 0 < patience < time.monotonic() - last

    for fresh in follow(log, wait):
        yield fresh
        last = time.monotonic()


@command(
    name="log recover",
    metavars={"out": "FILE"},
    helps={"out": "File to write; LOG-recovered.mcap here when omitted."},
    prepare=_written_as("-recovered.mcap"),
    more="upright log recover run.mcap -o whole.mcap",
)
@keeps_its_inputs
def log_recover(log: PathLike, *, out: PathLike | None = None) -> Answer[Salvaged]:
    """Save the rows of a damaged log, up to its first error, as a valid file.

    Every row that is kept was checked; the counts of kept and lost rows are reported. The log itself stays as it is.

    Parameters
    ----------
    log : path
        Log of a run (MCAP), torn or damaged.
    out : path, optional
        File to write; the rows are only in the answer when omitted.

    Returns
    -------
    Answer
        Of what was kept and what was not; `log` is what was kept.

    Raises
    ------
    BadInput
        When nothing of it can be read, or `out` may not be written.
    """
    from upright.logs import recover
    from upright.report.run import recovered_chapter

    log = path_of(log, "the log of a run")
    salvaged = recover(log, out)
    return Answer(salvaged, recovered_chapter(salvaged), [] if salvaged.file is None else [salvaged.file])


@command(
    name="log convert",
    metavars={"out": "FILE"},
    helps={"out": "File to write; its ending says the format: .csv, .parquet or .mat. LOG.csv here when omitted."},
    prepare=_written_as(".csv"),
    more="upright log convert run.mcap -o run.parquet",
)
@keeps_its_inputs
def log_convert(log: PathLike, *, out: PathLike | None = None) -> Answer[Record]:
    """Write a run's log as CSV, Parquet or MATLAB file.

    Units and provenance go with it.

    Parameters
    ----------
    log : path
        Log of a run (MCAP).
    out : path, optional
        File to write; its ending says the format: .csv, .parquet or .mat. The record is only answered when omitted.

    Returns
    -------
    Answer
        Of a `Record`.

    Raises
    ------
    BadInput
        When the log has fewer than two rows, or there is no such format.
    """
    from upright.logs import read_log
    from upright.report.page import Chapter, Part, Points

    log = path_of(log, "the log of a run")
    at = None if out is None else Path(out)
    if at is not None:
        if at.suffix not in _CONVERTED:
            raise BadInput(f"a log is converted to a file ending in {', '.join(_CONVERTED)}, got '{os.fspath(at)}'.")
        check_output(at, log)
    record = read_log(log).record(counts=True)
    if at is not None:
        {".csv": record.to_csv, ".parquet": record.to_parquet, ".mat": record.to_mat}[at.suffix](at)
    notes = (Part("Notes", (Points(record.provenance.notes),)),) if record.provenance.notes else ()
    page = Chapter(
        title=Path(log).name if at is None else f"{Path(log).name} as {at.name}",
        verdict=f"{len(record)} rows of {len(record.names) + 1} columns.",
        parts=notes,
        numbers={"rows": len(record), "columns": ["t", *record.names], "file": at and str(at)},
    )  # fmt: skip
    return Answer(record, page, [] if at is None else [at])


@command(
    name="log replay",
    wrong=lambda again: not again.value.identical,
    more="""
    upright log replay run.mcap

    Exit code: 0 every command is the logged one, 3 one differs, 2 the log cannot
    be replayed.
    """,
)
def log_replay(log: PathLike) -> Answer[Replay]:
    """Replay the logged law on the logged measurements, and compare its commands bit by bit.

    The same to the last bit.

    Parameters
    ----------
    log : path
        Log of a run (MCAP).

    Returns
    -------
    Answer
        Of a `Replay`; `identical` says it, `first` names the first difference.

    Raises
    ------
    BadInput
        When the log has no law, or no row in which it gave the command.
    """
    from upright.logs import read_log
    from upright.logs.replay import replay
    from upright.report.run import replayed

    log = path_of(log, "the log of a run")
    run = read_log(log)
    again = replay(run)
    return Answer(again, replayed(run, again))
