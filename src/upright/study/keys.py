"""What may a study say? Every key with its form and meaning, of ``keys.toml``; the check and `docs/reference/study.md`
both come from here.
"""

from __future__ import annotations

import math
import tomllib
from pathlib import Path
from typing import NamedTuple

from upright.identification.model.runs import FOR_GROUPS, PER_RUN
from upright.physics.actuator import ACTUATOR
from upright.readers.reader import READERS


class Key(NamedTuple):
    """One key of a study: name, how its value is written, what it means."""

    name: str
    form: str
    meaning: str


def _sections() -> dict[str, tuple[str, tuple[Key, ...]]]:
    stated = tomllib.loads(Path(__file__).with_name("keys.toml").read_text(encoding="utf-8"))
    lists = {"{per_run}": PER_RUN, "{for_groups}": FOR_GROUPS, "{readers}": READERS.own}
    out: dict[str, tuple[str, tuple[Key, ...]]] = {}
    for section, table in stated.items():
        heading: str = table.pop("heading")
        keys: list[Key] = []
        for name, (form, meaning) in table.items():
            for mark, listed in lists.items():
                meaning = meaning.replace(mark, ", ".join(listed))
            keys.append(Key(name, form, meaning))
        out["" if section == "study" else section] = heading, tuple(keys)
        if section == "actuator":
            out[section] = heading, (*_of_actuator(), *keys)
        if section == "runs":
            out["defaults"] = "[defaults]", tuple(key for key in keys if key.name not in ("label", "file"))
    return out


def _of_actuator() -> list[Key]:
    """Numbers of the drive, as physics has them."""
    return [
        Key(
            name.partition(".")[2],
            '"2 N/V" or a table as above' if name.endswith("gain") else "value",
            f"{what.meaning}; {'none' if math.isinf(what.default) else f'{what.default:g}'} if omitted",
        )
        for name, what in ACTUATOR.items()
    ]


SECTIONS = _sections()
"""Sections by their short name: heading and keys."""


def names(section: str) -> tuple[str, ...]:
    """Names of the keys of one section."""
    return tuple(key.name for key in SECTIONS[section][1])


def reference() -> str:
    """Markdown tables of all keys."""
    parts: list[str] = []
    for section, (heading, keys) in SECTIONS.items():
        if section == "defaults":
            parts.append("### `[defaults]`\n\nEvery key of `[[runs]]` except `label` and `file`.")
            continue
        title = heading if " " in heading and not heading.startswith("[") else f"`{heading}`"
        rows = "\n".join(f"| `{key.name}` | `{key.form}` | {key.meaning} |" for key in keys)
        parts.append(f"### {title}\n\n| key | for example | meaning |\n|---|---|---|\n{rows}")
    return "\n\n".join(parts) + "\n"


def write_reference(page: str) -> str:
    """A page whose part after the mark is replaced by the tables."""
    head, mark, _ = page.partition("<!-- keys")
    note = "<!-- keys: written by python -m upright.study.keys -->"
    return f"{head}{note if mark else ''}\n\n{reference()}"


if __name__ == "__main__":
    import sys
    from pathlib import Path

    file = Path(sys.argv[1] if len(sys.argv) > 1 else "docs/reference/study.md")
    file.write_text(write_reference(file.read_text(encoding="utf-8")), encoding="utf-8")
