"""Variables of a MATLAB version 5 file, and which of them are signals on which time.

Five habits are known: plain vectors beside a time vector; "structure with time" of Simulink's To Workspace; captures
of dSPACE's ControlDesk; cells of pieces (``Y_id`` beside ``Time_id``) that follow on from each other; and this
package's own files.
Scalars, text and structures of settings become notes.

The format is that of "MAT-File Format" (The MathWorks): a header of 128 bytes, then elements of a tag (type, length)
and padded data, mostly compressed. It is walked here because `scipy.io.loadmat` trusts what a file says of itself.
SciPy 1.17 was given randomly damaged copies of a log of 3 kB: in each of five series the interpreter itself was
killed (segmentation fault, bus error), after 214 to 2712 copies. Cells nested 5000 deep (10 kB) kill it too, and 184
bytes that announce 2^30 cells take 8 GB and half a minute. Below, lengths are checked before anything is allocated,
what is unpacked is counted, and objects of classes that only MATLAB knows are passed over by name.
"""

from __future__ import annotations

import re
import zlib
from collections.abc import Iterator
from dataclasses import dataclass
from math import prod
from struct import Struct
from typing import Any

import numpy as np

from upright.errors import BadInput
from upright.readers.formats.dspace import captured
from upright.readers.reader import Reader
from upright.readers.resolution import rebuild
from upright.readers.source import Source
from upright.records import Array, Record
from upright.records.columns import stated_unit, time_scale
from upright.records.record import KEY
from upright.units import converted

Variables = dict[str, Any]
"""By name: arrays (as many axes as in MATLAB), text, dict for a structure, list for cells, `Unreadable`."""
Signals = tuple[Array, dict[str, Array], list[str]]
"""Time (N,) [s], columns (N,) by name, notes."""
_Parts = Iterator[tuple[int, memoryview]]

_STEP_NAMES = ("dt", "ts", "t_s", "h", "period", "sampletime")
_MATRIX, _COMPRESSED = 14, 15  # types of elements; the others are numbers or text
_NUMBERS = {1: "i1", 2: "u1", 3: "i2", 4: "u2", 5: "i4", 6: "u4", 7: "f4", 9: "f8", 12: "i8", 13: "u8"}
_TEXTS = {4: "utf-16", 16: "utf-8", 17: "utf-16", 18: "utf-32", 2: "latin-1", 1: "latin-1"}
_CELLS, _STRUCTURE, _OBJECT, _TEXT, _SPARSE, _LAST = 1, 2, 3, 4, 5, 15  # classes; between the last two are numbers
_DEEPEST = 16
_SLICE = 1 << 16  # bytes unpacked at a time, into some 66 MB at most
_PART = 200  # bytes that the smallest variable or field takes in memory


@dataclass(frozen=True)
class Unreadable:
    """Variable of a kind that holds no plain numbers, such as an object."""

    kind: str


def _recognises(source: Source) -> bool:
    """Whether content is a MATLAB file of any version, or claims to be one by its suffix."""
    data, claimed = source.data, source.file.casefold().endswith(".mat")
    return data[:6] == b"MATLAB" or _is_hdf5(data) or (claimed and b"\0" in data[:128])


def _is_hdf5(data: bytes) -> bool:
    """Whether content is HDF5, as MATLAB's version 7.3 is."""
    return any(data[at : at + 8] == b"\x89HDF\r\n\x1a\n" for at in (0, 512))


def read(source: Source) -> Record:
    """Record of a MATLAB version 5 file."""
    content = variables(source)
    if KEY in content and {"t", "signals", "names"} <= set(content):
        return _written_by_us(source, content)
    return record_of(source, content, reader="matlab")


def record_of(source: Source, content: Variables, *, reader: str) -> Record:
    """Record of those variables that are signals on a time; what is a setting becomes a note."""
    pieces = _pieces(source, content) or captured(content) or _structures(content) or _vectors(source, content)
    if pieces is None or not pieces[1]:
        pieces = _vectors(source, _lifted(content)) or _table(content)
    if pieces is None or not pieces[1]:
        objects = any(isinstance(value, Unreadable) and value.kind == "object" for value in content.values())
        save = "; of a timeseries x, in MATLAB: t = x.Time; y = squeeze(x.Data); save('log.mat', 't', 'y', '-v7')"
        raise source.bad(
            "expected a log with a time vector and signals of the same length, got only parameters: "
            + (", ".join(f"{name} ({_shape(value)})" for name, value in list(content.items())[:8]) or "nothing")
            + "; a log needs a vector called t or time"
            + save * objects
        )
    t, signals, notes = pieces
    advice = "remove the sample or read each run on its own"
    source.must_increase(t, lambda row: {"sample": row + 1}, each="sample", advice=advice)
    t, note = rebuild(t)
    return Record(
        t=t,
        signals=signals,
        units={name: stated_unit(name) for name in signals},
        provenance=source.provenance(reader, *filter(None, [note]), *notes, *_settings(content)),
    )


def variables(source: Source) -> Variables:
    """Every variable of the file.

    Raises
    ------
    BadInput
        When the file is version 7.3 or 4, truncated or damaged, or unpacks to more than any log of a rig.
    """
    data = source.data
    if _is_hdf5(data) or data[:10] == b"MATLAB 7.3":
        raise source.bad(
            "expected MATLAB version 5, got version 7.3 (HDF5); in MATLAB: load it, then save('log.mat', '-v7')"
        )
    order = {b"IM": "<", b"MI": ">"}.get(data[126:128], "")
    if len(data) < 136 or data[:6] != b"MATLAB" or not order:
        raise source.bad(
            "expected a MATLAB version 5 file, got a damaged or older one; in MATLAB: save('log.mat', '-v7')"
        )
    content: Variables = {}
    try:
        for name, value in _Walk(source, order).variables():
            if name:  # MATLAB keeps its own book-keeping under an empty name
                content[name] = value
    except BadInput:
        raise
    except (zlib.error, ValueError, IndexError) as error:
        last = f" after variable '{list(content)[-1]}'" if content else ""
        raise source.bad(f"the MATLAB file is cut short or damaged{last} ({error}); copy it again") from None
    return content


class _Walk:
    """One pass over the elements of a file that counts what it unpacks; a ValueError says what contradicts itself."""

    def __init__(self, source: Source, order: str) -> None:
        self.source, self.order = source, order
        self.tag = Struct(order + "II")
        self.most = source.most_unpacked
        self.left = self.most << 20

    def spend(self, size: int) -> None:
        """Count bytes of memory."""
        self.left -= size
        if self.left < 0:
            raise self.source.bad(
                f"the MATLAB file unpacks to more than {self.most} MB, more than any log of a rig"
                f" in {len(self.source.data) / (1 << 20):.3g} MB; in MATLAB: save only the time and the signals"
            )

    def unpacked(self, content: memoryview) -> memoryview:
        """What a compressed element holds, counted while it grows."""
        machine = zlib.decompressobj()
        out = bytearray()
        for at in range(0, len(content), _SLICE):
            piece = machine.decompress(content[at : at + _SLICE], self.left + 1)
            self.spend(len(piece))
            out += piece
        if not machine.eof:
            raise ValueError("a compressed variable does not end")
        return memoryview(out)

    def variables(self) -> Iterator[tuple[str, Any]]:
        """Name and value of each variable in turn."""
        for kind, content in self.elements(memoryview(self.source.data)[128:]):
            if kind == _COMPRESSED:
                kind, content = _next(self.elements(self.unpacked(content)))
            if kind != _MATRIX:
                raise ValueError(f"an element of type {kind} where a variable should begin")
            yield self.matrix(content, 0)

    def elements(self, view: memoryview) -> _Parts:
        """Type and data of each element in turn."""
        at = 0
        while at < len(view):
            if len(view) - at < 8:
                if bytes(view[at:]).strip(b"\0"):
                    raise ValueError("the last element has no complete tag")
                return
            kind, length = self.tag.unpack_from(view, at)
            small = kind >> 16  # up to 4 bytes of data live inside the tag
            kind, length, begin = (kind & 0xFFFF, small, at + 4) if small else (kind, length, at + 8)
            if (small and length > 4) or begin + length > len(view):
                raise ValueError(f"an element of {length} bytes where {max(len(view) - begin, 0)} are left")
            yield kind, view[begin : begin + length]
            padded = length if kind == _COMPRESSED else (length + 7) // 8 * 8
            at = at + 8 if small else begin + padded

    def matrix(self, content: memoryview, depth: int) -> tuple[str, Any]:
        """Name and value of one miMATRIX element."""
        self.spend(_PART)
        if depth > _DEEPEST:
            raise ValueError("structures nested too deeply")
        if not len(content):
            return "", np.empty((0, 0))
        parts = self.elements(content)
        flags = int(np.frombuffer(_next(parts)[1], self.order + "u4")[0])
        code, is_complex = flags & 0xFF, bool(flags & 0x0800)
        if not (_CELLS <= code <= _LAST):
            return _name(_next(parts)[1]), Unreadable("object")
        dims = tuple(int(d) for d in np.frombuffer(_next(parts)[1], self.order + "i4"))
        if len(dims) < 2 or min(dims) < 0:
            raise ValueError(f"impossible dimensions {dims}")
        name = _name(_next(parts)[1])
        if code in (_OBJECT, _SPARSE):
            return name, Unreadable("object" if code == _OBJECT else "sparse matrix")
        if code == _CELLS:
            return name, self.children(parts, prod(dims), depth)
        if code == _STRUCTURE:
            return name, self.structure(parts, prod(dims), depth)
        kind, raw = _next(parts)
        if code == _TEXT:
            return name, self.text(kind, raw) if prod(dims) else ""
        return name, Unreadable("complex numbers") if is_complex else self.numbers(kind, raw, dims)

    def children(self, parts: _Parts, count: int, depth: int) -> list[Any]:
        """Values of exactly so many matrices, in MATLAB's (column) order."""
        values: list[Any] = []
        for i in range(count):
            kind, content = next(parts, (0, memoryview(b"")))
            if kind != _MATRIX:
                raise ValueError(f"{count} parts announced, {i} found")
            values.append(self.matrix(content, depth + 1)[1])
        return values

    def structure(self, parts: _Parts, count: int, depth: int) -> Any:
        """A structure as a dict, an array of structures as a list of them."""
        width = int(np.frombuffer(_next(parts)[1], self.order + "i4")[0])
        names = bytes(_next(parts)[1])
        if width < 1:
            raise ValueError("a structure with nameless fields")
        self.spend(_PART * (len(names) // width))
        fields = [_name(names[i : i + width]) for i in range(0, len(names), width)]
        values = self.children(parts, count * len(fields), depth)
        starts = range(0, len(values), max(len(fields), 1))
        rows = [dict(zip(fields, values[i : i + len(fields)], strict=True)) for i in starts]
        return rows[0] if count == 1 and rows else rows

    def text(self, kind: int, raw: memoryview) -> str:
        """Characters, in MATLAB's (column) order."""
        if kind not in _TEXTS:
            raise ValueError(f"text of unknown type {kind}")
        self.spend(4 * len(raw))  # one character outside the Latin ones, and all of them take 4 bytes
        encoding = _TEXTS[kind]
        if encoding.startswith(("utf-16", "utf-32")):
            encoding += "-le" if self.order == "<" else "-be"
        return str(raw, encoding)

    def numbers(self, kind: int, raw: memoryview, dims: tuple[int, ...]) -> Array:
        """Numbers as float64, with MATLAB's axes."""
        if kind not in _NUMBERS:
            raise ValueError(f"numbers of unknown type {kind}")
        flat = np.frombuffer(raw, self.order + _NUMBERS[kind])
        if flat.size != prod(dims):
            raise ValueError(f"{prod(dims)} numbers announced, {flat.size} found")
        self.spend(8 * flat.size)
        return flat.astype(np.float64).reshape(dims, order="F")


def _next(parts: _Parts) -> tuple[int, memoryview]:
    part = next(parts, None)
    if part is None:
        raise ValueError("a part of a variable is missing")
    return part


def _name(raw: memoryview | bytes) -> str:
    return bytes(raw).partition(b"\0")[0].decode("utf-8")


def _vectors(source: Source, content: Variables) -> Signals | None:
    """Plain vectors, and columns of matrices, as long as the time vector."""
    arrays = {name: value for name, value in content.items() if isinstance(value, np.ndarray) and value.size > 1}
    clock = next((name for name in arrays if time_scale(name) and _is_vector(arrays[name])), "")
    notes: list[str] = []
    if clock:
        t = converted(arrays.pop(clock).ravel(), time_scale(clock))
    else:
        step = next((name for name in content if name.casefold() in _STEP_NAMES and _scalar(content[name]) > 0), "")
        lengths = [value.size for value in arrays.values() if _is_vector(value)]
        if not step or not lengths:
            return None
        t = np.arange(max(lengths), dtype=np.float64) * _scalar(content[step])
        notes.append(f"No time vector; time was counted in steps of {step} = {_scalar(content[step]):g} s.")
    signals: dict[str, Array] = {}
    for name, value in arrays.items():
        if _is_vector(value) and value.size == t.size:
            signals[name] = value.ravel()
        elif value.ndim == 2 and t.size in value.shape:
            signals |= {f"{name}_{j}": x for j, x in enumerate(_in_rows(value, t).T, start=1)}
        else:
            notes.append(f"Variable '{name}' ({_shape(value)}) left out: time has {t.size} samples.")
    if not signals and arrays:
        raise source.bad(
            f"no variable is as long as the time vector '{clock}' ({t.size} samples): {' '.join(notes)[:300]}"
        )
    return t, signals, notes


def _lifted(content: Variables) -> Variables:
    """The variables with the fields of structures beside them, under their own names where these are free."""
    lifted = {name: value for name, value in content.items() if not isinstance(value, dict)}
    for name, value in content.items():
        for field, item in value.items() if isinstance(value, dict) else ():
            lifted[field if field not in lifted else f"{name}_{field}"] = item
    return lifted


EVEN = 0.2
"""Largest spread of the steps of a column, as a share of their mean, that is taken for a time without being named."""


def _table(content: Variables) -> Signals | None:
    """Columns of the one matrix whose first column, or row, increases evenly as a time does."""
    for name, value in content.items():
        if not isinstance(value, np.ndarray) or value.ndim != 2 or min(value.shape) < 2 or max(value.shape) < 10:
            continue
        table = value if value.shape[0] > value.shape[1] else value.T
        t, steps = table[:, 0], np.diff(table[:, 0])
        if np.isfinite(t).all() and steps.min() > 0 and steps.std() < EVEN * steps.mean():
            columns = {f"{name}_{j}": x for j, x in enumerate(table.T[1:], start=2)}
            return t, columns, [f"Column 1 of '{name}' increases evenly, so it is the time."]
    return None


def _structures(content: Variables) -> Signals | None:
    """Simulink's structures with time; those on the time base of the longest."""
    runs: list[tuple[str, Array, dict[str, Array]]] = []
    for name, value in content.items():
        if not (isinstance(value, dict) and isinstance(value.get("time"), np.ndarray) and "signals" in value):
            continue
        t = value["time"].ravel()
        several = value["signals"] if isinstance(value["signals"], list) else [value["signals"]]
        columns: dict[str, Array] = {}
        for k, signal in enumerate(several, start=1):
            values = signal.get("values") if isinstance(signal, dict) else None
            if not isinstance(values, np.ndarray) or t.size < 2 or t.size not in values.shape:
                continue
            table = _in_rows(values, t)
            label = signal["label"] if isinstance(signal.get("label"), str) else ""
            stem = name if len(several) == 1 else f"{name}/{label or k}"
            single = table.shape[1] == 1
            columns |= {stem if single else f"{stem}_{j}": x for j, x in enumerate(table.T, start=1)}
        if columns:
            runs.append((name, t, columns))
    if not runs:
        return None
    longest = max((t for _, t, _ in runs), key=len)
    signals: dict[str, Array] = {}
    notes: list[str] = []
    for name, t, columns in runs:
        if np.array_equal(t, longest):
            signals |= columns
        else:
            notes.append(f"Structure '{name}' left out: its time differs ({t.size} samples).")
    return longest, signals, notes


def _pieces(source: Source, content: Variables) -> Signals | None:
    """Cells of pieces beside cells of their times, joined in the order of time."""
    cells = {name: value for name, value in content.items() if isinstance(value, list)}
    clocks = {name: match[1] or "" for name in cells if (match := re.fullmatch(r"(?i:time|t)(_\w+)?", name))}
    pieces: list[tuple[Array, Array, str]] = []
    stem = ""
    for clock, suffix in clocks.items():
        for name, values in cells.items():
            head = name.removesuffix(suffix)
            same = len(values) == len(cells[clock]) and head == (stem or head)
            if name == clock or not name.endswith(suffix) or not same:
                continue
            stem = head
            for k, (t, y) in enumerate(zip(cells[clock], values, strict=True), start=1):
                arrays = isinstance(t, np.ndarray) and isinstance(y, np.ndarray)
                if not (arrays and t.size > 1 and y.ndim == 2 and t.size in y.shape):
                    raise source.bad(
                        f"expected piece {k} of '{name}' as long as its time, got {_shape(y)} and {_shape(t)}"
                    )
                pieces.append((t.ravel(), y.T if y.shape[1] == t.size else y, f"{name}{{{k}}}"))
    if not pieces:
        return None
    if len({y.shape[1] for _, y, _ in pieces}) > 1:
        raise source.bad(f"expected pieces with the same number of signals in the cells '{stem}', got different ones")
    pieces.sort(key=lambda piece: float(piece[0][0]))
    table = np.concatenate([y for _, y, _ in pieces])
    signals = {f"{stem}_{j}": x for j, x in enumerate(table.T, start=1)}
    joined, columns = ", ".join(name for *_, name in pieces), ", ".join(signals)
    note = f"Pieces joined in the order of time: {joined}; rows became columns {columns}."
    return np.concatenate([t for t, *_ in pieces]), signals, [note]


def _written_by_us(source: Source, content: Variables) -> Record:
    names, table, t, about = content["names"], content["signals"], content["t"], content[KEY]
    arrays = isinstance(table, np.ndarray) and isinstance(t, np.ndarray)
    if not (arrays and isinstance(names, list) and isinstance(about, str)):
        raise source.bad("expected a record written by upright, got variables of other kinds; write it again")
    labels = [item if isinstance(item, str) else "" for item in names]
    if table.shape != (t.size, len(labels)):
        raise source.bad(f"expected {t.size} samples of {len(labels)} signals, got {_shape(table)}; write it again")
    return Record.rebuild(t.ravel(), dict(zip(labels, table.T, strict=True)), about)


def _settings(content: Variables) -> Iterator[str]:
    """Notes on scalars, text and flat structures of settings."""
    for name, value in content.items():
        if isinstance(value, dict) and "signals" not in value:
            if settings := [f"{key} = {text}" for key, item in value.items() if (text := _plain(item))]:
                yield f"{name}: {', '.join(settings)}."
        elif _plain(value):
            yield f"{name} = {_plain(value)}."
        elif isinstance(value, Unreadable):
            yield f"Variable '{name}' left out: {value.kind}."


def _plain(value: Any) -> str:
    if isinstance(value, str):
        return repr(value[:80])
    return f"{_scalar(value):g}" if isinstance(value, np.ndarray) and value.size == 1 else ""


def _scalar(value: Any) -> float:
    return float(value.ravel()[0]) if isinstance(value, np.ndarray) and value.size == 1 else 0.0


def _is_vector(value: Array) -> bool:
    return value.size > 1 and max(value.shape) == value.size


def _in_rows(values: Array, t: Array) -> Array:
    """Table (N, columns) of an array that has the time (N,) along its first axis or its last."""
    first = values if values.shape[0] == t.size else np.moveaxis(values, -1, 0)
    return first.reshape(t.size, -1)


def _shape(value: Any) -> str:
    if isinstance(value, np.ndarray):
        return "x".join(map(str, value.shape))
    if isinstance(value, Unreadable):
        return value.kind
    return f"{len(value)} cells" if isinstance(value, list) else "structure" if isinstance(value, dict) else "text"


READER = Reader(name="matlab", files="MATLAB version 5", recognises=_recognises, read=read, order=20)
