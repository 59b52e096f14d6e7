"""Options and attributes under their former names: each is read for one version more, with a warning."""

from __future__ import annotations

import inspect
import warnings
from collections.abc import Callable, Mapping
from functools import wraps
from typing import Any, TypeVar

V = TypeVar("V", bound=Callable[..., Any])

Now = tuple[str, Callable[[Any], Any]]
"""Name of an option today, and its value made of the one under the former name."""

LET_GO: Mapping[str, Now] = {
    "tilt": ("start", lambda value: {"theta": value}),
    "push": ("start", lambda value: {"theta_dot": value}),
}


WORN: Mapping[str, Now] = {"worn": ("nonideal", lambda value: value)}
CLUSTER: Mapping[str, Now] = {"cluster": ("workers", lambda value: value)}
LIE: Mapping[str, Now] = {"lie": ("fault", lambda value: value)}
DRAWN: Mapping[str, Now] = {"plot": ("out", lambda value: "." if value else None)}


def renamed(former: Mapping[str, Now]) -> Callable[[V], V]:
    """Decorator of a verb or a class; values of one option that are mappings are put together."""

    def declare(verb: V) -> V:
        if isinstance(verb, type):
            verb.__init__ = declare(verb.__init__)  # type: ignore[reportArgumentType]
            return verb  # type: ignore[return-value]
        name_of_verb = verb.__qualname__.removesuffix(".__init__")

        @wraps(verb)
        def called(*args: Any, **options: Any) -> Any:
            for name in former.keys() & options.keys():
                now, made = former[name]
                warnings.warn(
                    f"{name_of_verb}({name}=...) is going: say {now}=... instead.",
                    DeprecationWarning,
                    stacklevel=outside(),
                )
                value = options.pop(name)
                if value is None or value == "":
                    continue
                value, before = made(value), options.get(now)
                if isinstance(before, Mapping):
                    options[now] = {**before, **value}
                elif before is None:
                    options[now] = value
            return verb(*args, **options)

        return called  # type: ignore[return-value]

    return declare


def outside() -> int:
    """Level, for `warnings.warn`, of the first caller that is not of this package."""
    frame, level = inspect.currentframe(), 0
    while frame is not None and frame.f_globals.get("__name__", "").partition(".")[0] == "upright":
        frame, level = frame.f_back, level + 1
    return level


def former(now: str) -> property:
    """Attribute under a former name, which reads `now` and warns."""

    def read(self: Any) -> Any:
        warnings.warn(
            f"this attribute of {type(self).__name__} is going: read .{now}.", DeprecationWarning, stacklevel=2
        )
        return getattr(self, now)

    return property(read)
