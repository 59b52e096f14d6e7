"""Efforts that did not drive the rig as logged: references, converter counts, limits, settings, motion before them."""

from __future__ import annotations

import re

import numpy as np

from upright.diagnosis.case import Case, unit_of
from upright.diagnosis.findings import Finding
from upright.diagnosis.sensors import clipped
from upright.readers.suspect_columns import DAC_COUNTS_PER_VOLT
from upright.study.draft.recognise import drive_column

HELD = 0.2
"""A body that moves less than this part of the largest motion was held."""
STILL = 0.1
"""Seconds at the beginning in which a rig must lie still before its first motion can be told."""


def examine_effort(case: Case) -> list[Finding]:
    """Findings about the columns that drive."""
    return [*_lies(case), *_copies(case), *_constant(case), *_limited(case), *_early(case)]


def _lies(case: Case) -> list[Finding]:
    """Columns that are not what their name says, as the reader's inspection found."""
    found: list[Finding] = []
    chosen = drive_column(case.record, case.inspection)
    for c in case.inspection.columns:
        for lie in c.lies:
            kind, severity, advice, key = "", "warning", "", ""
            if "not the effort" in lie:
                kind = "effort"
                instead = chosen.name if chosen is not None and chosen.name != c.name else ""
                advice = (
                    f"Take '{instead}' as the effort." if instead
                    else "The effort is not in this log; simulate the loop that made it from this reference."
                )  # fmt: skip
                key = f'[drive]\ncolumn = "{instead}"' if instead else f'loop = {{ reference = "`{c.name}`" }}'
            elif lie.startswith("the command in DAC counts"):
                kind, severity = "effort", "warning" if "effort" in c.name.casefold() else "note"
                advice = "Divide by 819 to get volts."
                key = f'[drive]\ncolumn = "{c.name}"\nunit = "V"\nscale = {1 / 819:.6g}'
            elif lie.startswith("follows"):
                kind, advice = "effort", "Take the control effort as the input, not this column."
            elif lie.startswith("the first samples are outliers"):
                kind, advice = "spike", "Leave the first samples out of the window."
                key = f'window = [{case.record.t[min(3, len(case.record) - 1)]:.6g}, "end"]'
            if not kind or any(f.columns == (c.name,) and f.kind == kind for f in found):
                continue
            driven = [c.name for c in case.measured][:1]
            found.append(
                Finding(
                    kind=kind,
                    columns=(c.name,),
                    severity="note" if severity == "note" else "warning",
                    sentence=f"'{c.name}' is {lie}." if not lie.startswith(("follows", "the first"))
                    else f"'{c.name}': {lie}.",
                    evidence={"lowest [1]": c.low, "highest [1]": c.high},
                    advice=advice,
                    key=key,
                    panels=case.over_time(c.name, *driven),
                )
            )  # fmt: skip
    return found


def _copies(case: Case) -> list[Finding]:
    """An effort that repeats a measured column."""
    if not case.drive or case.drive not in case.record.signals:
        return []
    for c in case.measured:
        x, u = case.record[c.name], case.record[case.drive]
        if c.name == case.drive or np.ptp(x) == 0 or np.ptp(u) == 0 or np.unique(u[:2000]).size < 12:
            continue
        a, b = x - x.mean(), u - u.mean()
        gain = float(a @ b) / float(a @ a)
        if float(np.abs(b - gain * a).max()) < 1e-6 * float(np.abs(b).max()) + 0.6 * abs(gain) * c.quantum.step:
            return [
                Finding(
                    kind="effort",
                    columns=(case.drive,),
                    severity="fault",
                    sentence=f"'{case.drive}' repeats the position '{c.name}' (times {gain:.6g}): no effort.",
                    evidence={"factor [1]": gain},
                    advice="Log the controller's output, or simulate the loop.",
                    panels=case.over_time(case.drive, c.name),
                )
            ]
    return []


def _constant(case: Case) -> list[Finding]:
    """An effort that never changes although the rig is set in motion."""
    if not case.driven or np.ptp(case.u) > 0 or not any(not c.constant for c in case.measured):
        return []
    return [
        Finding(
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
    ]


def _limited(case: Case) -> list[Finding]:
    """Effort cut off at its limit."""
    found: list[Finding] = []
    for c in case.inspection.columns:
        asked = any(word in c.name.casefold() for word in ("command", "target", "ref"))
        if not c.drive or c.constant or c.stepwise or asked:
            continue
        low, high, share = clipped(case.record[c.name], c.quantum.step, inertia=False)
        if share < 0.0002:
            continue
        ends = " and ".join(f"{v:.5g}" for v in (low, high) if v == v)
        limit = max(abs(v) for v in (low, high) if v == v)
        unit = unit_of(c)
        found.append(
            Finding(
                kind="saturation",
                columns=(c.name,),
                severity="warning" if share > 0.005 else "note",
                sentence=f"'{c.name}' is cut off at {ends} {unit} for {100 * share:.2g} % of the samples: the drive is"
                " at its limit, where a controller no longer acts.".replace("  ", " "),
                evidence={"share [%]": 100 * share, f"limit [{unit or 1}]": limit},
                advice="Tell the model the limit; ask for less where linear behaviour is wanted.",
                key=f"[actuator]\nlimit = {limit:.6g}",
                panels=case.over_time(c.name),
            )
        )
    return found


def _early(case: Case) -> list[Finding]:
    """Motion that begins from rest before the effort does."""
    if not case.driven or case.u[0] != 0:
        return []
    t = case.record.t
    command = int(np.argmax(case.u != 0))
    still = max(int(np.searchsorted(t, t[0] + STILL)), 5)
    if command <= still:
        return []
    first, who = len(t), ""
    for c in case.measured:
        x = case.record[c.name]
        span = float(np.ptp(x))
        if (
            (case.chained and case.beside(c) < HELD)
            or span == 0
            or np.ptp(x[:still]) > max(0.005 * span, 2 * c.quantum.step)
        ):
            continue
        far = np.abs(x[:command] - x[0]) > max(0.03 * span, 6 * c.quantum.step)
        if far.any() and int(np.argmax(far)) < first:
            first, who = int(np.argmax(far)), c.name
    ahead = float(t[command] - t[min(first, command)])
    if not who or ahead < max(0.02, 3 * case.record.period):
        return []
    return [
        Finding(
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
    ]


def examine_settings(case: Case) -> list[Finding]:
    """Settings in ``runParameters`` that the data contradict: ECP's MATLAB front end shifts its fields."""
    note = next((n for n in case.inspection.notes if n.startswith("runParameters:")), "")
    fields = {m[1]: float(m[2]) for m in re.finditer(r"(\w+) = (-?\d+(?:\.\d+)?(?:e-?\d+)?)", note)}
    if not {"Amplitude", "Reps"} <= fields.keys():
        return []
    dac = [c for c in case.inspection.columns if any(lie.startswith("the command in DAC") for lie in c.lies)]
    stored, repetitions = fields["Amplitude"], fields["Reps"]
    if not dac:
        return []
    levels = np.unique(case.record[dac[0].name])
    ran = float(levels[np.argmax(np.abs(levels))]) / DAC_COUNTS_PER_VOLT
    evidence = {"stored amplitude [V]": stored, "stored repetitions [1]": repetitions, "ran [V]": round(ran, 3)}
    if abs(stored - ran) < 0.01 or ran == 0:
        return []
    shifted = abs(repetitions - ran) < 0.01
    return [
        Finding(
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
    ]
