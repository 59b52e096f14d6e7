"""Dates and times of day at the beginning of a table's rows, as seconds since the first of them."""

from __future__ import annotations

import re
from datetime import date

_STAMP = (
    r'^[ \t]*"?(?:(?:(?P<year>\d{4})[-/](?P<month>\d\d?)[-/](?P<day>\d\d?)'  # ISO 8601
    r"|(?P<one>\d\d?)(?P<of>[./])(?P<two>\d\d?)(?P=of)(?P<last>\d{4}))"  # day.month.year, or with strokes either order
    r'(?:[T ]|(?P<apart>"?[ ]*[,;\t][ ]*"?)))?'  # a date may have a cell of its own
    r"(?P<hour>\d\d?):(?P<minute>\d\d):(?P<second>\d\d)(?:[MARK](?P<fraction>\d+))?"
    r'(?:[ ]?(?P<half>[AaPp])\.?[Mm]\.?)?(?:Z|(?P<east>[+-]\d\d):?(?P<past>\d\d)?)?"?(?=[,;\s]|$)'
)
_HEAD = 1 << 16  # characters in which the first row begins, and the last


def in_seconds(text: str) -> tuple[str, str]:
    """The text with each stamp replaced by its seconds, exact to a nanosecond, and the first stamp; empty without one.

    Commas before a fraction of a second are read where something else parts the cells. A date in a cell of its own
    becomes the seconds as well. Of 3/2/2026 nobody knows whether it is in February or March: the order is taken in
    which the log is the shorter.
    """
    stamp = re.compile(_STAMP.replace("MARK", "."), re.MULTILINE)
    begin = stamp.search(text, 0, _HEAD)
    if begin is None:
        return text, ""
    row = text[begin.start() :].partition("\n")[0]
    parted = ";" in row or "\t" in row
    if parted:
        stamp = re.compile(_STAMP.replace("MARK", ".,"), re.MULTILINE)
        begin = stamp.search(text, begin.start()) or begin
    cells = stamp.sub("", text[begin.start() :])
    mark = "," if parted and "," in cells and "." not in cells else "."
    *_, end = begin, *stamp.finditer(text, max(begin.start(), len(text) - _HEAD))
    lasts = {order: _nanoseconds(end, order) - _nanoseconds(begin, order) for order in (False, True)}
    day_first = 0 <= lasts[True] < lasts[False] or lasts[False] < 0
    first = _nanoseconds(begin, day_first)

    def seconds(stamped: re.Match[str]) -> str:
        since = _nanoseconds(stamped, day_first) - first
        whole, rest = divmod(abs(since), 10**9)
        number = f"{'-' * (since < 0)}{whole}{mark}{rest:09d}"
        apart = stamped["apart"]
        return number if apart is None else f"{number}{apart.replace(chr(34), '').strip(' ')}{number}"

    return stamp.sub(seconds, text), begin[0].strip().strip('"')


def _nanoseconds(stamped: re.Match[str], day_first: bool) -> int:
    part = stamped.groupdict(default="")
    one, two = (part["one"], part["two"]) if day_first or part["of"] == "." else (part["two"], part["one"])
    numbers = [int(n or "0") for n in (part["year"] or part["last"], part["month"] or two, part["day"] or one)]
    try:
        days = date(*numbers).toordinal() if any(numbers) else 0
    except ValueError:
        days = 0  # no such day; where the times fall for it, the reader refuses them with their line
    hour = int(part["hour"])
    if part["half"]:
        hour = hour % 12 + 12 * (part["half"] in "pP")
    zone = 60 * int(part["east"] or 0) + (-1 if part["east"].startswith("-") else 1) * int(part["past"] or 0)
    whole = 86400 * days + 3600 * hour + 60 * (int(part["minute"]) - zone) + int(part["second"])
    return whole * 10**9 + int(part["fraction"].ljust(9, "0")[:9])
