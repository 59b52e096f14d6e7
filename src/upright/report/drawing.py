"""The look of pictures on a screen and on grey paper, how they get into a page, and planes of poles.

Okabe and Ito's colours, which colour-blind readers can tell apart, each with a line style of its own.
"""

from __future__ import annotations

import os
import re
import warnings
from collections.abc import Callable, Generator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from functools import cache, wraps
from io import BytesIO, StringIO
from itertools import pairwise
from pathlib import Path
from typing import TYPE_CHECKING, Any, ParamSpec, TypeVar

import numpy as np
from numpy.typing import NDArray

from upright.errors import BadInput
from upright.files import whole_file
from upright.report.symbols import axis, mathtext

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

Roots = NDArray[np.complex128]
P = ParamSpec("P")
R = TypeVar("R")
Array = NDArray[np.float64]

BLACK, ORANGE, SKY, GREEN = "#000000", "#E69F00", "#56B4E9", "#009E73"
BLUE, VERMILLION, PURPLE, GREY = "#0072B2", "#D55E00", "#CC79A7", "#6b6b6b"
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
    PURPLE: "purple", GREY: "grey", "#ffffff": "white", "#e4e4e4": "grid",
}  # fmt: skip
"""Custom properties of a page's style that may replace a colour of a picture, ``--mpl-blue`` and so on."""

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
    "grid.color": "#e4e4e4",
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
        drawing.savefig(
            page, format="svg", transparent=True, metadata={"Date": None, "Creator": None, "Format": None, "Type": None}
        )
    text = page.getvalue()
    text = text[text.index("<svg") :]
    # `Figure.savefig` writes six decimals; a hundredth of a point is finer than any printer
    text = re.sub(r'(?<= d=")[^"]*', _short, text)
    text = re.sub(r'\b(id=")', rf"\1{name}-", text)
    text = re.sub(r"(url\(#|href=\"#)", rf"\1{name}-", text)
    text = re.sub(r'\s(xmlns|xmlns:xlink|version)="[^"]*"', "", text)
    text = re.sub(r"\n\s*", "\n", text)
    text = re.sub(r"(?<=: )#[0-9a-fA-F]{6}\b", _replaceable, text)
    opening = text[: text.index(">")]
    responsive = re.sub(r'\s(width|height)="[^"]*"', "", opening)
    share = 100 * min(1.0, drawing.get_figwidth() / WIDTH)
    return f'{responsive} style="max-width:{share:.0f}%" aria-hidden="true" focusable="false"{text[len(opening) :]}'


def _short(path: re.Match[str]) -> str:
    """A path in hundredths of a point, without the zeros and blanks that nobody needs."""
    rounded = re.sub(r"(\.\d\d)\d+", r"\1", path[0])
    numbers = re.sub(r"(\.\d*[1-9])0+(?!\d)|\.0+(?!\d)", r"\1", rounded)
    return re.sub(r"\s*([MLCQZz])\s*", r"\1", numbers)


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


@dataclass(frozen=True, kw_only=True)
class Poles:
    """Poles [1/s] of one kind with their mark: ``x`` open loop, ``o`` requested, ``+`` attained."""

    name: str
    values: Roots
    mark: str
    colour: str


@styled
def pole_map(kinds: Sequence[Poles], cloud: Roots | None = None, *, frame: int = 2) -> Figure:
    """Poles in the s-plane [1/s], the stable half shaded; `cloud` are those of the rigs that the fit allows.

    The view holds the first `frame` kinds; how many poles of the others lie outside is written below.
    """
    drawing = figure(4.2, width=6.2)
    ax: Any = drawing.subplots()
    shown = np.concatenate([k.values for k in kinds[:frame]])
    within = 1.3
    left, right = within * float(min(shown.real.min(), -1.0)), within * float(max(shown.real.max(), 1.0))
    high = within * float(max(np.abs(shown.imag).max(), 0.25 * (right - left)))
    ax.axvspan(left, 0.0, color=BLUE, alpha=0.06, linewidth=0)
    s_plane(ax)
    if cloud is not None and cloud.size:
        ax.plot(cloud.real, cloud.imag, ".", color=ORANGE, markersize=2, alpha=0.5, label="rigs that the fit allows")
    outside = 0
    for kind in kinds:
        v = kind.values
        roots(ax, v, kind.mark, kind.colour, kind.name, size=8 if kind.mark == "o" else 6)
        outside += int(np.sum((v.real < left) | (v.real > right) | (np.abs(v.imag) > high)))
    ax.set_xlim(left, right)
    ax.set_ylim(-high, high)
    more = f"; {outside} faster one{'s' if outside > 1 else ''} outside the picture" if outside else ""
    ax.set_xlabel(f"real part [1/s]{more}")
    ax.set_ylabel("imaginary part [rad/s]")
    ax.legend(loc="upper left", bbox_to_anchor=(1.01, 1.0))
    return drawing


@styled
def swing_figure(
    t: Array, coordinates: dict[str, tuple[Array, str]], command: Array, unit: str, limit: float | None
) -> Figure:
    """Linear motion from a deviation: coordinates with their units, and the command with the drive's limit."""
    drawing = figure(1.4 * (len(coordinates) + 1) + 0.4)
    axes: list[Any] = drawing.subplots(len(coordinates) + 1, 1, sharex=True, squeeze=False)[:, 0].tolist()
    for ax, (name, (values, of)) in zip(axes, coordinates.items(), strict=False):
        ax.plot(t, values, color=BLUE)
        ax.set_ylabel(axis(mathtext(name), of))
    axes[-1].plot(t, command, color=VERMILLION)
    axes[-1].set_ylabel(axis("command", unit))
    if limit is not None:
        draw_limits(axes[-1], limit, "limit", float(t[-1]))
        reach = 1.25 * max(limit, float(np.abs(command).max()))
        axes[-1].set_ylim(-reach, reach)
    hide_inner_times(axes)
    drawing.align_ylabels(axes)
    return drawing


@styled
def locus_figure(tracks: Roots, sets: dict[str, Roots], open_loop: Roots, *, origin: str = "open loop") -> Figure:
    """Poles as the effort's weight falls, shape (weights, n), with up to four named sets of poles on them.

    Only the upper half plane is drawn; the lower mirrors it.
    """
    drawing = figure(3.4)
    ax: Any = drawing.subplots()
    s_plane(ax)
    for i, track in enumerate(tracks.T):
        upper = track[track.imag >= -1e-9]
        label = "LQR poles as effort gets cheaper" if i == 0 else None
        ax.plot(upper.real, upper.imag, ".", color=BLUE, markersize=1.5, label=label)
    roots(ax, open_loop[open_loop.imag >= -1e-9], "x", GREY, origin)
    for (name, poles), mark in zip(sets.items(), "osD^", strict=False):
        roots(ax, poles[poles.imag >= 0], mark, VERMILLION, name, size=8)
    every = np.concatenate([*sets.values(), open_loop])
    wide = float(np.ptp(every.real))
    ax.set_xlim(every.real.min() - 0.08 * wide, every.real.max() + 0.08 * wide)
    high = max(float(every.imag.max()), 0.1 * wide)
    ax.set_ylim(-0.06 * high, 1.15 * high)
    ax.set_ylabel("imaginary part [rad/s]")
    ax.legend(loc="upper left", bbox_to_anchor=(1.01, 1.0))
    return drawing
