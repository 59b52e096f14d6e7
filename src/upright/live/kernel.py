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
        argument: dict[str, Any] = {"name": name, "shape": list(value.shape)}
        if value.dtype == np.int64:
            argument["whole"] = True
        if name not in _WRITTEN and value.any():
            argument["rows"] = [_row(row) for row in value.reshape(-1, value.shape[-1] if value.ndim > 1 else 1)]
        arguments.append(argument)
    return {
        "wasm": base64.b64encode(made.code).decode(),
        "imports": list(made.imports),
        "width": width,
        "rows": dict(simulator.rows),
        "settings": list(simulator.settings),
        "parameters": [*simulator.names, *simulator.law_rows],
        "arguments": arguments,
    }


def _row(row: np.ndarray) -> int | float | str:
    """A row of an array: one number where all are alike and JSON has it, else their bytes in base64."""
    if (row == row[0]).all() and np.isfinite(row[0]):
        return row[0].item()
    return base64.b64encode(np.ascontiguousarray(row).tobytes()).decode()
