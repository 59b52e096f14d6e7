"""A frequency response from a table of somebody else's program: an analyser's, MATLAB's, a spreadsheet's."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from upright import units
from upright.errors import BadInput
from upright.identification.frequency.response import Array, Complex, FrequencyResponse
from upright.readers.formats import excel
from upright.readers.formats.delimited import layout
from upright.readers.responses import UNITS, ResponseColumn, response_columns
from upright.readers.source import TextTable, load


def is_table(path: Path) -> bool:
    """Whether a file is a table whose columns are named like those of a frequency response."""
    try:
        return bool(response_columns(_table(path).names))
    except BadInput:
        return False


def response_of_table(path: Path, signals: Mapping[str, str] | None = None) -> FrequencyResponse:
    """Response of a table: frequency, and magnitude and phase, or real and imaginary part, of each output.

    Parameters
    ----------
    path : Path
        Text with a line of names. The units in the names say what is Hz or rad/s, dB or a ratio, deg or rad; what had
        to be guessed stands in the notes.
    signals : mapping of str to str, optional
        A column of each output by the name that it is to have.

    Raises
    ------
    BadInput
        When a column is missing, or the frequencies do not increase.
    """
    text = _table(path)
    frequency, *held = response_columns(text.names)
    table = text.numbers()
    notes: list[str] = []
    omega = table[:, frequency.at] * _per_second(frequency, notes)
    order = np.argsort(omega, kind="stable")
    order = order[(omega[order] > 0) & np.isfinite(table[order]).all(axis=1)]
    if order.size < omega.size:
        notes.append(f"{omega.size - order.size} rows are left out: no frequency above 0, or no number.")
    names = _named(path, held, signals or {})
    parts = [_output(path, [c for c in held if c.output == own], table[order], notes) for own in names]
    response, coherence = np.column_stack([p[0] for p in parts]), np.column_stack([p[1] for p in parts])
    return FrequencyResponse(
        omega=omega[order], response=response, outputs=tuple(names.values()), coherence=coherence, notes=tuple(notes),
        units=(*(_si(held, own)[1] for own in names), ""),
    ).with_scatter()  # fmt: skip


def _table(path: Path) -> TextTable:
    source = load(path)
    return layout(excel.first_sheet(source)[1] if excel.READER.recognises(source) else source)


def _per_second(column: ResponseColumn, notes: list[str]) -> float:
    """Frequency in rad/s per unit of a column."""
    if column.unit in UNITS:
        return UNITS[column.unit]
    angular = column.name.casefold().strip()[:1] in ("w", "o", "ω")
    notes.append(f"'{column.name}' states no unit and is taken as {'rad/s' if angular else 'Hz'}.")
    return 1.0 if angular else UNITS["hz"]


def _named(path: Path, held: Sequence[ResponseColumn], signals: Mapping[str, str]) -> dict[str, str]:
    """Name of each output as asked, by its own."""
    own = list(dict.fromkeys(c.output for c in held if c.kind in ("magnitude", "real")))
    if not signals:
        return {o: o or "y" for o in own}
    names: dict[str, str] = {}
    for name, column in signals.items():
        output = next((c.output for c in held if column in (c.name, c.output)), None)
        if output is None:
            raise BadInput(f"'{path}' has no column '{column}'; its columns are {', '.join(c.name for c in held)}.")
        names[output] = name
    return names


def _output(path: Path, held: Sequence[ResponseColumn], table: Array, notes: list[str]) -> tuple[Complex, Array]:
    """Response of one output [SI per unit of the command], and its coherence."""
    column = {c.kind: c for c in held}
    values = {kind: table[:, c.at] for kind, c in column.items()}
    scale = _si(held, held[0].output)[0]
    coherence = values.get("coherence", np.ones(table.shape[0]))
    if {"real", "imaginary"} <= values.keys():
        return np.asarray(scale * (values["real"] + 1j * values["imaginary"]), dtype=np.complex128), coherence
    if not {"magnitude", "phase"} <= values.keys():
        raise BadInput(
            f"'{path}' needs magnitude and phase, or real and imaginary part, of each output; got "
            f"{', '.join(c.name for c in held)}. Export both."
        )
    magnitude, phase = values["magnitude"], values["phase"]
    level, turn = column["magnitude"], column["phase"]
    if level.unit == "db" or (magnitude <= 0).any():  # no ratio is below 0
        magnitude = 10 ** (magnitude / 20)
        if level.unit != "db":
            notes.append(f"'{level.name}' goes below 0 and is taken as dB.")
    elif not level.unit:
        notes.append(f"'{level.name}' states no unit and is taken as a ratio, not as dB.")
    factor = UNITS.get(turn.unit, 0.0)
    if not factor:
        factor = UNITS["deg" if np.abs(phase).max() > 7 else "rad"]
        notes.append(f"'{turn.name}' states no unit and is taken as {'rad' if factor == 1 else 'deg'}.")
    return np.asarray(scale * magnitude * np.exp(1j * factor * phase), dtype=np.complex128), coherence


def _si(held: Sequence[ResponseColumn], own: str) -> tuple[float, str]:
    """Factor to SI of an output, and its unit, where a column states one: ``Magnitude [deg/V]``."""
    for c in held:
        above = c.unit.partition("/")[0].strip()
        if c.output == own and c.kind != "phase" and above and above != "db" and units.known(above):
            for si in ("rad", "m"):
                if units.same_dimension(above, si):
                    return units.scale(above), si
    return 1.0, ""
