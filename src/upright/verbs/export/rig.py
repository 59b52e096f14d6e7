"""An identified rig, written for other simulators."""

from __future__ import annotations

import os
from pathlib import Path
from typing import TYPE_CHECKING, Any

from upright.errors import BadInput
from upright.verbs.export.exported import Exported, exported
from upright.verbs.handover import SAVED, called, rig_of

if TYPE_CHECKING:
    from upright.exports.targets import RigTarget


def write_rig(source: Any, target: RigTarget, at: Path | None, limit: float | None) -> Exported:
    """The rig of a source in one form, its files in a folder."""
    from upright.exports.targets import TARGETS, RigExport, RigTarget
    from upright.report.page import resting_on

    if limit is not None and not target.limited:
        ours = (t for t in TARGETS.own.values() if isinstance(t, RigTarget) and t.limited)
        raise BadInput(f"the limit is that of the fit; --limit is for {', '.join(t.name for t in ours)}.")
    rig = rig_of(source, "export", draws=target.draws)
    export = RigExport(
        rig=rig, called=called(source), folder=at or Path(), store=lambda: _saved(source, at), limit=limit
    )
    contents, page = target.write(export)
    return exported(contents, resting_on(page, rig.basis), at, target.name)


def _saved(source: Any, at: Path | None) -> Path:
    """The fit.json of a source; of a fit in memory it is written now."""
    from upright.verbs.model.fit import FitAnswer

    if isinstance(source, FitAnswer):
        if at is None:
            raise BadInput("an environment reads its fit from a file beside it; name a folder for both, out='export'.")
        return source.save(at / SAVED)
    if not isinstance(source, str | os.PathLike):
        raise BadInput("an environment draws its rigs from a fit; export what up.identify answered, or a fit.json.")
    path = Path(source)
    return path / SAVED if path.is_dir() else path
