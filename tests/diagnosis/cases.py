"""Cases made by hand: a record of given columns, and what its inspection says of them, changed where a test says so."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from upright.diagnosis.case import Case, Place
from upright.readers.inspection import inspect_record
from upright.records import Provenance, Record


def case(
    dt: float = 0.01,
    *,
    units: Mapping[str, str] | None = None,
    measured: tuple[str, ...] = (),
    drive: str = "",
    columns: Mapping[str, Mapping[str, Any]] | None = None,
    notes: tuple[str, ...] = (),
    t: np.ndarray | None = None,
    **signals: np.ndarray,
) -> Case:
    """A case of columns in metres where nothing else is said; `columns` says otherwise of their inspection."""
    log = {name: np.asarray(x, dtype=np.float64) for name, x in signals.items()}
    n = len(next(iter(log.values())))
    given = dict.fromkeys(log, "m") | ({drive: "V"} if drive in log else {}) | dict(units or {})
    record = Record(
        t=np.arange(n) * dt if t is None else t, signals=log, units={k: v for k, v in given.items() if v},
        provenance=Provenance(file="log.csv", reader="table", notes=notes),
    )  # fmt: skip
    inspection = inspect_record(record)
    said = columns or {}
    inspection = replace(inspection, columns=tuple(replace(c, **said.get(c.name, {})) for c in inspection.columns))
    places = {
        f"q_{name}": Place(column=name, y=log[name], resolution=1e-5, unit=given[name]) for name in measured
    }  # fmt: skip
    u = log[drive] if drive in log else np.zeros(n)
    return Case(record=record, inspection=inspection, places=places, drive=drive, u=u)
