"""Result of a verb: a value, its report as a chapter, with the files that were written."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from io import StringIO
from pathlib import Path
from typing import TYPE_CHECKING, Any, Generic, TypeVar

from upright.errors import BadInput, nearest

if TYPE_CHECKING:
    from upright.report.page import Chapter, Picture

V = TypeVar("V")


class Answer(Generic[V]):
    """What a verb found; it shows itself as text at a prompt and as tables in a notebook.

    Attributes
    ----------
    value
        The result; its attributes can be read here as well.
    chapter : Chapter
        Its report.
    files : tuple of Path
        What was written.
    """

    def __init__(self, value: V, chapter: Chapter, files: Sequence[Path] = ()) -> None:
        self.value, self.chapter, self.files = value, chapter, tuple(files)

    def __repr__(self) -> str:
        return as_text(self.brief(), self.files)

    def _repr_html_(self) -> str:
        from upright.report.html import fragment

        return fragment(self.brief())

    def brief(self) -> Chapter:
        """What a prompt and a notebook show of the chapter."""
        return replace(self.chapter, steps=())

    def __getattr__(self, name: str) -> Any:
        if name.startswith("_") or name == "value":
            raise AttributeError(name)
        return getattr(self.value, name)

    def __dir__(self) -> list[str]:
        return sorted(n for n in {*super().__dir__(), *dir(self.value)} - {"brief"} if not n.startswith("_"))

    @property
    def verdict(self) -> str:
        """What was learned, in a sentence or more."""
        return str(getattr(self.value, "verdict", "") or self.chapter.verdict)

    @property
    def numbers(self) -> Any:
        """Plain values for another program [SI]."""
        return self.chapter.numbers

    @property
    def pictures(self) -> tuple[str, ...]:
        """Names of the pictures that `plot` draws."""
        return tuple(self._drawings())

    def plot(self, name: str | None = None) -> Any:
        """The chapter's best picture, or the one called `name`: a matplotlib figure or a chart; SVG of a stored one.

        Raises
        ------
        BadInput
            When there is no such picture.
        """
        drawings = self._drawings()
        if not drawings:
            raise BadInput(f"there is no picture of '{self.chapter.title}'; print it, or look into .numbers.")
        name = name or self.chapter.best or next(iter(drawings))
        if name not in drawings:
            raise BadInput(f"plot draws {', '.join(drawings)}, got '{name}'; {nearest(name, drawings)}")
        draw = drawings[name].draw
        if isinstance(draw, str):
            return StoredPicture(draw)
        return draw()

    def _drawings(self) -> dict[str, Picture]:
        from upright.report.page import Picture

        return {b.name: b for p in self.chapter.parts for b in p.content if isinstance(b, Picture)}

    def report(self, path: str | Path) -> Path:
        """Write the whole chapter as a page, HTML or PDF by the ending of `path`, and give back where."""
        path = Path(path)
        if path.suffix == ".pdf":
            from upright.report.pdf import available, write_pdf

            if not available():
                raise BadInput("a PDF needs the pdf extra: pip install 'upright[pdf]', or name a file ending in .html.")
            return write_pdf(path, self.chapter)
        if path.suffix != ".html":
            raise BadInput(f"a report is a file ending in .html or .pdf, got '{path}'.")
        from upright.report.html import write_html

        return write_html(path, self.chapter)


class StoredPicture(str):
    """SVG of a picture that an earlier run drew; a notebook shows it."""

    def _repr_svg_(self) -> str:
        first, end, _ = self.removeprefix('<div class="chart">').partition("</svg>")  # of a chart, the one for a desk
        return first + end


def as_text(chapter: Chapter, files: Sequence[Path] = ()) -> str:
    """A chapter as a terminal shows it."""
    from rich.console import Console

    from upright.report.terminal import print_chapter

    # in a notebook, rich would show what is printed at once instead of writing it
    screen = Console(file=StringIO(), width=120, highlight=False, force_jupyter=False)
    print_chapter(screen, chapter, files, chapter.title)
    return screen.file.getvalue().strip()  # type: ignore[attr-defined]
