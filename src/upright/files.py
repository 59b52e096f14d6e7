"""Files of a person: read when they are files, written whole or not at all, and never over what was just read.

And JSON as this program hands it on: plain values, null where a number is not finite.
"""

from __future__ import annotations

import json
import math
import os
import stat
from collections.abc import Callable, Generator, Mapping
from contextlib import contextmanager, suppress
from contextvars import ContextVar
from dataclasses import dataclass, field, is_dataclass
from functools import wraps
from pathlib import Path
from typing import Any, ParamSpec, TypeVar

from upright.errors import BadInput

P = ParamSpec("P")
R = TypeVar("R")
PathLike = str | os.PathLike[str]

LARGEST = 2048
"""Most MB of a file that is read whole; a log of ten million rows and ten columns has half of that."""


def regular(path: PathLike) -> os.stat_result:
    """What is known of a regular file, before it is opened.

    A pipe waits for a writer that never comes, and ``/dev/zero`` never ends.

    Raises
    ------
    BadInput
        When it is a folder, a pipe, a socket or a device.
    FileNotFoundError, OSError
        When there is none, or nobody may know.
    """
    about = os.stat(path)
    if not stat.S_ISREG(about.st_mode):
        raise BadInput(_no_file(path, about.st_mode))
    return about


def read_bytes(path: PathLike, *, most: int = LARGEST) -> bytes:
    """Content of a regular file of at most so many MB.

    Raises
    ------
    BadInput
        When it is no regular file, or larger.
    FileNotFoundError, OSError
        When there is none, or it may not be read.
    """
    about = regular(path)
    if about.st_size > most << 20:
        raise BadInput(
            f"'{path}' holds {about.st_size / (1 << 20):.0f} MB and is read whole, which is done up to {most} MB;"
            " name another file, or cut it."
        )
    call = _CALL.get()
    if call is not None and _identity(about) not in call.written:
        call.read.add(_identity(about))
    return Path(path).read_bytes()


def read_text(path: PathLike, *, most: int = 64, encoding: str = "utf-8") -> str:
    r"""Text of a regular file of at most so many MB, with ``\n`` line ends; see `read_bytes`.

    Raises
    ------
    UnicodeDecodeError
        When it is no text.
    """
    return read_bytes(path, most=most).decode(encoding).replace("\r\n", "\n").replace("\r", "\n")


def _no_file(path: PathLike, mode: int) -> str:
    if stat.S_ISDIR(mode):
        return f"'{path}' is a folder; name the file inside it."
    kinds = ((stat.S_ISFIFO, "a pipe"), (stat.S_ISSOCK, "a socket"))
    kind = next((words for is_kind, words in kinds if is_kind(mode)), "a device")
    return f"'{path}' is {kind}, and a regular file is needed; save what it gives to a file, and name that."


@dataclass
class _Call:
    """Files that a call has read, and those it has written itself, as device and number."""

    read: set[tuple[int, int]] = field(default_factory=set[tuple[int, int]])
    written: set[tuple[int, int]] = field(default_factory=set[tuple[int, int]])


_CALL: ContextVar[_Call | None] = ContextVar("call", default=None)


def _identity(about: os.stat_result) -> tuple[int, int]:
    return about.st_dev, about.st_ino


def keeps_its_inputs(verb: Callable[P, R]) -> Callable[P, R]:
    """A call that refuses to write over any file it has read, whatever the names of the two."""

    @wraps(verb)
    def inside(*args: P.args, **kwargs: P.kwargs) -> R:
        before = _CALL.set(_CALL.get() or _Call())
        try:
            return verb(*args, **kwargs)
        finally:
            _CALL.reset(before)

    return inside


def check_output(path: PathLike, *inputs: PathLike) -> Path:
    """A path that may be written: no device, no folder, none of the `inputs` and nothing that this call has read.

    Raises
    ------
    BadInput
        When it is one.
    """
    path = Path(path)
    try:
        about = path.stat()
    except OSError:  # there is none yet, or writing it will tell
        return path
    if not stat.S_ISREG(about.st_mode):
        raise BadInput(_no_file(path, about.st_mode))
    call = _CALL.get()
    read = {_identity(os.stat(p)) for p in inputs if os.path.exists(p)} | (call.read if call else set())
    if _identity(about) in read:
        raise BadInput(f"'{path}' is read by this call and would be overwritten; choose another place with -o.")
    return path


@contextmanager
def whole_file(path: PathLike) -> Generator[Path]:
    """Where to write a file, which is put into its place at the end: nobody meets half of it, no input is replaced.

    A file that is replaced keeps its permissions.

    Raises
    ------
    BadInput
        When it may not be written; see `check_output`.
    """
    path = check_output(path)
    path.parent.mkdir(parents=True, exist_ok=True)
    half, mode = _aside(path)
    try:
        yield half
        if mode is not None:
            with suppress(OSError):  # not every file system has permissions
                half.chmod(mode)
        half.replace(path)
    finally:
        half.unlink(missing_ok=True)
    call = _CALL.get()
    if call is not None:
        call.written.add(_identity(path.stat()))


def _aside(path: Path) -> tuple[Path, int | None]:
    """A new empty file beside another, and the permissions that it is to have in the end, where it replaces one.

    Its name is unpredictable, and a link or a file that is there already is refused, not followed. Unlike those of
    `tempfile.mkstemp`, its permissions are those of any new file, but for one that replaces a more private one.
    """
    mode = None
    with suppress(OSError):  # there is none yet
        mode = stat.S_IMODE(path.stat().st_mode) & 0o777 if os.name == "posix" else None
    half = path.with_name(f".{path.name[:32]}.{os.urandom(8).hex()}.part")
    os.close(os.open(half, os.O_CREAT | os.O_EXCL | os.O_WRONLY, 0o666 if mode is None else mode | stat.S_IWUSR))
    return half, mode


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
    with whole_file(path) as half:
        half.write_bytes(content)
    return path
