"""What of an earlier run still holds?

A finished experiment is kept, and taken up again as long as nothing it stands on has changed.
"""

from __future__ import annotations

import json
from collections.abc import Iterable
from functools import cache
from hashlib import sha256
from pathlib import Path
from typing import Any

from upright.report.page import Chapter
from upright.report.store import as_plain, from_plain, replace_file

FILE = "chapter.json"


@cache
def program() -> str:
    """Digest of the program as it stands: another version, or a changed line, is another experiment."""
    source = Path(__file__).parent.parent
    digest = sha256()
    for path in sorted(source.rglob("*.py")):
        digest.update(path.relative_to(source).as_posix().encode())
        digest.update(path.read_bytes())
    return digest.hexdigest()


def made_of(*parts: object, needs: Iterable[str] = ()) -> str:
    """Digest of what an experiment is made of: the program, its rig and seed, the experiments it builds on."""
    return sha256("\n".join([program(), *map(str, parts), *needs]).encode()).hexdigest()


def keep(folder: Path, digest: str, chapter: Chapter) -> None:
    """Write a finished chapter into its experiment's folder; whole or not at all."""
    content = {"made_of": digest, "chapter": as_plain(chapter)}
    replace_file(folder / FILE, json.dumps(content, ensure_ascii=False, allow_nan=False).encode())


def kept(folder: Path, digest: str) -> Chapter | None:
    """The chapter of an earlier run, or nothing when there is none or it was made of something else."""
    try:
        content: Any = json.loads((folder / FILE).read_text(encoding="utf-8"))
        return from_plain(content["chapter"]) if content["made_of"] == digest else None
    except (OSError, ValueError, KeyError, TypeError):  # none, torn, or another program's: it is made again
        return None
