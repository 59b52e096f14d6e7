"""Do the settings stored beside the data agree with the data? ECP's MATLAB front end shifts its fields."""

from __future__ import annotations

import re

import numpy as np

from upright.doctor.case import Case
from upright.doctor.findings import Finding
from upright.readers.suspect_columns import DAC_COUNTS_PER_VOLT


def examine_settings(case: Case) -> list[Finding]:
    """Findings about ``runParameters``."""
    note = next((n for n in case.seen.notes if n.startswith("runParameters:")), "")
    fields = {m[1]: float(m[2]) for m in re.finditer(r"(\w+) = (-?\d+(?:\.\d+)?(?:e-?\d+)?)", note)}
    if not {"Amplitude", "Reps"} <= fields.keys():
        return []
    dac = [c for c in case.seen.columns if any(lie.startswith("the command in DAC") for lie in c.lies)]
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
