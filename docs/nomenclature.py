"""What does each symbol mean? One table per family of plants, from the one line where a plant says it."""

from __future__ import annotations

import math
from collections.abc import Iterator

from upright.physics import BUILT_IN, Plant
from upright.quantities import Quantity
from upright.report.symbols import mathtext, unit

FAMILIES = {
    "Pendulums": ("pendulum", "cart-pendulum", "furuta"),
    "Carts on a rail": ("rectilinear-2",),
    "Disks on a shaft": ("torsional-2",),
    "Two links": ("double-pendulum", "double-pendulum-absolute", "flexible-link"),
}
_HEAD = """# Nomenclature

Written by `python -m docs` from the plants' own statements (`quantity()`, `Coordinate`, `Input`); a test keeps it current.
SI units and radians throughout; angle 0 hangs, pi stands.
The velocity of a coordinate carries `_dot`, and states come in the order position, velocity, position, velocity.

Index 1 is the driven body (cart, disk, arm), 2 the next one; a third cart or disk has the same symbols with 3.
At the end of an index, `c` means Coulomb, `q` quadratic, `s` break-away.
`J_A = J_p + m_p l_cg^2` is the pendulum's inertia about its hinge, `D_2` the determinant of the mass matrix at rest.
"""


def page() -> str:
    """The page as Markdown."""
    lines = [_HEAD]
    for title, names in FAMILIES.items():
        rows: dict[tuple[str, ...], list[str]] = {}
        for name in names:
            for row in _rows(BUILT_IN[name]):
                rows.setdefault(row, []).append(name)
        several = len(names) > 1
        lines += [
            f"## {title}\n",
            "| name | symbol | unit | meaning | bounds |" + (" plants |" if several else ""),
        ]
        lines.append("|---|---|---|---|---|" + ("---|" if several else ""))
        for row, plants in rows.items():
            lines.append(
                "| " + " | ".join([*row, *([", ".join(plants)] if several else [])]) + " |"
            )
        lines.append("")
    return "\n".join(lines)


def _rows(plant: type[Plant]) -> Iterator[tuple[str, ...]]:
    """Name, symbol, unit, meaning and bounds of coordinates, inputs and parameters."""
    for one in (*plant.coordinates, *plant.inputs):
        yield f"`{one.name}`", mathtext(one.name), unit(one.unit), one.meaning, ""
    for name in plant.names():
        what = plant.quantity(name)
        yield f"`{name}`", mathtext(name), unit(what.unit) or "1", what.meaning, _bounds(what)


def _bounds(what: Quantity) -> str:
    low = f"{'>' if what.open_lower else '≥'} {what.lower:g}" if math.isfinite(what.lower) else ""
    high = f"≤ {what.upper:g}" if math.isfinite(what.upper) else ""
    return ", ".join(filter(None, (low, high)))
