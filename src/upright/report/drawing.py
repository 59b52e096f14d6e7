"""The look of pictures on a screen and on grey paper, how they get into a page, and planes of poles.

Okabe and Ito's colours, which colour-blind readers can tell apart, each with a line style of its own.
"""

from __future__ import annotations

import os
import re
import warnings
from collections.abc import Callable, Generator, Mapping
from contextlib import contextmanager
from functools import cache, wraps
from io import BytesIO, StringIO
from itertools import pairwise
from pathlib import Path
from textwrap import fill
from typing import TYPE_CHECKING, Any, ParamSpec, TypeVar

import numpy as np
from numpy.typing import NDArray

from upright.errors import BadInput
from upright.files import whole_file

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

Roots = NDArray[np.complex128]
P = ParamSpec("P")
R = TypeVar("R")
Array = NDArray[np.float64]

BLACK, ORANGE, SKY, GREEN = "#000000", "#E69F00", "#56B4E9", "#009E73"
BLUE, VERMILLION, PURPLE, GREY = "#0072B2", "#D55E00", "#CC79A7", "#6b6b6b"
PALE = "#e4e4e4"
CYCLE = (
    (BLUE, "-"),
    (VERMILLION, "--"),
    (GREEN, "-."),
    (PURPLE, (0, (1, 1))),
    (ORANGE, (0, (6, 1, 1, 1, 1, 1))),
    (BLACK, (0, (3, 3))),
)
"""Colour and line style of the n-th curve."""
_ON_DARK = {
    BLACK: "black", ORANGE: "orange", SKY: "sky", GREEN: "green", BLUE: "blue", VERMILLION: "vermillion",
    PURPLE: "purple", GREY: "grey", "#ffffff": "white", PALE: "grid",
}  # fmt: skip
"""Custom properties of a page's style that may replace a colour of a picture, ``--mpl-blue`` and so on."""

_FAMILY = "'DejaVu Sans', sans-serif"  # of every text of a picture, said once
WIDTH = 7.4  # inches; a column of the page
_STYLE: dict[Any, Any] = {
    "font.size": 9,
    "font.family": ["sans-serif"],
    "font.sans-serif": ["DejaVu Sans"],
    "axes.titlesize": 10,
    "axes.titlelocation": "left",
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.grid": True,
    "axes.axisbelow": True,
    "axes.unicode_minus": True,
    "grid.color": PALE,
    "grid.linewidth": 0.6,
    "legend.frameon": False,
    "legend.fontsize": 8.5,
    "lines.linewidth": 1.2,
    "path.simplify": True,
    "svg.fonttype": "none",  # text stays text: it can be searched, read aloud and scaled
    "svg.hashsalt": "upright",  # the same fit draws the same bytes
    "mathtext.fontset": "dejavusans",
    "mathtext.default": "it",
}


def styled(draw: Callable[P, R]) -> Callable[P, R]:
    """Draw in the house style, whatever the user's own; the user's settings are put back afterwards."""

    @wraps(draw)
    def inside(*args: P.args, **kwargs: P.kwargs) -> R:
        import matplotlib

        with matplotlib.rc_context():
            matplotlib.rcdefaults()  # but for the backend: a matplotlibrc may ask for LaTeX, other colours, a cut edge
            matplotlib.rcParams.update(_STYLE)
            return draw(*args, **kwargs)

    return inside


@contextmanager
def _undisturbed() -> Generator[None]:
    """Write a picture without a word about glyphs that our fonts lack, and without the date of somebody's build."""
    date = os.environ.pop("SOURCE_DATE_EPOCH", None)  # matplotlib reads it even where no date is asked for
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", UserWarning)
            yield
    finally:
        if date is not None:
            os.environ["SOURCE_DATE_EPOCH"] = date


def figure(height: float, width: float = WIDTH, *, margins: tuple[float, ...] = ()) -> Figure:
    """Empty figure, sizes in inches; no window and no global state belong to it.

    `margins` are left, right, top and bottom; without them matplotlib measures every text, which takes longer.
    A notebook shows the figure when it is a cell's last value.
    """
    drawing = _shown_in_notebooks()(figsize=(width, height), layout=None if margins else "constrained")
    if margins:
        left, right, top, bottom = margins
        drawing.subplots_adjust(left / width, bottom / height, 1 - right / width, 1 - top / height)
    return drawing


NARROW = 3.6
"""Width of a figure on a phone [inch]: its letters of 9 points stand there as 11 px."""


BUCKETS_NARROW = 80
"""Of each curve there; every one shows its least and its greatest sample."""


@styled
def narrowed(drawing: Figure) -> bool:
    """Lay a figure out for a phone: panels below one another, long titles in several lines; False where it fits one."""
    width, height = drawing.get_size_inches().tolist()
    if width <= 1.2 * NARROW:
        return False
    panels = [(spec, ax) for ax in drawing.axes if (spec := ax.get_subplotspec()) is not None]
    grids = {id(spec.get_gridspec()): spec.get_gridspec() for spec, _ in panels}
    grid = next(iter(grids.values())) if len(grids) == 1 else None
    places = {(spec.num1, spec.num2) for spec, _ in panels}
    if grid is not None and grid.ncols > 1 and all(first == last for first, last in places):
        order = sorted(first for first, _ in places)
        if _named_by_its_edges({spec.num1: ax for spec, ax in panels}, grid.ncols):
            order.sort(key=lambda place: (place % grid.ncols, place))  # column by column
        stacked = drawing.add_gridspec(len(order), 1)
        for spec, ax in panels:
            ax.set_subplotspec(stacked[order.index(spec.num1)])
            ax.tick_params(labelleft=True)
        height *= len(order) / grid.nrows
    drawing.set_layout_engine("constrained")
    drawing.set_size_inches(NARROW, min(height, 2.4 * NARROW * max(1, len(places))))
    for ax in drawing.axes:
        for where in ("left", "center"):
            if title := ax.get_title(loc=where):
                ax.set_title(fill(title, 34) if "$" not in title else title, loc=where)
        words = [label.get_text() for label in ax.get_yticklabels()]
        if max(map(len, words), default=0) > 16 and not any("$" in word for word in words):
            ax.set_yticks(ax.get_yticks(), [fill(word, 16) for word in words])
        for text in ax.texts if len(ax.texts) > 20 else ():  # of the cells of a table
            text.set_fontsize(6)
        for line in ax.lines:
            x, y = (np.asarray(column, dtype=np.float64) for column in line.get_data())
            line.set_data(*decimated(x, y, BUCKETS_NARROW) if x.size == y.size else (x, y))
        ax.set_xlabel(fill(ax.get_xlabel(), 40))
    for owner in (drawing, *drawing.axes):
        _stack_legend(owner)
    return True


def _stack_legend(owner: Any) -> None:
    """Entries of a legend that stand in a row go below one another, two by two where they are short."""
    legends = owner.legends if hasattr(owner, "legends") else filter(None, [owner.get_legend()])
    for legend in tuple(legends):
        words = [text.get_text() for text in legend.get_texts()]
        if len(words) < 3 or getattr(legend, "_ncols", 1) < 3:
            continue
        handles, outside = legend.legend_handles, getattr(legend, "_outside_loc", None)
        legend.remove()
        if outside:
            owner.legend(handles, words, loc=f"outside {outside} center", ncols=2 if max(map(len, words)) <= 20 else 1)
        else:
            owner.legend(handles, words, loc="lower left", bbox_to_anchor=(0.0, 1.0))
            owner.figure.set_figheight(owner.figure.get_figheight() + 0.17 * len(words))


def _named_by_its_edges(panels: Mapping[int, Axes], columns: int) -> bool:
    """Whether a grid has titles above its first row alone; every panel then gets those of its column and its row."""
    titles = {place: ax.get_title(loc="left") for place, ax in panels.items()}
    rows = max(panels) // columns
    if not rows or not all(bool(title) == (place < columns) for place, title in titles.items()):
        return False
    for place, ax in panels.items():
        ax.set_title(titles[place % columns], loc="left")
        ax.set_ylabel(ax.get_ylabel() or panels[place - place % columns].get_ylabel())
    return True


@cache
def _shown_in_notebooks() -> type[Figure]:
    """Class of figures that Jupyter can show without pyplot."""
    from matplotlib.figure import Figure

    class Drawing(Figure):
        @styled
        def _repr_png_(self) -> bytes:
            page = BytesIO()
            with _undisturbed():
                self.savefig(page, format="png", dpi=120, facecolor="white")
            return page.getvalue()

    return Drawing


@styled
def svg(drawing: Figure, name: str) -> str:
    """Markup of a figure to stand inside a page; ids begin with `name`, so that several figures can share it."""
    page = StringIO()
    with _undisturbed():
        _lay_out(drawing)
        drawing.savefig(
            page, format="svg", transparent=True, metadata={"Date": None, "Creator": None, "Format": None, "Type": None}
        )
    text = page.getvalue()
    text = text[text.index("<svg") :]
    # `Figure.savefig` writes six decimals and a name for every group; a hundredth of a point is finer than any printer
    text = re.sub(r'(?<= d=")[^"]*', _short, text)
    text = re.sub(r'(?<= )([xy]=")([-\d.]+)', lambda m: f"{m[1]}{float(m[2]):.2f}", text)
    text = re.sub(r' transform="rotate\(-0 [^"]*"', "", text)
    text = re.sub(r"</?g\b[^>]*>", _Ungrouped(), text)
    text = re.sub(r'\b(id=")', rf"\1{name}-", text)
    text = re.sub(r"(url\(#|href=\"#)", rf"\1{name}-", text)
    text = re.sub(r'\s(xmlns|xmlns:xlink|version)="[^"]*"', "", text)
    text = re.sub(r"(\s*\n)+\s*", "\n", text)
    text = re.sub(r"(?<=: )#[0-9a-fA-F]{6}\b", _replaceable, text)
    text = re.sub(r'(?<=style=")[^"]*', lambda style: re.sub(r"([;:]) ", r"\1", style[0]), text)
    text = text.replace(f"font-family:{_FAMILY};", "")
    opening = text[: text.index(">")]
    responsive = re.sub(r'\s(width|height)="[^"]*"', "", opening)
    share = 100 * min(1.0, drawing.get_figwidth() / WIDTH)
    drawn = f'font-family="{_FAMILY}" style="max-width:{share:.0f}%" aria-hidden="true" focusable="false"'
    return f"{responsive} {drawn}{text[len(opening) :]}"


def _lay_out(drawing: Figure) -> None:
    """Lay a figure out for good; left to it, `Figure.savefig` draws it whole for that and then once more."""
    engine = drawing.get_layout_engine()
    if engine is not None:
        engine.execute(drawing)
        drawing.set_layout_engine(None)


def _short(path: re.Match[str]) -> str:
    """A path in hundredths of a point, every place counted from the one before it, which takes half the digits."""
    text, command_before, before = "", "", ""
    first = here = (0, 0)
    for command, numbers in re.findall(r"([MLCQZz])([^MLCQZz]*)", path[0]):
        hundredths = [round(100 * float(n)) for n in numbers.split()]
        places = list(zip(hundredths[::2], hundredths[1::2], strict=True))
        own = "M" if command == "M" else command.lower()
        if own != command_before:
            text, before = text + own, ""
        origin = (0, 0) if own == "M" else here
        for number in (_digits(v - o) for place in places for v, o in zip(place, origin, strict=True)):
            closed = not before or number.startswith("-") or (number.startswith(".") and "." in before)
            text, before = f"{text}{number}" if closed else f"{text} {number}", number
        here, command_before = places[-1] if places else first, own
        first = here if own == "M" else first
    return text


def _digits(hundredths: int) -> str:
    """A number of hundredths without the zeros that nobody needs."""
    return re.sub(r"^(-?)0(?=\.)", r"\1", f"{hundredths / 100:.2f}".rstrip("0").rstrip(".")) if hundredths else "0"


class _Ungrouped:
    """Leaves out groups that say nothing, in a text that is read from its beginning."""

    def __init__(self) -> None:
        self.kept: list[bool] = []

    def __call__(self, tag: re.Match[str]) -> str:
        if tag[0].endswith("/>"):
            return ""  # empty
        if tag[0] == "</g>":
            return tag[0] if self.kept.pop() else ""
        self.kept.append(not re.fullmatch(r'<g(?: id="[^"]*")?>', tag[0]))
        return tag[0] if self.kept[-1] else ""


def _replaceable(colour: re.Match[str]) -> str:
    """A colour of a style that a page may replace, in the dark."""
    name = _BY_HEX.get(colour[0].lower())
    return f"var(--mpl-{name}, {colour[0]})" if name else colour[0]


_BY_HEX = {colour.lower(): name for colour, name in _ON_DARK.items()}

PICTURES = (".svg", ".png")
"""Endings of files that a picture is written to."""


def picture_format(path: Path) -> str:
    """Format of a picture, by the ending of its file.

    Raises
    ------
    BadInput
        When it is none of `PICTURES`.
    """
    if path.suffix.lower() not in PICTURES:
        raise BadInput(f"a picture is a file ending in {' or '.join(PICTURES)}, got '{path}'; name one with -o.")
    return path.suffix[1:].lower()


@styled
def save(drawing: Figure, path: Path) -> Path:
    """Write a figure by itself, as SVG or PNG by the ending of `path`."""
    form = picture_format(path)
    with whole_file(path) as half, _undisturbed():
        drawing.savefig(
            half, format=form, dpi=160, facecolor="white",
            metadata={"Date": None, "Creator": None} if form == "svg" else {},
        )  # fmt: skip
    return path


def decimated(t: Array, y: Array, buckets: int = 450) -> tuple[Array, Array]:
    """Curve thinned to what an eye can see: the least and the greatest sample of every bucket.

    Fewer than ``3 buckets`` samples come back as they are.
    """
    if t.size <= 3 * buckets:
        return t, y
    edges = np.linspace(0, t.size, buckets + 1).astype(int)
    rows = {0, t.size - 1}
    for lo, hi in pairwise(edges):
        rows |= {int(lo + np.argmin(y[lo:hi])), int(lo + np.argmax(y[lo:hi]))}
    index = np.array(sorted(rows))
    return t[index], y[index]


def broken(t: Array, y: Array, every: float | None) -> tuple[Array, Array]:
    """Curve with a gap wherever a prediction was restarted, `every` seconds."""
    if every is None or t.size < 2:
        return t, y
    window = np.floor((t - t[0]) / every + 1e-9)
    cuts = np.flatnonzero(np.diff(window)) + 1
    return np.insert(t, cuts, t[cuts]), np.insert(y, cuts, np.nan)


def draw_limits(ax: Axes, most: float, name: str, at: float) -> None:
    """Lines at plus and minus `most`, named where the curves end, `at`."""
    for side in (-1, 1):
        ax.axhline(side * most, color=GREY, linestyle="--", linewidth=0.9)
    ax.text(at, most, f"{name} ", ha="right", va="bottom", fontsize=8.5, color=GREY)


def hide_inner_times(axes: list[Axes]) -> None:
    """Label only the lowest of panels that share their time axis."""
    for a in axes[:-1]:
        a.tick_params(labelbottom=False)
    axes[-1].set_xlabel("time [s]")


def s_plane(ax: Axes, *, unstable: float = 0.0) -> None:
    """Axes of the plane of poles [1/s]; its right half is shaded as far as `unstable`."""
    if unstable > 0:
        ax.axvspan(0.0, unstable, color=ORANGE, alpha=0.15, linewidth=0)
    ax.axhline(0.0, color=GREY, linewidth=0.8)
    ax.axvline(0.0, color=GREY, linewidth=0.8)
    ax.set_xlabel("real part [1/s]")


def roots(
    ax: Axes, values: NDArray[np.complex128], mark: str, colour: str, name: str | None, *, size: float = 7
) -> None:
    """Poles or zeros, each with a mark; rings, squares and the like are hollow."""
    hollow: dict[str, Any] = {"markerfacecolor": "none"} if mark in "osD^" else {}
    ax.plot(
        values.real, values.imag, mark, color=colour, markersize=size, markeredgewidth=1.4, linestyle="none",
        label=name, **hollow,
    )  # fmt: skip
