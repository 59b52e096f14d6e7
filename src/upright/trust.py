"""Whose Python code runs here? A study or a fit may name a plant in a file beside it, and to read it is to run it.

A file whose content this user has not met before, at a new path or changed at a known one, is announced on stderr
before it runs. With ``--no-code`` on the command line, or ``UPRIGHT_NO_CODE=1``, such files are refused.
"""

from __future__ import annotations

import os
import sys
from collections.abc import Generator
from contextlib import contextmanager, suppress
from contextvars import ContextVar
from pathlib import Path

from upright.errors import BadInput
from upright.files import read_bytes

_REFUSED: ContextVar[bool] = ContextVar("refused", default=False)


@contextmanager
def no_code(refused: bool = True) -> Generator[None]:
    """Refuse plants in files of their own while this lasts.

    Examples
    --------
    >>> with no_code():
    ...     pass  # up.identify("from_elsewhere.toml")
    """
    before = _REFUSED.set(refused or _REFUSED.get())
    try:
        yield
    finally:
        _REFUSED.reset(before)


def before_running(plant: str, by: Path) -> None:
    """Say, once for each content, that `by` (a study or a fit) runs the code of the plant that it names.

    Raises
    ------
    BadInput
        When code is refused.
    """
    from hashlib import sha256

    if ".py:" not in plant:  # as `physics.find` tells a file from a name
        return
    name, _, _ = plant.rpartition(":")
    if _REFUSED.get() or os.environ.get("UPRIGHT_NO_CODE", "0") not in ("", "0"):
        raise BadInput(
            f"{by} would run the Python code of {name}, and --no-code (or UPRIGHT_NO_CODE) refuses that; read the file,"
            " then run without it."
        )
    file = by.parent / name
    try:
        content = sha256(read_bytes(file, most=4)).hexdigest()
    except OSError:
        return  # who reads it says so
    where = sha256(str(file.resolve()).encode(errors="replace")).hexdigest()
    met = _met()
    if content not in met and sys.stderr is not None:
        what = "has changed since it was met here" if where in met else "was not met here before"
        print(
            f"upright: {by} runs the Python code of {file}, which {what}; look into it if it is from somebody else"
            " (--no-code refuses it).",
            file=sys.stderr,
        )
    _remember(content, where)


_SINCE_START: set[str] = set()


def _folder() -> Path:
    from platformdirs import user_cache_dir

    return Path(os.environ.get("UPRIGHT_CACHE") or user_cache_dir("upright")) / "met"


def _met() -> set[str]:
    """Digests of content and path of every file met before."""
    with suppress(OSError):
        return _SINCE_START | {path.name for path in _folder().iterdir()}
    return _SINCE_START


def _remember(*digests: str) -> None:
    """Empty files called after the digests; without a writable folder the announcement comes again next time."""
    _SINCE_START.update(digests)
    with suppress(OSError):
        _folder().mkdir(parents=True, exist_ok=True)
        for digest in digests:
            (_folder() / digest).touch()
