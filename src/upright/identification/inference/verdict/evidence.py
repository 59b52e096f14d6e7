"""What a fit came to, and the three questions that are asked of it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from upright.identification.inference.ceiling import Judged
from upright.identification.inference.loop import Standing
from upright.identification.inference.ties import Tie
from upright.identification.model.fit import Assumption, Estimate, RunScore
from upright.identification.model.grey_box import GreyBox

PREDICTS, USABLE, LOOP = "Does it predict?", "Can its numbers be used?", "Is it good enough for the loop?"


@dataclass(frozen=True, kw_only=True)
class Evidence:
    """What a fit came to.

    `unseen` and `conventions` are sentences on what the data cannot see and on signs or zeros that look wrong. The
    residuals are autocorrelated over `memory` seconds, the motion takes `period` seconds for one period. `standing`
    says how a rig within the intervals stands upright, if this plant can, `judged` how far ahead runs count that a
    filter predicts, `driven` whether a command acted in a run.
    Numbers that are `bent` leave their intervals with a dead time of the drive that would explain the runs better.
    Runs that are `lost` run away at the numbers or as soon as one is moved; `nothing` says that the runs are missed by
    more than they vary, `ties` which pairs of numbers cannot be separated, `missing` in sentences what the runs show
    and the model lacks, `alike` in one which other answers explain them as well. Runs that were `refitted` were
    predicted first, without them, and count as predicted.
    """

    rig: GreyBox
    runs: Mapping[str, RunScore]
    estimates: Mapping[str, Estimate]
    unseen: Sequence[str]
    conventions: Sequence[str]
    assumptions: Sequence[Assumption]
    converged: bool
    interrupted: bool
    memory: float
    period: float
    standing: Standing | None
    judged: Judged | None = None
    driven: bool = True
    bent: Sequence[str] = ()
    lost: Sequence[str] = ()
    nothing: bool = False
    ties: Sequence[Tie] = ()
    missing: Sequence[str] = ()
    alike: str = ""
    refitted: Sequence[str] = ()
