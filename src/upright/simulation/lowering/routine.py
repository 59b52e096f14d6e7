"""A function of a text on arrays of its own, called with nothing: a loop that has microseconds packs no arguments."""

from __future__ import annotations

import struct
from functools import cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from upright.simulation.lowering import cache as stored_code
from upright.simulation.lowering.module import Module
from upright.simulation.lowering.operands import FLOAT, INT, ArrayOf, Kind, Type

Argument = NDArray[Any] | float | int
_KINDS: dict[np.dtype[Any], Kind] = {np.dtype(np.float64): "float", np.dtype(np.int64): "int"}


class Routine:
    """A function of a text bound to what it works on; what goes in and comes out are the contents of its arrays.

    Parameters
    ----------
    text : str
        Of a module, as `Module` takes it.
    *given : array, float or int
        Its arguments; arrays of float64 or int64 whose numbers lie one behind the other.
    vectors : bool
        Whether its loops over ``_i`` become vector instructions.
    """

    def __init__(self, text: str, name: str, *args: Argument, vectors: bool = False) -> None:
        from upright.simulation.lowering import machine

        self._args = args  # whose places the words say
        self._words = b"".join(_word(x) for x in args)
        lanes = machine.lanes() if vectors else 1
        self._call = machine.function(_address(text, name, tuple(_type(x) for x in args), lanes))

    def __call__(self) -> None:
        """Run it once."""
        self._call(self._words)


@cache
def _address(text: str, name: str, types: tuple[Type, ...], lanes: int) -> int:
    from upright.simulation.lowering import machine

    def compiled() -> bytes:
        return machine.compiled(Module(text, lanes).entry(name, types, machine.platform()))

    key = stored_code.key(stored_code.lowered_by(), name, repr(types), str(lanes), text)
    return machine.address_of(stored_code.code(key, compiled), name)


def _type(x: Argument) -> Type:
    if not isinstance(x, np.ndarray):
        return INT if isinstance(x, int) else FLOAT
    kind = _KINDS.get(x.dtype)
    if kind is None or not x.flags.c_contiguous:
        raise TypeError(f"machine code reads float64 or int64 one behind the other, got {x.dtype} in {x.strides}.")
    return ArrayOf(x.ndim, kind)


def _word(x: Argument) -> bytes:
    return struct.pack("=d", x) if isinstance(x, float) else struct.pack("=q", x if isinstance(x, int) else id(x))
