"""Can a laboratory have sampled a rig at this pace, or is the clock in another unit?"""

from __future__ import annotations

from upright.errors import BadInput
from upright.records import Record

SLOWEST = 2.0
"""Seconds between samples beyond which nothing of a pendulum, a cart or a disk is seen."""

USUAL = 1e-4, 0.5
"""Seconds between samples, least and most, that are usual."""


def check_clock(record: Record) -> None:
    """Refuse a record whose samples lie further apart than any rig's.

    Raises
    ------
    BadInput
        With the unit in which the clock would make sense.
    """
    step = record.period
    if step <= SLOWEST:
        return
    units = [(name, word) for name, word, scale in (("ms", "milliseconds", 1e-3), ("us", "microseconds", 1e-6),
                                                    ("ns", "nanoseconds", 1e-9))
             if USUAL[0] <= step * scale <= USUAL[1]]  # fmt: skip
    file = record.provenance.file or "the log"
    likely = " or ".join(f"{word} (name the column 't [{name}]')" for name, word in units[:2])
    raise BadInput(
        f"'{file}': expected a sample at least every {SLOWEST:g} s, got one every {step:.4g} s; "
        + (f"its clock may count {likely}." if likely else "check the unit of its time column.")
    )
