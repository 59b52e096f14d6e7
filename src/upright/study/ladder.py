"""In which order should the model grow? [[ladder]] of a study becomes rungs."""

from __future__ import annotations

from typing import Any

from upright.identification.ladder.rungs import Rung
from upright.identification.model.nuisance_names import PER_RUN
from upright.physics import Plant
from upright.physics.actuator import ACTUATOR
from upright.study.keys import names
from upright.study.text import Section


def read_ladder(study: Section, plant: type[Plant]) -> tuple[Rung, ...]:
    """Rungs of a study, none when it has no [[ladder]]."""
    entries: Any = study.values.get("ladder", [])
    if not isinstance(entries, list):
        raise study.error("ladder", 'a ladder is a list of rungs: [[ladder]], then name = "Coulomb" below it')
    terms = (*plant.names(), *ACTUATOR)
    nuisances = (*PER_RUN, *(f"{kind}.{c.name}" for kind in ("offset", "scale") for c in plant.coordinates))
    rungs: list[Rung] = []
    for i, values in enumerate(entries):
        rung = Section(study.text, ("ladder", i), values)
        rung.check(names("ladder"))
        rungs.append(
            Rung(
                name=rung.text_of("name", "Coulomb friction"),
                adds=rung.names("adds", terms),
                drops=rung.names("drops", terms),
                unknown=rung.names("unknown", nuisances),
            )
        )
    return tuple(rungs)
