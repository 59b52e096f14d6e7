"""Text of a study: its tables, keys, units and comments, laid out as a person would write them."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence

Value = bool | float | str | Sequence["Value"] | Mapping[str, "Value"]


class Table:
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
        self.lines.append(f"{text}   # {note}" if note else text)

    def __str__(self) -> str:
        return "\n".join(self.lines) + "\n"


def study_text(tables: Iterable[Table]) -> str:
    """Tables one below the other, a blank line between them."""
    return "\n".join(str(table) for table in tables)


def number(value: float, unit: str = "", digits: int = 3) -> str:
    """A number that wears its unit, ``0.35 m``; a pure number ("" or "1") wears none."""
    return f"{value:.{digits}g}" + (f" {unit}" if unit not in ("", "1") else "")


def toml(value: Value, digits: int = 6) -> str:
    """A value in TOML: text in quotes on one line, numbers to so many significant digits, lists, inline tables."""
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, int):
        return str(value)
    if isinstance(value, float):
        return f"{value:.{digits}g}"
    if isinstance(value, str):
        text = value.replace("\\", "\\\\").replace('"', '\\"').replace("\n", " ")
        return f'"{text}"'
    if isinstance(value, Mapping):
        return "{ " + ", ".join(f"{k} = {toml(v, digits)}" for k, v in value.items()) + " }"
    return "[" + ", ".join(toml(v, digits) for v in value) + "]"
