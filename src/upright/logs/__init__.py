"""What did a run do, tick by tick? Written beside the loop by a process of its own, read back whole or torn.

`LogWriter` takes rows from the loop and never holds it up; `read_log` gives back what a file holds up to its first
error; `follow` reads a file that is still being written; `recover` writes what is left of a torn one as a whole file.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

from upright.logs.header import LogHeader, versions
from upright.logs.writer import LogStatus, LogWriter

if TYPE_CHECKING:
    from upright.logs.salvage import recover
    from upright.logs.tail import follow
    from upright.logs.whole import RunEvent, RunLog, read_log

_HOME = {"follow": "tail", "recover": "salvage", "RunEvent": "whole", "RunLog": "whole", "read_log": "whole"}

__all__ = [
    "LogHeader", "LogStatus", "LogWriter", "RunEvent", "RunLog", "follow", "read_log", "recover", "versions",
]  # fmt: skip


def __getattr__(name: str) -> Any:
    """Readers need NumPy, which the writing process does without."""
    if name not in _HOME:
        raise AttributeError(f"module 'upright.logs' has no attribute {name!r}")
    return getattr(import_module(f"upright.logs.{_HOME[name]}"), name)
