"""Files that the owner of a rig begins with: what nobody else can know stands in them as a question."""

from __future__ import annotations

from pathlib import Path

from upright.files import replace_file
from upright.study.text import toml

BLANK = Path(__file__).parent / "blank"
"""Holds them; the port of a rig stands in them as PORT."""


def write_templates(folder: Path, port: str) -> Path:
    """RIG.toml and study.toml of a rig at a port, where the folder has none; the first of them."""
    for blank in BLANK.glob("*.toml"):
        if not (path := folder / blank.name).exists():
            replace_file(path, blank.read_text(encoding="utf-8").replace('"PORT"', toml(port)).encode())
    return folder / "RIG.toml"
