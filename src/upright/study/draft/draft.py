"""Draft of a study for one log: a commented TOML file with what could be recognised filled in."""

from __future__ import annotations

import os
from pathlib import Path

from upright.readers.inspection import Inspection
from upright.records import Record
from upright.study.clock import check_clock
from upright.study.draft.chain import chain_tables
from upright.study.draft.chain_log import read_chain
from upright.study.draft.pendulum import pendulum_tables
from upright.study.draft.recognise import recognise
from upright.study.text import TomlTable, study_text


def draft(record: Record, seen: Inspection, log: Path, study: Path, *, plant: str = "") -> str:
    """Text of a study of one log.

    Parameters
    ----------
    record, seen : Record, Inspection
        The log.
    log, study : Path
        Its file, and where the study will be written: the file is named relative to that.
    plant : str, optional
        Overrides the plant that the columns suggest.

    Raises
    ------
    BadInput
        When nothing moves, or the clock cannot be in seconds.
    """
    check_clock(record)
    found = recognise(record, seen, plant)
    file = os.path.relpath(log.resolve(), study.resolve().parent).replace(os.sep, "/")
    if found.plant.startswith(("rectilinear", "torsional")):
        where = "/".join(log.resolve().parts[-3:])
        chain = read_chain(record, seen, found, named=bool(plant), path=where)
        found, tables = chain.recognised, chain_tables(record, chain, file, log.stem)
    else:
        found, tables = pendulum_tables(record, seen, found, file, log.stem)
    head = TomlTable()
    head.line(f"# Study of {log.name}, drafted by `upright init`. Check it, then: upright identify THIS_FILE -o OUT")
    head.line("# A number in quotes wears its unit; { guess = ... } asks for it; a plain text or number is known.")
    head.line("# Lines marked MEASURE hold placeholders. All keys: `upright identify --keys`.")
    for doubt in found.doubts:
        head.line(f"# GUESSED: {doubt}")
    head.key("title", log.stem)
    return study_text([head, *tables])
