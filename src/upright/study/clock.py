"""Can a laboratory have sampled a rig at this pace, or is the clock in another unit?"""

from __future__ import annotations

import numpy as np

from upright.errors import BadInput
from upright.records import Record
from upright.units import known, parse, same_dimension, scale

SLOWEST = 2.0
"""Seconds between samples beyond which nothing of a pendulum, a cart or a disk is seen."""

USUAL = 1e-4, 0.5
"""Seconds between samples, least and most, that are usual."""


def with_time_unit(record: Record, unit: str) -> Record:
    """Record whose time [s] was read from numbers in `unit`, such as "ms", that state none themselves.

    Of rows that are counted the unit is what lies between two of them, as in "20 ms".

    Raises
    ------
    BadInput
        When it is no unit of time.
    """
    if not unit:
        return record
    if counts_rows(unit):
        steps = np.diff(record.t)
        if not ((record.t == np.round(record.t)).all() and np.median(steps) == 1.0):
            raise BadInput(
                f"'{record.provenance.file or 'the log'}' has a time of its own, {record.period:.4g} s from sample to "
                f"sample; leave the time between two rows out."
            )
        return record.replace(t=record.t * parse(unit, "s"))
    if not (known(unit) and same_dimension(unit, "s")):
        raise BadInput(f"expected a unit of time, such as 'ms', 'us' or 's', got '{unit[:40]}'.")
    return record.replace(t=record.t * scale(unit))


def counts_rows(unit: str) -> bool:
    """Whether a unit of time is a time between two rows: a number with its unit."""
    return unit.strip()[:1].isdigit()


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
    likely = " or ".join(
        f"{word} (name the column 't [{name}]', or give --time-unit {name}; in a study time_unit = \"{name}\")"
        for name, word in units[:2]
    )
    raise BadInput(
        f"'{file}': expected a sample at least every {SLOWEST:g} s, got one every {step:.4g} s; "
        + (f"its clock may count {likely}." if likely else "check the unit of its time column.")
    )
