"""What is left of a torn log, as a whole file again?"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from upright.files import PathLike, check_output, whole_file
from upright.logs.layout import RunFile
from upright.logs.process import BATCH
from upright.logs.whole import RunEvent, RunLog, read_log


@dataclass(frozen=True, kw_only=True)
class Salvaged:
    """What was kept of a log, and what was not.

    Attributes
    ----------
    log : RunLog
        As it was read, up to its first error.
    file : Path, optional
        Where it stands as a whole file, if it was written.
    lost_bytes : int
        Bytes behind the first error, summary or torn end.
    lost_rows : int
        Rows that so many bytes held, judged by those that were read.
    """

    log: RunLog
    file: Path | None
    lost_bytes: int
    lost_rows: int


def recover(path: PathLike, out: PathLike | None = None) -> Salvaged:
    """Rows and events of a log up to its first error, as a whole file where one is named; the log stays as it is.

    Raises
    ------
    BadInput
        When nothing of it can be read, or `out` may not be written.
    """
    if out is not None:
        check_output(out, path)
    log = read_log(path)
    lost = log.size - log.readable
    rows = round(lost * len(log) / log.readable) if "Every chunk" not in log.complaint else 0
    if out is not None:
        _write_whole(log, out)
    return Salvaged(log=log, file=None if out is None else Path(out), lost_bytes=lost, lost_rows=rows)


def _write_whole(log: RunLog, out: PathLike) -> None:
    with whole_file(out) as half, open(half, "wb") as stream:
        file = RunFile(stream, log.header)
        events = list(log.events)
        for k in range(len(log)):
            while events and events[0].row <= k:
                _event(file, events.pop(0))
            file.row(log.row(k))
            if (k + 1) % BATCH == 0:
                file.flush()
        for event in events:
            _event(file, event)
        if log.complaint:
            t = float(log.columns["t"][-1]) if len(log) else 0.0
            file.event(t, "recovered", f"{len(log)} rows of {Path(log.file).name}. {log.complaint}")
        file.finish()


def _event(file: RunFile, event: RunEvent) -> None:
    file.event(event.t, event.kind, event.text, event.dropped)
