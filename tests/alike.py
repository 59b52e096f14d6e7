"""Where two answers differ: values compared field by field, whatever they are made of."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import fields, is_dataclass
from typing import Any

import numpy as np


def differences(a: Any, b: Any, *, rel: float = 1e-6, near: float = 1e-9, at: str = "") -> Iterator[str]:
    """Paths of fields in which two answers differ by more than the tolerances of `math.isclose`."""
    tolerance = {"rel": rel, "near": near}
    if isinstance(a, int | float) and isinstance(b, int | float):
        if not (math.isclose(a, b, rel_tol=rel, abs_tol=near) or (math.isnan(a) and math.isnan(b))):
            yield f"{at}: {a!r} and {b!r}"
    elif isinstance(a, np.ndarray):
        if np.shape(a) != np.shape(b) or not np.allclose(a, b, rtol=rel, atol=near, equal_nan=True):
            yield f"{at}: arrays"
    elif isinstance(a, Mapping):
        for key in {*a, *b}:
            yield from differences(a.get(key, "nothing"), b.get(key, "nothing"), **tolerance, at=f"{at}.{key}")
    elif isinstance(a, tuple | list):
        if len(a) != len(b):
            yield f"{at}: {len(a)} and {len(b)} of them"
        for i, (x, y) in enumerate(zip(a, b, strict=False)):
            yield from differences(x, y, **tolerance, at=f"{at}[{i}]")
    elif is_dataclass(a) and not isinstance(a, type):
        for field in fields(a):
            theirs = getattr(b, field.name, "nothing")
            yield from differences(getattr(a, field.name), theirs, **tolerance, at=f"{at}.{field.name}")
    elif a != b:
        yield f"{at}: {a!r} and {b!r}"
