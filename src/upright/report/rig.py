"""A rig on a page: its drawing with coordinates and signs, and the table of drive, encoders and servo."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from upright.physics import Plant
from upright.quantities import with_unit
from upright.report.page import Chapter, Picture, Table, resting_on
from upright.report.symbols import parts
from upright.rig import Rig
from upright.rig.hardware import meaning_of

Array = NDArray[np.float64]

_COLOURS = ("#0067a8", "#b84a00", "#8a3a86", "#6b6a00")
_TURN, _SWING, _STEP = 1.2, 0.7, 0.2  # pose of the drawing: about a vertical axis, in a plane, share of the rig's size
_SIZE, _WIDTH = 250.0, 330.0  # px of the rig's larger side and of the drawing: 16 px of text are 14 in a column of 300
_UP, _ASIDE = math.radians(24.0), math.radians(125.0)  # seen from where an arm's angle opens to the front


def rig_table(rig: Rig) -> Table:
    """Drive, encoders and servo with what each number rests on."""
    shown = {n: e for n, e in rig.hardware.entries.items() if not n.startswith(("sign.", "offset."))}
    return Table(
        caption="The rig as it is described", headings=("", "value", "from"),
        rows=tuple((meaning_of(n), with_unit(e.value, e.unit, 6), e.source)
                   for n, e in shown.items()), numbers=(1,),
    )  # fmt: skip


def of_rig(chapter: Chapter, rig: Rig, performed: str = "") -> Chapter:
    """The chapter with its rig's drawing, and with the verdict of the rig's model first; see `resting_on`."""
    return replace(resting_on(chapter, rig.basis, performed), drawing=rig_drawing(rig.plant))


def rig_drawing(plant: Plant) -> Picture | None:
    """The plant from its own outline, each coordinate with its zero and its positive sense; None where it has none."""
    if not plant.outline(plant, [0.0] * len(plant.coordinates)):
        return None
    drawing = _Drawing(plant)
    meanings = "; ".join(f"{c.name}: {c.meaning}" for c in plant.coordinates)
    return Picture(
        name="rig", draw=drawing.markup(), caption=f"{type(plant).__name__}: arrows point in the positive sense.",
        description=f"{type(plant).__name__} with its coordinates. {meanings}.",
    )  # fmt: skip


class _Drawing:
    """Lines of a plant, projected, with room for what is written beside them."""

    def __init__(self, plant: Plant) -> None:
        self.plant = plant
        self.names = [c.name for c in plant.coordinates]
        moving = [p for name, p in self._space([0.0] * len(self.names)) if name]
        size = float(np.ptp(np.vstack(moving), axis=0).max()) or 1.0
        self.q = [_SWING if c.unit == "rad" else _STEP * size for c in plant.coordinates]
        self.deep = bool(np.abs(np.vstack([p for _, p in self._space(self.q)])[:, 1]).max() > 0)
        self.q = [_TURN if self.deep and self._level(i) else value for i, value in enumerate(self.q)]
        upright = plant.equilibria.get("inverted", {})
        ends = [self.q, [0.0] * len(self.q), [upright.get(n, v) for n, v in zip(self.names, self.q, strict=True)]]
        self.scale = 1.0
        around = np.vstack([self._flat(p) for q in ends for name, p in self._space(q) if name or self.deep])
        self.scale = _SIZE / (float(np.ptp(around, axis=0).max()) or 1.0)
        self.left, self.right = self.scale * around[:, 0].min() - 46, self.scale * around[:, 0].max() + 46
        self.ground = math.inf
        self.boxes: list[Array] = []
        self.out: list[str] = []

    def _space(self, q: Sequence[float]) -> list[tuple[str, Array]]:
        lines = self.plant.outline(self.plant, list(q))
        return [(name, np.array(points, dtype=np.float64)) for name, points in lines]

    def _level(self, i: int) -> bool:
        """Whether a coordinate turns about the vertical."""
        here, there = self._at(i, 0.0), self._at(i, 0.5)
        return here is not None and there is not None and bool(np.allclose(here[:, 2], there[:, 2]))

    def _flat(self, points: Array) -> Array:
        """Points of the page [px], y down."""
        x, y, z = np.atleast_2d(points).T
        up, aside = (_UP, _ASIDE) if self.deep else (0.0, 0.0)
        across = x * math.cos(aside) + y * math.sin(aside)
        rise = z * math.cos(up) + (y * math.cos(aside) - x * math.sin(aside)) * math.sin(up)
        return np.column_stack([across, -rise]) * self.scale

    def markup(self) -> str:
        for name, points in self._space(self.q):
            self._body(name, points)
        for i, coordinate in enumerate(self.plant.coordinates):
            self._arrow(i, coordinate.unit == "rad")
        self._ghost()
        every = np.vstack(self.boxes)
        (left, top), (right, bottom) = every.min(axis=0) - 26, every.max(axis=0) + 26
        if hasattr(self.plant, "g"):
            right += 30
            x, y = right - 16, top + 14
            self.out.append(
                f'<path d="M{x:.1f} {y:.1f}v38" fill="none" stroke="var(--ink-2, #485654)" stroke-width="1.2"/>'
                f'<path d="M{x:.1f} {y + 46:.1f}l-5-11h10z" fill="var(--ink-2, #485654)"/>'
            )
            self._write(x - 12, y + 26, "g", "var(--ink-2, #485654)", anchor="end", sized=False)
        spare = max(0.0, _WIDTH - (right - left)) / 2
        left, right = left - spare, right + spare
        view = f"{left:.1f} {top:.1f} {right - left:.1f} {bottom - top:.1f}"
        return (
            f'<svg viewBox="{view}" class="rig-drawing" aria-hidden="true" focusable="false"'
            f' style="max-height:380px">{"".join(self.out)}</svg>'
        )

    def _line(self, points: Array, colour: str, width: float, more: str = "") -> None:
        self.boxes.append(points)
        places = " ".join(f"{x:.1f},{y:.1f}" for x, y in points)
        self.out.append(
            f'<polyline points="{places}" fill="none" stroke="{colour}" stroke-width="{width:g}"'
            f' stroke-linecap="round" stroke-linejoin="round"{more}/>'
        )

    def _colour(self, name: str) -> str:
        i = self.names.index(name) % len(_COLOURS)
        return f"var(--q{i}, {_COLOURS[i]})"

    def _body(self, name: str, points: Array) -> None:
        flat = self._flat(points)
        if name:
            closed = np.allclose(points[0], points[-1])
            self._line(flat, self._colour(name), 3 if closed else 7)
            if not closed:
                self._joint(flat[0])
            return
        grey = "var(--line-strong, #8b9795)"
        closed = np.allclose(points[0], points[-1])
        flat[:, 0] = flat[:, 0].clip(self.left, self.right)  # a rail goes on
        self._line(flat, grey, 1.2 if closed else 3, ' stroke-dasharray="4 4"' if closed else "")
        if closed:
            return
        ends = flat[np.argsort(flat[:, 1])]
        upright = abs(np.ptp(flat[:, 1])) > abs(np.ptp(flat[:, 0]))
        x0, x1 = (ends[-1, 0] - 60, ends[-1, 0] + 60) if upright else (flat[:, 0].min(), flat[:, 0].max())
        y = float(ends[-1, 1])
        if upright:
            self._line(np.array([[x0, y], [x1, y]]), grey, 1.5)
            self.ground = y
        strokes = "".join(f"M{x:.1f} {y:.1f}l-8 9" for x in np.arange(x0 + 8, x1 + 1, 12))
        self.out.append(f'<path d="{strokes}" fill="none" stroke="{grey}" stroke-width="1.2"/>')
        self.boxes.append(np.array([[x0, y + 9], [x1, y + 9]]))

    def _joint(self, at: Array) -> None:
        self.out.append(
            f'<circle cx="{at[0]:.1f}" cy="{at[1]:.1f}" r="5" fill="var(--raised, #fff)"'
            ' stroke="var(--ink, #14201f)" stroke-width="2"/>'
        )

    def _at(self, i: int, value: float) -> Array | None:
        """The line that a coordinate moves, with the coordinate at a value and the others as drawn."""
        q = [value if j == i else v for j, v in enumerate(self.q)]
        return next((points for name, points in self._space(q) if name == self.names[i]), None)

    def _arrow(self, i: int, turns: bool) -> None:
        first, colour = self._at(i, 0.0), self._colour(self.names[i])
        if first is None:
            return
        values = np.linspace(0.0, self.q[i], 24)
        lines = [line for v in values if (line := self._at(i, float(v))) is not None]
        dashes = ' stroke-dasharray="4 4"'
        grey = "var(--line-strong, #8b9795)"
        if turns:
            self._line(self._flat(first), grey, 1.2, dashes)
            path = np.vstack([self._flat(p[0] + 0.66 * (p[-1] - p[0])) for p in lines])
            outward = path[len(path) // 2] - self._flat(first[0])[0]
        else:
            low = float(self._flat(first)[:, 1].max()) + 24
            path = np.vstack([[self._flat(_middle(p))[0, 0], low] for p in lines])
            self._line(
                np.array([[path[0, 0], low + 6], [path[0, 0], self._flat(first)[:, 1].min()]]), grey, 1.2, dashes
            )
            outward = np.array([0.0, 1.0])
        self._line(path[:-2], colour, 2)
        self._tip(path, colour)
        outward = outward / (np.linalg.norm(outward) or 1.0)
        at = path[len(path) // 2] + outward * 17
        self._write(at[0], at[1] + 6, self.names[i], colour)
        if turns:
            zero = self._flat(first[-1])[0]
            away = zero - self._flat(first[0])[0]
            zero = zero + away / (np.linalg.norm(away) or 1.0) * 16
            rest = ", hanging" if self.plant.equilibria.get("hanging", {}).get(self.names[i]) == 0 else ""
            low = zero[1] + 5
            if abs(low - 5 - self.ground) < 24:  # below the strokes of the ground
                low = self.ground + 30
            self._write(zero[0], low, f"{self.names[i]} = 0{rest}", "var(--ink-2, #485654)", small=True)

    def _tip(self, path: Array, colour: str) -> None:
        along = path[-1] - path[-4]
        along = along / (np.linalg.norm(along) or 1.0)
        side = np.array([-along[1], along[0]])
        corners = (path[-1], path[-1] - 11 * along + 5 * side, path[-1] - 11 * along - 5 * side)
        self.out.append(f'<path d="M{" L".join(f"{x:.1f} {y:.1f}" for x, y in corners)}z" fill="{colour}"/>')

    def _ghost(self) -> None:
        """The rig upright, pale."""
        upright = self.plant.equilibria.get("inverted", {})
        if not upright:
            return
        q = [upright.get(n, v) for n, v in zip(self.names, self.q, strict=True)]
        moved = [(n, p) for n, p in self._space(q) if n in upright]
        for name, points in moved:
            self._line(self._flat(points), self._colour(name), 7, ' opacity="0.25"')
        if moved:
            end = self._flat(moved[-1][1][-1])[0]
            name = moved[-1][0]
            self._write(
                end[0] + 12, end[1] + 8, f"{name} = π, upright", "var(--ink-2, #485654)", small=True, anchor="start"
            )

    def _write(
        self, x: float, y: float, text: str, colour: str, *, anchor: str = "middle", small: bool = False,
        sized: bool = True,
    ) -> None:  # fmt: skip
        name, blank, rest = text.partition(" ")
        stem, below, _ = parts(name)
        sub = f'<tspan font-size="11" dy="4">{below}</tspan><tspan dy="-4">\u200b</tspan>' if below else ""
        size = 16 if small else 21
        wide = (len(stem) + 0.7 * len(below) + len(rest) + bool(rest)) * size * 0.56
        if sized:
            start = x - {"middle": wide / 2, "end": wide, "start": 0.0}[anchor]
            self.boxes.append(np.array([[start + 20, y - size + 20], [start + wide - 20, y - 18]]))
        italic = f'<tspan font-style="italic" font-family="serif">{stem}</tspan>{sub}'
        self.out.append(
            f'<text x="{x:.1f}" y="{y:.1f}" text-anchor="{anchor}" font-size="{size}" font-family="sans-serif"'
            f' fill="{colour}" style="paint-order:stroke;stroke:var(--paper, #fff);stroke-width:4px">'
            f"{italic}{blank}{rest}</text>"
        )


def _middle(points: Array) -> Array:
    """Middle of a body; the corners of one that is closed have its first twice."""
    return (points.min(axis=0) + points.max(axis=0)) / 2
