"""Every key of a tree of values, changed in every way that a hand or a program may get it wrong."""

from __future__ import annotations

import copy
from collections.abc import Iterator
from typing import Any

Place = tuple[str | int, ...]
REMOVED: Any = object()


def paths(tree: Any, to: Place = ()) -> Iterator[Place]:
    """Path of every key and entry, the tables themselves included."""
    entries = tree.items() if isinstance(tree, dict) else enumerate(tree) if isinstance(tree, list) else ()
    for key, value in entries:
        yield (*to, key)
        yield from paths(value, (*to, key))


def at(tree: Any, path: Place) -> Any:
    for key in path:
        tree = tree[key]
    return tree


def changed(tree: Any, path: Place, value: Any) -> Any:
    """A copy with another value under a path, or without it."""
    out = copy.deepcopy(tree)
    holder = at(out, path[:-1])
    if value is REMOVED:
        del holder[path[-1]]
    else:
        holder[path[-1]] = value
    return out


def wrong(value: Any) -> Iterator[tuple[str, Any]]:
    """What may stand in the place of a value, by what is wrong with it: missing, type, sign, size, unit."""
    yield "missing", REMOVED
    for other in (True, "", "strange", 7, -7, 0, [], {}, [value], [[]], {"value": value}, "[bold]", "9**9**9"):
        yield f"type {other!r:.12}", other
    for size in (1e-300, 1e300, -1e300, float("nan"), float("inf"), 10**400, 2**63):
        yield f"size {size!r:.8}", size
    if isinstance(value, int | float) and not isinstance(value, bool):
        yield "sign", -value
    if isinstance(value, str):
        for text in (f"-{value}", f"{value} {value}", f"1e300 {value}", f"{value} furlong", value * 50, f"0 {value}"):
            yield f"unit {text:.12}", text
        number, _, unit = value.partition(" ")
        if unit:
            for text in (f"-{number} {unit}", number, f"{number}e300 {unit}", f"{number} V", f"0 {unit}"):
                yield f"unit {text:.12}", text
