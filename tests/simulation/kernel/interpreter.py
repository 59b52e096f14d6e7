"""The text of a kernel run by Python itself: slow, and what the machine code has to give."""

from __future__ import annotations

import math
from collections.abc import Callable
from types import SimpleNamespace
from typing import Any

import numpy as np

from upright.simulation import Simulator
from upright.simulation.kernel.compiled import source
from upright.simulation.kernel.lanes import RUN_ARGUMENTS


def functions(text: str) -> dict[str, Any]:
    """Functions of a text as Python has them."""

    def as_it_is(function: Callable[..., Any]) -> Callable[..., Any]:
        return function

    names = dict.fromkeys(("inline", "inline_strict", "exact", "scalar", "entry", "separate"), as_it_is)
    known = ("sin", "cos", "tan", "sqrt", "exp", "pi", "nan", "inf")
    space: dict[str, Any] = names | {n: getattr(math, n) for n in known}
    space |= {"floor": np.floor, "ldexp": math.ldexp, "frexp": math.frexp}
    exec(compile(text, "kernel", "exec"), space)
    return space


def interpreted(simulator: Simulator) -> Simulator:
    """The same simulator without its machine code."""
    run = functions(source(simulator._layout))
    words = [name.strip() for name in RUN_ARGUMENTS.split(",")]

    def call(name: str) -> Callable[..., None]:
        def stepped(*given: Any) -> None:
            with np.errstate(all="ignore"):
                run[name](**dict(zip(words, given, strict=True)))

        return stepped

    simulator.__dict__["_kernel"] = SimpleNamespace(run_1=call("run_1"), run_16=call("run_16"), events=0)
    return simulator
