"""Dates and times of day at the beginning of a table's rows, as seconds since the first of them."""

from __future__ import annotations

import re
from datetime import date

_STAMP = (
    r'^[ \t]*"?(?:(?:(\d{4})-(\d\d)-(\d\d)|(\d\d?)\.(\d\d?)\.(\d{4}))[T ])?'  # ISO 8601, or day.month.year
    r'(\d\d?):(\d\d):(\d\d)(?:[MARK](\d+))?(?:Z|([+-]\d\d):?(\d\d)?)?"?(?=[,;\s]|$)'
)
_HEAD = 1 << 16  # characters in which the first row begins


def in_seconds(text: str) -> tuple[str, str]:
    """The text with each stamp replaced by its seconds, exact to a nanosecond, and the first stamp; empty without one.

    Commas before a fraction of a second are read where something else parts the cells.
    """
    stamp = re.compile(_STAMP.replace("MARK", "."), re.MULTILINE)
    begin = stamp.search(text, 0, _HEAD)
    if begin is None:
        return text, ""
    row = text[begin.start() :].partition("\n")[0]
    parted = ";" in row or "\t" in row
    if parted:
        stamp = re.compile(_STAMP.replace("MARK", ".,"), re.MULTILINE)
    cells = stamp.sub("", text[begin.start() :])
    mark = "," if parted and "," in cells and "." not in cells else "."
    first, began = None, ""

    def seconds(stamped: re.Match[str]) -> str:
        nonlocal first, began
        at = _nanoseconds(stamped)
        if first is None:
            first, began = at, stamped[0].strip().strip('"')
        whole, rest = divmod(abs(at - first), 10**9)
        return f"{'-' * (at < first)}{whole}{mark}{rest:09d}"

    return stamp.sub(seconds, text), began


def _nanoseconds(stamped: re.Match[str]) -> int:
    year, month, day, day_first, month_first, year_last, hour, minute, second, fraction, east, past = stamped.groups()
    numbers = [int(n or "0") for n in (year or year_last, month or month_first, day or day_first)]
    try:
        days = date(*numbers).toordinal() if any(numbers) else 0
    except ValueError:
        days = 0  # no such day; where the times fall for it, the reader refuses them with their line
    zone = 60 * int(east or 0) + (-1 if (east or "").startswith("-") else 1) * int(past or 0)
    whole = 86400 * days + 3600 * int(hour) + 60 * (int(minute) - zone) + int(second)
    return whole * 10**9 + int((fraction or "0").ljust(9, "0")[:9])
