"""Efforts that did not drive the rig as logged: references, converter counts, limits, settings, trips, no effort."""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from upright.diagnosis.case import Case, column_unit
from upright.diagnosis.findings import Curve, Finding, Panel
from upright.diagnosis.forces import ForceBalance
from upright.diagnosis.motion import SmoothedMotion, driven_row, simplest
from upright.diagnosis.sensors import clipped
from upright.quantities import two_figures
from upright.readers.inspection import DAC_COUNTS_PER_VOLT
from upright.records import Array
from upright.signals.trips import TripRegression
from upright.study.draft.recognise import drive_column

STILL = 0.1
"""Seconds at the beginning in which a rig must rest before its first motion can be detected."""


def examine_effort(case: Case) -> list[Finding]:
    """Findings about the columns that drive."""
    return [*_mislabelled(case), *_copies(case), *_constant(case), *_limited(case), *_early(case)]


def _mislabelled(case: Case) -> list[Finding]:
    """Columns that are not what their name says, as the reader's inspection found."""
    findings: list[Finding] = []
    chosen = drive_column(case.record, case.inspection)
    for c in case.inspection.columns:
        for remark in c.remarks:
            kind, severity, advice, key = "", "warning", "", ""
            if "not the effort" in remark:
                kind = "effort"
                instead = chosen.name if chosen is not None and chosen.name != c.name else ""
                advice = (
                    f"Take '{instead}' as the effort." if instead
                    else "The effort is not in this log; simulate the loop that made it from this reference."
                )  # fmt: skip
                key = f'[drive]\ncolumn = "{instead}"' if instead else f'loop = {{ reference = "`{c.name}`" }}'
            elif remark.startswith("the command in DAC counts"):
                kind, severity = "effort", "warning" if "effort" in c.name.casefold() else "note"
                advice = "Divide by 819 to get volts."
                key = f'[drive]\ncolumn = "{c.name}"\nunit = "V"\nscale = {1 / 819:.6g}'
            elif remark.startswith("follows"):
                kind, advice = "effort", "Take the control effort as the input, not this column."
            elif remark.startswith("the first samples are outliers"):
                kind, advice = "spike", "Leave the first samples out of the window."
                key = f'window = [{case.record.t[min(3, len(case.record) - 1)]:.6g}, "end"]'
            if not kind or any(f.columns == (c.name,) and f.kind == kind for f in findings):
                continue
            driven = [c.name for c in case.measured][:1]
            findings.append(
                Finding(
                    kind=kind,
                    columns=(c.name,),
                    severity="note" if severity == "note" else "warning",
                    sentence=f"'{c.name}' is {remark}." if not remark.startswith(("follows", "the first"))
                    else f"'{c.name}': {remark}.",
                    evidence={"lowest [1]": c.low, "highest [1]": c.high},
                    advice=advice,
                    key=key,
                    panels=case.over_time(c.name, *driven),
                )
            )  # fmt: skip
    return findings


def _copies(case: Case) -> Iterator[Finding]:
    """An effort that repeats a measured column."""
    if not case.drive or case.drive not in case.record.signals:
        return
    for c in case.measured:
        x, u = case.record[c.name], case.record[case.drive]
        if c.name == case.drive or np.ptp(x) == 0 or np.ptp(u) == 0 or np.unique(u[:2000]).size < 12:
            continue
        a, b = x - x.mean(), u - u.mean()
        gain = float(a @ b) / float(a @ a)
        if float(np.abs(b - gain * a).max()) < 1e-6 * float(np.abs(b).max()) + 0.6 * abs(gain) * c.resolution.step:
            yield Finding(
                kind="effort",
                columns=(case.drive,),
                severity="fault",
                sentence=f"'{case.drive}' repeats the position '{c.name}' (times {gain:.6g}): no effort.",
                evidence={"factor [1]": gain},
                advice="Log the controller's output, or simulate the loop.",
                panels=case.over_time(case.drive, c.name),
            )
            return


def _constant(case: Case) -> Iterator[Finding]:
    """An effort that never changes although the rig is set in motion."""
    if not case.driven or np.ptp(case.u) > 0 or not any(not c.constant for c in case.measured):
        return
    yield Finding(
        kind="effort",
        columns=(case.drive,),
        severity="warning",
        sentence=f"'{case.drive}' is {case.u[0]:.6g} from the first to the last sample while the rig moves: a set"
        " value or a dead channel rather than what was put out.",
        evidence={"value [1]": float(case.u[0])},
        advice="Log the effort as applied; for a free motion say so.",
        key="drive = 0",
        panels=case.over_time(case.drive, *[c.name for c in case.measured][:1]),
    )


def _limited(case: Case) -> Iterator[Finding]:
    """Effort cut off at its limit."""
    for c in case.inspection.columns:
        reference = any(word in c.name.casefold() for word in ("command", "target", "ref"))
        if not c.drive or c.constant or c.stepwise or reference:
            continue
        low, high, share = clipped(case.record[c.name], c.resolution.step, inertia=False)
        if share < 0.0002:
            continue
        ends = " and ".join(f"{v:.5g}" for v in (low, high) if v == v)
        limit = max(abs(v) for v in (low, high) if v == v)
        unit = column_unit(c)
        yield Finding(
            kind="saturation",
            columns=(c.name,),
            severity="warning" if share > 0.005 else "note",
            sentence=f"'{c.name}' is cut off at {ends} {unit} for {two_figures(100 * share)} % of the samples:"
            " the drive is at its limit, where a controller no longer acts.".replace("  ", " "),
            evidence={"share [%]": 100 * share, f"limit [{unit or 1}]": limit},
            advice="Tell the model the limit; ask for less where linear behaviour is wanted.",
            key=f"[actuator]\nlimit = {limit:.6g}",
            panels=case.over_time(c.name),
        )


def _early(case: Case) -> Iterator[Finding]:
    """Motion that begins from rest before the effort does."""
    if not case.driven or case.u[0] != 0:
        return
    t = case.record.t
    command = int(np.argmax(case.u != 0))
    still = max(int(np.searchsorted(t, t[0] + STILL)), 5)
    if command <= still:
        return
    first, who = len(t), ""
    for c in case.measured:
        x = case.record[c.name]
        span = float(np.ptp(x))
        if case.held(c) or span == 0 or np.ptp(x[:still]) > max(0.005 * span, 2 * c.resolution.step):
            continue
        far = np.abs(x[:command] - x[0]) > max(0.03 * span, 6 * c.resolution.step)
        if far.any() and int(np.argmax(far)) < first:
            first, who = int(np.argmax(far)), c.name
    ahead = float(t[command] - t[min(first, command)])
    if not who or ahead < max(0.02, 3 * case.record.period):
        return
    yield Finding(
        kind="early",
        columns=(who, case.drive),
        severity="fault",
        sentence=f"'{who}' moves at {t[first]:.4g} s, {ahead:.3g} s before the first command of '{case.drive}' at"
        f" {t[command]:.4g} s: an earlier one was not logged, the clocks differ, or a hand moved it.",
        evidence={"motion [s]": float(t[first]), "command [s]": float(t[command])},
        advice="Begin the window after the first command.",
        key=f'window = [{t[command]:.5g}, "end"]',
        panels=case.over_time(who, case.drive),
        marks=(float(t[first]), float(t[command])),
    )


def examine_settings(case: Case) -> Iterator[Finding]:
    """Settings in ``runParameters`` that the data contradict: ECP's MATLAB front end shifts its fields."""
    note = next((n for n in case.inspection.notes if n.startswith("runParameters:")), "")
    fields = {m[1]: float(m[2]) for m in re.finditer(r"(\w+) = (-?\d+(?:\.\d+)?(?:e-?\d+)?)", note)}
    if not {"Amplitude", "Reps"} <= fields.keys():
        return
    dac = [c for c in case.inspection.columns if any(remark.startswith("the command in DAC") for remark in c.remarks)]
    stored, repetitions = fields["Amplitude"], fields["Reps"]
    if not dac:
        return
    levels = np.unique(case.record[dac[0].name])
    ran = float(levels[np.argmax(np.abs(levels))]) / DAC_COUNTS_PER_VOLT
    evidence = {"stored amplitude [V]": stored, "stored repetitions [1]": repetitions, "ran [V]": round(ran, 3)}
    if abs(stored - ran) < 0.01 or ran == 0:
        return
    shifted = abs(repetitions - ran) < 0.01
    yield Finding(
        kind="settings",
        columns=("runParameters",),
        severity="warning",
        sentence="The fields of runParameters are shifted: "
        f"'Reps' holds the step of {repetitions:g} V and 'Amplitude' the repetitions ({stored:g})."
        if shifted
        else f"runParameters says {stored:g} V, but '{dac[0].name}' ran {ran:.3g} V.",
        evidence=evidence,
        advice=f"Trust '{dac[0].name}', not the settings.",
    )


LEAST = 0.7
"""Of what may stay unexplained before a trip, this part must be exceeded with all of the effort."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Push:
    """How the effort explains what friction and springs leave of the driven body's force or acceleration.

    `without`, `full` and `cut` are shares of it left without effort, with all of it, and with the effort until `end`
    [s]; `after` is the force per unit after `end` beside that before, 0 unless it explains something; `late` is the
    share of the effort after `end`; `rest` (N,) is what is to be explained.
    """

    without: float
    full: float
    cut: float
    end: float
    after: float
    late: float
    rest: Array
    t: Array
    u: Array


def push_of(motion: SmoothedMotion, balance: ForceBalance | None) -> Push | None:
    """What the effort explains; None without an effort on a measured body."""
    if not np.ptp(motion.u) > 0:
        return None
    driven = [c.name for c in motion.plant.coordinates].index(motion.plant.inputs[0].on)
    here = swift(motion, driven)
    if np.count_nonzero(here) < 40 or driven not in motion.rows:
        return None
    if balance is not None:
        k = motion.rows.index(driven)
        tau, _ = balance.needed(np.ones((1, len(balance.names))))
        explained = [(tau[0, k][here], balance.friction[k][here])]
    else:
        explained = driven_row(motion, here)
    if not explained:
        return None
    u, t, rows = motion.u[here], motion.t[here], motion.samples[here]
    live = np.flatnonzero(np.abs(u) > 0.02 * float(np.abs(u).max()))
    if live.size < 8:
        return None
    first, last = int(rows[live[0]]), int(rows[live[-1]]) + 1
    tables = [
        TripRegression(rows=rows, target=y, base=others, switched=motion.command[:, None], weights=motion.weights)
        for y, others in explained
    ]
    ends = [table.search(first, last, forward=False) for table in tables]
    best = simplest([min(costs.values()) for _, costs in ends])
    table, (end, costs) = tables[best], ends[best]
    (early,) = table.before(np.array([end]))
    late = table.whole - early
    after = 1.0
    if float(np.sum(late**2)) > 1e-9 * float(u @ u):
        left, g = table.explain(np.vstack([early, late]))
        after = float(g[1] / g[0]) if g[0] and left < 0.6 * costs[end] else 0.0
    speed = motion.v[driven][here]
    sliding = np.abs(speed) > 0.1 * float(np.abs(speed).max())
    return Push(
        without=float(table.explain(early[:0])[0]),
        full=float(table.explain(table.whole)[0]),
        cut=costs[end],
        end=float(motion.t[0] + (end - motion.samples[0]) * motion.dt),
        after=after,
        late=float(np.sum(late[:, sliding] ** 2)) / float(u @ u),
        rest=table.rest,
        t=t,
        u=u,
    )


def swift(motion: SmoothedMotion, i: int) -> NDArray[np.bool_]:
    """Samples (N,) at which a body is clearly on its way: then friction is known up to a number, and cannot hide."""
    return np.abs(motion.v[i]) > 0.05 * float(np.abs(motion.v[i]).max())


def examine_push(case: Case, push: Push, *, most: float) -> list[Finding]:
    """A silent trip, when the effort before it leaves less than `most` unexplained."""
    t, end = case.record.t, push.end
    driven = next(iter(case.places.values())).column
    tripped = (
        push.cut < most and push.cut < 0.5 * push.full and push.cut < 0.5 * push.without and abs(push.after) < 0.45
    )
    live = np.flatnonzero(case.u)
    strong = push.t[np.abs(push.u) > 0.1 * float(np.abs(push.u).max())]
    first, last = float(strong[0]), float(strong[-1])
    lasted = end - first > 0.05 * (last - first)  # a kick at the start is no drive that worked until then
    if tripped and lasted and push.late > 0.04 and push.full > LEAST * most:
        return [
            Finding(
                kind="trip",
                columns=(case.drive,),
                severity="fault",
                sentence=f"The drive trips silently: '{case.drive}' is logged until {t[live[-1]]:.4g} s, but from about"
                f" {end:.4g} s on '{driven}' moves as if there were none ({100 * push.full:.0f} % of its force is"
                f" unexplained with all of the effort, {100 * push.cut:.1f} % with what came before).",
                evidence={"end [s]": end, "logged end [s]": float(t[live[-1]]), "unexplained with all [%]":
                          100 * push.full, "unexplained with the first part [%]": 100 * push.cut},
                advice="Ask for the end of the effective input, or end the window there.",
                key='unknown = ["initial", "input_end"]',
                panels=(*case.over_time(driven, case.drive), _panel(case, push)),
                marks=(end,),
            )
        ]  # fmt: skip
    return []


def examine_uselessness(case: Case, push: Push) -> Iterator[Finding]:
    """An effort column that explains little of the force that the driven body needs."""
    if push.without < 0.3 or push.full < 0.95 * push.without:
        return
    driven = next(iter(case.places.values())).column
    explains = 100 * (1 - push.full / push.without)
    yield Finding(
        kind="effort",
        columns=(case.drive,),
        severity="warning",
        sentence=f"'{case.drive}' acts like no effort: friction and springs leave {100 * push.without:.0f} %"
        f" of the driven body's force, and of that '{case.drive}' explains {explains:.0f} %.",
        evidence={"left to explain [%]": 100 * push.without, "explained by it [%]": explains},
        advice="Look for the column the controller put out; a reference or a set value is no effort.",
        key='[drive]\ncolumn = "..."',
        panels=(*case.over_time(driven, case.drive), _panel(case, push)),
    )


def _panel(case: Case, push: Push) -> Panel:
    """What the effort must explain beside the effort, each as a share of its largest value."""
    return Panel(label="what effort must explain\n(scaled)", curves=(
        Curve(name="needed", t=push.t, y=push.rest / (float(np.abs(push.rest).max()) or 1.0)),
        Curve(name=f"'{case.drive}'", t=push.t, y=push.u / (float(np.abs(push.u).max()) or 1.0)),
    ))  # fmt: skip
