"""Signals of a capture of dSPACE's ControlDesk saved for MATLAB: a structure of X, the times, and Y, the signals."""

from __future__ import annotations

import re
from collections.abc import Mapping
from typing import Any

import numpy as np

from upright.records import Array

Capture = tuple[Array, dict[str, Array], list[str]]
"""Time (N,) [s], columns (N,) by name with their units in brackets, notes."""


def captured(content: Mapping[str, Any]) -> Capture | None:
    """The signals of the first capture on its longest time; None where there is none."""
    for value in content.values():
        if not (isinstance(value, dict) and {"X", "Y"} <= value.keys()):
            continue
        times = [_data(axis) for axis in _several(value["X"])]
        signals = [s for s in _several(value["Y"]) if isinstance(s, dict) and _data(s) is not None]
        t = max((x for x in times if x is not None), key=len, default=None)
        if t is None or not signals:
            continue
        names = _shortest([_path(s) for s in signals])
        columns: dict[str, Array] = {}
        notes: list[str] = []
        for name, signal in zip(names, signals, strict=True):
            y, unit = _data(signal), signal.get("Unit")
            if y is None or y.size != t.size or not _on(times, signal, t):
                notes.append(f"Signal '{name}' left out: its time differs.")
            else:
                columns[f"{name} ({unit})" if isinstance(unit, str) and unit.strip() else name] = y
        return t, columns, notes
    return None


def _several(value: Any) -> list[Any]:
    return value if isinstance(value, list) else [value]


def _data(part: Any) -> Array | None:
    data = part.get("Data") if isinstance(part, dict) else None
    return data.ravel() if isinstance(data, np.ndarray) and data.size > 1 else None


def _on(times: list[Array | None], signal: Mapping[str, Any], t: Array) -> bool:
    """Whether a signal says that it is on this time; one that says nothing is where it is as long."""
    index = signal.get("XIndex")
    at = int(index.ravel()[0]) - 1 if isinstance(index, np.ndarray) and index.size == 1 else -1
    return not 0 <= at < len(times) or times[at] is t


def _path(signal: Mapping[str, Any]) -> list[str]:
    """Names of the model's blocks down to the signal, each in quotation marks or not."""
    whole = "/".join(str(signal[key]) for key in ("Path", "Name") if isinstance(signal.get(key), str) and signal[key])
    return [part for part in re.split(r"[/\n]+", whole.replace('"', "")) if part.strip()] or ["y"]


def _shortest(paths: list[list[str]]) -> list[str]:
    """The last names of each path, as many as tell it from the others."""
    out: list[str] = []
    for i, path in enumerate(paths):
        others = [other for j, other in enumerate(paths) if j != i]
        enough = (n for n in range(1, len(path) + 1) if all(other[-n:] != path[-n:] for other in others))
        out.append("/".join(path[-next(enough, len(path)) :]))
    return [name if out.count(name) == 1 else f"{name}_{out[: i + 1].count(name)}" for i, name in enumerate(out)]
