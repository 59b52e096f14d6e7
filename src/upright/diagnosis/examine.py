"""One record in, everything that looks wrong out."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from upright.diagnosis.case import Case, case_of
from upright.diagnosis.clock import examine_clock
from upright.diagnosis.effort import examine_effort, examine_push, examine_settings, examine_uselessness, push_of
from upright.diagnosis.findings import KINDS, SEVERITIES, Diagnosis, Finding
from upright.diagnosis.forces import ForceBalance, against_form, against_gain, against_numbers, friction_of, values_of
from upright.diagnosis.motion import SmoothedMotion, motion_of, sign_terms
from upright.diagnosis.rest import examine_rest
from upright.diagnosis.sensors import examine_sensors
from upright.physics import Plant, name_of
from upright.readers.inspection import inspect_record
from upright.records import Record
from upright.rig import Rig
from upright.study.draft.suits import plants_that_suit
from upright.study.sensors import Wiring, with_derived

HOPELESS = frozenset({"dead", "stuck", "gap", "doubled", "jitter"})
"""Findings after which equations of motion are not evaluated: they would only repeat them."""


def examine(
    record: Record, rig: Rig | type[Plant] | None = None, wiring: Wiring | None = None, *,
    before: tuple[Finding, ...] = (),
) -> Diagnosis:  # fmt: skip
    """Everything that looks wrong with a record.

    Parameters
    ----------
    rig : Rig or type of Plant, optional
        What needs one is left out without; what needs numbers is left out where only the kind of plant is known.
    wiring : Wiring, optional
        Which column is what, from `read_known`; recognised without.
    before : tuple of Finding
        What was found, and mended, while the log was read.
    """
    wiring = wiring or Wiring()
    record = record if wiring.study is None else with_derived(record, wiring.study)
    inspection = inspect_record(record)
    case = case_of(record, inspection, rig, wiring)
    findings = [*before, *examine_clock(case)]
    sensors, mended = examine_sensors(case)
    if mended is not None:
        case = replace(case_of(mended, inspection, rig, wiring), drive=case.drive, u=case.u)
    findings += [*sensors, *examine_effort(case), *examine_rest(case), *examine_settings(case)]
    unchecked = _unchecked(case)
    forces, reasons = _forces(case, findings)
    if any(f.kind == "scale" for f in forces):  # what looks held is only read on another scale
        findings = [f for f in findings if f.kind != "creep"]
    findings += forces
    unchecked |= reasons
    order = {s: i for i, s in enumerate(SEVERITIES)}
    return Diagnosis(
        file=inspection.file,
        rig="" if rig is None else rig.name if isinstance(rig, Rig) else name_of(rig) or rig.__name__,
        samples=len(record),
        duration=inspection.time.duration,
        findings=tuple(sorted(findings, key=lambda f: order[f.severity])),
        checked=tuple(k for k in KINDS if k not in unchecked and (k != "settings" or _settings(case))),
        unchecked=unchecked,
        rigs=plants_that_suit(case.record, inspection) if rig is None else (),
    )


def _unchecked(case: Case) -> dict[str, str]:
    """What this record cannot tell, whatever the rig."""
    out: dict[str, str] = {}
    if not case.drive:
        idle = [c.name for c in case.inspection.columns if c.idle]
        no = f"'{idle[0]}' is zero throughout" if idle else "the log has no effort column that could be recognised"
        out |= dict.fromkeys(("effort", "trip", "early"), no)
    elif not case.driven:
        out |= dict.fromkeys(("trip", "early"), f"the effort '{case.drive}' is zero throughout")
    elif case.u[0] != 0:
        out["early"] = f"'{case.drive}' acts from the first sample on"
    if case.plant is None:
        out |= dict.fromkeys(("sign", "scale", "trip"), "the rig is not specified; name it with --rig")
    return out


def _settings(case: Case) -> bool:
    return any(n.startswith("runParameters") for n in case.inspection.notes)


def _forces(case: Case, findings: list[Finding]) -> tuple[list[Finding], dict[str, str]]:
    """What effort and motion say about each other, and why they do not where they do not."""
    if case.plant is None:
        return [], {}
    spoilt = next((f for f in findings if f.kind in HOPELESS and f.severity != "note" and f.spoils), None)
    motion: SmoothedMotion | str = (
        f"after the {spoilt.kind} found above, mend that first" if spoilt is not None else motion_of(case)
    )
    if isinstance(motion, str):
        return [], dict.fromkeys(("sign", "scale", "trip"), motion)
    blamed = {f.columns for f in findings if f.kind == "effort" and f.severity != "note"}
    faulty = (case.drive,) in blamed and not _in_dac(case)
    numbers = values_of(case, friction_of(case.plant))
    out: list[Finding] = []
    reasons: dict[str, str] = {}
    balance: ForceBalance | None = None
    if isinstance(numbers, str):
        reasons["scale"] = numbers
    else:
        balance = ForceBalance(motion, *numbers)
        balance.used = balance.used and not faulty
    push = None if faulty else push_of(motion, balance)
    conventions = against_numbers(case, balance) if balance is not None else []
    trip = examine_push(case, push, most=0.35 if balance is None else 0.15) if push is not None else []
    if conventions and trip and push is not None and 100 * push.cut > min(f.left for f in conventions):
        trip = []  # the other convention explains the whole record better than an end of the effort does
    if push is not None and trip:  # what the drive did before it tripped still tells signs and scales
        motion = replace(motion, u=np.where(motion.t < push.end, motion.u, 0.0))
        conventions = against_numbers(case, ForceBalance(motion, *numbers)) if not isinstance(numbers, str) else []
    if balance is None:
        signed = [x for x in sign_terms(motion) if not (faulty and x.who[0] == "effort")]
        conventions = against_form(case, motion, signed)
        if not signed:
            reasons["sign"] = "the record holds no motion whose sign is known"
    out += [*trip, *conventions]
    rough = any(f.kind in HOPELESS for f in findings)  # accelerations are then too uneven to blame the effort
    if not out and not rough and balance is not None and push is not None:
        out += against_gain(case, balance)
    if not out and not rough and push is not None:
        out += examine_uselessness(case, push)
    if push is None and case.driven:
        reasons["trip"] = "the effort column is none" if faulty else "the driven body was not measured or did not move"
    return out, reasons


def _in_dac(case: Case) -> bool:
    """Whether the effort is one in converter counts, which acts all the same."""
    return any(
        remark.startswith("the command in DAC")
        for c in case.inspection.columns
        if c.name == case.drive
        for remark in c.remarks
    )
