"""Text of a study, read and written: the line of every key, and tables laid out as a person would write them.

`tomllib` gives values without places. `StudyText` finds where each key stands, so that each complaint names file, line
and the nearest valid name, and `Section` hands out the values of one table. `TomlTable` is one that is written.
"""

from __future__ import annotations

import json
import math
import re
import tomllib
from collections.abc import Generator, Iterable, Iterator, Mapping, Sequence
from contextlib import AbstractContextManager, contextmanager
from pathlib import Path
from typing import Any

from upright import units
from upright.errors import BadInput, UprightError, nearest
from upright.files import read_text

_LEAST = 1e-60
LOGS = (".csv", ".tsv", ".txt", ".dat", ".mat", ".mcap")
"""Endings of files that are no study."""
SOURCES = ("assumed", "measured")
"""Source of a known number, as in ``{ value = "10 V", measured = true }``."""
KeyPath = tuple[str | int, ...]
"""Keys from the root down; the entries of a list of tables are counted from 0."""


class StudyText:
    """Text of a study, read from its file unless it is given, with its values and the line of each key.

    Raises
    ------
    BadInput
        When the file is missing, no text, or no TOML.
    """

    def __init__(self, path: Path, text: str | None = None) -> None:
        self.path = path
        try:
            self.text = read_text(path, encoding="utf-8-sig", most=4) if text is None else text
        except UnicodeDecodeError:
            raise BadInput(
                f"{path} is not text, and a study is a TOML file; to make one from a log: upright init {path}"
            ) from None
        try:
            self.values: dict[str, Any] = tomllib.loads(self.text)
        except tomllib.TOMLDecodeError as error:
            message = str(error)
            at = re.search(r"\s*\(at (?:line (\d+), column (\d+)|end of document)\)", message)
            line = at.group(1) if at and at.group(1) else self.text.count("\n") + 1
            what = re.sub(r"\s*\(at .*\)$", "", message)
            if path.suffix.lower() in LOGS:
                raise BadInput(
                    f"{path} is a log, and what is needed here is a study or a fit. To make a study of it: "
                    f"upright init {path} -o {path.stem}.toml"
                ) from None
            raise BadInput(
                f"{path}, line {line}: this is not TOML ({what[:1].lower()}{what[1:]}). Write text in quotes, as in"
                ' plant = "furuta", and each key on its own line. To make a study of a log: upright init LOG'
            ) from None
        except (ValueError, RecursionError):  # a number of 5000 digits, a list in 1000 lists
            raise BadInput(
                f"{path}: this study has a number of thousands of digits, or brackets nested hundreds deep; a study"
                " needs neither"
            ) from None
        self.lines = key_lines(self.text)

    def line(self, path: KeyPath) -> int:
        """Line of a key, or of the nearest table around it that the text names."""
        while path and path not in self.lines:
            path = path[:-1]
        return self.lines.get(path, 1)

    def error(self, path: KeyPath, sentence: str) -> BadInput:
        """The complaint about one key."""
        return BadInput(f"{self.path}, line {self.line(path)}: {sentence}")

    @contextmanager
    def at(self, path: KeyPath) -> Generator[None]:
        """Put file and line before whatever the block complains about."""
        try:
            yield
        except UprightError as error:
            if str(error).startswith(str(self.path)):
                raise
            raise self.error(path, str(error)) from None
        except FileNotFoundError as error:
            raise self.error(path, f"the file {error.filename} does not exist") from None

    def root(self) -> Section:
        """The whole study as a section."""
        return Section(self, (), self.values)


class Section:
    """One table of the study; asks for its values by name, form and unit, and knows where each one stands."""

    def __init__(self, text: StudyText, path: KeyPath, values: Any) -> None:
        self.text, self.path = text, path
        if not isinstance(values, dict):
            raise text.error(path, f"'{self.name}' must be a table of keys, got {as_written(values)}")
        self.values: dict[str, Any] = values
        self.places: dict[str, KeyPath] = {}

    @property
    def name(self) -> str:
        """How the study writes this table, such as ``sensors.theta``."""
        return ".".join(str(part) for part in self.path if isinstance(part, str)) or "the study"

    def __contains__(self, key: str) -> bool:
        return key in self.values

    def place(self, key: str) -> KeyPath:
        """Path of a key in the study."""
        return self.places.get(key, (*self.path, key))

    def over(self, base: Section) -> Section:
        """Join this table with what it leaves out taken from `base`; each key keeps its line."""
        both = Section(self.text, self.path if self.values else base.path, {**base.values, **self.values})
        both.places = {k: base.place(k) for k in base.values} | {k: self.place(k) for k in self.values}
        return both

    def at(self, key: str) -> AbstractContextManager[None]:
        """Put file and line of a key before whatever the block complains about."""
        return self.text.at(self.place(key))

    def error(self, key: str, sentence: str) -> BadInput:
        """The complaint about one key of this table."""
        return self.text.error(self.place(key), sentence)

    def check(self, valid: Iterable[str], what: str = "key") -> None:
        """Refuse the first key that is none of `valid`."""
        valid = tuple(valid)
        for key in self.values:
            if key not in valid:
                place = f"[{self.name}] has" if self.path else "there is"  # at the top of a study or of a RIG.toml
                raise self.error(key, f"{place} no {what} '{key}'; {nearest(key, valid)}")

    def section(self, key: str) -> Section:
        """TomlTable under `key`, empty when absent."""
        return Section(self.text, self.place(key), self.values.get(key, {}))

    def text_of(self, key: str, example: str) -> str:
        """Text under `key`."""
        value = self.values.get(key)
        if not isinstance(value, str) or not value.strip():
            got = "nothing" if key not in self.values else as_written(value)
            raise self.error(key, f'[{self.name}] needs {key} as text, such as {key} = "{example}", got {got}')
        return value

    def names(self, key: str, valid: Iterable[str], default: tuple[str, ...] = ()) -> tuple[str, ...]:
        """List of names under `key`, each one of `valid`; a single name may stand alone."""
        if key not in self.values:
            return default
        value, valid = self.values[key], tuple(valid)
        items = [value] if isinstance(value, str) else value
        if not isinstance(items, list):
            raise self.error(
                key, f'{key} must be a list of names, such as {key} = ["{valid[0]}"], got {as_written(value)}'
            )
        for item in items:
            if item not in valid:
                raise self.error(key, f"{key} lists {as_written(item)}; {nearest(str(item), valid)}")
        return tuple(dict.fromkeys(items))

    def entries(self, key: str) -> list[Any]:
        """List under `key`, where a single entry may stand alone; empty when absent."""
        value: Any = self.values.get(key, [])
        return list(value) if isinstance(value, list) else [value]

    def number(self, key: str, unit: str, default: float | None = None) -> float:
        """Number under `key` in SI, dimension checked; a plain number is SI already."""
        if key not in self.values:
            if default is None:
                raise self.error(key, f"[{self.name}] needs {key}, a number in {unit}")
            return default
        with self.at(key):
            return in_si(self.values[key], unit, key)

    def positive(self, key: str, unit: str, default: float) -> float:
        """Number above zero."""
        value = self.number(key, unit, default)
        if not value > 0:
            raise self.error(key, f"{key} must be above zero, got {as_written(self.values[key])}")
        return value

    def stated(self, key: str, unit: str) -> tuple[float, str]:
        """Number above zero, plain or in a table beside what it rests on, and that in a word."""
        value = self.values[key]
        inner = self.section(key) if isinstance(value, dict) else self
        if inner is not self:
            inner.check(("value", *SOURCES))
        number = inner.number("value" if inner is not self else key, unit)
        if not number > 0:
            raise self.error(
                key, f"{key} must be above zero, got {as_written(value)}; leave it out where there is none"
            )
        return number, source_of(value)

    def flag(self, key: str) -> bool:
        """True or false, false when left out."""
        value = self.values.get(key, False)
        if not isinstance(value, bool):
            raise self.error(key, f"{key} must be true or false, got {as_written(value)}")
        return value

    def choice(self, key: str, valid: Iterable[str], default: str) -> str:
        """One of some words."""
        value, valid = self.values.get(key, default), tuple(valid)
        if value not in valid:
            words = " or ".join(f'"{v}"' for v in valid)
            raise self.error(key, f"{key} must be {words}, got {as_written(value)}; {nearest(str(value), valid)}")
        return value

    def whole(self, key: str, default: int, most: int) -> int:
        """Whole number from 1 to `most`."""
        value = self.values.get(key, default)
        if isinstance(value, bool) or not isinstance(value, int) or not 1 <= value <= most:
            raise self.error(key, f"{key} must be a whole number from 1 to {most}, got {as_written(value)}")
        return value


def source_of(value: Any) -> str:
    """What a number of a study rests on, in the study's own word: "known" where it says nothing of it."""
    if not isinstance(value, dict):
        return "known"
    entry: dict[str, Any] = value
    return next((word for word in SOURCES if entry.get(word)), "measured" if "uncertainty" in entry else "known")


def in_si(value: Any, unit: str, what: str) -> float:
    """Value in `unit`, one of SI or of the command, of a number or of text such as ``"2 mm"``."""
    if isinstance(value, bool) or not isinstance(value, str | int | float):
        raise BadInput(f'{what} must be a number or text with a unit, such as "1.5 {unit}", got {as_written(value)}')
    if not isinstance(value, str) and not abs(value) < 1e300:
        raise BadInput(f"{what} must be a finite number, got {as_written(value)}")
    number = units.in_unit(value, unit)
    if number and not _LEAST <= abs(number) <= 1 / _LEAST:  # its square, or the inverse of that, would overflow
        raise BadInput(f"{what} must be 0 or from {_LEAST:g} to {1 / _LEAST:g} in size, got {as_written(value)}")
    return number


def as_written(value: Any) -> str:
    """A value as the study wrote it, short."""
    if isinstance(value, str):
        return f'"{value}"' if len(value) < 40 else f'"{value[:37]}..."'
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, dict):
        return "a table {" + ", ".join(list(value)[:4]) + "}"
    return str(value) if len(str(value)) < 40 else f"{str(value)[:37]}..."


def key_lines(text: str) -> dict[KeyPath, int]:
    """Line (from 1) of every key and table of valid TOML; list entries are counted from 0.

    The text is read again by `tomllib`, key by key: lines are gathered until they are TOML by themselves. A list over
    several lines is closed early after each of them, which tells what the line added.
    """
    lines: dict[KeyPath, int] = {}
    counts: dict[KeyPath, int] = {}
    base: KeyPath = ()
    gathered, first = "", 1
    for number, line in enumerate(text.split("\n"), start=1):
        gathered += f"{line}\n"
        values, whole = _toml_so_far(gathered)
        if values and gathered.lstrip().startswith("["):
            base = _enter(values, counts)
            paths = [base]
        else:
            paths = [(*base, *path) for path in _paths(values)]
        for path in paths:
            for cut in range(1, len(path) + 1):
                lines.setdefault(path[:cut], first if first else number)
        if values or whole:
            first = 0  # what comes now was added by a later line
        if whole:
            gathered, first = "", number + 1
    return lines


def _toml_so_far(text: str) -> tuple[dict[str, Any], bool]:
    """What the beginning of a text in TOML says, its lists closed if need be, and whether that was not needed."""
    for closed in ("", *("]" * depth for depth in range(1, 9))):
        try:
            return tomllib.loads(text + closed), not closed
        except (ValueError, RecursionError):
            continue
    return {}, False


def _paths(value: Any) -> Iterator[KeyPath]:
    """Path of every key in a value, with the place of each table in a list."""
    entries = enumerate(value) if isinstance(value, list) else value.items() if isinstance(value, dict) else ()
    for key, inner in entries:
        if isinstance(value, dict) or isinstance(inner, dict):
            yield (key,)
        for path in _paths(inner):
            yield (key, *path)


def _enter(header: Any, counts: dict[KeyPath, int]) -> KeyPath:
    """Path of a table header, with the running number of each list of tables on the way."""
    path: KeyPath = ()
    while header:
        if isinstance(header, list):
            counts[path] = counts.get(path, -1) + 1
            break
        key = next(iter(header))
        path, header = (*path, key), header[key]
        if path in counts and not isinstance(header, list):
            path = (*path, counts[path])
    return (*path, counts[path]) if isinstance(header, list) else path


Value = bool | float | str | Sequence["Value"] | Mapping[str, "Value"]


class TomlTable:
    """One table of a study, written key by key.

    Parameters
    ----------
    header : str
        Its first line, ``[drive]`` or ``[[runs]]``; empty for the keys before the first table.
    note : str, optional
        Comment behind it.
    """

    def __init__(self, header: str = "", note: str = "") -> None:
        self.lines: list[str] = []
        if header:
            self.line(header, note)

    def key(self, name: str, value: Value, note: str = "", *, digits: int = 6, off: bool = False) -> None:
        """Add a key; numbers get so many significant `digits`, and one that is `off` is commented out."""
        self.line(f"{'# ' if off else ''}{name} = {toml(value, digits)}", note)

    def line(self, text: str, note: str = "") -> None:
        """Add a line as it is."""
        whole = f"{text}   # {note}" if note else text
        self.lines.append(re.sub(r"[\x00-\x08\x0a-\x1f\x7f]", " ", whole))  # as the name of a log may hold

    def __str__(self) -> str:
        return "\n".join(self.lines) + "\n"


def study_text(tables: Iterable[TomlTable]) -> str:
    """Tables one below the other, a blank line between them."""
    return "\n".join(str(table) for table in tables)


def toml(value: Value, digits: int = 6) -> str:
    """A value in TOML: text in quotes on one line, numbers to so many significant digits, lists, inline tables."""
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, int):
        return str(value)
    if isinstance(value, float):
        return f"{value:.{digits}g}"
    if isinstance(value, str):
        return json.dumps(value, ensure_ascii=False).replace("\x7f", "\\u007f")
    if isinstance(value, Mapping):
        return "{ " + ", ".join(f"{k} = {toml(v, digits)}" for k, v in value.items()) + " }"
    return "[" + ", ".join(toml(v, digits) for v in value) + "]"


def table(header: str, note: str = "", /, digits: int = 6, **keys: Value) -> TomlTable:
    """A table with some keys."""
    out = TomlTable(header, note)
    for name, value in keys.items():
        out.key(name, value, digits=digits)
    return out


def counted_sensor(name: str, unit: str, counts: float) -> TomlTable:
    """Sensor of a coordinate in rad or m, whose column of the same name holds encoder counts, so many per unit."""
    per, factor = ("counts_per_rev", 2 * math.pi) if unit == "rad" else ("counts_per_m", 1.0)
    return table(f"[sensors.{name}]", column=name, unit="counts", digits=10, **{per: counts * factor})
