"""Record of a log, whichever program wrote it, and what its columns are.

`read` recognises the format from the content, not from the suffix.
"""

from __future__ import annotations

import warnings
from dataclasses import replace

from upright.errors import BadInput
from upright.readers.inspection import Inspection, inspect_column, inspect_record
from upright.readers.reader import READERS, Reader
from upright.readers.source import Source, load
from upright.readers.wrapped import counted_on, may_turn_on, turned_on, unwrapped
from upright.records import PathLike, Record
from upright.records.columns import ANGLES

__all__ = ["READERS", "inspect", "read", "reader_of"]


def read(path: PathLike, *, reader: str | None = None, counted: bool = False) -> Record:
    """Record of a log.

    Parameters
    ----------
    path : path
        File as its program wrote it.
    reader : str, optional
        One of `READERS`, when the content is not to be judged.
    counted : bool
        Whether the rows of a table without a time are counted, instead of refused.

    Raises
    ------
    BadInput
        When the file cannot be read, with the line and the column of the trouble.
    """
    return read_source(replace(load(path), counted=counted), reader=reader)


def read_source(source: Source, *, reader: str | None = None) -> Record:
    """Record of content already in memory; see `read`."""
    chosen = READERS.named(reader or reader_of(source))
    try:
        return _unwrapped(chosen.read(source))
    except BadInput as error:
        where = "" if source.file in str(error) else f"'{source.file}': "  # the record refused what the reader found
        raise BadInput(" ".join((f"{where}{error}", *(() if reader else READERS.unsound())))) from None


def _unwrapped(record: Record) -> Record:
    """The record with every counter and angle that passed its end counted on."""
    signals, notes = dict(record.signals), list[str]()
    for name, values in record.signals.items():
        signals[name], bits, times = unwrapped(values)
        if not times:
            unit = record.units[name] or (inspect_column(record, name).guess if may_turn_on(values) else "")
            signals[name], times = turned_on(values, unit) if unit in ANGLES else (values, 0)
        if times:
            notes.append(counted_on(name, bits, times))
    if not notes:
        return record
    origin = record.provenance
    return record.replace(signals=signals, provenance=replace(origin, notes=(*origin.notes, *notes)))


def reader_of(source: Source) -> str:
    """Name of the reader for this content, the first in the readers' `order` that recognises it."""
    readers = sorted(READERS.sound().items(), key=lambda item: item[1].order)
    return next(name for name, reader in readers if _recognises(name, reader, source))


def _recognises(name: str, reader: Reader, source: Source) -> bool:
    """Whether a reader does; one of another package that stops does not, and the others are tried."""
    try:
        return reader.recognises(source)
    except Exception as error:
        if name in READERS.own:
            raise
        if not isinstance(error, BadInput):
            why = f"{type(error).__name__}: {error}"
            warnings.warn(f"the reader '{name}' stops at '{source.file}': {why}", stacklevel=2)
        return False


def inspect(what: Record | PathLike) -> Inspection:
    """Inspection of each column and of the time base of a record or a log."""
    return inspect_record(what if isinstance(what, Record) else read(what))
