"""What a verb is handed, as the object that it stands for: a fit, a rig, a study or a plant, in memory or as a file."""

from __future__ import annotations

import os
from pathlib import Path
from typing import TYPE_CHECKING, Any

from upright.errors import BadInput
from upright.verbs.answer import Answer

if TYPE_CHECKING:
    from upright.rig import Rig
    from upright.study.stored_fit import StoredFit

SAVED = "fit.json"
"""What a command calls a fit that is in memory, once it is saved."""


def rig_of(source: Any, verb: str, *, seed: int = 0, draws: int = 200) -> Rig:
    """The rig that a source tells of.

    Parameters
    ----------
    source : path, Fit, Study, Plant or Rig
        A path is that of a fit.json, of its folder, of a study, or of an MJCF file.
    verb : str
        Who asks, for the sentence.
    seed, draws : int
        Of the rigs that are drawn from a fit's covariance, and how many.

    Raises
    ------
    BadInput
        When it is none of these, or its file cannot be read.
    """
    from upright.physics import Plant
    from upright.rig import Rig
    from upright.study import stored_rig
    from upright.study.load import Study
    from upright.verbs.model.fit import FitAnswer

    if isinstance(source, Rig):
        return source
    if isinstance(source, FitAnswer):
        return source.fitted.rig(seed=seed, draws=draws)
    if isinstance(source, Study):
        return source.rig
    if isinstance(source, Plant):
        return Rig(plant=source)
    return stored_rig.read_stored_rig(_file(source, verb), seed=seed, draws=draws)


def fitted_of(source: Any, verb: str) -> StoredFit:
    """The fitted model of a fit in memory, of a fit.json or of its folder.

    Raises
    ------
    BadInput
        When it is none of these.
    """
    from upright.study.stored_fit import StoredFit, read_fit
    from upright.verbs.model.fit import FitAnswer

    if isinstance(source, StoredFit):
        return source
    if isinstance(source, FitAnswer):
        return source.fitted
    if not (isinstance(source, str | os.PathLike | type) or _written(source)):
        raise BadInput(
            f"{verb} takes what up.identify answered, a fit.json or its folder, got {type(source).__name__}."
        )
    path = _file(source, verb)
    return read_fit(path / SAVED if path.is_dir() else path)


def called(source: Any) -> str:
    """How a command would name a source: its path, or the file that it is saved to."""
    from upright.report.symbols import typed

    written = _written(source)
    return typed(Path(source)) if isinstance(source, str | os.PathLike) else typed(written) if written else SAVED


def _written(source: Any) -> Path | None:
    """The fit.json that an answer wrote."""
    files = source.files if isinstance(source, Answer) else ()
    return next((f for f in files if f.name == SAVED), None)


def _file(source: Any, verb: str) -> Path:
    if isinstance(source, str | os.PathLike):
        return Path(source)
    written = _written(source)
    if written is not None:
        return written
    if isinstance(source, type):
        raise BadInput(f"{verb} needs numbers: {source.__name__}(...), or what up.identify answered.")
    from upright.identification import Fit

    alone = " Give the whole answer of up.identify, without .value." if isinstance(source, Fit) else ""
    raise BadInput(
        f"{verb} takes what up.identify answered, a fit.json or its folder, a study, an MJCF file, a rig or a plant "
        f"with numbers, got {type(source).__name__}.{alone}"
    )
