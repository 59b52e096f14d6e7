"""A verb as Python calls it: its sentences name arguments where the command line names options."""

from __future__ import annotations

import re
from collections.abc import Callable
from functools import wraps
from typing import Any, TypeVar

from upright.errors import UprightError
from upright.verbs.command import Command, command_of

V = TypeVar("V", bound=Callable[..., Any])

_COMMAND_LINE = re.compile(r"(`[^`]*`|\bupright [^;,]*)")
_OPTION = re.compile(r"(?<![\w-])(--?[a-z][a-z-]*)(?: (\"[^\"]*\"|\d[\d.]*\b|[A-Z]{2,}\b))?")


def worded_for_python(verb: V) -> V:
    """The verb or method, its errors worded for Python."""

    @wraps(verb)
    def called(*args: Any, **words: Any) -> Any:
        try:
            return verb(*args, **words)
        except UprightError as error:
            command = command_of(verb)
            error.args = tuple(worded(a, command) if isinstance(a, str) else a for a in error.args)
            raise

    return called  # type: ignore[return-value]


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
