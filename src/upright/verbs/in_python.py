"""A verb as Python calls it: arguments of the kind that it states, and sentences that name them.

The command line names options instead, and makes their values itself.
"""

from __future__ import annotations

import os
import re
from collections.abc import Callable, Mapping
from functools import wraps
from inspect import signature
from numbers import Complex, Integral, Real
from pathlib import Path
from typing import Any, TypeVar

from upright.errors import BadInput, UprightError
from upright.verbs.command import Command, command_of
from upright.verbs.options import Counts, shared_parameters
from upright.verbs.values import Start

V = TypeVar("V", bound=Callable[..., Any])

_COMMAND_LINE = re.compile(r"(`[^`]*`|\bupright [^;,]*)")
_OPTION = re.compile(r"(?<![\w-])(--?[a-z][a-z-]*)(?: (\"[^\"]*\"|\d[\d.]*\b|[A-Z]{2,}\b))?")

_KINDS: dict[str, tuple[tuple[type, ...], str]] = {
    "PathLike": ((str, os.PathLike), "a path such as 'rig/fit.json'"),
    "str": ((str, os.PathLike), "a text"),
    "int": ((Integral,), "a whole number"),
    "float": ((Real,), "a number"),
    "complex": ((Complex,), "a number"),
    "None": ((type(None),), "None"),
}
"""What an annotation means: the types of its values, and how a sentence calls them."""
_ALIASES = {"Counts": Counts, "Start": Start}


def worded_for_python(verb: V) -> V:
    """The verb or method; arguments that are not of the kind it states are refused, errors are worded for Python."""

    @wraps(verb)
    def called(*args: Any, **words: Any) -> Any:
        try:
            _check_kinds(verb, args, words)
            return verb(*args, **words)
        except UprightError as error:
            command = command_of(verb)
            error.args = tuple(worded(a, command) if isinstance(a, str) else a for a in error.args)
            raise
        except FileNotFoundError as error:
            from upright.readers.source import neighbour

            if error.filename is None:
                raise
            raise BadInput(f"There is no file '{error.filename}';{neighbour(Path(error.filename))}") from None

    return called  # type: ignore[return-value]


def _check_kinds(verb: Callable[..., Any], args: tuple[Any, ...], words: dict[str, Any]) -> None:
    stated = signature(verb)
    try:
        given = stated.bind_partial(*args, **words).arguments
    except TypeError:
        return  # Python's own sentence names what is missing or too much
    kinds = {name: str(p.annotation) for name, p in stated.parameters.items()}
    for p in stated.parameters.values():
        if p.kind is p.VAR_KEYWORD:
            shared = shared_parameters(p, verb.__module__)[0]
            given |= given.pop(p.name, {})
            kinds |= {name: f"{option.annotation} | None" for name, option in shared.items()}
    for name, value in given.items():
        kind = kinds.get(name, "Any")
        if not _fits(value, kind):
            *others, last = dict.fromkeys(_called(k) for k in _alternatives(kind))
            needed = f"{', '.join(others)} or {last}" if others else last
            raise BadInput(f"{name} takes {needed}, got {value!r:.60}.")
        if name == "seed" and isinstance(value, Integral) and value < 0:
            raise BadInput(f"seed takes a whole number of at least 0, got {value}.")


def _alternatives(annotation: str) -> list[str]:
    """The kinds of ``A | B[C | D]``, aliases of the verbs' own resolved; NumPy's and those of rooms below stay."""
    kinds, depth = [""], 0
    for letter in annotation:
        depth += (letter == "[") - (letter == "]")
        if letter == "|" and depth == 0:
            kinds.append("")
        else:
            kinds[-1] += letter
    stripped = [kind.strip() for kind in kinds]
    return [k for s in stripped for k in (_alternatives(_text_of(_ALIASES[s])) if s in _ALIASES else [s])]


def _text_of(alias: Any) -> str:
    return str(alias).replace("collections.abc.", "").replace("typing.", "")


def _fits(value: Any, annotation: str) -> bool:
    """Whether a value is of an annotation's kind; one of a kind that this module does not know is let through."""
    return any(_fits_one(value, kind) for kind in _alternatives(annotation))


def _fits_one(value: Any, kind: str) -> bool:
    name, _, inside = kind.partition("[")
    if name == "bool":
        return isinstance(value, bool) or type(value).__name__ == "bool"  # NumPy's too
    if name in _KINDS:
        return isinstance(value, _KINDS[name][0]) and not (isinstance(value, bool) and name != "None")
    of = inside.removesuffix("]")
    if name == "Mapping":
        each = of.partition(", ")[2]
        return issubclass(type(value), Mapping) and all(isinstance(k, str) and _fits(v, each) for k, v in value.items())
    if name in ("Sequence", "Iterable", "tuple"):
        each, length = of.partition(", ")[0], of.count(", ") + 1
        if isinstance(value, str | bytes | Mapping) or not hasattr(value, "__iter__") or isinstance(value, type):
            return False
        if getattr(value, "ndim", 1) == 0:
            return False
        if not hasattr(value, "__len__"):
            return name == "Iterable"
        return (name != "tuple" or len(value) == length) and all(_fits(v, each) for v in value)
    return True


def _called(kind: str) -> str:
    """How a sentence calls a kind."""
    name, _, inside = kind.partition("[")
    if name == "Mapping":
        return "values by name"
    if name in ("Sequence", "Iterable", "tuple"):
        many = "two" if name == "tuple" else "several"
        return f"{many} {'texts' if inside.startswith('str') else 'numbers'}"
    return "True or False" if name == "bool" else _KINDS[name][1]


def worded(sentence: str, command: Command) -> str:
    """A sentence with ``--period "2 ms"`` as ``period="2 ms"``; whole lines for a terminal stay."""
    arguments = {option: name for name in command.names for option in command.options(name)}
    arguments.setdefault("-o", "out")

    def argument(match: re.Match[str]) -> str:
        option, value = match.groups()
        switch, off, name = option.partition("no-")
        if off and switch == "--" and not value:
            return f"{name.replace('-', '_')}=False"
        name = arguments.get(option, option[2:].replace("-", "_"))
        if not name or name in command.flags:
            return match[0]
        return f"{name}={value}" if value else name

    pieces = _COMMAND_LINE.split(sentence)
    return "".join(p if i % 2 else _OPTION.sub(argument, p) for i, p in enumerate(pieces))
