"""Which plants a log's columns could be of, without a description of the rig."""

from __future__ import annotations

from upright.physics import PLANTS, Plant
from upright.readers.inspection import Inspection
from upright.records import Record
from upright.records.columns import ANGLES, LENGTHS
from upright.study.draft.chain_log import chain_kind
from upright.study.draft.recognise import drive_column, moves_against, plant_of, position_columns

COUNTED = ("counts", "")
"""Units of a column that may be an angle as well as a length."""

MOST_BODIES = 3


def plants_that_suit(record: Record, inspection: Inspection) -> tuple[str, ...]:
    """Plants whose coordinates a log's moving columns can measure, the likeliest first; none when none can."""
    places = position_columns(record, inspection)
    if not places:
        return ()
    drive = drive_column(record, inspection)
    likely, _ = plant_of(places, drive)
    if all(c.guess in COUNTED for c in places):
        places = places[:MOST_BODIES]
        first = record[places[0].name]
        against = drive is not None and moves_against(record.t, record[drive.name], first)
        kind, _ = chain_kind(record, places, drive, against, record.provenance.file or "")
        likely = f"{kind}-{len(places)}"
    units = [c.guess for c in places]
    lengths, angles = sum(u in LENGTHS for u in units), sum(u in ANGLES for u in units)

    def suits(plant: type[Plant]) -> bool:
        turning = sum(c.unit == "rad" for c in plant.coordinates)
        sliding = len(plant.coordinates) - turning
        return len(plant.coordinates) == len(units) and turning >= angles and sliding >= lengths

    others = [name for name, plant in PLANTS.sound().items() if name != likely and suits(plant)]
    return (likely, *others)
