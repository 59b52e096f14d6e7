"""A matrix with a name for each row and column, coloured by size: numbers where there is room, all under the cursor."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from html import escape

from upright.report.interactive.charts import LETTER, TEXT, WIDTHS, Array, Readable, page_colour
from upright.report.interactive.script import in_script
from upright.report.symbols import parts

_TALLEST = 34.0
_ROOM = {2: 5.5 * LETTER, 1: 4.5 * LETTER}
"""Width that a cell needs for so many figures after the point."""
_FULL = 0.5
"""Opacity of 1, through which figures can be read."""
_STRONG = 0.9
_SMALL = 10.0
_WIDEST = 8.4
"""Units of a letter of a name, in the widest of the fonts that it may be shown with."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Cells(Readable):
    """Correlations of pairs, from -1 to 1; one that is not known is not finite.

    Attributes
    ----------
    names : tuple of str
        Symbols of rows and columns alike.
    matrix : array, shape (n, n)
    """

    names: Sequence[str]
    matrix: Array

    @property
    def label(self) -> str:
        """What a cell is."""
        return "correlation"

    def svg(self, name: str) -> str:
        """Markup for the widest column and for a phone."""
        return f'<div class="chart">{"".join(self._drawn(kind, wide) for kind, wide in WIDTHS.items())}</div>'

    def values(self) -> str:
        """Every cell as a point, its correlation a note."""
        n, names = len(self.names), self.names
        lines = [
            {
                "name": names[i], "marks": True, "x": [j + 0.5 for j in range(n)], "y": [i + 0.5] * n,
                "notes": [f"{names[j]}: {_figures(r, 3) or 'not known'}" for j, r in enumerate(row)],
            }
            for i, row in enumerate(self.matrix.tolist())
        ]  # fmt: skip
        panel = {"title": self.label, "unit": "", "span": (n, 0), "logarithmic": False, "lines": lines}
        return in_script({
            "chart": self.label, "unit": "", "span": (0, n), "logarithmic": False, "plane": "cells", "panels": [panel]
        })  # fmt: skip

    def _drawn(self, kind: str, wide: float) -> str:
        n, symbols = len(self.names), [parts(name) for name in self.names]
        longest = _WIDEST * max(len(stem) + _SMALL * len(below) / TEXT for stem, below, _ in symbols)
        left = longest + 8
        across = (wide - left) / n
        high = min(across, _TALLEST)
        digits = next((k for k, room in _ROOM.items() if across >= room), 0)
        turned = 0 if longest <= across else 45 if across > 20.0 else 90  # degrees
        cells, figures = list[str](), list[str]()
        for i, row in enumerate(self.matrix.tolist()):
            for j, r in enumerate(row):
                x, y = left + j * across, i * high
                if i != j and math.isfinite(r):
                    paint = (
                        f'fill="{page_colour("q0" if r > 0 else "q1")}" fill-opacity="{_FULL * min(abs(r), 1.0):.2f}"'
                    )
                    cells.append(f'<path d="M{x:.1f} {y:.1f}h{across:.1f}v{high:.1f}h-{across:.1f}z" {paint}/>')
                text = ("1" if i == j else _figures(r, digits) or "–") if digits else ""
                bold = ' font-weight="700"' if i != j and abs(r) > _STRONG else ""
                if text:
                    figures.append(f'<text x="{x + across / 2:.1f}" y="{y + high / 2 + 4.5:.1f}"{bold}>{text}</text>')
        named = [_symbol(*symbol) for symbol in symbols]
        rows = [f'<text x="{longest:.1f}" y="{(i + 0.5) * high + 4.5:.1f}">{s}</text>' for i, s in enumerate(named)]
        columns = list[str]()
        for j, s in enumerate(named):
            x, y = left + (j + 0.5) * across, n * high + 16
            columns.append(
                f'<text transform="translate({x + 5:.1f} {y - 6:.1f}) rotate(-{turned})">{s}</text>' if turned
                else f'<text x="{x:.1f}" y="{y:.1f}">{s}</text>'
            )  # fmt: skip
        foot = math.sin(math.radians(turned)) * longest + 16 if turned else 22
        hidden = ' style="display:none"' if kind != "wide" else ' style="max-width:88%"'
        ink, (end, middle) = page_colour("ink"), (columns, []) if turned else ([], columns)
        return (
            f'<svg class="{kind}" viewBox="0 0 {wide:g} {n * high + foot:.0f}"{hidden} font-size="{TEXT:g}" '
            f'aria-hidden="true" focusable="false">'
            f'<g class="panel" data-area="{left:g} 0 {n * across:.4g} {n * high:.4g}">{"".join(cells)}</g>'
            f'<g text-anchor="middle" fill="{ink}">{"".join(figures + middle)}</g>'
            f'<g text-anchor="end" fill="{ink}">{"".join(rows + end)}</g></svg>'
        )


def _symbol(stem: str, below: str, dot: str) -> str:
    """Stem, slanted where it is one letter, and a subscript below the line."""
    slanted = ' font-style="italic"' if len(stem) == 1 else ""
    small = f'<tspan dy="3" font-size="{_SMALL:g}">{escape(below)}</tspan>' if below else ""
    return f"<tspan{slanted}>{escape(stem)}{chr(0x307) if dot else ''}</tspan>{small}"


def _figures(r: float, digits: int) -> str:
    return f"{r:.{digits}f}".replace("-", "−") if math.isfinite(r) else ""
