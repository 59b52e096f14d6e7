"""How work travels: as bytes that carry with them what the other side cannot import.

Functions of a script or notebook go as they are, plants of a user's own file with the text of that file.
"""

from __future__ import annotations

import sys
from functools import cache
from io import BytesIO
from pathlib import Path
from types import FunctionType, ModuleType
from typing import Any

from upright.files import OWN_FILE


def carried(value: Any) -> bytes:
    """A value as it travels."""
    content = BytesIO()
    _carrier()(content).dump(value)
    return content.getvalue()


def unpacked(content: bytes) -> Any:
    """The value that travelled, to or from a worker of ours."""
    import cloudpickle

    return cloudpickle.loads(content)


@cache
def _carrier() -> Any:
    import cloudpickle

    class Carrier(cloudpickle.Pickler):
        def reducer_override(self, obj: Any) -> Any:
            if isinstance(obj, type | FunctionType) and (obj.__module__ or "").startswith(OWN_FILE):
                module = sys.modules[obj.__module__]
                return _of_own_file, (obj.__module__, obj.__qualname__, str(module.__file__), _text(module))
            return super().reducer_override(obj)

    return Carrier


def _text(module: ModuleType) -> str:
    """What stood in the user's file when it was loaded here, or travelled here."""
    if "__text__" not in vars(module):
        vars(module)["__text__"] = Path(str(module.__file__)).read_text(encoding="utf-8")
    return vars(module)["__text__"]


def _of_own_file(name: str, what: str, file: str, text: str) -> Any:
    """Something that a user's file defines, which is read here when it has not been."""
    import linecache

    module = sys.modules.get(name)
    if module is None or _text(module) != text:
        module = ModuleType(name)
        module.__file__, vars(module)["__text__"] = file, text
        sys.modules[name] = module
        linecache.cache[file] = (len(text), None, text.splitlines(keepends=True), file)
        exec(compile(text, file, "exec"), vars(module))
    value: Any = module
    for part in what.split("."):
        value = getattr(value, part)
    return value
