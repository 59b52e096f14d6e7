"""What do the names of columns state: which one is the time, and in which unit is each?"""

from __future__ import annotations

import math
import re
from typing import Any

import numpy as np
from numpy.typing import NDArray

from upright.errors import BadInput, nearest
from upright.units import converted

TIME_NAMES = (
    *("t", "time", "t_received", "timestamp", "__time", "tout", "time_s", "t_s", "seconds", "sec"),
    *("zeit", "temps", "tiempo", "tempo", "tid", "tijd", "czas"),
)
ANGLES = {"rad": 1.0, "deg": math.pi / 180, "rev": 2 * math.pi}
LENGTHS = {"m": 1.0, "cm": 1e-2, "mm": 1e-3}
"""SI value of the units in which logs hold places."""
_SPELLED = {"\u00b0": "deg", "degree": "deg", "degrees": "deg", "radian": "rad", "radians": "rad", "count": "counts"}
_SPELLED |= {"volt": "V", "volts": "V", "amp": "A", "amps": "A", "ampere": "A", "amperes": "A", "newtons": "N"}
_SPELLED |= {"second": "s", "seconds": "s", "meter": "m", "meters": "m", "metre": "m", "metres": "m"}
# the names are case-folded, which makes the micro sign a Greek letter
_UNIT_SUFFIX = {"s": 1.0, "sec": 1.0, "seconds": 1.0, "ms": 1e-3, "us": 1e-6, "\u03bcs": 1e-6, "ns": 1e-9}
_UNIT_SUFFIX |= {"msec": 1e-3, "usec": 1e-6, "milliseconds": 1e-3, "microseconds": 1e-6, "nanoseconds": 1e-9}
_UNIT_SUFFIX |= {"millis": 1e-3, "millis()": 1e-3, "micros": 1e-6, "micros()": 1e-6}  # Arduino's clocks


_APART = ("/", ",", " in ")
_ALONE = {*ANGLES, *LENGTHS, "counts", "V", "mV", "mA", "N"}
"""What parts a name from a unit without brackets, and the units that are read there beside times and full words.

An A is none: channels are called so.
"""


def split_heading(name: str) -> tuple[str, str]:
    """A column's name and the unit behind it, as it is written there; empty where none is.

    In brackets anything may be one, and what follows it after a comma is a remark: ``theta [deg, 0 = up]``. Behind a
    slash, a comma or the word "in" a unit is one that logs are full of, ``Zeit/s`` or ``Angle, deg``, and no part of
    another unit, as in ``m/s``.
    """
    name = name.strip()
    at = _opening(name)
    inside = name[at + 1 : -1].strip() if at >= 0 else ""
    unit = inside if inside[:1].isdigit() else re.split(r"[,;]", inside, maxsplit=1)[0].rstrip(" .")
    if unit:
        return name[:at].rstrip(" /"), unit
    for mark in _APART:
        stem, _, unit = (part.strip() for part in name.rpartition(mark))
        if stem and mark not in stem and stem.split()[-1] not in _ALONE and _is_alone(unit):
            return stem, unit
    return name, ""


def _opening(name: str) -> int:
    """Place of the bracket that the last character closes; -1 where it closes none."""
    depth = 0
    for at in range(len(name) - 1, -1, -1):
        depth += (name[at] in ")]") - (name[at] in "([")
        if depth == 0:
            return at if name[at] in "([" else -1
    return -1


def _is_alone(unit: str) -> bool:
    return unit in _ALONE or unit.casefold() in _UNIT_SUFFIX or unit.casefold() in _SPELLED


def time_scale(name: str) -> float:
    """Seconds per unit of a column that is called like a time; 0 when it is not.

    ``"t"``, ``"Time"``, ``"time [ms]"``, ``"Time (s)"``, ``"Zeit/s"``, ``"t_us"``, ``"ms"`` and Arduino's ``"millis"``
    are.
    """
    stem, unit = (part.casefold() for part in split_heading(name))
    if stem in TIME_NAMES:
        return _UNIT_SUFFIX.get(unit, 0.0) if unit else 1.0
    if not unit and len(stem) > 1 and stem in _UNIT_SUFFIX:  # "s" may be a position
        return _UNIT_SUFFIX[stem]
    head, _, suffix = stem.rpartition("_")
    return _UNIT_SUFFIX.get(suffix, 0.0) if head in TIME_NAMES else 0.0


def stated_time_unit(name: str) -> float:
    """Seconds per unit of a column that states a unit of time, whatever it is called; 0 where it states none."""
    return _UNIT_SUFFIX.get(stated_unit(name).casefold(), 0.0)


def stated_unit(name: str) -> str:
    """Unit behind a name, as in ``theta [rad]``, see `split_heading`; empty when there is none that can be read."""
    from upright.units import known

    _, unit = split_heading(name)
    unit = _SPELLED.get(unit.casefold(), unit)
    return unit if known(unit) else ""


def bare_name(name: str) -> str:
    """A name without its unit: ``theta`` of ``theta [deg]``, ``theta (counts)`` and ``theta_rad``."""
    return re.sub(r"(?<=\w)_(rad|deg|rev|m|cm|mm|counts?)$", "", split_heading(name)[0])


def take_time(frame: Any, name: str | None = None) -> tuple[NDArray[np.float64], Any]:
    """Time [s] of a data frame, and the frame without it.

    A column `name` is the time when it is given. Otherwise an index that was set to it is, one of stamps counted from
    the first; an index that only numbers the rows is none, and the one column called like a time stands in for it.

    Raises
    ------
    BadInput
        When `name` is no column, or nothing or several things could be the time.
    """
    columns = [str(c) for c in frame.columns]
    if name is None and not _numbers_rows(frame.index):
        return _seconds(frame.index, 1.0), frame
    if name is None:
        like = [c for c in columns if time_scale(c)]
        if len(like) != 1:
            what = f"{' and '.join(like)} are called so" if like else f"its columns are {', '.join(columns)}"
            raise BadInput(
                f"A record needs one column of time, and {what}; name it, as in time='{(like or columns or ['t'])[0]}',"
                " or make it the index of the frame."
            )
        name = like[0]
    if name not in columns:
        raise BadInput(f"The data frame has no column '{name}' to be the time; {nearest(name, columns)}")
    at = columns.index(name)
    rest = frame.iloc[:, [i for i in range(len(columns)) if i != at]]
    return _seconds(frame.iloc[:, at], time_scale(name) or 1.0), rest


def _numbers_rows(index: Any) -> bool:
    """Whether an index counts rows and says nothing of time: whole numbers, never called a time."""
    return np.asarray(index).dtype.kind in "iu" and not time_scale(str(index.name or ""))


def _seconds(values: Any, unit: float) -> NDArray[np.float64]:
    array = np.asarray(values)
    if array.dtype.kind == "M":
        array = array - array[:1]
    if array.dtype.kind == "m":
        return array / np.timedelta64(1, "s")
    return converted(array, unit) if array.dtype.kind in "iuf" else array
