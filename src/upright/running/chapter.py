"""Runs, check-ups and jitter, told: what came of it, how far to trust it, and what to do next."""

from __future__ import annotations

from typing import Any

import numpy as np

from upright.control.effort import RestEffort, shown
from upright.realtime.jitter import Jitter
from upright.report.page import Chapter, Facts, KeyNumber, Part, Picture, Step, Table, resting_on
from upright.report.run import draw_run
from upright.report.symbols import number, typed
from upright.rigs.board import told
from upright.running.doctor import Checkup
from upright.running.figures import jitter_figure
from upright.running.run import RigRun

NO_SAFETY = "This supervision is software, not a rated safety function: keep a stop in hardware within reach."


def run_chapter(done: RigRun) -> Chapter:
    """One run."""
    end, rig, log = done.end, typed(done.wish.rig), done.log
    facts: list[tuple[str, str]] = []
    if end.about is not None:
        facts.append(("rig", f"{end.about.name}, a tick every {1e3 * end.about.period:.4g} ms"))
    share = f"{100 * end.late / end.ticks:.2g} %" if end.ticks else "none"
    facts += [("ticks", f"{end.ticks}, {end.late} late ({share})"),
              ("log", f"{done.log_path.name}: {end.rows} rows, {end.dropped} dropped")]  # fmt: skip
    if done.unrest:
        facts += [
            (f"{c.name}, rms of the second half",
             f"below a count, {number(count, 2)} {c.unit}" if v < count else f"{number(v, 3)} {c.unit}")
            for c, v, count in zip(done.model.plant.coordinates, done.unrest, done.count, strict=True)
        ]  # fmt: skip
    if (taken := done.way_back) is not None:
        peak = f"{number(taken.peak, 3)} of {done.limit:g} {done.model.unit}"
        facts.append(("largest command", f"{peak}, at the limit for {100 * taken.saturated:.2g} % of the ticks"))
    if done.effort is not None:
        facts.append(("command at rest", shown(done.effort, done.limit, done.model.unit)))
    parts = [Part("The run", (Facts(tuple(facts)), *_events(done)))]
    if log is not None and len(log) > 2:
        parts.append(Part("What was logged", (
            Picture(name="run", draw=lambda: draw_run(log), caption="Readings and commands as they were logged.",
                    description="Readings and commands over time."),
        )))  # fmt: skip
    warnings = tuple(filter(None, (end.warning, NO_SAFETY if done.file.hardware else "", end.log_message)))
    chapter = Chapter(
        title=f"Run on {done.model.name}", verdict=done.verdict, sound=done.sound and done.quiet,
        parts=tuple(parts),
        warnings=warnings, steps=_steps(done, rig), numbers=_numbers(done),
        findings=(KeyNumber(what="late ticks", value=f"{end.late} of {end.ticks}"),),
    )  # fmt: skip
    return resting_on(chapter, done.basis, done.file.performed)


def _events(done: RigRun) -> tuple[Table, ...]:
    rows = tuple((number(t, 4), kind, text) for t, kind, text in done.end.events)
    return (Table(caption="What happened", headings=("t [s]", "", ""), rows=rows, numbers=(0,)),) if rows else ()


def _steps(done: RigRun, rig: str) -> tuple[Step, ...]:
    log = typed(done.log_path)
    if done.end.stopped and done.log is None:
        return (Step("Look at the rig without a loop first.", f"upright rig doctor {rig}"),)
    out = [Step("Look at the log.", f"upright log show {log} --plot")]
    if done.end.stopped:
        out.append(Step("Find out whether the rig is wired as it is described.", f"upright rig doctor {rig}"))
    if done.end.late:
        out.append(Step("See what rate this machine holds.", "upright rig check"))
    if done.wish.law is None:
        out.append(Step("Identify the rig from this log.", f"upright init {log}"))
    elif not done.quiet:
        out.append(Step("Design a law whose command is quieter at rest: slower poles, or velocities from a filter.",
                        "upright design --help"))  # fmt: skip
    elif not done.end.stopped:
        out.append(Step("Check that the law gave what the log says.", f"upright log replay {log}"))
    return tuple(out)


def _numbers(done: RigRun) -> dict[str, Any]:
    end = done.end
    return {
        "rig": done.model.name, "kind": done.file.kind, "seconds": done.wish.seconds, "ticks": end.ticks,
        "late": end.late, "stopped": end.stopped, "faults": int(end.faults), "fault_words": told(end.faults),
        "rows": end.rows, "dropped": end.dropped, "rms": list(done.unrest), "log": str(done.log_path),
        "way_back": None if done.way_back is None else vars(done.way_back), "effort": _effort(done.effort),
        "clock_seconds": end.seconds, "verdict": done.verdict,
    }  # fmt: skip


def _effort(found: RestEffort | None) -> dict[str, Any] | None:
    """Command at rest, as shares of the limit; limit cycles in SI."""
    return None if found is None else {"quiet": found.quiet, **vars(found)}


def checkup_chapter(found: Checkup, rig: str) -> Chapter:
    """What was found on a rig."""
    words = {True: "good", False: "wrong", None: "not looked at"}
    rows = tuple((f.what, f.found, words[f.good]) for f in found.findings)
    step = (
        Step("Close a loop on it.", f"upright run --rig {rig} --law design.json --duration 30")
        if found.sound
        else Step("Mend what is said above, and look again.", f"upright rig doctor {rig}")
    )
    return Chapter(
        title=f"Check-up of {found.name}", verdict=found.verdict, sound=found.sound, steps=(step,),
        warnings=(NO_SAFETY,), numbers={"findings": [vars(f) for f in found.findings], "verdict": found.verdict},
        parts=(Part("What was looked at", (Table(caption="", headings=("", "found", ""), rows=rows),)),),
    )  # fmt: skip


def jitter_chapter(found: Jitter) -> Chapter:
    """How late this machine is."""
    q = {n: f"{1e6 * v:.3g} µs" for n, v in found.quantiles.items()}
    work, longer = np.percentile(found.work, [50, 99]).tolist()
    facts = Facts((
        *q.items(), ("late ticks", f"{found.late} of {found.behind.size}"), ("priority", found.standing.priority),
        ("memory", "locked" if found.standing.locked else "not locked"),
        ("processors", "kept awake" if found.standing.awake else "may sleep between ticks"),
        *((("taken by the host", f"{found.stolen:.2g} s"),) if found.stolen else ()),
        ("law and supervision of a tick", f"{1e6 * work:.3g} µs (p99 {1e6 * longer:.3g} µs)"),
        ("rate held", f"{found.rate:g} Hz" if found.rate else "none"),
        *((("time left for", f"{found.promising} Hz, not tried"),) if found.promising else ()),
    ))  # fmt: skip
    picture = Picture(
        name="jitter", draw=lambda: jitter_figure(found), caption="How far behind its deadline each tick was woken.",
        description="Histogram of the lateness of all ticks, both axes logarithmic.",
    )  # fmt: skip
    late = found.late / found.behind.size
    steps = [Step("Measure longer, with what else will run beside the loop.", "upright rig check --seconds 600")]
    if found.promising:
        steps.append(Step("Try a faster loop.", f"upright rig check --rate {found.promising}"))
    return Chapter(
        title="How late is this machine?", verdict=found.verdict, sound=found.held,
        warnings=(found.standing.warning,) if found.standing.warning else (),
        parts=(Part(f"{found.behind.size * found.period:.3g} s at {1 / found.period:.4g} Hz", (facts, picture)),),
        steps=tuple(steps),
        numbers={
            "period": found.period, "ticks": found.behind.size, "late": found.late, "late_share": late,
            **{f"behind_{n}": v for n, v in found.quantiles.items()}, "priority": found.standing.priority,
            "locked": found.standing.locked, "awake": found.standing.awake, "stolen": found.stolen,
            "work_p50": work, "work_p99": longer, "rate": found.rate, "promising": found.promising,
            "verdict": found.verdict,
        },
    )  # fmt: skip
