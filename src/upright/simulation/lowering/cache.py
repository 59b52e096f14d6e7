"""Machine code kept between processes, in a folder that only its owner can write to and checked before it is loaded.

A file's name is a hash of everything that its code depends on, so nothing goes stale. Whatever goes wrong with files
costs the time to compile again, and nothing else.
"""

from __future__ import annotations

import hashlib
import os
import stat
import tempfile
from collections.abc import Callable
from functools import cache
from pathlib import Path

_CHECK = 32  # bytes of a SHA-256


@cache
def cache_folder() -> Path | None:
    """Folder of the machine code: below ``UPRIGHT_CACHE``, else in the user's cache; None where neither will do."""
    from platformdirs import user_cache_dir

    for place in filter(None, [os.environ.get("UPRIGHT_CACHE"), user_cache_dir("upright")]):
        path = Path(place) / "code"
        try:
            path.mkdir(mode=0o700, parents=True, exist_ok=True)
            if not _only_ours(path.lstat()):
                path.chmod(0o700)  # refused for another user's folder
            if path.is_dir() and not path.is_symlink() and _only_ours(path.lstat()):
                return path
        except OSError:
            continue
    return None


def _only_ours(status: os.stat_result) -> bool:
    """Whether nobody but this user can write there; on Windows the user's profile sees to that."""
    return not hasattr(os, "getuid") or (status.st_uid == os.getuid() and not status.st_mode & 0o022)


@cache
def lowered_by() -> str:
    """What machine code depends on besides its text: this processor, LLVM, and how the text is lowered."""
    from upright.simulation.lowering import machine

    own = [path.read_bytes() for path in sorted(Path(__file__).parent.glob("*.py"))]
    return f"{machine.identity()} {hashlib.sha256(b''.join(own)).hexdigest()}"


def key(*parts: str) -> str:
    """Name of what depends on these texts."""
    return hashlib.sha256("\0".join(parts).encode()).hexdigest()[:40]


def code(name: str, compiled: Callable[[], bytes]) -> bytes:
    """What was kept under a name; where there is nothing, what is compiled now, which is kept."""
    content = cached_code(name)
    if content is None:
        content = compiled()
        keep_code(name, content)
    return content


def cached_code(name: str) -> bytes | None:
    """What was kept under a name; None when there is nothing, or not what was written."""
    place = cache_folder()
    if place is None:
        return None
    try:
        # a link planted there is not followed, and what is opened is what is examined
        descriptor = os.open(place / name, os.O_RDONLY | getattr(os, "O_NOFOLLOW", 0) | getattr(os, "O_BINARY", 0))
        with os.fdopen(descriptor, "rb") as file:
            status = os.fstat(descriptor)
            if not stat.S_ISREG(status.st_mode) or not _only_ours(status):
                return None
            content = file.read()
    except OSError:
        return None
    code = content[_CHECK:]
    return code if content[:_CHECK] == _check(name, code) else None


def keep_code(name: str, code: bytes) -> None:
    """Keep code under a name, written aside and moved so that none sees half of it; not where there is no room."""
    place = cache_folder()
    if place is None:
        return
    aside = ""
    try:
        descriptor, aside = tempfile.mkstemp(dir=place, suffix=".tmp")
        with os.fdopen(descriptor, "wb") as file:
            file.write(_check(name, code) + code)
        os.replace(aside, place / name)
    except OSError:  # a full disk; Windows, while another process has the same file open
        if aside:
            Path(aside).unlink(missing_ok=True)


def _check(name: str, code: bytes) -> bytes:
    """The name is part of it: a file moved to another name is not what was written there."""
    return hashlib.sha256(name.encode() + code).digest()
