"""Was every sample taken when the log says? Gaps, jitter, doubled rows, rounded stamps, a clock that starts again."""

from __future__ import annotations

import re

import numpy as np

from upright.doctor.case import Case
from upright.doctor.channels import doubled_rows
from upright.doctor.findings import Curve, Finding, Panel
from upright.records import Array

LOOSE = 0.05
"""Jitter, as part of the period, from which straight lines between samples replace the samples."""


def examine_clock(case: Case) -> list[Finding]:
    """Findings about the time base."""
    return [*_rounding(case), *_gaps(case), *_jitter(case), *_doubled(case)]


def steps_panel(t: Array) -> Panel:
    """Time between samples, over time."""
    return Panel(label="time since last sample [ms]",
                 curves=(Curve(name="steps", t=t[1:], y=np.diff(t) * 1e3, style="points"),))  # fmt: skip


def _rounding(case: Case) -> list[Finding]:
    time = case.seen.time
    if not time.rebuilt:
        coarse = time.rounding > 0.1 * time.period and time.jitter > LOOSE * time.period
        if not coarse:
            return []
        return [
            Finding(
                kind="clock",
                columns=("time",),
                severity="warning",
                sentence=f"The time stamps are rounded to {time.rounding * 1e3:g} ms, which is coarse beside the"
                f" period of {time.period * 1e3:.4g} ms, and do not follow a uniform clock.",
                evidence={"rounding [ms]": time.rounding * 1e3, "period [ms]": time.period * 1e3},
                advice="Log the sample index, or the time with more digits.",
                panels=(steps_panel(case.record.t),),
            )
        ]
    note = next(n for n in case.seen.notes if "rebuilt from the sample index" in n)
    wander = re.search(r"wander up to ([\d.e-]+) ms", note)
    return [
        Finding(
            kind="clock",
            columns=("time",),
            severity="note",
            sentence=f"The time stamps are rounded to {time.rounding * 1e3:g} ms and wander up to"
            f" {wander[1] if wander else '?'} ms from a uniform clock of {time.period * 1e3:.6g} ms.",
            evidence={"rounding [ms]": time.rounding * 1e3, "wander [ms]": float(wander[1]) if wander else 0.0},
            advice="Nothing: the reader rebuilds the time from the sample index.",
        )
    ]


def _gaps(case: Case) -> list[Finding]:
    time = case.seen.time
    if not time.gaps:
        return []
    largest = max(time.gaps, key=lambda gap: gap.length)
    missing = sum(gap.missing for gap in time.gaps)
    many = len(time.gaps)
    return [
        Finding(
            kind="gap",
            columns=("time",),
            severity="warning" if missing > 1 or many > 1 else "note",
            sentence=f"{many} gap{'s' if many > 1 else ''} in time: about {missing} samples are missing, the longest"
            f" silence lasts {largest.length * 1e3:.4g} ms from {largest.start:.5g} s on.",
            spoils=missing > 0.1 * time.samples,
            evidence={"gaps [1]": float(many), "missing samples [1]": float(missing),
                      "longest [ms]": largest.length * 1e3},
            advice="Choose a window without the gap, or make one run of each side of it.",
            key=f"window = [{largest.start + largest.length:.6g}, \"end\"]",
            panels=(steps_panel(case.record.t),),
            marks=tuple(gap.start for gap in time.gaps[:20]),
        )
    ]  # fmt: skip


def _jitter(case: Case) -> list[Finding]:
    time = case.seen.time
    share = time.jitter / time.period
    if share < LOOSE or (time.rounding > 0 and time.jitter <= time.rounding and time.rounding > LOOSE * time.period):
        return []
    return [
        Finding(
            kind="jitter",
            columns=("time",),
            severity="warning",
            sentence=f"The samples jitter: 1 % of the steps differ from the period of {time.period * 1e3:.4g} ms by"
            f" more than {time.jitter * 1e3:.3g} ms ({100 * share:.0f} %).",
            spoils=share > 0.5,
            evidence={"jitter [ms]": time.jitter * 1e3, "period [ms]": time.period * 1e3},
            advice="A fit resamples by straight lines; set a period, or log from a loop with a fixed rate.",
            key=f'period = "{time.period * 1e3:.4g} ms"',
            panels=(steps_panel(case.record.t),),
        )
    ]


def _doubled(case: Case) -> list[Finding]:
    named = {c.name: case.record[c.name] for c in case.measured if not c.constant}
    rows = doubled_rows([(x, case.seen.column(name).quantum.step) for name, x in named.items()])
    if rows.size < 3:
        return []
    t = case.record.t
    moved = [
        (float(np.ptp(x[j - 3 : j + 4])) / float(np.ptp(x)), name, j)
        for name, x in named.items()
        for j in rows.tolist()
    ]
    _, name, i = max(moved)
    near = slice(max(i - 15, 0), i + 16)
    curve = Curve(name=name, t=t[near], y=case.record[name][near], style="points")
    return [
        Finding(
            kind="doubled",
            columns=tuple(c.name for c in case.measured if not c.constant),
            severity="warning",
            sentence=f"{rows.size} rows repeat the row before in every measured column while the rig moves"
            f" (the first at {t[rows[0]]:.5g} s): rows were written twice, or samples were missed.",
            spoils=rows.size > 0.03 * t.size,
            evidence={"doubled rows [1]": float(rows.size), "share [%]": 100 * rows.size / t.size},
            advice="Drop the doubled rows before reading; if their time goes on, each hides a missed sample.",
            panels=(Panel(label=name, curves=(curve,)),),
            marks=tuple(float(t[j]) for j in rows if near.start <= j < near.stop),
        )
    ]  # fmt: skip
