"""Description of a run before its first row: rig, law, the columns with their units, and which program wrote it."""

from __future__ import annotations

import json
import platform
import shutil
import subprocess
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, NamedTuple, Self

from upright._version import __version__
from upright.errors import BadInput
from upright.files import plain_values

_DEEPEST = 64
"""Tables and lists in one another; the arrays of a law are 4."""


class LogColumn(NamedTuple):
    """One number of each row; a whole one is kept to the last digit, up to 64 bits."""

    name: str
    unit: str
    whole: bool = False


@dataclass(frozen=True, kw_only=True)
class LogHeader:
    """Description of a run before its first row.

    Attributes
    ----------
    rig : str
        Text of the rig's file.
    law : mapping of str
        The law as `upright.laws.as_values` gives it, for a replay; anything else that JSON can hold is kept and shown.
    coordinates : tuple of (str, str)
        Name and unit of each measured coordinate, in the plant's order. A row has the counts of each first.
    period : float
        Of the control tick [s].
    references : tuple of (str, str)
        Name and unit of each reference as the law was given it; none where nothing is followed, and in old logs.
    command : str
        Name of the command's column.
    modes, faults : mapping of int to str
        What the numbers in the columns ``mode`` (one of them) and ``faults`` (their sum) mean.
    driven : tuple of int
        Modes in which the law of the header gives the command; all when empty.
    start : float
        Time t = 0 since 1970 [s], for other programs to show; 0 where unknown.
    versions : mapping of str to str
        Program and version that wrote the log; see `versions`.
    """

    rig: str
    law: Mapping[str, Any]
    coordinates: tuple[tuple[str, str], ...]
    command_unit: str
    period: float
    references: tuple[tuple[str, str], ...] = ()
    command: str = "u"
    modes: Mapping[int, str] = field(default_factory=dict[int, str])
    faults: Mapping[int, str] = field(default_factory=dict[int, str])
    driven: tuple[int, ...] = ()
    start: float = 0.0
    versions: Mapping[str, str] = field(default_factory=lambda: versions())

    def __post_init__(self) -> None:
        if not 0.0 < self.period < 3600.0:
            raise BadInput(f"a log needs the period of its rows in s, above 0, got {self.period}.")
        if not self.coordinates:
            raise BadInput("a log needs the name and the unit of at least one measured coordinate, got none.")
        names = [column.name for column in self.columns]
        if twice := sorted({name for name in names if names.count(name) > 1}):
            raise BadInput(
                f"the columns of a log need names of their own, and {', '.join(twice)} would stand there twice;"
                " rename the coordinate, the reference or the command."
            )

    @property
    def columns(self) -> tuple[LogColumn, ...]:
        """The numbers of a row, in their order.

        These are t, tick, counts, readings, references, command, applied command, mode, faults.
        """
        measured = [LogColumn(name, unit) for name, unit in (*self.coordinates, *self.references)]
        counts = [LogColumn(f"{name}_counts", "counts", whole=True) for name, _ in self.coordinates]
        commands = [LogColumn(name, self.command_unit) for name in (self.command, f"{self.command}_applied")]
        states = [LogColumn(name, "1", whole=True) for name in ("mode", "faults")]
        return (LogColumn("t", "s"), LogColumn("tick", "1", whole=True), *counts, *measured, *commands, *states)

    def as_metadata(self) -> dict[str, dict[str, str]]:
        """Texts by name for the records of a file."""
        rest = {
            "coordinates": self.coordinates, "references": self.references, "command": self.command,
            "command_unit": self.command_unit, "period": self.period, "modes": self.modes, "faults": self.faults,
            "driven": self.driven, "start": self.start,
        }  # fmt: skip
        return {
            "rig": {"file": self.rig},
            "law": {"json": _text(self.law)},
            "log": {"json": _text(rest)},
            "versions": {str(name): str(version) for name, version in self.versions.items()},
        }

    @classmethod
    def of_metadata(cls, texts: Mapping[str, Mapping[str, str]]) -> Self:
        """The same header again; rig and law are empty where their texts are missing.

        Raises
        ------
        KeyError, TypeError, ValueError, AttributeError
            When the texts are no header's.
        """
        rest = _table_of(texts["log"]["json"])
        named = {name: {int(number): str(word) for number, word in rest[name].items()} for name in ("modes", "faults")}
        return cls(
            rig=texts.get("rig", {}).get("file", ""), law=_table_of(texts.get("law", {}).get("json", "{}")),
            coordinates=tuple((str(name), str(unit)) for name, unit in rest["coordinates"]),
            references=tuple((str(name), str(unit)) for name, unit in rest.get("references", ())),
            command=str(rest["command"]), command_unit=str(rest["command_unit"]), period=float(rest["period"]),
            driven=tuple(int(mode) for mode in rest["driven"]), start=float(rest["start"]),
            versions=dict(texts.get("versions", {})), **named,
        )  # fmt: skip

    def fault_names(self, faults: int) -> tuple[str, ...]:
        """Words for the bits of a sum of faults."""
        bits = (1 << n for n in range(faults.bit_length()) if faults >> n & 1)
        return tuple(self.faults.get(bit, f"fault {bit}") for bit in bits)


def _text(values: Any) -> str:
    return json.dumps(plain_values(values), ensure_ascii=False, separators=(",", ":"))


def _table_of(text: str) -> dict[str, Any]:
    """Values of a JSON text by name, nested no deeper than what walks through them later can follow."""
    try:
        values: Any = json.loads(text)
    except RecursionError:
        raise ValueError("nested too deeply") from None
    if not isinstance(values, dict):
        raise ValueError("not a table of names and values")
    level: list[Any] = [values]
    for _ in range(_DEEPEST):
        level = [item for inner in level for item in (inner.values() if isinstance(inner, dict) else inner)]
        level = [item for item in level if isinstance(item, dict | list)]
        if not level:
            return values
    raise ValueError("nested too deeply")


def versions() -> dict[str, str]:
    """Versions of this program, of its source where it runs from a working copy of it, and of Python."""
    return {"upright": __version__, "git": _git_version(), "python": platform.python_version()}


def _git_version() -> str:
    """As ``git describe`` says it; empty when this file is in nobody's repository, or there is no git."""
    git = shutil.which("git")
    if git is None:
        return ""

    def output(*words: str) -> str:
        process = subprocess.run(
            [git, "-C", str(Path(__file__).parent), *words], capture_output=True, encoding="utf-8", timeout=10
        )
        return process.stdout.strip() if process.returncode == 0 else ""

    try:
        # a package that is installed somewhere below another repository is not a part of it
        return output("describe", "--always", "--dirty") if output("ls-files", "--error-unmatch", "header.py") else ""
    except (OSError, subprocess.SubprocessError):
        return ""
