"""Chapters as plain values, which JSON can hold, and back."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import fields, is_dataclass, replace
from typing import Any

from upright.files import plain_values
from upright.report.page import Chapter, Code, Facts, Finding, Formula, Part, Picture, Points, Step, Symbol, Table

_KINDS: dict[str, Callable[..., Any]] = {
    kind.__name__: kind for kind in (Chapter, Code, Facts, Finding, Formula, Part, Picture, Points, Step, Table)
}


def as_plain(value: Any, instead: Callable[[Any], Any] = lambda value: None) -> Any:
    """A chapter, or what stands in one, as values that JSON can hold; each says its kind.

    `instead` may offer something else for a value, and nothing (None) for most.
    """
    if (other := instead(value)) is not None:
        return other
    if isinstance(value, Symbol):
        return {"kind": "Symbol", "text": str(value)}
    if isinstance(value, Picture):
        value = replace(value, draw=value.svg)
    if isinstance(value, Mapping):
        return plain_values(value)
    if is_dataclass(value):
        told = {f.name: as_plain(getattr(value, f.name), instead) for f in fields(value)}
        return {"kind": type(value).__name__, **told}
    return [as_plain(v, instead) for v in value] if isinstance(value, tuple | list) else value


def from_plain(content: Any) -> Any:
    """The chapter, or what stands in one, that `as_plain` wrote."""
    if isinstance(content, list):
        return tuple(from_plain(c) for c in content)
    if not isinstance(content, dict):
        return content
    kind = content["kind"]
    if kind == "Symbol":
        return Symbol(content["text"])
    told = {name: from_plain(value) for name, value in content.items() if name not in ("kind", "numbers")}
    if "numbers" in content:  # columns of a table, or a chapter's values for another program, which stay as they are
        told["numbers"] = tuple(content["numbers"]) if kind == "Table" else content["numbers"]
    return _KINDS[kind](**told)
