"""Reports of runs, check-ups and jitter: the result, how far to trust it, and what to do next."""

from __future__ import annotations

from typing import Any

import numpy as np

from upright.control.effort import RestEffort, shown
from upright.quantities import two_figures
from upright.realtime.jitter import Jitter
from upright.report.page import Chapter, Facts, KeyNumber, Part, Picture, Step, Table, resting_on
from upright.report.run import draw_run
from upright.report.symbols import number, typed
from upright.rigs.board import fault_text
from upright.running.doctor import Checkup
from upright.running.figures import jitter_figure
from upright.running.run import RigRun

NO_SAFETY = "This supervision is software, not a rated safety function: keep a stop in hardware within reach."


def run_chapter(run: RigRun) -> Chapter:
    """One run."""
    end, rig, log = run.end, typed(run.request.rig), run.log
    facts: list[tuple[str, str]] = []
    if end.about is not None:
        facts.append(("rig", f"{end.about.name}, a tick every {1e3 * end.about.period:.4g} ms"))
    share = f"{two_figures(100 * end.late / end.due)} %" if end.due else "none"
    facts += [("ticks", f"{end.ticks}{f' of {end.due} due' * (end.passed > 0)}, {end.late} late ({share})"),
              ("log", f"{run.log_path.name}: {end.rows} rows, {end.dropped} dropped")]  # fmt: skip
    if run.unrest:
        facts += [
            (f"{c.name}, rms of the second half",
             f"below a count, {number(count, 2)} {c.unit}" if v < count else f"{number(v, 3)} {c.unit}")
            for c, v, count in zip(run.model.plant.coordinates, run.unrest, run.count, strict=True)
        ]  # fmt: skip
    if (back := run.way_back) is not None:
        peak = f"{number(back.peak, 3)} of {run.limit:g} {run.model.unit}"
        facts.append(
            ("largest command", f"{peak}, at the limit for {two_figures(100 * back.saturated)} % of the ticks")
        )
    if run.effort is not None:
        facts.append(("command at rest", shown(run.effort, run.limit, run.model.unit)))
    parts = [Part("The run", (Facts(tuple(facts)), *_events(run)))]
    if log is not None and len(log) > 2:
        parts.append(Part("What was logged", (
            Picture(name="run", draw=lambda: draw_run(log), caption="Readings and commands as they were logged.",
                    description="Readings and commands over time."),
        )))  # fmt: skip
    warnings = tuple(filter(None, (end.warning, NO_SAFETY if run.file.hardware else "", end.log_message)))
    chapter = Chapter(
        title=f"Run on {run.model.name}", verdict=run.verdict, sound=run.sound and run.quiet,
        parts=tuple(parts),
        warnings=warnings, steps=_steps(run, rig), numbers=_numbers(run),
        findings=(KeyNumber(what="late ticks", value=f"{end.late} of {end.due}"),),
    )  # fmt: skip
    return resting_on(chapter, run.basis, run.file.performed)


def _events(run: RigRun) -> tuple[Table, ...]:
    rows = tuple((number(t, 4), kind, text) for t, kind, text in run.end.events)
    return (Table(caption="What happened", headings=("t [s]", "", ""), rows=rows, numbers=(0,)),) if rows else ()


def _steps(run: RigRun, rig: str) -> tuple[Step, ...]:
    log = typed(run.log_path)
    if run.end.stopped and run.log is None:
        return (Step("Look at the rig without a loop first.", f"upright rig doctor {rig}"),)
    out = [Step("Look at the log.", f"upright log show {log} --plot")]
    if run.end.stopped:
        out.append(Step("Find out whether the rig is wired as it is described.", f"upright rig doctor {rig}"))
    if run.end.late:
        out.append(Step("See what rate this machine holds.", "upright rig check"))
    if run.request.law is None:
        out.append(Step("Identify the rig from this log.", f"upright init {log}"))
    elif not run.quiet:
        out.append(Step("Design a law whose command is quieter at rest: slower poles, or velocities from a filter.",
                        "upright design --help"))  # fmt: skip
    elif not run.end.stopped:
        out.append(Step("Check that the law gave what the log says.", f"upright log replay {log}"))
    return tuple(out)


def _numbers(run: RigRun) -> dict[str, Any]:
    end = run.end
    return {
        "rig": run.model.name, "kind": run.file.kind, "seconds": run.request.seconds, "ticks": end.ticks,
        "late": end.late, "stopped": end.stopped, "faults": int(end.faults), "fault_words": fault_text(end.faults),
        "rows": end.rows, "dropped": end.dropped, "rms": list(run.unrest), "log": str(run.log_path),
        "way_back": None if run.way_back is None else vars(run.way_back), "effort": _effort(run.effort),
        "clock_seconds": end.seconds, "verdict": run.verdict,
    }  # fmt: skip


def _effort(effort: RestEffort | None) -> dict[str, Any] | None:
    """Command at rest, as shares of the limit; limit cycles in SI."""
    return None if effort is None else {"quiet": effort.quiet, **vars(effort)}


def checkup_chapter(checkup: Checkup, rig: str) -> Chapter:
    """What was found on a rig."""
    words = {True: "good", False: "wrong", None: "not looked at"}
    rows = tuple((f.what, f.observed, words[f.good]) for f in checkup.findings)
    again = f"upright rig doctor {rig}"
    if checkup.sound and any(f.what == "the drive" for f in checkup.findings):
        step = Step("Supply on, and try the drive.", again)
    elif checkup.sound:
        step = Step("Close a loop on it.", f"upright run --rig {rig} --law design.json --duration 30")
    elif checkup.written is not None:
        step = Step(f"The counts are in {rig} now; look again.", again)
    else:
        mends = "; ".join(checkup.mends)
        step = Step(f"Mend it, and look again: {mends}." if mends else "Mend what is above, and look again.", again)
    return Chapter(
        title=f"Check-up of {checkup.name}", verdict=checkup.verdict, sound=checkup.sound, steps=(step,),
        warnings=(NO_SAFETY,), numbers={
            "findings": [vars(f) for f in checkup.findings], "verdict": checkup.verdict, "counts": dict(checkup.counts),
            "dead_zone": list(checkup.dead_zone), "lost": list(checkup.lost),
        },
        parts=(Part("What was looked at", (Table(caption="", headings=("", "found", ""), rows=rows),)),),
    )  # fmt: skip


def jitter_chapter(jitter: Jitter) -> Chapter:
    """How late this machine is."""
    q = {n: f"{1e6 * v:.3g} µs" for n, v in jitter.quantiles.items()}
    work, longer = np.percentile(jitter.work, [50, 99]).tolist()
    facts = Facts((
        *q.items(), ("late ticks", f"{jitter.late} of {jitter.due}"), ("priority", jitter.standing.priority),
        ("memory", "locked" if jitter.standing.locked else "not locked"),
        ("processors", "kept awake" if jitter.standing.awake else "may sleep between ticks"),
        *((("taken by the host", f"{jitter.stolen:.2g} s"),) if jitter.stolen else ()),
        ("law and supervision of a tick", f"{1e6 * work:.3g} µs (p99 {1e6 * longer:.3g} µs)"),
        ("rate held", f"{jitter.rate:g} Hz" if jitter.rate else "none"),
        *((("time left for", f"{jitter.promising} Hz, not tried"),) if jitter.promising else ()),
    ))  # fmt: skip
    picture = Picture(
        name="jitter", draw=lambda: jitter_figure(jitter), caption="How far behind its deadline each tick was woken.",
        description="Histogram of the lateness of all ticks, both axes logarithmic.",
    )  # fmt: skip
    late = jitter.late / jitter.due
    steps = [Step("Measure longer, with what else will run beside the loop.", "upright rig check --seconds 600")]
    if jitter.promising:
        steps.append(Step("Try a faster loop.", f"upright rig check --rate {jitter.promising}"))
    return Chapter(
        title="How late is this machine?", verdict=jitter.verdict, sound=jitter.held,
        warnings=(jitter.standing.warning,) if jitter.standing.warning else (),
        parts=(Part(f"{jitter.behind.size * jitter.period:.3g} s at {1 / jitter.period:.4g} Hz", (facts, picture)),),
        steps=tuple(steps),
        numbers={
            "period": jitter.period, "ticks": jitter.behind.size, "late": jitter.late, "late_share": late,
            **{f"behind_{n}": v for n, v in jitter.quantiles.items()}, "priority": jitter.standing.priority,
            "locked": jitter.standing.locked, "awake": jitter.standing.awake, "stolen": jitter.stolen,
            "work_p50": work, "work_p99": longer, "rate": jitter.rate, "promising": jitter.promising,
            "verdict": jitter.verdict,
        },
    )  # fmt: skip
