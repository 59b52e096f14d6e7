"""Many motions on a GPU of NVIDIA's, a thread for each, through its driver."""

from __future__ import annotations

import ctypes
from collections.abc import Callable, Sequence
from contextlib import ExitStack
from functools import cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from upright.errors import BadInput
from upright.simulation.lowering.gpu import KERNEL

Arrays = NDArray[np.float64] | NDArray[np.int64]

THREADS = 128
"""Threads of a block: a GPU has room for few blocks of motions, whose numbers fill its registers."""

_STAY = "leave device at 'cpu'"


def door() -> Any:
    """The driver of the GPU as `cuda-python` shows it.

    Raises
    ------
    BadInput
        When that is not installed.
    """
    try:
        from cuda.bindings import driver  # pyright: ignore[reportMissingImports]  # an extra
    except ImportError:
        raise BadInput(
            f"device='gpu' needs cuda-python, which is not installed; pip install 'upright[cuda]', or {_STAY}."
        ) from None
    return driver


def launch(
    driver: Any, code: Callable[[], bytes], lanes: int, arguments: Sequence[int | float | Arrays],
    results: Sequence[Arrays],
) -> None:  # fmt: skip
    """Run a kernel of `lowering.gpu.threads` to its end, and fill the `results` among its arguments.

    Parameters
    ----------
    driver : module
        From `door`, or what answers the same calls.
    code : callable
        Gives PTX, once there is a GPU.
    lanes : int
        Threads that have something to do.
    arguments : sequence of number or array
        Those of the kernel, in order; arrays contiguous, row by row.
    results : sequence of array
        Those of the arrays that are written; the others are only read.

    Raises
    ------
    BadInput
        When there is no GPU, it has no room, or its driver refuses.
    """
    with ExitStack() as after:
        _do(driver, "cuCtxPushCurrent", _context(driver))
        after.callback(driver.cuCtxPopCurrent)
        module = _do(driver, "cuModuleLoadData", code() + b"\0")
        after.callback(driver.cuModuleUnload, module)
        function = _do(driver, "cuModuleGetFunction", module, KERNEL.encode())
        words: list[Any] = []
        written: list[tuple[Arrays, Any]] = []
        for a in arguments:
            if not isinstance(a, np.ndarray):
                words.append(ctypes.c_double(a) if isinstance(a, float) else ctypes.c_int64(a))
                continue
            place = _do(driver, "cuMemAlloc", max(a.nbytes, 8))
            after.callback(driver.cuMemFree, place)
            words += [ctypes.c_uint64(int(place)), *(ctypes.c_int64(n) for n in a.shape)]
            if a.nbytes and any(a is x for x in results):
                written.append((a, place))
            elif a.nbytes:
                _do(driver, "cuMemcpyHtoD", place, a.ctypes.data, a.nbytes)
        pointers = (ctypes.c_void_p * len(words))(*map(ctypes.addressof, words))
        blocks = -(-lanes // THREADS)
        _do(driver, "cuLaunchKernel", function, blocks, 1, 1, THREADS, 1, 1, 0, 0, ctypes.addressof(pointers), 0)
        _do(driver, "cuCtxSynchronize")
        for a, place in written:
            _do(driver, "cuMemcpyDtoH", a.ctypes.data, place, a.nbytes)


@cache
def _context(driver: Any) -> Any:
    """What this process owns on the first GPU; it is shared with whoever else in it uses the GPU, and stays."""
    try:
        _do(driver, "cuInit", 0)
        device = _do(driver, "cuDeviceGet", 0)
    except (BadInput, RuntimeError) as error:  # the latter where there is not even a driver
        message = str(error).rstrip(".")
        raise BadInput(f"device='gpu' needs a GPU of NVIDIA's and its driver, got: {message}; or {_STAY}.") from None
    return _do(driver, "cuDevicePrimaryCtxRetain", device)


def _do(driver: Any, name: str, *args: Any) -> Any:
    """A call of the driver, and what it gives."""
    status, *out = getattr(driver, name)(*args)
    if int(status):
        code = getattr(status, "name", status)
        if code == "CUDA_ERROR_OUT_OF_MEMORY":
            raise BadInput(f"the GPU has no room for so many motions; give it fewer lanes at a time, or {_STAY}.")
        raise BadInput(
            f"the GPU's driver answers {code} to {name}; an A100 or newer and a current driver are needed, or {_STAY}."
        )
    return out[0] if out else None
