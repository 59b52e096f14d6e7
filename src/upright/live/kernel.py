"""A kernel as a page needs it: the module of WebAssembly, its arrays, and where each number of a lane stands."""

from __future__ import annotations

import base64
from pathlib import Path
from typing import Any

import numpy as np

from upright.simulation import Simulator
from upright.simulation.kernel.lanes import RUN_ARGUMENTS
from upright.simulation.simulator import Call

SCRIPT = Path(__file__).with_name("kernel.js")
"""Script that instantiates what `described` says: ``new Kernel(described)``."""

_WRITTEN = ("OUT", "STAT", "W")


def described(simulator: Simulator, call: Call, *, width: int) -> dict[str, Any]:
    """What ``new Kernel(...)`` takes, as JSON holds it.

    Parameters
    ----------
    simulator : Simulator
        Whose kernel it is.
    call : Call
        What it is called with, from ``simulator.call(..., width=width)``.
    width : int
        Lanes of a block: 1, or 16.

    Raises
    ------
    BadInput
        When the kernel cannot be compiled for a page.
    """
    made = simulator.wasm(width)
    values = (0, call.blocks, *call.arguments, np.zeros(call.room), 0)
    arguments: list[dict[str, Any]] = []
    for name, value in zip(RUN_ARGUMENTS.split(", "), values, strict=True):
        if not isinstance(value, np.ndarray):
            arguments.append({"name": name, "value": value})
            continue
        whole = value.dtype == np.int64
        argument: dict[str, Any] = {"name": name, "shape": list(value.shape)} | ({"whole": True} if whole else {})
        if name not in _WRITTEN and value.any():
            argument["data"] = base64.b64encode(np.ascontiguousarray(value).tobytes()).decode()
        arguments.append(argument)
    return {
        "wasm": base64.b64encode(made.code).decode(),
        "imports": list(made.imports),
        "width": width,
        "rows": dict(simulator.rows),
        "arguments": arguments,
    }
