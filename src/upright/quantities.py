"""Unit, meaning and bounds of a parameter, and how many of its figures mean something.

A parameter says so once, in `quantity()`; tables, axis labels, forms and the
nomenclature are generated from that line.
"""

from __future__ import annotations

import math
from dataclasses import MISSING, dataclass, field, fields
from typing import Any

from upright.errors import ImpossiblePhysics


@dataclass(frozen=True, kw_only=True)
class Quantity:
    """Unit, meaning and bounds of one parameter.

    `lower` and `upper` are the bounds; `open_lower` says that the lower bound itself is excluded.
    """

    unit: str
    meaning: str
    lower: float = -math.inf
    upper: float = math.inf
    open_lower: bool = False

    def check(self, name: str, value: float) -> None:
        """Raise `ImpossiblePhysics` when `value` is not finite or lies outside the bounds."""
        below = value < self.lower or (self.open_lower and value <= self.lower)
        if math.isfinite(value) and not below and value <= self.upper:
            return
        bounds = f"{'>' if self.open_lower else '>='} {self.lower:g}" if math.isfinite(self.lower) else "finite"
        if math.isfinite(self.upper):
            bounds += f" and <= {self.upper:g}"
        raise ImpossiblePhysics(
            f"{name} ({self.meaning}) must be {bounds} {self.unit}, got {value:g}; check its sign and its unit."
        )


def quantity(
    unit: str,
    meaning: str,
    *,
    default: float | None = None,
    above: float | None = None,
    at_least: float | None = None,
    at_most: float | None = None,
) -> Any:
    """Declare a dataclass field that knows its unit (SI, radians), meaning and bounds.

    Parameters
    ----------
    unit : str
        As pint reads it and a person writes it, such as ``"kg m^2"``; ``"1"`` for a pure number.
    meaning : str
        A few words that fit into a table.
    default : float, optional
        Value when none is given.
    above, at_least, at_most : float, optional
        Bounds; `above` excludes its own value.
    """
    lower = above if above is not None else at_least
    what = Quantity(
        unit=unit,
        meaning=meaning,
        lower=-math.inf if lower is None else lower,
        upper=math.inf if at_most is None else at_most,
        open_lower=above is not None,
    )
    return field(default=MISSING if default is None else default, metadata={"quantity": what})  # type: ignore[call-overload]


def quantities(owner: object) -> dict[str, Quantity]:
    """Quantities of a dataclass or of an instance of one, by field name, in order."""
    return {f.name: f.metadata["quantity"] for f in fields(owner) if "quantity" in f.metadata}  # type: ignore[arg-type]


def figures(value: float, stderr: float) -> int:
    """How many significant figures of `value` its standard error leaves, two of the error included."""
    if not (math.isfinite(stderr) and math.isfinite(value)) or stderr <= 0 or value == 0:
        return 4
    return min(max(math.floor(math.log10(abs(value))) - math.floor(math.log10(stderr)) + 2, 2), 8)


def two_figures(value: float) -> str:
    """Two figures, of what is large without powers of ten: ``0.23``, ``4.7``, ``100``, ``3100``."""
    text = f"{value:.2g}"
    return f"{float(text):.0f}" if 99.5 <= abs(value) < math.inf else text


def with_unit(value: float, unit: str = "", digits: int = 3) -> str:
    """A number with its unit, ``0.35 m``; a pure number ("" or "1") has none."""
    return f"{value:.{digits}g}" + (f" {unit}" if unit not in ("", "1") else "")
