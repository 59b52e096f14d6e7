"""A session in the laboratory as one report, and as plain values for another program."""

from __future__ import annotations

import platform
from dataclasses import replace
from datetime import date
from pathlib import Path
from typing import Any

from upright import __version__
from upright.experiments.laboratory import EXPERIMENTS, Session
from upright.report.book import Book
from upright.report.page import Step
from upright.report.symbols import typed

TITLE = "The laboratory: identify it hanging, hold it upright"


def book(session: Session, day: date) -> Book:
    """Everything the session has to say."""
    rigs = dict.fromkeys(f"{t.rig} (seed {session.seed})" for t in session.told)
    notes: list[str] = []
    if session.interrupted:
        left = ", ".join(e.key for e in session.missing)
        notes.append(
            "Stopped by Ctrl-C; this report holds what was there by then"
            + (f", and not yet experiments {left}." if left else ".")
        )
    return Book(
        title=TITLE,
        facts=(
            ("Rig", "; ".join(rigs) or f"seed {session.seed}"),
            ("Data", "Digital twins: dry friction, encoder counts, delay and limits as on rigs; none was touched."),
            ("Experiments", ", ".join(t.experiment.key for t in session.told) or "none"),
            ("Made", f"{day.isoformat()}, upright {__version__}, Python {platform.python_version()}"),
            ("Again", command(session)),
        ),
        chapters=tuple(
            replace(t.chapter, about=t.rig, finished=t.state in ("done", "kept")) for t in session.told
        ),
        notes=tuple(notes),
        missing=tuple((e.key, e.title) for e in session.missing),
        steps=next_steps(session),
    )  # fmt: skip


def command(session: Session, seed: int | None = None) -> str:
    """What to type for this session, or for the same on another rig."""
    seed = session.seed if seed is None else seed
    shown = ["upright lab"]
    if session.make:
        shown.append(f"--rig {session.make}")
    there = [e for e in EXPERIMENTS if not session.make or session.make in e.makes]
    told = {e.key for e in session.asked} | {t.experiment.key for t in session.told}
    if len(told) < len(there):
        shown += [f"--experiment {e.key}" for e in there if e.key in told]
    if seed:
        shown.append(f"--seed {seed}")
    return " ".join(shown)


def next_steps(session: Session) -> tuple[Step, ...]:
    """What to do with the whole: go on, take another rig, or a log of one's own."""
    steps: list[Step] = []
    if session.interrupted or any(t.state == "failed" for t in session.told):
        steps.append(
            Step("Go on where this stopped; what is finished is kept.",
                 f"{command(session)} -o {typed(session.folder)}")
        )  # fmt: skip
    steps.append(Step("Take another rig of the same make.", command(session, session.seed + 1)))
    other = "linear" if session.make != "linear" else "furuta"
    steps.append(Step("Run the laboratory on another kind of rig.", f"upright lab --rig {other}"))
    steps.append(Step("Start on a log of your own.", "upright init LOG"))
    return tuple(steps)


def summary(session: Session, report: Path, pdf: Path | None) -> dict[str, Any]:
    """The session as plain values for another program: SI."""
    return {
        "seed": session.seed,
        "rig": session.make or None,
        "folder": str(session.folder),
        "report": str(report),
        "pdf": str(pdf) if pdf else None,
        "interrupted": session.interrupted,
        "missing": [e.key for e in session.missing],
        "seconds": session.seconds,
        "experiments": {
            t.experiment.key: {
                "title": t.chapter.title,
                "rig": t.rig,
                "make": t.make,
                "state": t.state,
                "seconds": t.seconds,
                "sound": t.chapter.sound,
                "verdict": t.chapter.verdict,
                "detail": t.chapter.detail,
                "numbers": t.chapter.numbers,
                "steps": [s.command for s in t.chapter.steps if s.command],
            }
            for t in session.told
        },
    }
