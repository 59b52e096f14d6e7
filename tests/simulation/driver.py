"""A GPU's driver made of this machine: its threads are called one after the other, its memory is counted."""

from __future__ import annotations

import ctypes
from functools import cache
from types import SimpleNamespace
from typing import Any

import numpy as np

from upright.simulation.kernel.compiled import RUN, Kernel, threaded
from upright.simulation.kernel.lanes import RUN_ARGUMENTS
from upright.simulation.lowering import machine
from upright.simulation.lowering.operands import FLOAT, ArrayOf

OWN = ("_b0", "_b1", "W", "_events")
"""What a thread knows without being told."""


def words() -> list[Any]:
    """Types of what a kernel is called with."""
    out: list[Any] = []
    for name, t in zip(RUN_ARGUMENTS.split(", "), RUN, strict=True):
        if isinstance(t, ArrayOf):
            out += [ctypes.c_void_p] + [ctypes.c_int64] * t.axes if name not in OWN else []
        elif name not in OWN:
            out.append(ctypes.c_double if t == FLOAT else ctypes.c_int64)
    return out


def code_for_here(kernel: Kernel, room: int) -> bytes:
    """What stands for PTX: one thread's work for this processor, from the same text."""
    return _code_for_here(kernel.text, room)


@cache
def _code_for_here(text: str, room: int) -> bytes:
    return machine.compiled(threaded(text, room, machine.platform()))


class Driver:
    """Answers the calls of `cuda.bindings.driver`; the one named `fails` is refused with `status`."""

    def __init__(self, *, fails: str = "", status: str = "CUDA_ERROR_UNKNOWN") -> None:
        self.fails, self.status = fails, status
        self.memory: dict[int, Any] = {}
        self.modules = self.contexts = self.threads = 0

    def __getattribute__(self, name: str) -> Any:
        if name.startswith("cu") and name == self.fails:
            return lambda *_: (_Status(self.status),)
        return super().__getattribute__(name)

    def cuInit(self, flags: int) -> tuple[Any, ...]:
        return (0,)

    def cuDeviceGet(self, ordinal: int) -> tuple[Any, ...]:
        return 0, ordinal

    def cuDevicePrimaryCtxRetain(self, device: int) -> tuple[Any, ...]:
        return 0, "context"

    def cuCtxPushCurrent(self, context: str) -> tuple[Any, ...]:
        self.contexts += 1
        return (0,)

    def cuCtxPopCurrent(self) -> tuple[Any, ...]:
        self.contexts -= 1
        return 0, "context"

    def cuModuleLoadData(self, image: bytes) -> tuple[Any, ...]:
        assert image.endswith(b"\0")  # the driver reads on to there
        self.modules += 1
        return 0, machine.address_of(image[:-1], "thread")

    def cuModuleUnload(self, module: int) -> tuple[Any, ...]:
        self.modules -= 1
        return (0,)

    def cuModuleGetFunction(self, module: int, name: bytes) -> tuple[Any, ...]:
        return (0, module) if name == b"lanes" else (_Status("CUDA_ERROR_NOT_FOUND"),)

    def cuMemAlloc(self, size: int) -> tuple[Any, ...]:
        assert size > 0  # the driver refuses nothing at all
        block = np.full(-(-size // 8), np.nan)
        self.memory[block.ctypes.data] = block
        return 0, block.ctypes.data

    def cuMemFree(self, place: int) -> tuple[Any, ...]:
        del self.memory[place]
        return (0,)

    def _inside(self, place: int, size: int) -> None:
        assert 0 < size <= self.memory[place].nbytes

    def cuMemcpyHtoD(self, place: int, here: int, size: int) -> tuple[Any, ...]:
        self._inside(place, size)
        ctypes.memmove(place, here, size)
        return (0,)

    def cuMemcpyDtoH(self, here: int, place: int, size: int) -> tuple[Any, ...]:
        self._inside(place, size)
        ctypes.memmove(here, place, size)
        return (0,)

    def cuLaunchKernel(
        self, function: int, blocks: int, by: int, bz: int, threads: int, ty: int, tz: int, shared: int, stream: int,
        given: int, extra: int,
    ) -> tuple[Any, ...]:  # fmt: skip
        assert (by, bz, ty, tz, shared, stream, extra) == (1, 1, 1, 1, 0, 0, 0)
        types = words()
        where = (ctypes.c_void_p * len(types)).from_address(given)
        values = [t.from_address(place).value for t, place in zip(types, where, strict=True)]
        thread = ctypes.CFUNCTYPE(None, ctypes.c_int64, *types)(function)
        for index in range(blocks * threads):
            thread(index, *values)
        self.threads = blocks * threads
        return (0,)

    def cuCtxSynchronize(self) -> tuple[Any, ...]:
        return (0,)


class _Status(SimpleNamespace):
    def __init__(self, name: str) -> None:
        super().__init__(name=name)

    def __int__(self) -> int:
        return 999
