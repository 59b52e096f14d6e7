"""Record of a log, whichever program wrote it, and what can be told about its columns.

`read` recognises the format from the content, not from the suffix.
"""

from __future__ import annotations

from upright.errors import BadInput, nearest
from upright.readers import delimited, ecp, matlab, rosbag, run
from upright.readers.inspection import Inspection, inspect_record
from upright.readers.source import Source, load
from upright.records import PathLike, Record
from upright.records.record import CSV_MARK

READERS = {
    "ecp": ecp.read,
    "table": delimited.read,
    "ros-bag": rosbag.read,
    "matlab": matlab.read,
    "mcap": run.read,
    "upright": delimited.read_written,
}

_HEAD = 1 << 20  # characters in which the line of names ends

__all__ = ["READERS", "inspect", "read", "recognise"]


def read(path: PathLike, *, reader: str | None = None) -> Record:
    """Record of a log.

    Parameters
    ----------
    path : path
        File as its program wrote it.
    reader : str, optional
        One of `READERS`, when the content is not to be judged.

    Raises
    ------
    BadInput
        When the file cannot be read, with the line and the column of the trouble.
    """
    return read_source(load(path), reader=reader)


def read_source(source: Source, *, reader: str | None = None) -> Record:
    """Record of content already in memory; see `read`."""
    name = reader or recognise(source)
    if name not in READERS:
        raise BadInput(f"There is no reader '{name}': {nearest(name, READERS)}")
    try:
        return READERS[name](source)
    except BadInput as error:
        if source.file in str(error):
            raise
        raise BadInput(f"'{source.file}': {error}") from None  # the record refused what the reader found


def recognise(source: Source) -> str:
    """Name of the reader for this content."""
    if run.recognise(source.data):
        return "mcap"
    if matlab.recognise(source.data, source.file):
        return "matlab"
    text = source.text
    if text.startswith(CSV_MARK):
        return "upright"
    if ecp.recognise(text):
        return "ecp"
    names = tuple(name.strip() for name in text[:_HEAD].lstrip().split("\n", 1)[0].split(","))
    if rosbag.recognise(names) and not delimited.begins_with_number(text):
        return "ros-bag"
    return "table"


def inspect(what: Record | PathLike) -> Inspection:
    """What can be told about each column and about the time base of a record or a log."""
    return inspect_record(what if isinstance(what, Record) else read(what))
