"""What a log holds, by whatever name its owner calls it."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

from upright.progress import Progress
from upright.readers import inspect, read_source
from upright.readers.source import load
from upright.records import Record


def record_named(path: Path, name: str) -> Record:
    """Record of a log whose sentences call it by its owner's name."""
    return read_source(replace(load(path), file=name))


def inspect_log(path: Path, name: str, progress: Progress) -> str:
    """Rows, seconds and columns of a log, as JSON.

    Raises
    ------
    BadInput
        What its reader says, with the name by which its owner calls it.
    """
    record = record_named(path, name)
    inspect(record)
    seconds = float(record.t[-1] - record.t[0])
    return json.dumps({"rows": len(record), "seconds": seconds, "columns": list(record.names)[:40]})
