"""Arrays as an SVG with axes, ticks and units, drawn for a phone and for a desk, and the values that a cursor reads.

A chart stands without a script and on paper; ``charts.js`` adds a cursor for mouse, touch and keys.
"""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from html import escape
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from upright.report.interactive.script import in_script
from upright.report.page import Picture

Array = NDArray[np.float64]

COLOURS = {
    "ink": "#14201f", "ink-2": "#485654", "line": "#d9dedd", "line-strong": "#8b9795", "q0": "#0067a8", "q1": "#b84a00",
    "q2": "#8a3a86", "q3": "#6b6a00", "effort": "#00735a", "sim": "#5a3f9e", "care": "#7d4f00", "no": "#ab1f2d",
    "raised": "#ffffff", "paper": "#fcfcfa",
}  # fmt: skip
"""Custom properties of a page, and what stands for them elsewhere."""
WIDTHS = {"wide": 640.0, "narrow": 330.0}
"""Units of a drawing: about the CSS pixels of the column that it stands in."""
TEXT, LETTER = 13.0, 7.4  # units of text and of one of its letters, on average and with room to spare
_LEFT, _RIGHT, _HEAD, _FOOT, _BETWEEN, _ROW = 50.0, 14.0, 20.0, 40.0, 8.0, 19.0
_RAISED = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")
_OFF = 0.1  # units by which a drawn curve may miss its samples: a tenth of a pixel
_MANY = 12  # points of a line from which on their marks are small
_MARKS = {
    "x": "M{l} {t}L{r} {b}M{l} {b}L{r} {t}", "+": "M{x} {t}V{b}M{l} {y}H{r}", "s": "M{l} {t}H{r}V{b}H{l}Z",
    "D": "M{x} {t}L{r} {y}L{x} {b}L{l} {y}Z", "^": "M{x} {t}L{r} {b}H{l}Z",
}  # fmt: skip


@dataclass(frozen=True, kw_only=True, eq=False)
class ChartLine:
    """One curve, or points.

    Attributes
    ----------
    name : str
        In the legend; a line without one is not in it.
    x, y : array, shape (N,)
    colour : str
        One of `COLOURS`.
    mark : str
        Of points: ``x``, ``+``, ``o``, ``s``, ``D``, ``^``; ``p`` for what was measured, ``.`` for a cloud. A line
        joins them when empty.
    dash : str
        As SVG has it.
    bars, across : (array, array), optional
        Ends, shape (N,) each, of a bar through every point, upright and level.
    notes : tuple of str
        What else is said of every point.
    read : bool
        Whether the cursor reads it.
    """

    name: str
    x: Array
    y: Array
    colour: str = "ink"
    mark: str = ""
    dash: str = ""
    bars: tuple[Array, Array] | None = None
    across: tuple[Array, Array] | None = None
    notes: tuple[str, ...] = ()
    read: bool = True


@dataclass(frozen=True, kw_only=True, eq=False)
class ChartPanel:
    """Lines over the abscissa that all panels of a chart share.

    Attributes
    ----------
    title, unit : str
        Of the ordinate.
    lines : tuple of ChartLine
    limits : (float, float), optional
        Of the ordinate; what the lines need when None.
    logarithmic : bool
    step : float
        Distance of ticks; chosen when 0.
    height : float
        Of the axes, in pixels of a wide screen.
    levels, places : tuple of (float, str)
        Dashed lines across, and upright, with what is written there.
    """

    title: str
    unit: str = ""
    lines: tuple[ChartLine, ...]
    limits: tuple[float, float] | None = None
    logarithmic: bool = False
    step: float = 0.0
    height: float = 150.0
    levels: tuple[tuple[float, str], ...] = ()
    places: tuple[tuple[float, str], ...] = ()


class Readable(ABC):
    """A drawing of our own that a cursor reads."""

    @property
    @abstractmethod
    def label(self) -> str:
        """What it shows, in a word or two."""

    @abstractmethod
    def svg(self, name: str) -> str:
        """Markup for the widest column and for a phone, of which a page shows one; ids begin with `name`."""

    @abstractmethod
    def values(self) -> str:
        """What ``charts.js`` reads, as JSON that may stand inside a script."""

    def picture(self, name: str, *, caption: str, description: str) -> Picture:
        """It, with its caption, for a chapter."""
        return Picture(name=name, draw=lambda: self, interactive=self.values, caption=caption, description=description)

    def save(self, path: Path) -> Path:
        """Write the drawing for a desk by itself, as SVG."""
        from upright.files import replace_file
        from upright.report.pdf import standalone

        return replace_file(path, standalone(self.svg("chart"))[0].encode())

    def _repr_html_(self) -> str:
        """It in a notebook, where a cursor reads it as in a page."""
        from upright.report.html import picture_in_notebook

        return picture_in_notebook(self.picture("chart", caption="", description=self.label))


@dataclass(frozen=True, kw_only=True, eq=False)
class Chart(Readable):
    """Panels one below the other over one abscissa.

    Attributes
    ----------
    x, unit : str
        Of the abscissa.
    panels : tuple of ChartPanel
    limits : (float, float), optional
        Of the abscissa; what the lines need when None.
    logarithmic : bool
    plane : str
        Empty where the cursor reads every line at one abscissa; ``s`` where it goes from point to point of the plane of
        poles, whose unstable half is tinted.
    note : str
        What else is written below the abscissa.
    """

    x: str
    unit: str = ""
    panels: tuple[ChartPanel, ...]
    limits: tuple[float, float] | None = None
    logarithmic: bool = False
    plane: str = ""
    note: str = ""
    span: tuple[float, float] = field(init=False)
    spans: tuple[tuple[float, float], ...] = field(init=False)

    def __post_init__(self) -> None:
        lines = [line for p in self.panels for line in p.lines]
        room = 0.03 if any(line.mark for line in lines) else 0.0
        object.__setattr__(self, "span", self.limits or _range([line.x for line in lines], self.logarithmic, room))
        spans = tuple(p.limits or _range([y for line in p.lines for y in (line.y, *(line.bars or ()))], p.logarithmic)
                      for p in self.panels)  # fmt: skip
        object.__setattr__(self, "spans", spans)

    def svg(self, name: str) -> str:
        """Markup for the widest column and for a phone."""
        return f'<div class="chart">{"".join(_Drawing(self, kind, name).markup() for kind in WIDTHS)}</div>'

    @property
    def label(self) -> str:
        """Title of the abscissa."""
        return (f"{self.x} [{self.unit}]" if self.unit else self.x) + self.note

    def values(self) -> str:
        """Values by panel and line."""
        content: dict[str, Any] = {
            "chart": self.x, "unit": self.unit, "span": self.span, "logarithmic": self.logarithmic, "plane": self.plane,
            "panels": [
                {"title": p.title, "unit": p.unit, "span": span, "logarithmic": p.logarithmic, "lines": [
                    {"name": line.name, "marks": bool(line.mark), "x": _digits(line.x), "y": _digits(line.y),
                     **({"notes": line.notes} if line.notes else {})}
                    for line in p.lines if line.read
                ]}
                for p, span in zip(self.panels, self.spans, strict=True)
            ],
        }  # fmt: skip
        return in_script(content)


def round_ticks(low: float, high: float, most: int) -> list[float]:
    """Multiples of 1, 2 or 5 times a power of ten from `low` to `high`, at most so many."""
    step = _step((high - low) / max(most, 1))
    return [round(k * step, 12) for k in range(math.ceil(low / step - 1e-9), math.floor(high / step + 1e-9) + 1)]


def _step(least: float) -> float:
    power = 10.0 ** math.floor(math.log10(least))
    return next((m * power for m in (1, 2, 5) if m * power >= least * (1 - 1e-9)), 10 * power)


def decade_ticks(low: float, high: float, most: int) -> list[float]:
    """1, 2 and 5 times powers of ten from `low` to `high`; powers alone, and fewer of them, where there is no room."""
    first, last = math.floor(math.log10(low)), math.ceil(math.log10(high))
    for within in ((1, 2, 5), (1, 3), (1,)):
        chosen = [m * 10.0**d for d in range(first, last + 1) for m in within]
        chosen = [v for v in chosen if low * (1 - 1e-9) <= v <= high * (1 + 1e-9)]
        if len(chosen) <= most:
            return chosen
    return chosen[:: -(-len(chosen) // most)]


def _range(every: Sequence[ArrayLike], logarithmic: bool, room: float = 0.07) -> tuple[float, float]:
    """What the finite values take, with some room."""
    values = np.concatenate([np.zeros(0), *(np.asarray(v, dtype=np.float64).ravel() for v in every)])
    values = values[np.isfinite(values) & ((values > 0) | (not logarithmic))]
    if values.size == 0:
        return (1.0, 10.0) if logarithmic else (-1.0, 1.0)
    low, high = float(values.min()), float(values.max())
    if logarithmic:
        wide = max(math.log10(high / low), 0.3)
        return low / 10 ** (room * wide), high * 10 ** (room * wide)
    wide = (high - low) or abs(high) or 1.0
    return (low - room * wide, high + room * wide) if high > low else (low - wide / 2, high + wide / 2)


def _digits(values: Array) -> list[float | None]:
    return [float(f"{v:.5g}") if math.isfinite(v) else None for v in values.tolist()]


def page_colour(name: str) -> str:
    """One of `COLOURS` as an attribute of SVG takes it."""
    return f"var(--{name}, {COLOURS[name]})"


def _label(value: float) -> str:
    if value == 0 or 1e-3 <= abs(value) < 1e5:
        return f"{value:.6g}".replace("-", "−")
    digit, _, power = f"{value:.0e}".partition("e")
    return ("" if digit == "1" else f"{digit}·") + "10" + str(int(power)).translate(_RAISED)


class _Drawing:
    """A chart for one width."""

    def __init__(self, chart: Chart, kind: str, name: str) -> None:
        self.chart, self.kind, self.name, self.wide = chart, kind, name, WIDTHS[kind]
        self.across = self.wide - _LEFT - _RIGHT
        self.out: list[str] = []

    def markup(self) -> str:
        """All of it."""
        chart, y = self.chart, self._legend()
        for i, panel in enumerate(chart.panels):
            high = panel.height * (1.0 if self.kind == "wide" else 0.86)
            self._text(0.0, y + 14, f"{panel.title} [{panel.unit}]" if panel.unit else panel.title, bold=True)
            self._panel(
                panel, chart.spans[i], y + _HEAD, high, f"{self.name}-{self.kind}{i}", last=panel is chart.panels[-1]
            )
            y += _HEAD + high + (_BETWEEN if panel is not chart.panels[-1] else _FOOT)
        hidden = ' style="display:none"' if self.kind != "wide" else ' style="max-width:88%"'
        return (
            f'<svg class="{self.kind}" viewBox="0 0 {self.wide:g} {y:g}"{hidden} font-size="{TEXT:g}" '
            f'aria-hidden="true" focusable="false">{"".join(self.out)}</svg>'
        )

    def _legend(self) -> float:
        """Names of lines with a sample of each; gives the height that they take."""
        named = {line.name: line for p in self.chart.panels for line in p.lines if line.name}
        if len(named) < 2:
            return 0.0
        x, y = 0.0, 14.0
        for name, line in named.items():
            wide = 34 + LETTER * len(name)
            if x > 0 and x + wide > self.wide:
                x, y = 0.0, y + _ROW
            at = np.array([x + 3, x + 21]) if not line.mark else np.array([x + 12])
            self._line(line, at, np.full(at.size, y - 4.5))
            self._text(x + 27, y, name)
            x += wide
        return y + 8

    def _place(self, values: Array, span: tuple[float, float], logarithmic: bool, first: float, size: float) -> Array:
        low, high = span
        with np.errstate(divide="ignore", invalid="ignore"):
            share = np.log(values / low) / math.log(high / low) if logarithmic else (values - low) / (high - low)
        return first + size * share

    def _x(self, values: ArrayLike) -> Array:
        return self._place(
            np.asarray(values, dtype=np.float64), self.chart.span, self.chart.logarithmic, _LEFT, self.across
        )

    def _panel(
        self, panel: ChartPanel, span: tuple[float, float], top: float, high: float, key: str, *, last: bool
    ) -> None:
        chart, right, bottom = self.chart, _LEFT + self.across, top + high

        def down(values: ArrayLike) -> Array:
            return self._place(np.asarray(values, dtype=np.float64), span, panel.logarithmic, bottom, -high)

        self.out.append(f'<g class="panel" data-area="{_LEFT:g} {top:g} {self.across:g} {high:g}">')
        if chart.plane and chart.span[1] > 0:
            zero = max(float(self._x(0.0)), _LEFT)
            self._shape(f"M{zero:.1f} {top:g}H{right:g}V{bottom:g}H{zero:.1f}Z", "care", fill=True)
        most = max(3, int(high / 27))
        if panel.step:
            ordinates = [
                panel.step * k for k in range(math.ceil(span[0] / panel.step), math.floor(span[1] / panel.step) + 1)
            ]
            ordinates = ordinates[:: max(1, -(-len(ordinates) // most))]
        else:
            ordinates = (decade_ticks if panel.logarithmic else round_ticks)(*span, most)
        for value, y in zip(ordinates, down(ordinates).tolist(), strict=True):
            self._shape(f"M{_LEFT:g} {y:.1f}H{right:g}", "line")
            self._text(_LEFT - 6, y + 4.5, _label(value), anchor="end")
        most = int(self.across / 44)
        abscissae = (decade_ticks if chart.logarithmic else round_ticks)(*chart.span, most)
        for value, x in zip(abscissae, self._x(abscissae).tolist(), strict=True):
            self._shape(f"M{x:.1f} {top:g}V{bottom:g}", "line")
            if last:
                self._text(x, bottom + 16, _label(value), anchor="middle")
        if chart.plane:
            self._shape(
                f"M{_LEFT:g} {float(down(0.0)):.1f}H{right:g}M{float(self._x(0.0)):.1f} {top:g}V{bottom:g}",
                "line-strong",
            )
        else:
            self._shape(f"M{_LEFT:g} {bottom:g}H{right:g}", "line-strong")
        if last:
            self._text(_LEFT + self.across / 2, bottom + 34, chart.label, anchor="middle")
        self.out.append(
            f'<clipPath id="{key}"><rect x="{_LEFT - 1:g}" y="{top - 1:g}" width="{self.across + 2:g}" '
            f'height="{high + 2:g}"/></clipPath><g clip-path="url(#{key})">'
        )
        for value, _ in panel.levels:
            self._shape(f"M{_LEFT:g} {float(down(value)):.1f}H{right:g}", "care", dash="6 4")
        for value, _ in panel.places:
            self._shape(f"M{float(self._x(value)):.1f} {top:g}V{bottom:g}", "care", dash="6 4")
        for line in panel.lines:
            x, y = self._x(line.x), down(line.y)
            if line.bars is not None:
                self._bars(line.colour, x, x, down(line.bars[0]), down(line.bars[1]))
            if line.across is not None:
                self._bars(line.colour, self._x(line.across[0]), self._x(line.across[1]), y, y)
            self._line(line, x, y)
        self.out.append("</g>")
        for value, text in panel.levels:
            y = float(down(value))
            if text and span[0] <= value <= span[1]:
                self._text(right - 3, y - 4 if y > top + 18 else y + 14, text, anchor="end", colour="care")
        for k, (value, text) in enumerate(panel.places):
            x, room = float(self._x(value)), LETTER * len(text) + 6
            if text and _LEFT <= x <= right:
                left = x + room > right
                self._text(
                    x - 4 if left else x + 4, top + 13 + 16 * k, text, anchor="end" if left else "start", colour="care"
                )
        self.out.append("</g>")

    def _bars(self, colour: str, left: Array, right: Array, low: Array, high: Array) -> None:
        ends = (np.nan_to_num(v, nan=np.nan, posinf=4000.0, neginf=-4000.0).tolist() for v in (left, right, low, high))
        bars = (f"M{a:.1f} {c:.1f}L{b:.1f} {d:.1f}" for a, b, c, d in zip(*ends, strict=True)
                if math.isfinite(a + b + c + d))  # fmt: skip
        self._shape("".join(bars), colour, width=1.1)

    def _line(self, line: ChartLine, x: Array, y: Array) -> None:
        if not line.mark:
            for path in _pieces(x, y):
                self._shape(path, line.colour, width=1.6, dash=line.dash)
            return
        points = [(a, b) for a, b in zip(x.tolist(), y.tolist(), strict=True) if math.isfinite(a + b)]
        if line.mark == ".":
            self._shape(
                "".join(sorted({f"M{a:.1f} {b:.1f}h0" for a, b in points})), line.colour, width=3.0, opacity=0.55
            )
            return
        w = 5.0 if len(points) <= _MANY else 3.4
        for a, b in points:
            if line.mark in "op":
                r, inside = (1.1 * w, "none") if line.mark == "o" else (3.2, page_colour("raised"))
                ring = f'stroke="{page_colour(line.colour)}" stroke-width="1.6" fill="{inside}"'
                self.out.append(f'<circle cx="{a:.1f}" cy="{b:.1f}" r="{r:.2g}" {ring}/>')
                continue
            path = _MARKS[line.mark].format(
                x=f"{a:.1f}", y=f"{b:.1f}", l=f"{a - w:.1f}", r=f"{a + w:.1f}", t=f"{b - w:.1f}", b=f"{b + w:.1f}"
            )
            self._shape(path, line.colour, width=2.0)

    def _shape(
        self, path: str, colour: str, *, width: float = 1.0, dash: str = "", opacity: float = 1.0, fill: bool = False
    ) -> None:
        paint = (
            f'fill="{page_colour(colour)}" fill-opacity="0.09"'
            if fill
            else f'fill="none" stroke="{page_colour(colour)}"'
        )
        more = f' stroke-dasharray="{dash}"' * bool(dash) + f' stroke-opacity="{opacity:g}"' * (opacity < 1)
        more += f' stroke-width="{width:g}"' * (width != 1.0) + ' stroke-linecap="round"' * (width >= 2)
        if path:
            self.out.append(f'<path d="{path}" {paint}{more}/>')

    def _text(
        self, x: float, y: float, text: str, *, anchor: str = "start", colour: str = "ink-2", bold: bool = False
    ) -> None:
        more = f' text-anchor="{anchor}"' * (anchor != "start") + ' font-weight="600"' * bold
        more += f' paint-order="stroke" stroke="{page_colour("paper")}" stroke-width="4"' * (colour != "ink-2")
        self.out.append(
            f'<text x="{x:.1f}" y="{y:.1f}" fill="{page_colour("ink" if bold else colour)}"{more}>{escape(text)}</text>'
        )


def _pieces(x: Array, y: Array) -> Iterator[str]:
    """Paths of a curve between its gaps, through those of its points that an eye would miss."""
    y = np.clip(y, -2000.0, 4000.0)  # what leaves the picture by far
    whole = np.isfinite(x) & np.isfinite(y)
    for piece in np.split(np.arange(x.size), np.flatnonzero(np.diff(whole.astype(np.int8))) + 1):
        if piece.size > 1 and whole[piece[0]]:
            kept = piece[_needed(x[piece], y[piece])]
            yield "M" + "L".join(f"{x[i]:.1f} {y[i]:.1f}" for i in kept)


def _needed(x: Array, y: Array) -> list[int]:
    """Points without which a polygon would move by more than `_OFF` (Ramer, 1972; Douglas and Peucker, 1973)."""
    needed, open_ends = {0, x.size - 1}, [(0, x.size - 1)]
    while open_ends:
        a, b = open_ends.pop()
        if b - a < 2:
            continue
        along = np.array([x[b] - x[a], y[b] - y[a]])
        long = float(np.hypot(*along))
        dx, dy = x[a + 1 : b] - x[a], y[a + 1 : b] - y[a]
        off = np.abs(along[0] * dy - along[1] * dx) / long if long > 0 else np.hypot(dx, dy)
        if float(off.max()) > _OFF:
            far = a + 1 + int(off.argmax())
            needed.add(far)
            open_ends += [(a, far), (far, b)]
    return sorted(needed)
