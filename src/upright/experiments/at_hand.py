"""Which experiments can be made on a rig at hand, and what they ask of the person beside it?"""

from __future__ import annotations

from pathlib import Path
from typing import Any

from upright.basis import Basis
from upright.errors import BadInput
from upright.experiments.hands_on.loaded import kind_of, run_loaded
from upright.experiments.hands_on.rig import RigAtHand
from upright.experiments.hands_on.studies import can_identify
from upright.experiments.laboratory import Experiment, ExperimentInput
from upright.physics import Plant
from upright.quantities import with_unit
from upright.report.page import Chapter, resting_on
from upright.rig.makes import MAKES, SHAFTS


def experiments_for(rig: RigAtHand, name: str) -> tuple[Experiment, ...]:
    """The experiments that a rig can have, which is asked for by this name.

    Raises
    ------
    BadInput
        When there is none.
    """
    plant, makes = rig.model.plant, (name,)
    pendulum = _pendulum(plant)
    loaded = Experiment(key="1a", part_of="1", title="Added loads", makes=makes, needs=(), seconds=15.0,
                        tell=_loaded)  # fmt: skip
    hanging = Experiment(key="1b", part_of="1", title="Frequency response", makes=makes, needs=("1a",), seconds=40.0,
                         tell=_hanging)  # fmt: skip
    upright = Experiment(key="2", part_of="2", title="Holding it upright", makes=makes, needs=("1b",), seconds=30.0,
                         tell=_upright)  # fmt: skip
    swing_up = Experiment(key="2b", part_of="2", title="Swinging up and catching", makes=makes, needs=("1b",),
                          seconds=10.0, tell=_swing_up)  # fmt: skip
    shaft = Experiment(key="3", part_of="3", title="Tracking through a flexible shaft", makes=makes, needs=("1b",),
                       seconds=30.0, tell=_tracking)  # fmt: skip
    swings = Experiment(key="4", part_of="4", title="Large free swing", makes=makes, needs=("1b",), seconds=15.0,
                        tell=_swings)  # fmt: skip
    out = [loaded] if kind_of(plant) and rig.file.added else []
    out += [hanging] if can_identify(rig) else []
    out += [upright, swing_up] if pendulum else []
    out += [shaft] if _shaft(plant) else []
    out += [swings] if pendulum and can_identify(rig) else []
    if not out:
        raise BadInput(
            f"{rig.file.path} names a fit of a rig with neither pendulum nor shaft; identification begins with a "
            "study: name that."
        )
    return tuple(out)


def _pendulum(plant: Plant) -> bool:
    return "inverted" in plant.equilibria and len(plant.coordinates) == 2


def _shaft(plant: Plant) -> bool:
    return any(isinstance(plant, type(MAKES[key].plant)) for key in SHAFTS)


def _fit(at: ExperimentInput) -> Path:
    """That of experiment 1b, or the one that describes the rig."""
    known = _at(at).file.known
    return at.fit if known is None or can_identify(_at(at)) else known


def _at(given: ExperimentInput) -> RigAtHand:
    assert given.hands is not None  # as the table says
    return given.hands


def _loaded(at: ExperimentInput) -> tuple[Chapter, bool]:
    from upright.experiments.hands_on.chapters import loaded_chapter

    return loaded_chapter(run_loaded(_at(at), at.folder, at.progress), at.folder), True


def _hanging(at: ExperimentInput) -> tuple[Chapter, bool]:
    from upright.experiments.hands_on.chapters import hanging_chapter
    from upright.experiments.hands_on.hanging import run_hanging

    rig = _at(at)
    known = _found(at, "1a", rig.model.plant.names()[0]) if kind_of(rig.model.plant) else {}
    done = run_hanging(rig, at.folder, at.progress, known)
    return hanging_chapter(done, at.folder, rig.true_values), not done.fit.interrupted


def _upright(at: ExperimentInput) -> tuple[Chapter, bool]:
    from upright.experiments.hands_on.upright import run_upright
    from upright.experiments.regulation_2.chapter import chapter

    done = run_upright(_at(at), _fit(at), at.seed, at.folder, at.progress, at.stopped)
    return _performed(at, chapter(done), done.rig.basis), not done.interrupted


def _swing_up(at: ExperimentInput) -> tuple[Chapter, bool]:
    from upright.experiments.hands_on.upwards import run_upwards
    from upright.experiments.swing_up_2b.chapter import chapter

    done = run_upwards(_at(at), _fit(at), at.folder, at.progress, at.stopped)
    return _performed(at, chapter(done), done.model.basis), not at.stopped()


def _tracking(at: ExperimentInput) -> tuple[Chapter, bool]:
    from upright.experiments.hands_on.shaft import run_shaft
    from upright.experiments.tracking_3.chapter import chapter

    done = run_shaft(_at(at), _fit(at), at.folder, at.progress, at.stopped)
    return _performed(at, chapter(done), done.model.basis), not done.interrupted


def _performed(at: ExperimentInput, chapter: Chapter, basis: Basis) -> Chapter:
    """The chapter, which says so where no hardware is driven: a twin, or a replay."""
    performed = _at(at).file.performed
    return resting_on(chapter, basis, performed) if performed else chapter


def _swings(at: ExperimentInput) -> tuple[Chapter, bool]:
    from upright.experiments.hands_on.chapters import fit_chapter
    from upright.experiments.hands_on.swings import carrier_of, run_swings

    rig = _at(at)
    study, fit = run_swings(rig, at.folder, at.progress, _found(at, "1b", carrier_of(rig)))
    return fit_chapter(study, fit, at.folder, rig.true_values), not fit.interrupted


def _found(at: ExperimentInput, key: str, body: str) -> dict[str, dict[str, Any]]:
    """What an earlier experiment says of a body's inertia, as a study has it."""
    chapter = at.earlier.get(key)
    told = chapter.numbers.get("parameters", {}).get(body) if chapter else None
    if not told or not told.get("stderr"):
        return {}
    unit = told["unit"]
    return {body: {"value": with_unit(told["value"], unit, 10), "uncertainty": with_unit(told["stderr"], unit, 4)}}
