"""The studies in `examples/studies`, and logs that stand in for those of their rigs."""

from __future__ import annotations

import re
import tomllib
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from upright.records import Record
from upright.study.text import toml

FOLDER = Path(__file__).parents[2] / "examples" / "studies"
STUDIES = {path.stem: tomllib.loads(path.read_text(encoding="utf-8")) for path in sorted(FOLDER.glob("*.toml"))}


def words(tree: Any) -> Iterator[str]:
    """Every name in every text of a study."""
    if isinstance(tree, str):
        yield tree
        yield from re.findall(r"[A-Za-z_]\w*", tree)
    for inner in tree.values() if isinstance(tree, dict) else tree if isinstance(tree, list) else ():
        yield from words(inner)


def stand_ins(study: dict[str, Any]) -> dict[str, Record]:
    """A log for each file that a study names: every column that it may ask for, decaying swings, for 80 s."""
    rng = np.random.default_rng(5)
    t = np.arange(4000) * 0.02
    names = sorted({*words(study), *study.get("sensors", {})} - {"t"})
    swing = np.exp(-0.02 * t) * np.cos(5 * t)
    columns = {name: np.round(300 * swing + rng.normal(size=t.size)) for name in names}
    return {run["file"]: Record(t=t, signals=columns) for run in study["runs"]}


def text_of(study: dict[str, Any]) -> str:
    """A study as TOML, a line for each of its tables."""
    return "".join(f"{_key(key)} = {_value(value)}\n" for key, value in study.items())


def _key(name: str) -> str:
    return toml(name)


def _value(value: Any) -> str:
    if isinstance(value, dict):
        return "{ " + ", ".join(f"{_key(k)} = {_value(v)}" for k, v in value.items()) + " }"
    if isinstance(value, list):
        return "[" + ", ".join(map(_value, value)) + "]"
    return repr(value) if isinstance(value, float) else toml(value)
