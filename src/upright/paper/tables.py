"""Tables 1, 2 and 4 of the paper, as text, so that the digits printed tell the rounding."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Roots = NDArray[np.complex128]

TABLE_1 = (
    "-4.1484+-1.6341j, -16.8545, -3.2220",
    "-4.4305+-2.0497j, -21.915, -2.9234",
    "-4.5628+-2.2419j, -29.5357, -2.8285",
    "-4.6314+-2.3357j, -40.7029, -2.7882",
)
"""Furuta pendulum, inverted; four sets, the effort cheaper from set to set."""
TABLE_2 = (
    "-7.533+-27.28j, -18.53+-10.35j",
    "-8.7164+-26.7j, -23.59+-9.53j",
    "-9.3632+-26.0j, -35.1, -26.96",
    "-9.6046+-25.516j, -60.124, -22.841",
)
"""ECP 210, two carts."""
TABLE_3_FIRST = ("46", "54")
"""Percentages that answered the first question, strongly agree and agree."""
TABLE_4 = (
    ("3.27", "2.98", "3.88", "3.58"),
    ("2.98", "2.50", "3.58", "3.25"),
    ("3.15", "2.79", "3.75", "3.42"),
    ("2.54", "2.23", "3.83", "3.46"),
    ("1.60", "1.50", "3.02", "2.69"),
    ("2.26", "2.04", "3.44", "2.96"),
)
"""Mean ratings before (knowledge, confidence) and after."""
STUDENTS = 53


def poles(text: str) -> tuple[Roots, Roots]:
    """Poles of one set [1/s], and half a unit of their last digits, real and imaginary part apart."""
    values: list[complex] = []
    halves: list[complex] = []
    for part in text.split(", "):
        real, _, imaginary = part.removesuffix("j").partition("+-")
        for sign in (1, -1) if imaginary else (1,):
            values.append(complex(float(real), sign * float(imaginary or 0)))
            halves.append(complex(_half(real), _half(imaginary) if imaginary else 1.0))
    return np.array(values), np.array(halves)


def _half(number: str) -> float:
    return 0.5 * 10.0 ** -len(number.partition(".")[2])
