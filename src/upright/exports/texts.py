"""What laws and rigs are exported as, each text in its own language with places for what differs, ``$name``."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path
from string import Template

FOLDER = Path(__file__).parent / "templates"


def filled(name: str, /, **values: object) -> str:
    """Text of the template called so, with its values."""
    return Template((FOLDER / name).read_text(encoding="utf-8")).substitute(values)


def indented(lines: Iterable[str], by: int = 4) -> str:
    """Lines one below the other, moved to the right."""
    return "\n".join(f"{' ' * by}{line}" for line in lines)
