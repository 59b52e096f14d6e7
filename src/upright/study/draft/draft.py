"""Draft of a study for one log: a commented TOML file with what could be recognised filled in."""

from __future__ import annotations

import os
from pathlib import Path

from upright.readers.inspection import Inspection
from upright.records import Record
from upright.study.clock import check_clock
from upright.study.draft.chain import chain_tables
from upright.study.draft.chain_log import read_chain
from upright.study.draft.described import describe
from upright.study.draft.pendulum import pendulum_tables
from upright.study.draft.recognise import recognise
from upright.study.draft.suits import plants_that_suit
from upright.study.text import TomlTable, study_text

CHAINS = ("rectilinear", "torsional")


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
    if found.plant.startswith(CHAINS):
        where = "/".join(log.resolve().parts[-3:])
        chain = read_chain(record, seen, found, named=bool(plant), path=where)
        found, tables = chain_tables(record, chain, file, log.stem)
    else:
        found, tables = pendulum_tables(record, seen, found, file, log.stem)
    describe(tables, record, seen, found)
    if not plant:
        rig = next(t for t in tables if t.lines and t.lines[0].startswith("[rig]"))
        rig.key("guessed", True, "nobody named the plant: take this out once you know it is this one")
    doubts = list(found.doubts)
    told = bool(plant) or (found.plant.startswith(CHAINS) and len(found.columns) > 1)  # carts from disks, and why
    others = [name for name in plants_that_suit(record, seen) if name != found.plant and name not in " ".join(doubts)]
    if others and not told:
        doubts.append(f"Taken for {found.plant}; the columns could be of {' or '.join(others)}: --plant says which.")
    head = TomlTable()
    head.line(f"# Study of {log.name}, drafted by `upright init`. Check it, then: upright identify THIS_FILE -o OUT")
    head.line("# A number in quotes wears its unit; { guess = ... } asks for it; a plain text or number is known.")
    head.line("# Lines marked MEASURE hold placeholders. All keys: `upright identify --keys`.")
    for doubt in doubts:
        head.line(f"# GUESSED: {doubt}")
    head.key("title", log.stem)
    return study_text([head, *tables])
