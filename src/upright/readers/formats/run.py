"""Record of a run's log (MCAP), as `upright.logs` wrote it beside the loop."""

from __future__ import annotations

from upright.logs.container import MAGIC
from upright.logs.whole import log_of
from upright.readers.reader import Reader
from upright.readers.source import Source
from upright.records import Record


def _recognises(source: Source) -> bool:
    """Whether content begins as MCAP does."""
    return source.data.startswith(MAGIC)


def read(source: Source) -> Record:
    """Record of the rows up to the first error; what is missing stands in its notes."""
    return log_of(source.data, source.file).record(source.provenance("mcap"))


READER = Reader(name="mcap", files="logs of a run (MCAP)", recognises=_recognises, read=read, order=10)
