"""The forms in which a verb takes a rig, a fit, runs and a law, as its signature names them.

`handover` makes one object of each.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

    from upright.experiments.frequency_1b.run import FrequencyRun
    from upright.files import PathLike
    from upright.laws import Law, Rule
    from upright.physics import Plant
    from upright.rig import Rig
    from upright.study.load import Study
    from upright.study.stored_fit import StoredFit
    from upright.verbs.answer import Answer
    from upright.verbs.linear.feedback import Gains
    from upright.verbs.model.fit import FitAnswer
    from upright.verbs.model.frequency import LoggedResponse
    from upright.verbs.values import Log

    FitLike = PathLike | FitAnswer | Answer[FrequencyRun | LoggedResponse] | StoredFit
    """A fit: its fit.json or the folder of it, or what `identify` or `frequency` answered."""
    RigLike = FitLike | Rig | Study | Plant
    """A rig: a fit, a study or its file, a MuJoCo model's file, a rig, or a plant with its numbers."""
    PlantLike = RigLike | type[Plant] | str
    """What a log is of: a rig, or the class or the name of its plant."""
    StudyLike = Log | Study | FitAnswer
    """Runs and what is asked of them: a study or its file, a log, or a fit, which has its study."""
    LawLike = Gains | Law | Rule | ArrayLike
    """What closes a loop: gains, an array of them, or a law."""
