"""Which variables does a MATLAB version 5 file hold?

The format is that of "MAT-File Format" (The MathWorks): a header of 128 bytes, then elements of a tag (type,
length) and padded data, mostly compressed. Lengths are checked before anything is allocated, so that a damaged
file gives a sentence, and objects of classes only MATLAB knows are passed over by name.
"""

from __future__ import annotations

import zlib
from collections.abc import Iterator
from dataclasses import dataclass
from math import prod
from typing import Any

import numpy as np

from upright.errors import BadInput
from upright.readers.source import Source

_TYPES = {1: "i1", 2: "u1", 3: "i2", 4: "u2", 5: "i4", 6: "u4", 7: "f4", 9: "f8", 12: "i8", 13: "u8"}
_TEXTS = {4: "utf-16", 16: "utf-8", 17: "utf-16", 18: "utf-32", 2: "latin-1", 1: "latin-1"}
_MATRIX, _COMPRESSED = 14, 15
_CELL, _STRUCT, _OBJECT, _CHAR, _SPARSE, _FIRST_NUMERIC, _LAST_NUMERIC = 1, 2, 3, 4, 5, 6, 15
_LARGEST_BYTES = 1 << 30  # a log of 1 GiB once unpacked is no log of a rig
_DEEPEST = 16


@dataclass(frozen=True, kw_only=True)
class Cells:
    """Cell array: its contents in MATLAB's (column) order."""

    items: tuple[Any, ...]


@dataclass(frozen=True, kw_only=True)
class Unreadable:
    """Variable of a kind that holds no plain numbers, such as an object."""

    kind: str


class _Damaged(Exception):
    """Something in the file contradicts itself; the reader adds the file's name."""


def recognise(data: bytes, file: str) -> bool:
    """Whether content is a MATLAB file of any version, or claims to be one by its suffix."""
    return data[:6] == b"MATLAB" or is_hdf5(data) or (file.casefold().endswith(".mat") and b"\0" in data[:128])


def is_hdf5(data: bytes) -> bool:
    """Whether content is HDF5, as MATLAB's version 7.3 is."""
    return any(data[at : at + 8] == b"\x89HDF\r\n\x1a\n" for at in (0, 512))


def variables(source: Source) -> dict[str, Any]:
    """Variables by name: arrays (as many axes as in MATLAB), text, dict for a structure, `Cells`, `Unreadable`.

    Raises
    ------
    BadInput
        When the file is version 7.3 or 4, truncated or damaged.
    """
    data = source.data
    if is_hdf5(data) or data[:10] == b"MATLAB 7.3":
        raise source.bad(
            "expected MATLAB version 5, got version 7.3 (HDF5); in MATLAB: load it, then save('log.mat', '-v7')"
        )
    order = {b"IM": "<", b"MI": ">"}.get(data[126:128], "")
    if len(data) < 136 or data[:6] != b"MATLAB" or not order:
        raise source.bad(
            "expected a MATLAB version 5 file, got a damaged or older one; in MATLAB: save('log.mat', '-v7')"
        )
    found: dict[str, Any] = {}
    try:
        for kind, content in _elements(data, 128, order):
            unpacked = _unpack(content) if kind == _COMPRESSED else None
            if unpacked is not None:
                kind, content = next(_elements(unpacked, 0, order))
            if kind != _MATRIX:
                raise _Damaged(f"an element of type {kind} where a variable should begin")
            name, value = _matrix(content, order, 0)
            if name:  # MATLAB keeps its own book-keeping under an empty name
                found[name] = value
    except (_Damaged, zlib.error, ValueError, IndexError, StopIteration, UnicodeDecodeError, OverflowError) as error:
        if isinstance(error, BadInput):
            raise
        last = f" after variable '{list(found)[-1]}'" if found else ""
        raise source.bad(
            f"the MATLAB file is cut short or damaged{last} ({error or type(error).__name__}); copy it again"
        ) from None
    return found


def _unpack(content: memoryview | bytes) -> bytes:
    machine = zlib.decompressobj()
    out = machine.decompress(content, _LARGEST_BYTES)
    if not machine.eof:
        raise _Damaged("a compressed variable does not end")
    return out


def _elements(data: bytes | memoryview, start: int, order: str) -> Iterator[tuple[int, memoryview]]:
    """Type and data of each element in turn."""
    view, at = memoryview(data), start
    endian = "little" if order == "<" else "big"
    while at < len(view):
        if len(view) - at < 8:
            if bytes(view[at:]).strip(b"\0"):
                raise _Damaged("the last element has no complete tag")
            return
        word = int.from_bytes(view[at : at + 4], endian)
        small = word >> 16
        if small:  # up to 4 bytes of data live inside the tag
            kind, length, begin, after = word & 0xFFFF, small, at + 4, at + 8
        else:
            kind, length, begin = word, int.from_bytes(view[at + 4 : at + 8], endian), at + 8
            after = begin + length if kind == _COMPRESSED else begin + (length + 7) // 8 * 8
        if (small and length > 4) or begin + length > len(view):
            raise _Damaged(f"an element of {length} bytes where {max(len(view) - begin, 0)} are left")
        yield kind, view[begin : begin + length]
        at = after


def _matrix(content: memoryview, order: str, depth: int) -> tuple[str, Any]:
    """Name and value of one miMATRIX element."""
    if depth > _DEEPEST:
        raise _Damaged("structures nested too deeply")
    if not len(content):
        return "", np.empty((0, 0))
    parts = _elements(content, 0, order)
    flags = int(np.frombuffer(next(parts)[1], order + "u4")[0])
    code, is_complex = flags & 0xFF, bool(flags & 0x0800)
    if not (_CELL <= code <= _LAST_NUMERIC):
        return _name(next(parts)[1]), Unreadable(kind="object")
    dims = tuple(int(d) for d in np.frombuffer(next(parts)[1], order + "i4"))
    if len(dims) < 2 or min(dims) < 0:
        raise _Damaged(f"impossible dimensions {dims}")
    name = _name(next(parts)[1])
    count = prod(dims)
    if _FIRST_NUMERIC <= code <= _LAST_NUMERIC:
        kind, raw = next(parts)
        if is_complex:
            return name, Unreadable(kind="complex numbers")
        return name, _array(kind, raw, order, dims)
    if code == _CHAR:
        kind, raw = next(parts)
        return name, bytes(raw).decode(_text(kind, order)) if count else ""
    if code == _CELL:
        return name, Cells(items=tuple(_matrix(raw, order, depth + 1)[1] for _, raw in _exactly(parts, count)))
    if code == _STRUCT:
        width = int(np.frombuffer(next(parts)[1], order + "i4")[0])
        names = bytes(next(parts)[1])
        if width < 1:
            raise _Damaged("a structure with nameless fields")
        fields = [_name(names[i : i + width]) for i in range(0, len(names), width)]
        values = [_matrix(raw, order, depth + 1)[1] for _, raw in _exactly(parts, count * len(fields))]
        rows = [
            dict(zip(fields, values[i : i + len(fields)], strict=True))
            for i in range(0, len(values), max(len(fields), 1))
        ]
        return name, rows[0] if count == 1 and rows else Cells(items=tuple(rows))
    return name, Unreadable(kind={_OBJECT: "object", _SPARSE: "sparse matrix"}[code])


def _exactly(parts: Iterator[tuple[int, memoryview]], count: int) -> Iterator[tuple[int, memoryview]]:
    for i in range(count):
        part = next(parts, None)
        if part is None or part[0] != _MATRIX:
            raise _Damaged(f"{count} parts announced, {i} found")
        yield part


def _name(raw: memoryview | bytes) -> str:
    return bytes(raw).partition(b"\0")[0].decode("utf-8")


def _text(kind: int, order: str) -> str:
    if kind not in _TEXTS:
        raise _Damaged(f"text of unknown type {kind}")
    name = _TEXTS[kind]
    return name if name in ("utf-8", "latin-1") else f"{name}-{'le' if order == '<' else 'be'}"


def _array(kind: int, raw: memoryview, order: str, dims: tuple[int, ...]) -> Any:
    if kind not in _TYPES:
        raise _Damaged(f"numbers of unknown type {kind}")
    flat = np.frombuffer(raw, order + _TYPES[kind])
    if flat.size != prod(dims):
        raise _Damaged(f"{prod(dims)} numbers announced, {flat.size} found")
    return flat.astype(np.float64).reshape(dims, order="F")
