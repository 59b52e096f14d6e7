"""A verb as Python calls it: arguments of the kind that it states, and sentences that name them.

The command line names options instead, and makes their values itself.
"""

from __future__ import annotations

import os
import re
from collections.abc import Callable
from functools import wraps
from inspect import signature
from numbers import Integral, Real
from typing import Any, TypeVar

from upright.errors import BadInput, UprightError
from upright.verbs.command import Command, command_of

V = TypeVar("V", bound=Callable[..., Any])

_COMMAND_LINE = re.compile(r"(`[^`]*`|\bupright [^;,]*)")
_OPTION = re.compile(r"(?<![\w-])(--?[a-z][a-z-]*)(?: (\"[^\"]*\"|\d[\d.]*\b|[A-Z]{2,}\b))?")

_KINDS: dict[str, tuple[tuple[type, ...], str]] = {
    "PathLike": ((str, os.PathLike), "a path such as 'rig/fit.json'"),
    "str": ((str, os.PathLike), "a text"),
    "int": ((Integral,), "a whole number"),
    "float": ((Real,), "a number"),
}
"""What an annotation means: the types of its values, and how a sentence calls them."""


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

    return called  # type: ignore[return-value]


def _check_kinds(verb: Callable[..., Any], args: tuple[Any, ...], words: dict[str, Any]) -> None:
    stated = signature(verb)
    try:
        given = stated.bind_partial(*args, **words).arguments
    except TypeError:
        return  # Python's own sentence names what is missing or too much
    for name, value in given.items():
        kind, _, absent = str(stated.parameters[name].annotation).partition(" | ")
        if absent not in ("", "None") or (absent and value is None):
            continue
        if kind == "bool" and not (isinstance(value, bool) or type(value).__name__ == "bool"):  # NumPy's too
            raise BadInput(f"{name} is True or False, got {value!r:.60}.")
        types, needed = _KINDS.get(kind, ((object,), ""))
        if not isinstance(value, types) or (isinstance(value, bool) and kind in ("int", "float")):
            raise BadInput(f"{name} takes {needed}{' or None' * bool(absent)}, got {value!r:.60}.")


def worded(sentence: str, command: Command) -> str:
    """A sentence with ``--period "2 ms"`` as ``period="2 ms"``; whole lines for a terminal stay."""
    arguments = {option: name for name in command.names for option in command.options(name)}
    arguments.setdefault("-o", "out")

    def argument(match: re.Match[str]) -> str:
        option, value = match.groups()
        name = arguments.get(option, option[2:].replace("-", "_"))
        if not name or name in command.flags:
            return match[0]
        return f"{name}={value}" if value else name

    pieces = _COMMAND_LINE.split(sentence)
    return "".join(p if i % 2 else _OPTION.sub(argument, p) for i, p in enumerate(pieces))
