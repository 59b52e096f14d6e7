"""Where a verb writes: the folder, and the page as HTML and PDF."""

from __future__ import annotations

import os
from pathlib import Path
from typing import TYPE_CHECKING

from upright.errors import BadInput

if TYPE_CHECKING:
    from upright.report.page import Chapter


def folder(path: str | os.PathLike[str]) -> Path:
    """The folder for results.

    Raises
    ------
    BadInput
        When it is a file.
    """
    path = Path(path)
    if path.exists() and not path.is_dir():
        raise BadInput(f"--out needs a folder, and '{path}' is a file; name another folder.")
    return path


def page_folder(out: str | os.PathLike[str], pdf: bool) -> Path:
    """The folder for results; says before the work begins that a PDF cannot be made.

    Raises
    ------
    BadInput
        When it is a file, or a PDF is asked for and there is no program to make it.
    """
    can_be_pdf(pdf)
    return folder(out)


def folder_if_given(out: str | os.PathLike[str] | None, pdf: bool = False) -> Path | None:
    """The folder for results, where one is named; says before the work begins that a PDF cannot be made.

    Raises
    ------
    BadInput
        When it is a file, or a PDF is asked for and there is no folder for it or no program to make it.
    """
    pdf_has_folder(out, pdf)
    return None if out is None else folder(out)


def pdf_has_folder(out: str | os.PathLike[str] | None, pdf: bool) -> None:
    """Refuse a PDF that cannot be made, or for which no folder is named."""
    if can_be_pdf(pdf) and out is None:
        raise BadInput("pdf writes into the folder out, and none was named; name one, or call .report('page.pdf').")


def can_be_pdf(asked: bool) -> bool:
    """Whether a PDF is asked for.

    Raises
    ------
    BadInput
        When it is, and cannot be made.
    """
    if asked:
        from upright.report.pdf import available

        if not available():
            raise BadInput("--pdf needs the pdf extra: pip install 'upright[pdf]', or print the page from a browser.")
    return asked


def write_page(chapter: Chapter, path: Path, pdf: bool) -> list[Path]:
    """Write a chapter as HTML and, where that is asked for, as PDF beside it; gives back the files."""
    from upright.report.html import write_html
    from upright.report.pdf import write_pdf

    return [write_html(path, chapter), *([write_pdf(path.with_suffix(".pdf"), chapter)] if pdf else [])]
