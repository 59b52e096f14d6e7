"""Options under the names that they had: each is read for one version more, with a warning."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Mapping
from functools import wraps
from typing import Any, TypeVar

V = TypeVar("V", bound=Callable[..., Any])

Now = tuple[str, Callable[[Any], Any]]
"""Name of an option today, and its value made of what was given under the former name."""

LET_GO: Mapping[str, Now] = {
    "tilt": ("start", lambda value: {"theta": value}),
    "push": ("start", lambda value: {"theta_dot": value}),
}


CLUSTER: Mapping[str, Now] = {"cluster": ("workers", lambda value: value)}


def renamed(former: Mapping[str, Now]) -> Callable[[V], V]:
    """Decorator of a verb; values of one option that are mappings are put together."""

    def declare(verb: V) -> V:
        @wraps(verb)
        def called(*given: Any, **options: Any) -> Any:
            for name in former.keys() & options.keys():
                now, made = former[name]
                warnings.warn(
                    f"{verb.__name__}({name}=...) is going: say {now}=... instead.", DeprecationWarning, stacklevel=2
                )
                value = options.pop(name)
                if value is None or value == "":
                    continue
                value = made(value)
                before = options.get(now)
                options[now] = {**before, **value} if isinstance(before, Mapping) else value
            return verb(*given, **options)

        return called  # type: ignore[return-value]

    return declare
