"""JSON as this program hands it on: plain values, null where a number is not finite, files whole or not at all."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from dataclasses import is_dataclass
from pathlib import Path
from typing import Any

OWN_FILE = "upright_user_"
"""How the name of a module begins that was loaded from a user's file: no other process can import it."""


def plain_values(value: Any) -> Any:
    """Values that JSON can hold: arrays as lists, complex numbers as pairs, nothing where a number is not one.

    A dataclass becomes a table of its fields, whose names are then those of a file's format.
    """
    if is_dataclass(value):
        return plain_values(vars(value))
    if isinstance(value, Mapping):
        return {str(k): plain_values(v) for k, v in value.items()}
    if isinstance(value, list | tuple):
        return [plain_values(v) for v in value]
    if hasattr(value, "tolist"):
        return plain_values(value.tolist())
    if isinstance(value, complex):
        return plain_values([value.real, value.imag])
    if isinstance(value, float):
        return value if math.isfinite(value) else None
    return value if value is None or isinstance(value, bool | int | str) else str(value)


def json_text(content: Any) -> str:
    """Text of any values."""
    return json.dumps(plain_values(content), indent=2, ensure_ascii=False, allow_nan=False)


def write_json(path: Path, content: Any) -> Path:
    """Write values to a file."""
    return replace_file(path, f"{json_text(content)}\n".encode())


def replace_file(path: Path, content: bytes) -> Path:
    """Write a file, and its folder; one that exists is replaced at once, so that nobody meets half of it."""
    path.parent.mkdir(parents=True, exist_ok=True)
    half = path.with_name(f".{path.name}.part")
    half.write_bytes(content)
    half.replace(path)
    return path
