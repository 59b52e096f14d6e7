"""Whose Python code runs here? A study or a fit may name a plant in a file beside it, and to read it is to run it.

A file whose content this user has not agreed to before, at a new path or changed at a known one, runs only when the
person at the terminal says yes; where nobody can answer, with ``--allow-code`` on the command line, `allow_code` in a
program, or ``UPRIGHT_ALLOW_CODE=1``. What was agreed to is remembered by its hash. With ``--no-code``, or
``UPRIGHT_NO_CODE=1``, all such files are refused.
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
_ALLOWED: ContextVar[bool] = ContextVar("allowed", default=False)


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


@contextmanager
def allow_code(allowed: bool = True) -> Generator[None]:
    """Agree to plants in files of their own while this lasts; each is announced and remembered by its hash.

    Examples
    --------
    >>> with allow_code():
    ...     pass  # up.identify("of_a_colleague.toml")
    """
    before = _ALLOWED.set(allowed or _ALLOWED.get())
    try:
        yield
    finally:
        _ALLOWED.reset(before)


def before_running(plant: str, by: Path) -> None:
    """Ask, once for each content, whether `by` (a study or a fit) may run the code of the plant that it names.

    Raises
    ------
    BadInput
        When code is refused, or nobody agreed to it.
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
    if content not in met:
        what = "has changed since it was met here" if where in met else "was not met here before"
        if not _agreed(f"{by} runs the Python code of {file}, which {what}"):
            raise BadInput(
                f"{by} would run the Python code of {file}, which {what}, and nobody agreed to that; read the file, "
                "then say --allow-code (in a program upright.trust.allow_code, or UPRIGHT_ALLOW_CODE=1). It is asked "
                "once for each content."
            )
    _remember(content, where)


def _agreed(what: str) -> bool:
    """Whether this code may run: said beforehand, or by the person at the terminal."""
    if _ALLOWED.get() or os.environ.get("UPRIGHT_ALLOW_CODE", "0") not in ("", "0"):
        if sys.stderr is not None:
            print(f"upright: {what}.", file=sys.stderr)
        return True
    if sys.stdin is None or sys.stderr is None or not (sys.stdin.isatty() and sys.stderr.isatty()):
        return False
    print(f"upright: {what}. Look into it first if it is from somebody else. Run it? [y/N] ", end="", file=sys.stderr)
    sys.stderr.flush()
    return sys.stdin.readline().strip().lower() in ("y", "yes")


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
