"""Every form that a law or a rig can be exported in; a file each, which declares a `LawTarget` or a `RigTarget`."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path

from upright.declared import Declaration, Declared, declared_in
from upright.exports.controller import SampledController
from upright.exports.vector import ReplayVector
from upright.report.page import Chapter
from upright.rig import Rig


@dataclass(frozen=True, kw_only=True)
class Target(Declaration):
    """One form: `name` is what ``--to`` says."""


@dataclass(frozen=True, kw_only=True)
class LawTarget(Target):
    """A program that runs a law.

    Attributes
    ----------
    title : str
        What it is for: ``"MATLAB and GNU Octave"``.
    write : callable
        Texts by file name, of a law, the replay it tests itself by, and whether it is in single precision.
    test : str
        Command that lets it test itself, with the ``{folder}`` of its files.
    onward : str
        How it is called, a sentence.
    rules : bool
        Whether it can write a `Rule` too.
    warn : callable
        What to say beforehand of a law in double precision; and by how much it misses in single precision, with unit.
    """

    title: str
    write: Callable[[SampledController, ReplayVector, bool], Mapping[str, str]]
    test: str
    onward: str
    rules: bool = False
    warn: Callable[[SampledController, str], str] = lambda made, miss: ""


@dataclass(frozen=True, kw_only=True)
class RigExport:
    """What a rig's form is written from.

    Attributes
    ----------
    called : str
        How a command would name what it was read from.
    folder : Path
        That the files will stand in.
    kept : callable
        The fit.json that it was read from; one that was only in memory is written into the folder.
    limit : float or None
        Requested limit of the command.
    """

    rig: Rig
    called: str
    folder: Path
    store: Callable[[], Path]
    limit: float | None = None


@dataclass(frozen=True, kw_only=True)
class RigTarget(Target):
    """A rig for another simulator.

    Attributes
    ----------
    write : callable
        Content of the files by name, and what there is to say of them.
    limited : bool
        Whether it can have another limit than the fit.
    draws : int
        How many rigs it wants drawn from the fit's covariance.
    """

    write: Callable[[RigExport], tuple[Mapping[str, bytes], Chapter]]
    limited: bool = False
    draws: int = 0


TARGETS = Declared(
    "form to export in", "upright.exports", declared_in(Target, "upright.exports.targets"),
    lambda value: isinstance(value, LawTarget | RigTarget),
)  # fmt: skip
"""Every form by name."""
