"""The log of a run as a chapter: what ran, what happened, what is missing; what was recovered, what a replay says."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from upright.logs import LogHeader, RunLog
from upright.readers import inspect
from upright.report.drawing import BLUE, GREY, VERMILLION, decimated, figure, styled
from upright.report.log import draw_columns
from upright.report.page import Chapter, Code, Facts, Part, Picture, Points, Step, Table
from upright.report.symbols import typed

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from upright.logs.replay import Replay
    from upright.logs.salvage import Salvaged

_MOST = 40  # events in a table


def chapter(log: RunLog) -> Chapter:
    """What a run's log holds."""
    t, n = log.columns["t"], len(log)
    seconds = float(t[-1] - t[0]) if n > 1 else 0.0
    facts = [("rows", f"{n} over {seconds:.6g} s, every {1e3 * log.header.period:.6g} ms")]
    if n > 1:
        step = np.diff(t)
        longest = int(np.argmax(step))
        facts.append(("longest step", f"{1e3 * step[longest]:.4g} ms at {t[longest]:.6g} s"))
    facts += [
        ("dropped", f"{log.dropped} rows of the loop" if log.dropped else "none"),
        ("law", law_in_words(log.header)),
        *(("followed", f"{name} [{unit}]") for name, unit in log.header.references),
        ("written by", ", ".join(f"{name} {version}" for name, version in log.header.versions.items() if version)),
    ]
    parts = [Part("Run", (Facts(tuple(facts)),))]
    if stretches := tuple(_modes(log)):
        parts.append(Part("Modes and faults", (_table("What the rig did", stretches),)))
    if log.events:
        rows = tuple((f"{e.t:.6g}", str(e.row), e.kind, e.text) for e in log.events[:_MOST])
        more = f", the first {_MOST} of {len(log.events)}" if len(log.events) > _MOST else ""
        events = Table(caption=f"Events{more}", headings=("t [s]", "after row", "kind", ""), rows=rows, numbers=(0, 1))
        parts.append(Part("Events", (events,)))
    if log.header.rig.strip():
        parts.append(Part("Rig", (Code(log.header.rig.strip()),)))
    if n > 1:
        drawn = Picture(
            name="columns", draw=lambda: draw_run(log), caption="The columns over time.",
            description=f"{n} rows of {', '.join(log.columns)}.",
        )  # fmt: skip
        parts.append(Part("Columns", (drawn,)))
    name = typed(Path(log.file))
    steps = [Step("Ask its law again.", f"upright log replay {name}")] if "kind" in log.header.law else []
    if log.complaint:
        steps.insert(0, Step("Make a whole file of what can be read.", f"upright log recover {name}"))
    verdict = f"{n} whole rows. {log.complaint}" if log.complaint else f"The log is whole: {n} rows."
    return Chapter(
        title=Path(log.file).name, verdict=verdict, sound=not log.complaint and not log.dropped, parts=tuple(parts),
        steps=tuple(steps), numbers=log_numbers(log),
    )  # fmt: skip


def log_numbers(log: RunLog) -> dict[str, Any]:
    """The same as plain values."""
    t, header = log.columns["t"], log.header
    return {
        "file": log.file, "rows": len(log), "seconds": float(t[-1] - t[0]) if len(log) > 1 else 0.0,
        "period": header.period, "dropped": log.dropped, "complaint": log.complaint, "bytes": log.size,
        "columns": {column.name: column.unit for column in header.columns}, "law": dict(header.law), "rig": header.rig,
        "versions": dict(header.versions), "events": [vars(event) for event in log.events],
        "faults": list(header.fault_names(_faults(log))),
    }  # fmt: skip


def law_in_words(header: LogHeader) -> str:
    """A law in a line."""
    law = header.law
    if not law:
        return "none was logged"
    if law.get("kind") == "linear":
        limit = f", limited to {law['limit']:g} {header.command_unit}" if law.get("limit") else ""
        return f"linear, {len(law.get('A', ()))} memories{limit}"
    if law.get("kind") == "rule":
        return f"a rule of {len(str(law.get('text', '')).splitlines())} lines, {len(law.get('initial', ()))} memories"
    return ", ".join(str(name) for name in law)


def _faults(log: RunLog) -> int:
    return int(np.bitwise_or.reduce(log.columns["faults"])) if len(log) else 0


def _modes(log: RunLog) -> Iterator[tuple[str, ...]]:
    """From when to when the rig was in which mode with which faults."""
    t, mode, faults = (log.columns[name] for name in ("t", "mode", "faults"))
    if not len(log):
        return
    begins = [0, *(np.flatnonzero(np.diff(mode) | np.diff(faults)) + 1).tolist()]
    for begin, end in zip(begins[:_MOST], [*begins[1:], len(log)], strict=False):
        number, words = int(mode[begin]), ", ".join(log.header.fault_names(int(faults[begin])))
        name = log.header.modes.get(number, f"mode {number}")
        yield f"{t[begin]:.6g}", f"{t[end - 1]:.6g}", str(end - begin), name, words


def _table(caption: str, rows: tuple[tuple[str, ...], ...]) -> Table:
    return Table(
        caption=caption, headings=("from [s]", "to [s]", "rows", "mode", "faults"), rows=rows, numbers=(0, 1, 2)
    )


def draw_run(log: RunLog) -> Figure:
    """The columns over time [s]."""
    record = log.record()
    return draw_columns(record, inspect(record))


def recovered_chapter(salvaged: Salvaged) -> Chapter:
    """What was kept of a torn log."""
    log, file = salvaged.log, salvaged.file
    lost = (
        f"{salvaged.lost_bytes} bytes behind them (about {salvaged.lost_rows} rows) could not be read"
        if salvaged.lost_bytes
        else "nothing that was written is missing"
    )
    return Chapter(
        title=f"{Path(log.file).name} recovered",
        verdict=f"{len(log)} rows and {len(log.events)} events kept; {lost}.",
        parts=(Part("Why", (Points((log.complaint or "The log was whole.",)),)),),
        steps=() if file is None else (Step("Look at it.", f"upright log show {typed(file)}"),),
        numbers={
            "rows": len(log), "events": len(log.events), "lost_bytes": salvaged.lost_bytes,
            "lost_rows": salvaged.lost_rows, "complaint": log.complaint, "file": file and str(file),
        },
    )  # fmt: skip


def replayed(log: RunLog, replay: Replay) -> Chapter:
    """Whether a law gives its commands again."""
    unit, first = log.header.command_unit, replay.first
    sentences = [
        f"{replay.rows.size} rows compared; the law began {replay.starts} time{'s' if replay.starts > 1 else ''}."
    ]
    if first is not None:
        verdict = (
            f"{replay.differing} of {replay.rows.size} commands differ, the first in row {first.row} at {first.t:.6g} "
            f"s: logged {first.logged!r} {unit}, replayed {first.replayed!r} {unit}."
        )
        sentences.append(f"The largest difference is {replay.largest:.3g} {unit}.")
    else:
        verdict = f"All {replay.rows.size} commands are bit-identical to the logged ones."
    if replay.passed_over:
        sentences.append(
            f"{replay.passed_over} rows were passed over: rows before them were dropped from the log, so that what the"
            " law remembered there is not known."
        )
    drawn = Picture(
        name="replay", draw=lambda: draw_replay(log, replay),
        caption="The logged and the replayed command; their distance.", description=verdict,
    )  # fmt: skip
    return Chapter(
        title=f"{Path(log.file).name}, its law replayed", verdict=verdict, sound=replay.identical,
        parts=(Part("Commands", (Points(tuple(sentences)), drawn)),),
        numbers={
            "identical": replay.identical, "compared": replay.rows.size, "differing": replay.differing,
            "largest": replay.largest, "starts": replay.starts, "passed_over": replay.passed_over,
            "first": None if first is None else vars(first),
        },
    )  # fmt: skip


@styled
def draw_replay(log: RunLog, replay: Replay) -> Figure:
    """Commands over time [s], logged and replayed, and below them their difference."""
    t, logged = log.columns["t"][replay.rows], log.columns[log.header.command][replay.rows]
    drawing = figure(4.2)
    above, below = drawing.subplots(2, 1, sharex=True)
    for values, colour, label in ((logged, GREY, "logged"), (replay.commands, BLUE, "replayed")):
        above.plot(*decimated(t, values, buckets=800), color=colour, linewidth=1.0, label=label)
    below.plot(*decimated(t, replay.commands - logged, buckets=800), color=VERMILLION, linewidth=1.0)
    above.set_ylabel(f"{log.header.command} [{log.header.command_unit}]", parse_math=False)
    below.set_ylabel("difference")
    below.set_xlabel("time [s]")
    above.legend()
    return drawing
