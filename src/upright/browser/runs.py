"""Runs that are over: their logs, their reports, and a list of both."""

from __future__ import annotations

import json
import multiprocessing
import os
import re
from collections.abc import Callable
from dataclasses import replace
from multiprocessing.connection import Connection
from pathlib import Path
from typing import Any

from upright.browser.rig import NO_LAW
from upright.errors import UprightError
from upright.files import replace_file
from upright.realtime.interrupts import ignoring
from upright.realtime.session import RunEnd
from upright.report.html import write_html
from upright.running.chapter import run_chapter
from upright.running.run import PreparedRun

_STEM = re.compile(r"run(-\d+)?")


def write_report(run: PreparedRun, end: RunEnd, started: float) -> str:
    """Write the report of a run beside its log, and what a list says of it; the verdict."""
    result = run.ended(end)
    chapter = run_chapter(result)
    write_html(result.log_path.with_suffix(".html"), chapter)
    seconds = float(result.t[-1]) if result.t.size else 0.0
    list_run(run, started, seconds, chapter.verdict)
    return chapter.verdict


def list_run(run: PreparedRun, started: float, seconds: float, verdict: str = "") -> None:
    """Write what a list says of a run; without a verdict, its report is not written."""
    begun = "first motions" if run.request.exploration else "swing-up" if run.request.from_rest else "run"
    facts = {"what": run.request.what or begun, "started": started, "seconds": seconds, "verdict": verdict}
    replace_file(run.order.log.with_suffix(".json"), json.dumps(facts).encode())


def report_apart(run: PreparedRun, end: RunEnd, started: float) -> str:
    """The same in a process of its own."""
    # the law of a swing-up is a function that no other process knows by its name, and a report has no use for it
    return in_own_process(write_report, replace(run, law=NO_LAW), end, started)


def listed(folder: Path, name: str) -> list[dict[str, Any]]:
    """Runs of a rig, the newest first: those whose report is written, and in a class those whose log is."""
    out: list[dict[str, Any]] = []
    for path in sorted(folder.glob("run*.json")):
        if _STEM.fullmatch(path.stem):
            facts: dict[str, Any] = json.loads(path.read_text(encoding="utf-8"))
            there = {
                key: f"/rigs/{name}/runs/{path.stem}.{end}"
                for key, end in (("log", "mcap"), ("report", "html"), ("response", "frequency.csv"))
                if path.with_suffix(f".{end}").exists()
            }
            out.append({"id": path.stem, **facts, **there})
    return sorted(out, key=lambda run: -run["started"])


def in_own_process(task: Callable[..., str], *arguments: Any) -> str:
    """What a task gives that would hold up everything else here; an error of ours is raised as it came.

    Raises
    ------
    UprightError
        Also when the process ends without an answer: by a bug, which it has printed, or since the bench is closed.
    """
    context = multiprocessing.get_context("spawn")
    ours, theirs = context.Pipe(duplex=False)
    process = context.Process(target=_perform, args=(theirs, task, arguments), daemon=True, name="upright clerk")
    with ignoring():  # Ctrl-C reaches a whole group of processes; what is begun is written
        process.start()
    theirs.close()
    try:
        answer = ours.recv()
    except EOFError:
        raise UprightError("the process that was to write this ended without an answer.") from None
    finally:
        process.join()
        ours.close()
    if isinstance(answer, UprightError):
        raise answer
    return str(answer)


def _perform(pipe: Connection, task: Callable[..., str], arguments: tuple[Any, ...]) -> None:
    if hasattr(os, "nice"):
        os.nice(5)  # what moves comes first, yet 10 leaves a tenth of a processor that a browser draws on
    try:
        pipe.send(task(*arguments))
    except UprightError as error:
        pipe.send(error)
    pipe.close()
