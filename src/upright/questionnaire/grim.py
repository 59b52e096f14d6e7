"""Can this printed number come from that many answers? The GRIM check (Brown and Heathers 2017), in whole numbers.

A mean of n whole ratings is a whole number over n, and so is a share; few n fit every number that was printed.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction

from upright.errors import BadInput


@dataclass(frozen=True, kw_only=True)
class Fits:
    """How many printed numbers can come from `answers` answers."""

    answers: int
    possible: int
    printed: int


def counts(printed: str, answers: int, *, of: int = 1) -> range:
    """Whole totals S for which ``of * S / answers`` rounds to the printed number, halves up or down.

    Parameters
    ----------
    printed : str
        As printed, since its decimals say how it was rounded: ``"3.10"`` is not ``"3.1"``.
    answers : int
    of : int
        1 for a mean, 100 for a percentage.
    """
    try:
        value = Fraction(printed)
    except (ValueError, ZeroDivisionError):
        raise BadInput(f"Expected a printed number such as '3.27', got '{printed}'.") from None
    if answers < 1:
        raise BadInput(f"A number needs at least one answer, got {answers}.")
    half = Fraction(1, 2 * 10 ** (len(printed.partition(".")[2])))
    low = math.ceil((value - half) * answers / of)
    high = math.floor((value + half) * answers / of)
    return range(low, high + 1)


def possible(printed: str, answers: int, *, of: int = 1) -> bool:
    """Whether a number can come from that many answers."""
    return len(counts(printed, answers, of=of)) > 0


def whole_row(shares: Sequence[str], answers: int) -> bool:
    """Whether the percentages of one question can come from whole counts that add up to all answers."""
    found = [counts(share, answers, of=100) for share in shares]
    return all(found) and sum(c[0] for c in found) <= answers <= sum(c[-1] for c in found)


def fitting(means: Sequence[str], shares: Sequence[str], most: int) -> tuple[Fits, ...]:
    """How many of all printed numbers each number of answers up to `most` makes possible."""
    printed = len(means) + len(shares)
    return tuple(
        Fits(
            answers=n,
            possible=sum(possible(m, n) for m in means) + sum(possible(s, n, of=100) for s in shares),
            printed=printed,
        )
        for n in range(1, most + 1)
    )
