"""The files of an export, in memory and, where a folder is named, in it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from upright.files import replace_file
from upright.verbs.answer import Answer

if TYPE_CHECKING:
    from upright.report.page import Chapter


class Exported(Answer[tuple[str, ...]]):
    """Names of the files of an export.

    Attributes
    ----------
    contents : mapping of str to bytes
        Of every file by its name.
    """

    def __init__(self, contents: Mapping[str, bytes], page: Chapter, at: Path | None) -> None:
        folder = at or Path()
        files = [] if at is None else [replace_file(at / name, content) for name, content in contents.items()]
        super().__init__(tuple(str(folder / name) for name in contents), page, files)
        self.contents = contents


def exported(contents: Mapping[str, bytes], page: Chapter, at: Path | None, to: str) -> Exported:
    """An export, its files in a folder where one is named; otherwise nothing is proposed that reads them."""
    names = [str((at or Path()) / name) for name in contents]
    page = replace(page, numbers={"to": to, "files": names, **page.numbers})
    return Exported(contents, page if at is not None else replace(page, steps=()), at)
