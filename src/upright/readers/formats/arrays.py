"""Record of arrays that NumPy saved, several by their names (.npz) or one (.npy)."""

from __future__ import annotations

import math
from io import BytesIO
from typing import Any
from zipfile import ZipFile

import numpy as np
from numpy.lib import format as npy
from numpy.typing import NDArray

from upright.errors import BadInput
from upright.readers.formats.matlab import Unreadable, Variables, record_of
from upright.readers.reader import Reader
from upright.readers.source import Source
from upright.records import Record

_ONE, _SEVERAL = b"\x93NUMPY", b"PK\x03\x04"


def _recognises(source: Source) -> bool:
    return source.data.startswith(_ONE) or (source.data.startswith(_SEVERAL) and b".npy" in source.data[:1024])


def read(source: Source) -> Record:
    """Record of a file of NumPy; of a single array the first column is the time."""
    return record_of(source, variables(source), reader="numpy")


def variables(source: Source) -> Variables:
    """Arrays by name, the fields of an array of records beside them."""
    try:
        arrays = _arrays(source)
    except BadInput:
        raise
    except Exception as error:  # NumPy tokenizes a header, zipfile has errors of five kinds
        raise source.bad(f"the file is damaged or holds no plain numbers ({error}); save it again") from None
    content: Variables = {}
    for name, array in arrays.items():
        if array.dtype.names:
            content |= {field: _plain(array[field]) for field in array.dtype.names}
        else:
            content[name] = _plain(array)
    return content


def _arrays(source: Source) -> dict[str, NDArray[Any]]:
    if source.data.startswith(_ONE):
        return {"array": _array(source.data)}
    with ZipFile(BytesIO(source.data)) as file:
        members = [member for member in file.infolist() if member.filename.endswith(".npy")]
        if sum(member.file_size for member in members) > source.most_unpacked << 20:
            raise source.bad("it would unpack to more than any log holds; save its arrays again")
        return {member.filename.removesuffix(".npy"): _array(file.read(member)) for member in members}


def _array(data: bytes) -> NDArray[Any]:
    """One array; its size is checked before `numpy.load` allocates what its header says."""
    stream = BytesIO(data)
    head = npy.read_array_header_1_0 if npy.read_magic(stream) == (1, 0) else npy.read_array_header_2_0
    shape, _, kind = head(stream)
    if kind.hasobject:
        raise ValueError("Python objects")
    if math.prod(shape) * kind.itemsize > len(data):
        raise ValueError(f"{len(data)} bytes for an array of {' by '.join(map(str, shape))}")
    return np.load(BytesIO(data), allow_pickle=False)


def _plain(array: NDArray[Any]) -> Any:
    """Numbers as float64, stamps as seconds since the first, a text; other kinds are passed over by name."""
    if array.dtype.kind == "M" and array.size:
        array = array - array.flat[0]
    if array.dtype.kind == "m":
        return array / np.timedelta64(1, "s")
    if array.dtype.kind in "biuf":
        return array.astype(np.float64)
    return str(array) if array.dtype.kind in "US" and array.size == 1 else Unreadable(array.dtype.name)


READER = Reader(name="numpy", files="arrays of NumPy (.npz, .npy)", recognises=_recognises, read=read, order=15)
