"""Which program wrote this log, and what does it hold?

`read` recognises the format from the content, not from the suffix.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from upright.errors import BadInput, nearest
from upright.readers.source import Source, load
from upright.records import PathLike, Record

if TYPE_CHECKING:
    from upright.readers.inspection import Inspection

READERS = ("ecp", "table", "ros-bag", "matlab", "upright")

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
    try:
        if name == "matlab":
            from upright.readers import matlab

            return matlab.read(source)
        if name == "ecp":
            from upright.readers import ecp

            return ecp.read(source)
        if name == "ros-bag":
            from upright.readers import rosbag

            return rosbag.read(source)
        if name == "upright":
            from upright.readers import own

            return own.read(source)
        if name == "table":
            from upright.readers import delimited

            return delimited.read(source)
    except BadInput as error:
        if source.file in str(error):
            raise
        raise BadInput(f"'{source.file}': {error}") from None  # the record refused what the reader found
    raise BadInput(f"There is no reader '{name}': {nearest(name, READERS)}")


def recognise(source: Source) -> str:
    """Name of the reader for this content."""
    from upright.readers import delimited, ecp, mat5, rosbag
    from upright.readers.own import MARK

    if mat5.recognise(source.data, source.file):
        return "matlab"
    text = source.text
    if text.startswith(MARK):
        return "upright"
    if ecp.recognise(text):
        return "ecp"
    names = tuple(name.strip() for name in text.lstrip().split("\n", 1)[0].split(","))
    if rosbag.recognise(names) and not delimited.begins_with_number(text):
        return "ros-bag"
    return "table"


def inspect(what: Record | PathLike) -> Inspection:
    """What can be told about each column and about the time base of a record or a log."""
    from upright.readers.inspection import inspect_record

    return inspect_record(what if isinstance(what, Record) else read(what))
