"""The function that stands behind a command of the command line."""

from __future__ import annotations

from collections.abc import Callable
from importlib import import_module
from pkgutil import walk_packages
from typing import Any

from upright import verbs


def verb(command: str) -> Callable[..., Any] | None:
    """Namesake of a command, wherever among the verbs it is written; None where there is none."""
    name = command.replace("-", "_")
    for module in walk_packages(verbs.__path__, "upright.verbs."):
        found = getattr(import_module(module.name), name, None)
        if callable(found) and found.__module__ == module.name:
            return found
    return None
