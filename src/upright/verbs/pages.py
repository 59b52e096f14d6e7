"""Where a verb writes: the folder, and the page as HTML and PDF."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import wraps
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Any, TypeVar

from upright.errors import BadInput
from upright.verbs.answer import Answer

if TYPE_CHECKING:
    from upright.files import PathLike
    from upright.report.page import Chapter

V = TypeVar("V", bound=Callable[..., Any])


def written_where_named(verb: V) -> V:
    """Let a verb that writes its results leave no file unless `out` names a folder.

    Without one it works in a folder that is gone when it answers; commands that read its files again are not proposed.
    """

    @wraps(verb)
    def answered(*arguments: Any, out: PathLike | None = None, pdf: bool = False, **more: Any) -> Any:
        if out is not None:
            return verb(*arguments, out=out, pdf=pdf, **more)
        pdf_has_folder(out, pdf)
        with TemporaryDirectory(prefix="upright-") as name:
            answer = verb(*arguments, out=name, pdf=False, **more)
        numbers = {n: v for n, v in answer.numbers.items() if n not in ("report", "files")}
        return Answer(answer.value, replace(answer.chapter, steps=(), numbers=numbers))

    return answered  # type: ignore[return-value]


def folder(path: PathLike) -> Path:
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


def page_folder(out: PathLike | None, pdf: bool) -> Path:
    """The folder for results; says before the work begins that a PDF cannot be made.

    Raises
    ------
    BadInput
        When it is a file, or a PDF is requested and there is no program to make it.
    """
    can_be_pdf(pdf)
    return folder(out or "")


def folder_if_given(out: PathLike | None, pdf: bool = False) -> Path | None:
    """The folder for results, where one is named; says before the work begins that a PDF cannot be made.

    Raises
    ------
    BadInput
        When it is a file, or a PDF is requested and there is no folder for it or no program to make it.
    """
    pdf_has_folder(out, pdf)
    return None if out is None else folder(out)


def pdf_has_folder(out: PathLike | None, pdf: bool) -> None:
    """Refuse a PDF that cannot be made, or for which no folder is named."""
    if can_be_pdf(pdf) and out is None:
        raise BadInput("pdf writes into the folder out, and none was named; name one, or call .report('page.pdf').")


def can_be_pdf(requested: bool) -> bool:
    """Whether a PDF is requested.

    Raises
    ------
    BadInput
        When it is, and cannot be made.
    """
    if requested:
        from upright.report.pdf import available

        if not available():
            raise BadInput("--pdf needs the pdf extra: pip install 'upright[pdf]', or print the page from a browser.")
    return requested


def write_page(chapter: Chapter, path: Path, pdf: bool) -> list[Path]:
    """Write a chapter as HTML and, where requested, as PDF beside it; gives back the files."""
    from upright.report.html import write_html
    from upright.report.pdf import write_pdf

    return [write_html(path, chapter), *([write_pdf(path.with_suffix(".pdf"), chapter)] if pdf else [])]
