"""Which of MATLAB's variables are signals, and on which time?

Four habits are known: plain vectors beside a time vector; "structure with time" of Simulink's To Workspace;
cells of pieces (``Y_id`` beside ``Time_id``) that follow on from each other; and this package's own files.
Scalars, text and structures of settings become notes.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import Any

import numpy as np

from upright.readers import mat5
from upright.readers.mat5 import Cells
from upright.readers.source import Source
from upright.readers.timebase import rebuild, time_scale
from upright.records import Array, Record
from upright.records.exchange import KEY

_STEP_NAMES = ("dt", "ts", "t_s", "h", "period", "sampletime")


@dataclass(frozen=True, kw_only=True)
class Found:
    """Time (N,) [s], signals on it, and what to say about them."""

    t: Any
    signals: dict[str, Array]
    notes: tuple[str, ...] = ()


def read(source: Source) -> Record:
    """Record of a MATLAB version 5 file."""
    content = mat5.variables(source)
    if KEY in content and {"t", "signals", "names"} <= set(content):
        return _own(source, content)
    found = _pieces(source, content) or _structures(content) or _vectors(source, content)
    if found is None or not found.signals:
        raise source.bad(
            "expected a log with a time vector and signals of the same length, got only parameters: "
            + (", ".join(f"{name} ({_shape(value)})" for name, value in list(content.items())[:8]) or "nothing")
            + "; a log needs a vector called t or time"
        )
    t = found.t
    bad = np.flatnonzero(~(np.diff(t) > 0))
    if bad.size:
        row = int(bad[0]) + 1
        raise source.bad(
            f"time must increase from sample to sample, but sample {row + 1} is at {t[row]:.9g} s after"
            f" {t[row - 1]:.9g} s; remove the sample or read each run on its own"
        )
    t, note = rebuild(t)
    notes = [*filter(None, [note]), *found.notes, *_settings(content)]
    return Record(t=t, signals=found.signals, provenance=source.provenance("matlab", *notes))


def _vectors(source: Source, content: dict[str, Any]) -> Found | None:
    """Plain vectors, and columns of matrices, as long as the time vector."""
    arrays = {name: value for name, value in content.items() if isinstance(value, np.ndarray) and value.size > 1}
    clock = next((name for name in arrays if time_scale(name) and _is_vector(arrays[name])), "")
    notes: list[str] = []
    if clock:
        t = arrays.pop(clock).ravel() * time_scale(clock)
    else:
        step = next((name for name in content if name.casefold() in _STEP_NAMES and _scalar(content[name]) > 0), "")
        lengths = [value.size for value in arrays.values() if _is_vector(value)]
        if not step or not lengths:
            return None
        t = np.arange(max(lengths)) * _scalar(content[step])
        notes.append(f"No time vector; time was counted in steps of {step} = {_scalar(content[step]):g} s.")
    signals: dict[str, Array] = {}
    for name, value in arrays.items():
        if _is_vector(value) and value.size == t.size:
            signals[name] = value.ravel()
        elif value.ndim == 2 and t.size in value.shape:
            table = value if value.shape[0] == t.size else value.T
            signals |= {f"{name}_{j + 1}": table[:, j] for j in range(table.shape[1])}
        else:
            notes.append(f"Variable '{name}' ({_shape(value)}) left out: time has {t.size} samples.")
    if not signals and arrays:
        raise source.bad(
            f"no variable is as long as the time vector '{clock}' ({t.size} samples): {' '.join(notes)[:300]}"
        )
    return Found(t=t, signals=signals, notes=tuple(notes))


def _structures(content: dict[str, Any]) -> Found | None:
    """Simulink's structures with time; those on the time base of the longest."""
    runs: list[tuple[str, Array, list[tuple[str, Array]]]] = []
    for name, value in content.items():
        if not (isinstance(value, dict) and isinstance(value.get("time"), np.ndarray) and "signals" in value):
            continue
        t = value["time"].ravel()
        several = value["signals"].items if isinstance(value["signals"], Cells) else (value["signals"],)
        columns: list[tuple[str, Array]] = []
        for k, signal in enumerate(several):
            values = signal.get("values") if isinstance(signal, dict) else None
            if not isinstance(values, np.ndarray) or t.size < 2 or t.size not in values.shape:
                continue
            table = (
                values.reshape(t.size, -1)
                if values.shape[0] == t.size
                else np.moveaxis(values, -1, 0).reshape(t.size, -1)
            )
            label = str(signal.get("label") or "") if isinstance(signal.get("label"), str) else ""
            stem = name if len(several) == 1 else f"{name}/{label or k + 1}"
            width = table.shape[1]
            columns += [(stem if width == 1 else f"{stem}_{j + 1}", table[:, j]) for j in range(width)]
        if columns:
            runs.append((name, t, columns))
    if not runs:
        return None
    _, t, _ = max(runs, key=lambda run: run[1].size)
    signals: dict[str, Array] = {}
    notes: list[str] = []
    for name, clock, columns in runs:
        if np.array_equal(clock, t):
            signals |= dict(columns)
        else:
            notes.append(f"Structure '{name}' left out: its time differs ({clock.size} samples).")
    return Found(t=t, signals=signals, notes=tuple(notes))


def _pieces(source: Source, content: dict[str, Any]) -> Found | None:
    """Cells of pieces beside cells of their times, joined in the order of time."""
    pieces: list[tuple[Array, np.ndarray, str]] = []
    stem = ""
    for clock, times in content.items():
        match = re.fullmatch(r"(?:time|t)(_\w+)?", clock, re.IGNORECASE)
        if match is None or not isinstance(times, Cells):
            continue
        suffix = match[1] or ""
        for name, values in content.items():
            if name == clock or not isinstance(values, Cells) or not name.endswith(suffix):
                continue
            head = name.removesuffix(suffix)
            if len(values.items) != len(times.items) or (stem and head != stem):
                continue
            stem = head
            for k, (t, y) in enumerate(zip(times.items, values.items, strict=True), start=1):
                if not (
                    isinstance(t, np.ndarray)
                    and isinstance(y, np.ndarray)
                    and t.size > 1
                    and y.ndim == 2
                    and t.size in y.shape
                ):
                    raise source.bad(
                        f"expected piece {k} of '{name}' as long as its time, got {_shape(y)} and {_shape(t)}"
                    )
                pieces.append((t.ravel(), y.T if y.shape[1] == t.size else y, f"{name}{{{k}}}"))
    if not pieces:
        return None
    if len({piece[1].shape[1] for piece in pieces}) > 1:
        raise source.bad(f"expected pieces with the same number of signals in the cells '{stem}', got different ones")
    pieces.sort(key=lambda piece: float(piece[0][0]))
    table = np.concatenate([piece[1] for piece in pieces])
    signals = {f"{stem}_{j + 1}": table[:, j] for j in range(table.shape[1])}
    joined, columns = ", ".join(piece[2] for piece in pieces), ", ".join(signals)
    note = f"Pieces joined in the order of time: {joined}; rows became columns {columns}."
    return Found(t=np.concatenate([piece[0] for piece in pieces]), signals=signals, notes=(note,))


def _own(source: Source, content: dict[str, Any]) -> Record:
    names, table, t, about = content["names"], content["signals"], content["t"], content[KEY]
    if not (
        isinstance(names, Cells)
        and isinstance(table, np.ndarray)
        and isinstance(t, np.ndarray)
        and isinstance(about, str)
    ):
        raise source.bad("expected a record written by upright, got variables of other kinds; write it again")
    labels = [item if isinstance(item, str) else "" for item in names.items]
    if table.ndim != 2 or table.shape != (t.size, len(labels)):
        raise source.bad(f"expected {t.size} samples of {len(labels)} signals, got {_shape(table)}; write it again")
    return Record.rebuild(t.ravel(), dict(zip(labels, table.T, strict=True)), about)


def _settings(content: dict[str, Any]) -> list[str]:
    """Notes on scalars, text and flat structures of settings."""
    notes: list[str] = []
    for name, value in content.items():
        if isinstance(value, dict) and "signals" not in value:
            flat = {key: _plain(item) for key, item in value.items()}
            notes.append(f"{name}: {', '.join(f'{key} = {item}' for key, item in flat.items() if item)}.")
        elif _plain(value):
            notes.append(f"{name} = {_plain(value)}.")
        elif isinstance(value, mat5.Unreadable):
            notes.append(f"Variable '{name}' left out: {value.kind}.")
    return notes


def _plain(value: Any) -> str:
    if isinstance(value, str):
        return repr(value[:80])
    return f"{float(value.ravel()[0]):g}" if isinstance(value, np.ndarray) and value.size == 1 else ""


def _scalar(value: Any) -> float:
    return float(value.ravel()[0]) if isinstance(value, np.ndarray) and value.size == 1 else 0.0


def _is_vector(value: np.ndarray) -> bool:
    return value.size > 1 and max(value.shape) == value.size


def _shape(value: Any) -> str:
    if isinstance(value, np.ndarray):
        return "x".join(map(str, value.shape))
    if isinstance(value, Cells):
        return f"{len(value.items)} cells"
    return (
        "structure"
        if isinstance(value, dict)
        else "text"
        if isinstance(value, str)
        else getattr(value, "kind", "unknown")
    )
