"""What a call hands over, as the verbs take it: logs, values with or without a unit, poles, pairs of name and value.

A text is read as the command line reads it; a number is in SI units with radians.
"""

from __future__ import annotations

import math
import os
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, Protocol, TypeVar

from upright.errors import BadInput, nearest

if TYPE_CHECKING:
    from concurrent.futures import Executor

    import numpy as np
    from numpy.typing import NDArray

    from upright.files import PathLike
    from upright.records import Record

T = TypeVar("T")


class Frame(Protocol):
    """What a pandas data frame is recognised by, so that pandas need not be there."""

    @property
    def columns(self) -> Any:
        """Names of the columns."""
        ...

    @property
    def iloc(self) -> Any:
        """Rows and columns by number."""
        ...


if TYPE_CHECKING:
    Workforce = int | str | Executor
    """Who shares work: a number of processes, the address of a Dask scheduler, or an executor."""
    Log = PathLike | Record | Frame
    """A log: its file, a record, or a data frame."""


def open_log(log: Log, reader: str | None = None, time_unit: str | None = None) -> tuple[Record, Path]:
    """Record of a log and the path that it is called by; ``log`` for one that comes from no file.

    A `time_unit` is that of a time column which states none, or the time between two rows where there is none.

    Raises
    ------
    BadInput
        When it is none, or the file cannot be read.
    """
    if isinstance(log, str | os.PathLike):
        from upright.readers import read
        from upright.study.clock import counts_rows, with_time_unit

        path, unit = Path(log), time_unit or ""
        return with_time_unit(read(path, reader=reader, counted=counts_rows(unit)), unit), path
    from upright.records import Record

    if not isinstance(log, Record):
        if not (hasattr(log, "columns") and hasattr(log, "iloc")):
            raise BadInput(f"a log is a file's name, a Record or a pandas DataFrame, got {log!r:.60}.")
        log = Record.from_pandas(log)
    name = log.provenance.file or "log"
    return log.replace(provenance=replace(log.provenance, file=name)), Path(name)


def si(value: float | str, unit: str) -> float:
    """Value in SI: a text such as ``"2 mm"`` is converted, a plain number is taken to be in SI already.

    Raises
    ------
    BadInput
        When the text is no value of this dimension, or the number is not finite.
    """
    if isinstance(value, str):
        from upright.units import parse

        return parse(value, unit)
    try:
        number = float(value)
    except (TypeError, ValueError):
        raise BadInput(
            f"a number was needed, in the SI unit of {unit or '1'}, or a text with its unit, got {value!r:.40}."
        ) from None
    if not math.isfinite(number):
        raise BadInput(f"a finite number was needed, in the SI unit of {unit or '1'}, got {number}.")
    return number


def si_if_given(value: float | str | None, unit: str) -> float | None:
    """The same for an option that may be left out, as None or an empty text."""
    return None if value is None or value == "" else si(value, unit)


Start = str | Mapping[str, float | str]
"""Deviation by state, `read_start`."""


def read_start(start: Start | None, states: Sequence[str], units: Sequence[str]) -> dict[str, float]:
    """Deviation from an equilibrium by state: ``{"theta": "5 deg"}``, ``"theta=5 deg, theta_dot=1 rad/s"``.

    A value alone is of the last coordinate, whose state comes before the last.

    Raises
    ------
    BadInput
        When there is no such state, or a value is none of its unit.
    """
    from upright.units import scale

    values: dict[str, float | str]
    if isinstance(start, str):
        pieces = [piece.rpartition("=") for piece in start.split(",") if piece.strip()]
        values = {(name.strip() or states[-2]): value for name, _, value in pieces}
    elif start is None or isinstance(start, Mapping):  # type: ignore[reportUnnecessaryIsInstance]
        values = dict(start or {})
    else:
        raise BadInput(f"a start names states, such as {{'{states[-2]}': '5 deg'}} or '5 deg', got {start!r:.40}.")
    unit = dict(zip(states, units, strict=True))
    for name in values:
        if name not in unit:
            raise BadInput(f"--start names states as in \"theta=5 deg\", got '{name}'; {nearest(name, states)}")
    return {n: si(v, unit[n]) / (scale(unit[n]) if isinstance(v, str) else 1.0) for n, v in values.items()}


def read_pole_list(value: str | Iterable[complex] | None) -> NDArray[np.complex128] | None:
    """Poles [1/s] of a text such as ``"-4+-2j, -10"`` or of numbers, a pair as two; None where none are given."""
    if value is None or isinstance(value, str):
        from upright.gains.requests import read_poles

        return read_poles(value) if value else None
    import numpy as np

    try:
        poles = np.atleast_1d(np.asarray(value, dtype=np.complex128)).ravel()
    except (TypeError, ValueError):
        raise BadInput(f'poles are numbers [1/s] or a text such as "-4+-2j, -10", got {value!r:.60}.') from None
    return poles if poles.size else None


def pairs(value: Mapping[str, T] | Sequence[str] | str | None, option: str) -> dict[str, T | str]:
    """Values by name, of a mapping or of texts NAME=VALUE.

    Raises
    ------
    BadInput
        When a text is no such pair.
    """
    if isinstance(value, Mapping):
        return dict(value)
    out: dict[str, T | str] = {}
    for text in texts(value):
        name, equals, content = text.partition("=")
        if not equals or not name.strip() or not content.strip():
            raise BadInput(f"{option} takes NAME=VALUE, got '{text}'.")
        out[name.strip()] = content.strip()
    return out


def texts(value: Sequence[str] | str | None) -> tuple[str, ...]:
    """Several texts of an option that may be one or none."""
    if isinstance(value, str):
        return (value,) if value else ()
    if value is not None and not isinstance(value, Iterable):  # type: ignore[reportUnnecessaryIsInstance]
        raise BadInput(f"a text or several were needed, got {value!r:.40}.")
    return () if value is None else tuple(value)


def path_of(value: Any, what: str) -> Path:
    """The path that something is named by.

    Raises
    ------
    BadInput
        When it is none.
    """
    if not isinstance(value, str | os.PathLike):
        raise BadInput(f"{what} is named by its file, got {type(value).__name__}.")
    return Path(value)


def paths(value: Sequence[T] | T | None) -> tuple[T, ...]:
    """Several logs or files of an argument that may be one or none."""
    if value is None:
        return ()
    return tuple(value) if isinstance(value, list | tuple) else (value,)  # type: ignore[return-value]
