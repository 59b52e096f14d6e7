"""Content of a log as bytes and as text, and sentences that say where in it a mistake is."""

from __future__ import annotations

import hashlib
import re
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np

from upright.errors import BadInput
from upright.records import Array, PathLike, Provenance

_UNPRINTABLE = re.compile(r"[\x00-\x08\x0b\x0e-\x1f\x7f]")


@dataclass(frozen=True, kw_only=True)
class Source:
    """Content of one log and the name to call it by."""

    file: str
    data: bytes

    @cached_property
    def text(self) -> str:
        r"""Content as text with ``\n`` line ends; refuses binary content with its place."""
        encoding = "utf-16" if self.data[:2] in (b"\xff\xfe", b"\xfe\xff") else "utf-8-sig"
        try:
            text = self.data.decode(encoding)
        except UnicodeDecodeError:
            text = self.data.decode("latin-1")  # degree signs of older Windows programs
        text = text.replace("\r\n", "\n").replace("\r", "\n")
        strange = _UNPRINTABLE.search(text)
        if strange is not None:
            line = text.count("\n", 0, strange.start()) + 1
            column = strange.start() - text.rfind("\n", 0, strange.start())
            raise self.bad(
                f"expected text or a MATLAB file, got the byte {ord(strange[0]):#04x} of some binary format;"
                " export the log as CSV or MAT version 5",
                line=line,
                column=column,
            )
        return text

    def provenance(self, reader: str, *notes: str) -> Provenance:
        """Origin of a record that `reader` made of this file."""
        return Provenance(file=self.file, sha256=hashlib.sha256(self.data).hexdigest(), reader=reader, notes=notes)

    def bad(self, sentence: str, *, line: int = 0, column: int = 0, sample: int = 0, name: str = "") -> BadInput:
        """Error that names the file and the place in it, all counted from 1."""
        counted = (("line", line), ("column", column), ("sample", sample))
        place = [f"'{self.file}'", *(f"{what} {number}" for what, number in counted if number)]
        return BadInput(f"{', '.join(place)}{f' ({name})' if name and column else ''}: {sentence}.")

    def must_increase(
        self,
        t: Array,
        place: Callable[[int], dict[str, Any]],
        *,
        what: str = "time",
        unit: str = " s",
        each: str = "row",
        advice: str = "mend or delete the row",
        strictly: bool = True,
    ) -> None:
        """Refuse times (N,) that do not increase, or fall where not `strictly`; `place` finds a row counted from 0."""
        step = np.diff(t)
        bad = np.flatnonzero(~(step > 0) if strictly else step < 0)
        if bad.size:
            row = int(bad[0]) + 1
            raise self.bad(
                f"{what} must increase from {each} to {each}, got {t[row]:.9g}{unit} after {t[row - 1]:.9g}{unit};"
                f" {advice}",
                **place(row),
            )


def load(path: PathLike) -> Source:
    """Whole content of a file.

    Raises
    ------
    BadInput
        When there is no such file, it is a folder, empty, or cannot be read.
    """
    name = str(path)
    try:
        data = Path(path).read_bytes()
    except IsADirectoryError:
        raise BadInput(f"'{name}' is a folder; name the log file inside it.") from None
    except FileNotFoundError:
        raise BadInput(f"There is no file '{name}';{_neighbour(Path(path))}") from None
    except (OSError, ValueError) as error:
        raise BadInput(f"'{name}' cannot be read: {error}; check its name and permissions.") from None
    source = Source(file=name, data=data)
    if not data.strip():
        raise source.bad("the file is empty; export the log again")
    return source


def _neighbour(path: Path) -> str:
    from difflib import get_close_matches

    try:
        beside = [p.name for p in path.parent.iterdir() if p.is_file()]
    except OSError:
        return f" there is no folder '{path.parent}' either, check the path."
    close = get_close_matches(path.name, beside, n=1, cutoff=0.5)
    return f" did you mean '{close[0]}'?" if close else " check the path."
