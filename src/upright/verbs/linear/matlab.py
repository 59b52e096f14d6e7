"""A linear model that MATLAB saved: `from_matlab`."""

from __future__ import annotations

from pathlib import Path
from typing import Any, cast

import numpy as np

from upright.errors import BadInput, nearest
from upright.files import PathLike, read_bytes
from upright.readers.formats.matlab import Variables, variables
from upright.readers.source import Source
from upright.systems import StateSpace

_HOW = "[A, B, C, D, Ts] = ssdata(sys); save('model.mat', 'A', 'B', 'C', 'D', 'Ts', '-v7')"


def from_matlab(file: PathLike, name: str | None = None) -> StateSpace:
    """Linear model of a MAT file: variables or a structure with the fields A, B, C, D and Ts, as `ssdata` gives them.

    MATLAB stores `ss`, `idss` and `idgrey` objects in a form that only MATLAB reads. Save their matrices::

        [A, B, C, D, Ts] = ssdata(sys);                  % of an idgrey or idss model too
        save('model.mat', 'A', 'B', 'C', 'D', 'Ts', '-v7')

    or the structure ``m = struct(A=sys.A, B=sys.B, C=sys.C, D=sys.D, Ts=sys.Ts)``, with ``StateName``, ``InputName``
    and ``OutputName`` where they are to be kept.

    Parameters
    ----------
    file : path
        MAT file of version 5 to 7.
    name : str, optional
        Of the structure, where the file holds several.

    Returns
    -------
    StateSpace
        Sampled where Ts is above 0, with its `dt` [s].

    Raises
    ------
    BadInput
        When the file cannot be read, holds no such matrices or several structures, or the sizes do not fit.
    """
    path = Path(file)
    content = variables(Source(file=path.name, data=read_bytes(path)))
    fields = _fields(content, name, path.name)
    unreadable = [key for key in ("A", "B") if not isinstance(fields.get(key), np.ndarray)]
    if unreadable:
        raise BadInput(f"'{path.name}' holds no matrix {' and no matrix '.join(unreadable)}; in MATLAB: {_HOW}.")
    period = float(np.ravel(fields.get("Ts", 0.0))[0])
    outputs: dict[str, Any] = {key: fields[key] for key in ("C", "D") if key in fields}
    return StateSpace(
        fields["A"], np.atleast_2d(fields["B"]), **outputs, dt=period if period > 0 else None,
        states=_names(fields.get("StateName")), inputs=_names(fields.get("InputName")),
        outputs=_names(fields.get("OutputName")),
    )  # fmt: skip


def _fields(content: Variables, name: str | None, file: str) -> Variables:
    """Variables of a file, or fields of its one structure with an A, or of the one named."""
    models = {key: value for key, value in content.items() if isinstance(value, dict) and "A" in value}
    if name:
        if name not in models:
            raise BadInput(f"'{file}' holds no structure '{name}' with a field A; {nearest(name, models)}.")
        return models[name]
    if "A" in content or not models:
        return content
    if len(models) > 1:
        raise BadInput(f"'{file}' holds several models; give the name of one: {', '.join(models)}.")
    return next(iter(models.values()))


def _names(value: Any) -> tuple[str, ...]:
    """Texts of a cell, or one text; empty where there is none, or an empty one."""
    texts = [value] if isinstance(value, str) else cast(list[Any], value) if isinstance(value, list) else []
    return tuple(map(str, texts)) if all(texts) else ()
