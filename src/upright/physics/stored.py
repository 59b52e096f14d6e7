"""Equations of motion as files of this package, so that nothing needs SymPy at run time."""

from __future__ import annotations

import json
from dataclasses import asdict
from pathlib import Path
from typing import Any

from upright.physics.equations import Derived, DryJoint

FOLDER = Path(__file__).parent / "generated"


def stored(name: str) -> Derived | None:
    """Equations of a file's name, None where there is no such file."""
    path = FOLDER / f"{name}.json"
    if not path.is_file():
        return None
    content = _tuples(json.loads(path.read_text(encoding="utf-8")))
    joints = tuple(DryJoint(**joint) for joint in content.pop("joints"))
    return Derived(**content, joints=joints)


def file_text(derived: Derived) -> str:
    """What `stored` reads again."""
    return json.dumps(asdict(derived), indent=1) + "\n"


def _tuples(value: Any) -> Any:
    if isinstance(value, list):
        return tuple(_tuples(v) for v in value)
    return {k: _tuples(v) for k, v in value.items()} if isinstance(value, dict) else value
