"""Draft of a study for one log: a commented TOML file with what could be recognised filled in."""

from __future__ import annotations

import os
import tomllib
from collections.abc import Mapping, Sequence
from contextlib import suppress
from pathlib import Path
from types import MappingProxyType

import numpy as np

from upright.errors import BadInput
from upright.physics import find
from upright.readers import inspect
from upright.readers.inspection import Inspection
from upright.records import Record
from upright.records.analogue import in_places
from upright.study.clock import check_clock
from upright.study.draft.chain import chain_tables
from upright.study.draft.chain_log import read_chain
from upright.study.draft.compare import BY_FAR, CLEAR, DOUBTFUL, LITTLE, LONGEST, explained
from upright.study.draft.derived import derived_angle
from upright.study.draft.described import describe
from upright.study.draft.pendulum import pendulum_tables
from upright.study.draft.recognise import Recognised, named_after, position_columns, recognise
from upright.study.draft.suits import COUNTED, plants_that_suit
from upright.study.draft.tables import as_logged
from upright.study.text import TomlTable, study_text
from upright.study.windows import window_sentence

NONE: Mapping[str, str] = MappingProxyType({})
CHAINS = ("rectilinear", "torsional")


def draft(
    record: Record, inspection: Inspection, log: Path, study: Path, *, plant: str = "",
    scales: Mapping[str, str] = NONE,
) -> str:  # fmt: skip
    """Text of a study of one log.

    Parameters
    ----------
    record, seen : Record, Inspection
        The log.
    log, study : Path
        Its file, and where the study will be written: the file is named relative to that.
    plant : str, optional
        Overrides the plant that the columns suggest.
    scales : mapping of str to str, optional
        By column: the angle or length that one unit of it stands for, as in "30 deg/V".

    Raises
    ------
    BadInput
        When nothing moves, or the clock cannot be in seconds.
    """
    check_clock(record)
    logged = record
    if scales:
        record = in_places(record, scales)
        inspection = inspect(record)
    derived = None if scales else derived_angle(record, inspection, places=bool(position_columns(record, inspection)))
    if derived is not None:
        record = derived.in_place(record)
        inspection = inspect(record)
    recognised, tables = _drafted(record, inspection, log, study, plant)
    doubts = recognised.doubts
    if not plant:
        better, sentences = alike(record, inspection, recognised)
        if better:
            recognised, tables = _drafted(record, inspection, log, study, better)
        doubts = (*recognised.doubts, *sentences)
        rig = next(t for t in tables if t.lines and t.lines[0].startswith("[rig]"))
        rig.key("guessed", True, "the plant was not given; delete this line once you are sure of it")
    as_logged(tables, logged, scales)
    if derived is not None:
        sensors = next(i for i, table in enumerate(tables) if table.lines[0].startswith("[sensors."))
        tables = [*tables[:sensors], derived.table, *tables[sensors:]]
        doubts = (derived.doubt, *doubts)
    head = TomlTable()
    head.line(f"# Study of {log.name}, drafted by `upright init`. Check it, then: upright identify THIS_FILE -o OUT")
    head.line("# Quantities are written with units. { guess = ... } is estimated; a text or number alone is known.")
    head.line("# Lines marked MEASURE hold assumed placeholders: no estimate that depends on one can be used.")
    head.line('# Replace them by what you measured, as in m_p = "0.22 kg". All keys: `upright identify --keys`.')
    head.line(f"# {window_of(tables, record)}")
    for doubt in doubts:
        head.line(f"# GUESSED: {doubt}")
    head.key("title", log.stem)
    return study_text([head, *tables])


def _drafted(
    record: Record, inspection: Inspection, log: Path, study: Path, plant: str
) -> tuple[Recognised, list[TomlTable]]:
    """What was recognised, as this plant or what the columns suggest, and the tables of its study."""
    recognised = recognise(record, inspection, plant)
    force = [i.name for i in find(recognised.plant).inputs if i.name in record.signals and record[i.name].any()]
    if force and recognised.drive is None and not record.inputs:  # a column bears its name
        return _drafted(record.replace(inputs=(force[0],)), inspection, log, study, plant)
    file = os.path.relpath(log.resolve(), study.resolve().parent).replace(os.sep, "/")
    if recognised.plant.startswith(CHAINS):
        where = "/".join(log.resolve().parts[-3:])
        chain = read_chain(record, inspection, recognised, named=bool(plant), path=where)
        recognised, tables = chain_tables(record, chain, file, log.stem)
    else:
        recognised, tables = pendulum_tables(record, inspection, recognised, file, log.stem)
    describe(tables, record, inspection, recognised)
    return recognised, tables


def window_of(tables: Sequence[TomlTable], record: Record) -> str:
    """How much of the record the runs of a draft are, in a sentence."""
    runs = [tomllib.loads(str(table))["runs"][0] for table in tables if table.lines[:1] == ["[[runs]]"]]
    return window_sentence([(r["role"], *r["window"]) for r in runs], float(record.t[0]), float(record.t[-1]))


def alike(record: Record, inspection: Inspection, recognised: Recognised) -> tuple[str, list[str]]:
    """Plant to draft instead, and the sentence on all that the columns could be of with what each explains.

    A plant that explains the accelerations far better is taken, unless the columns are called as the coordinates of the
    one recognised. Counts of an unknown encoder do not tell: a pendulum's angle has to be an angle. Carts from disks
    they never tell, and what was recognised says so already.
    """
    counted = any(c.guess in COUNTED for c in recognised.columns.values())
    others = [
        n
        for n in plants_that_suit(record, inspection)
        if n != recognised.plant and n not in " ".join(recognised.doubts)
    ]
    if not others or (counted and recognised.plant.startswith(CHAINS) and len(recognised.columns) > 1):
        return "", []
    head = f"Taken for {recognised.plant}"
    by_columns = [f"{head}; the columns also suit {' or '.join(others)}; choose with --plant."]
    if counted:
        return "", by_columns
    if record.t.size > LONGEST:
        first = min(int(np.searchsorted(record.t, recognised.window[0])), record.t.size - LONGEST)
        record = record.window(record.t[first], record.t[first + LONGEST - 1])
        inspection = inspect(record)
    log, drafts = Path("log.csv"), dict[str, str]()
    for name in (recognised.plant, *others):
        with suppress(BadInput):  # it is not tried then, and said so
            drafts[name] = draft(record, inspection, log, log.with_suffix(".toml"), plant=name)
    shares = explained(record, drafts, log.name)
    if recognised.plant not in shares:
        return "", by_columns
    own, best = shares[recognised.plant], next(iter(shares))
    left, least = 1 - own, 1 - shares[best]
    better = (left > DOUBTFUL and least < CLEAR * left) or (left > LITTLE and least < BY_FAR * left)
    named = named_after(list(recognised.columns.values())) == recognised.plant
    taken, reason = (recognised.plant, " by its columns") if named or not better else (best, "")
    rest = [n for n in (recognised.plant, *others) if n != taken]
    shares_text = ", ".join(f"{n} {100 * shares[n]:.0f} %" if n in shares else f"{n} was not tried" for n in rest)
    remedy = f"--plant {best} drafts what explains them far better" if better and named else "choose with --plant"
    sentence = f"Taken for {taken}{reason}. It explains {100 * shares[taken]:.0f} % of the accelerations"
    return "" if taken == recognised.plant else taken, [f"{sentence}, {shares_text}; {remedy}."]
