"""The log of a lane's run, once it is over: until then its rows stand in a file beside."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from upright.browser.runs import list_run
from upright.errors import UprightError
from upright.laws import Law
from upright.logs.layout import RunFile
from upright.realtime.session import RunEnd, log_header
from upright.rigs.protocol import Mode
from upright.running.run import PreparedRun

NO_REPORT = "The bench was closed before its report was written; its log is kept."


def rows_of(log: Path) -> Path:
    """Where the rows stand until there is a log of them."""
    return log.with_suffix(".rows")


def row_of(coordinates: int) -> np.dtype[np.void]:
    """A row there."""
    return np.dtype([("tick", "<i8"), ("counts", "<i8", (coordinates,)), ("command", "<f8"), ("reference", "<f8")])


@dataclass(frozen=True, kw_only=True, eq=False)
class LaneLog:
    """What makes the log of a run, whose rows are there."""

    run: PreparedRun
    end: RunEnd
    started: float
    units: tuple[str, ...]
    law: Law


def write_lane_logs(logs: Sequence[LaneLog]) -> str:
    """Write logs and list their runs, before there are reports; of each what went wrong, or an empty text, as JSON."""
    return json.dumps([_written(log) for log in logs])


def _written(log: LaneLog) -> str:
    path = log.run.order.log
    try:
        if log.end.about is None or not log.end.ticks:
            path.unlink(missing_ok=True)
        else:
            _write_log(log.run, log.end, log.started, log.units, log.law)
            list_run(log.run, log.started, log.end.seconds)
        rows_of(path).unlink(missing_ok=True)
    except (OSError, UprightError) as error:  # the others' are written all the same
        return f"its log was not written: {error}"
    return ""


def _write_log(run: PreparedRun, end: RunEnd, started: float, units: tuple[str, ...], law: Law) -> None:
    assert end.about is not None  # as was just asked
    header = log_header(run.order, end.about, units, law, started)
    n, followed = len(units), bool(run.order.references)
    kept = np.fromfile(rows_of(run.order.log), dtype=row_of(n))
    events = list(end.events)
    with open(run.order.log, "wb") as stream:
        file = RunFile(stream, header)
        for k, row in enumerate(kept):
            t = float(row["tick"]) * end.about.period
            while events and events[0][0] < t:
                file.event(*events.pop(0))
            counts = row["counts"].tolist()
            readings = [c / per for c, per in zip(counts, end.about.counts, strict=True)]
            command = float(row["command"])
            file.row(
                (t, int(row["tick"]), *counts, *readings, *([float(row["reference"])] * followed), command, command,
                 int(Mode.HOST), 0)
            )  # fmt: skip
            if k % 1000 == 999:
                file.flush()
        if end.stopped:
            file.event(end.ticks * end.about.period, "fault", end.stopped)
        file.finish()
