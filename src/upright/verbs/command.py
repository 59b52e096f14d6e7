"""How the command line offers a verb: what neither the verb's signature nor its docstring says."""

from __future__ import annotations

import inspect
import re
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field
from typing import Any, TypeVar

V = TypeVar("V", bound=Callable[..., Any])

NAMES = {"out": "-o --out"}
"""Options that are not called after their parameter alone, whichever command they are of."""

_SECTION = re.compile(r"\n\n(\w+)\n-{3,}\n")


@dataclass(frozen=True, kw_only=True, eq=False, repr=False)
class Flag:
    """An option that only the command line has; where it `prints` something, the command does only that."""

    help: str
    prints: Callable[[], str] | None = None


@dataclass(frozen=True, kw_only=True, eq=False, repr=False)  # each method that is made delays `upright --help`
class Command:
    """A verb as a command; the mappings are by the names of its parameters.

    Attributes
    ----------
    verb : callable
        Does the work. Its positional parameters become arguments, the others options: repeated where the default is
        ``()``, a flag where it is a truth value, a path where the annotation says so.
    group : str
        Section of ``upright --help``.
    name : str
        One word or two, as in ``"log show"``; that of the verb when omitted.
    more : str
        Follows the docstring's description in ``--help``: examples, exit codes.
    metavars, helps, names, defaults, ranges : mapping
        What stands for a value in ``--help``; help where that of the docstring is not for a command line; options such
        as ``"-o --html"`` where they are not called after the parameter; another default; least and greatest value.
    hidden : collection of str
        Parameters that cannot be typed.
    flags : mapping of str to Flag
    prepare : callable
        Turns what was typed, by parameter or flag, into what the verb is called with; flags are left out of that.
    lines : callable, optional
        What is printed piece by piece, texts or answers, where the verb returns no answer.
    wrong : callable
        Whether an answer, with the flags, ends the command with exit code 3; interrupted ones end with 130.
    resumes : bool
        The command may write over what it has read.
    """

    verb: Callable[..., Any]
    group: str = "Other packages"
    name: str = ""
    more: str = ""
    metavars: Mapping[str, str] = field(default_factory=dict[str, str])
    helps: Mapping[str, str] = field(default_factory=dict[str, str])
    names: Mapping[str, str] = field(default_factory=dict[str, str])
    defaults: Mapping[str, Any] = field(default_factory=dict[str, Any])
    ranges: Mapping[str, tuple[float | None, float | None]] = field(
        default_factory=dict[str, tuple[float | None, float | None]]
    )
    hidden: Iterable[str] = ()
    flags: Mapping[str, Flag] = field(default_factory=dict[str, Flag])
    prepare: Callable[[dict[str, Any]], dict[str, Any]] = lambda typed: typed
    lines: Callable[[Any], Iterable[Any]] | None = None
    wrong: Callable[..., bool] = lambda answer, **flags: False
    resumes: bool = False

    @property
    def words(self) -> str:
        """What is typed after ``upright``."""
        return self.name or self.verb.__name__.replace("_", "-")

    def options(self, name: str) -> list[str]:
        """What is typed for a parameter, where it is not called after it."""
        return self.names.get(name, NAMES.get(name, "")).split()

    @property
    def line(self) -> str:
        """What the command does, in a line."""
        return " ".join(description(self.verb).partition("\n\n")[0].split())


def command(group: str = Command.group, **settings: Any) -> Callable[[V], V]:
    """Decorator that offers a verb as a command; see `Command` for its settings."""

    def declare(verb: V) -> V:
        verb.command = Command(verb=verb, group=group, **settings)  # type: ignore[attr-defined]
        return verb

    return declare


def command_of(verb: Any) -> Command:
    """The command that was declared for a verb, or the one that follows from the verb alone."""
    declared = vars(verb).get("command")
    return declared if isinstance(declared, Command) else Command(verb=verb)


def description(verb: Any) -> str:
    """Text of a docstring before its first section."""
    return _SECTION.split(inspect.getdoc(verb) or "", maxsplit=1)[0]


def parameter_texts(verb: Any) -> dict[str, str]:
    """What the section Parameters of a numpydoc docstring says of each, in one line."""
    pieces = _SECTION.split(inspect.getdoc(verb) or "")
    section = dict(zip(pieces[1::2], pieces[2::2], strict=True)).get("Parameters", "")
    out: dict[str, str] = {}
    names: list[str] = []
    for line in section.splitlines():
        if line[:1].strip():
            names = line.partition(" : ")[0].split(", ")
        elif line.strip():
            out |= {name: f"{out.get(name, '')} {line.strip()}".strip() for name in names}
    return out
