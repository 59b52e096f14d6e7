"""A law sample by sample, with the same bits at a rig, in a replay of its log and on any machine.

A sum of floats depends on its order, and libraries choose theirs by processor and version (Python's own `sum` changed
with 3.12). Here it goes from left to right in plain multiplications and additions, memory before readings, as in the
compiled kernel and in what `upright export` writes.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import lru_cache
from math import floor, isfinite, nan
from typing import Any

import numpy as np

from upright.errors import BadInput
from upright.laws.linear import Array, Controller, Law
from upright.laws.rule import Numbers, Rule

AtWork = Callable[[float, Sequence[float]], Numbers]
"""Commands for a time since the start [s] and the readings then; remembers what the law remembers."""
RECENT = 64
"""Readings from which other gains take their memories, as if they had read them: what a filter of 0.5 had before is
left by 1e-19."""
_TERMS = 50  # Python's compiler goes as deep as an expression is long


def at_work(law: Law | Rule, before: Sequence[tuple[float, Sequence[float]]] = ()) -> AtWork:
    """The law from its first sample on, one call for each; `before` are times and readings that it has had already.

    Commands are rounded and limited as the law says; its `delay` is left to the computer and the converter that have
    it, and its `resolution` to the encoders.

    A reading or a command that is not finite stops the law: it gives NaN from there on, upon which a rig's supervisor
    stops the rig with a message. An exported program has nobody above it, and gives zero instead.

    Raises
    ------
    BadInput
        When the law has lanes.
    """
    if any(width > 1 for width in law.widths().values()):
        raise BadInput("a law at work has one lane; take it from those it has with of_lanes(slice(k, k + 1)).")
    running = _linear(law, before) if isinstance(law, Law) else _function(law)
    stopped = False

    def step(t: float, y: Sequence[float]) -> Numbers:
        nonlocal stopped
        if not stopped and all(map(isfinite, y)):
            u = running(t, y)
            stopped = not all(map(isfinite, u))
        else:  # a rule would make a command of any comparison with NaN, and a memory would keep it
            u, stopped = (nan,) * (len(law.D) if isinstance(law, Law) else law.commands(len(y))), True
        return (nan,) * len(u) if stopped else u

    for t, y in before if isinstance(law, Rule) else ():
        step(t, y)
    return step


def _linear(law: Law, before: Sequence[tuple[float, Sequence[float]]]) -> AtWork:
    a, b, c, d = (getattr(law, name).reshape(getattr(law, name).shape[:2]).tolist() for name in "ABCD")
    command, after = _sums(c, d), _sums(a, b)
    numbers = {name: _row(values[:, 0]) for name, values in law.by_lane(1).items() if name in ("initial", "target")}
    target, z, n = numbers["target"], numbers["initial"], law.readings
    begin = None if law.begin is None else [_row(row) for row in law.begin]
    held = [law.windup == "hold" and row == unit for row, unit in zip(a, np.eye(len(a)).tolist(), strict=True)]
    referred, finish = _references(law), _finish(law)
    k = 0

    def step(t: float, y: Sequence[float]) -> Numbers:
        nonlocal z, begin, k
        w = (*(y[i] - target[i] for i in range(n)), *referred(k))
        if begin is not None:
            z, begin = tuple(_dot(row, w[:n], x) for x, row in zip(z, begin, strict=True)), None
        u, beyond = finish(command(z, w))
        new = after(z, w)
        z = tuple(x if stays else y for x, y, stays in zip(z, new, held, strict=True)) if beyond else new
        k += 1
        return u

    for t, y in before:
        if any(held) or begin is not None:
            step(t, y)
        else:  # what it commanded meanwhile changes none of its memories, and other gains come between two ticks
            z, k = after(z, (*(y[i] - target[i] for i in range(n)), *referred(k))), k + 1
    return step


def _sums(of: list[list[float]], to: list[list[float]]) -> Callable[[Numbers, Numbers], Numbers]:
    """Rows of ``of z + to w`` as `_dot` sums them, written out; in loops they take most of a tick's time."""
    lines = [f"    {'z%d, ' * len(row) % tuple(range(len(row)))}= z" for row in of[:1] if row]
    lines += [f"    {'w%d, ' * len(row) % tuple(range(len(row)))}= w" for row in to[:1] if row]
    for i, (memory, measured) in enumerate(zip(of, to, strict=True)):
        terms = [f"{a!r} * z{j}" for j, a in enumerate(memory)] + [f"{a!r} * w{j}" for j, a in enumerate(measured)]
        lines += [f"    u{i} = 0.0"]
        lines += [f"    u{i} = u{i} + {' + '.join(terms[j : j + _TERMS])}" for j in range(0, len(terms), _TERMS)]
    lines += [f"    return ({'u%d, ' * len(of) % tuple(range(len(of)))})"]
    return _compiled("\n".join(["def sums(z, w):", *lines]))


@lru_cache(maxsize=64)
def _compiled(text: str) -> Callable[[Numbers, Numbers], Numbers]:
    """The function of a text; kept, since other gains leave the memories' sums as they are."""
    space: dict[str, Any] = {}
    exec(text, space)
    return space["sums"]


def _function(law: Rule) -> AtWork:
    p, z = (_row(values[:, 0]) for values in law.by_lane(1).values())
    referred, finish = _references(law), _finish(law)
    k = 0

    def step(t: float, y: Sequence[float]) -> Numbers:
        nonlocal z, k
        u, z = law.function(t, tuple(y), referred(k), z, p)
        k += 1
        return finish(u)[0]

    return step


def _references(law: Controller) -> Callable[[int], Numbers]:
    """References at sample k; the last are held."""
    r = [_row(row) for row in law.signal()]
    return lambda k: r[min(k, len(r) - 1)]


def _finish(law: Controller) -> Callable[[Sequence[float]], tuple[Numbers, bool]]:
    """Commands rounded and limited, and whether one was beyond the limit."""
    limit, resolution = law.limit, np.asarray(law.command_resolution, dtype=np.float64)
    quanta = _row(resolution) if resolution.ndim else (float(resolution),)

    def finish(u: Sequence[float]) -> tuple[Numbers, bool]:
        values = [_rounded(x, q) for x, q in zip(u, quanta if len(quanta) > 1 else quanta * len(u), strict=True)]
        # a command that is infinite is none: the limit would make all that the drive can of it
        limited = tuple(min(max(x, -limit), limit) if isfinite(x) else nan for x in values)
        return limited, any(abs(x) > limit for x in values)

    return finish


def _rounded(x: float, step: float) -> float:
    if not step > 0.0:
        return float(x)
    steps = x * (1.0 / step)
    return floor(steps + 0.5) * step if isfinite(steps) else steps


def _row(values: Array) -> Numbers:
    return tuple(np.asarray(values, dtype=np.float64).tolist())


def _dot(row: Numbers, x: Sequence[float], total: float = 0.0) -> float:
    """Sum of products on top of a total."""
    for factor, value in zip(row, x, strict=True):
        total += factor * value
    return total
