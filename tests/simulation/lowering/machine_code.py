"""A function of the text compiled by itself, called with arrays and numbers."""

from __future__ import annotations

import struct
from collections.abc import Callable
from functools import cache

import numpy as np

from upright.simulation.lowering import machine
from upright.simulation.lowering.module import Module
from upright.simulation.lowering.operands import FLOAT, INT, ArrayOf, Type


def type_of(x: object) -> Type:
    if isinstance(x, np.ndarray):
        return ArrayOf(x.ndim, "int" if x.dtype == np.int64 else "float")
    return INT if isinstance(x, int) else FLOAT


def compiled(text: str, *, lanes: int = 1, name: str = "entered") -> Callable[..., None]:
    """The entry of a text, for whatever arguments it is called with."""

    @cache
    def address(types: tuple[Type, ...]) -> int:
        module = Module(text, lanes).entry(name, types, machine.platform())
        return machine.address_of(machine.compiled(module), name)

    def call(*args: object) -> None:
        words = [struct.pack("=d", a) if isinstance(a, float) else struct.pack("=q", a if isinstance(a, int) else id(a))
                 for a in args]  # fmt: skip
        machine.function(address(tuple(map(type_of, args))))(b"".join(words))

    return call
