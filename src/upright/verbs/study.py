"""The study that a verb is given, and what it says of where its numbers come from."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from upright.errors import BadInput

if TYPE_CHECKING:
    from upright.study.load import Study


def read_study(study: Path, folder: Path, data: Path | None) -> Study:
    """A study, once study and folder of the results are what they should be."""
    from upright.readers.source import neighbour
    from upright.report.symbols import typed
    from upright.study.load import load_study

    if not study.exists():
        raise BadInput(
            f"There is no study '{study}';{neighbour(study)} "
            f"`upright init LOG -o {typed(study.name)}` writes one from a log"
        )
    if folder.exists() and not folder.is_dir():
        raise BadInput(f"results need a folder, but {folder} is a file; name another with -o")
    return load_study(study, data=data)


def folder_beside(study: Path, what: str) -> Path:
    """Folder of results beside a study and called after it, ``crane-fit``.

    Raises
    ------
    BadInput
        When the study is a folder.
    """
    if study.is_dir():
        raise BadInput(f"'{study}' is a folder, and a study is a TOML file; name the file inside it.")
    return study.with_name(f"{study.stem}-{what}")
