"""The function that stands behind a command of the command line."""

from __future__ import annotations

from collections.abc import Callable
from importlib import import_module
from pkgutil import iter_modules
from typing import Any

from upright import verbs


def verb(command: str) -> Callable[..., Any] | None:
    """Namesake of a command, wherever among the verbs it is written; None where there is none."""
    name = command.replace("-", "_")
    for module in iter_modules(verbs.__path__):
        found = getattr(import_module(f"upright.verbs.{module.name}"), name, None)
        if callable(found) and found.__module__ == f"upright.verbs.{module.name}":
            return found
    return None
