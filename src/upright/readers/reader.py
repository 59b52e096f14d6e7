"""What a reader of logs declares of itself, and every reader there is."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from upright.declared import Declaration, Declared, declared_in
from upright.readers.source import Source
from upright.records import Record


@dataclass(frozen=True, kw_only=True)
class Reader(Declaration):
    """Reader of one format; an object of a module of `formats`, or the entry point of a package.

    Attributes
    ----------
    name : str
        As a study names it.
    files : str
        What it reads, for sentences: ``"MATLAB version 5"``.
    recognises : callable
        Whether content is of its format.
    read : callable
        Record of content; what is wrong with it is raised as `Source.bad` says it.
    order : int
        Order in which readers are tried on a content, the smallest first. Formats that begin with a mark of their
        own stand below 30, texts that are recognised by their words above, a table of anything at 100.
    """

    files: str
    recognises: Callable[[Source], bool]
    read: Callable[[Source], Record]
    order: int = 25  # before the texts


READERS = Declared(
    "reader", "upright.readers", declared_in(Reader, "upright.readers.formats"), lambda value: isinstance(value, Reader)
)
"""Every reader by name."""
