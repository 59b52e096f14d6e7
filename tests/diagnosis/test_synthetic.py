"""How often is a fault that was put in found, and how often one that was not? Bounds as docs/howto/doctor.md states."""

from __future__ import annotations

import math

import pytest

from benchmarks.doctored import FAULTS, PLANTS, batch
from upright.diagnosis import examine

EACH = 12
SURE = 3.0
"""Standard deviations of a binomial count that chance is allowed."""


def fewest(share: float, records: int) -> float:
    return records * share - SURE * math.sqrt(records * share * (1 - share))


@pytest.mark.slow
@pytest.mark.thorough
@pytest.mark.parametrize("fault", FAULTS)
def test_a_fault_is_found_in_90_of_100_records(fault):
    records = [d for plant in PLANTS for d in batch(plant, fault, EACH, seed=77)]
    found = sum(bool({f.kind for f in examine(d.record, d.rig, d.wiring).wrong} & FAULTS[fault]) for d in records)
    assert found >= fewest(0.9, len(records))


@pytest.mark.slow
def test_a_clean_record_is_left_alone_in_98_of_100():
    records = [d for plant in PLANTS for d in batch(plant, "", 2 * EACH, seed=78)]
    quiet = sum(not examine(d.record, d.rig, d.wiring).wrong for d in records)
    assert quiet >= fewest(0.98, len(records))


def test_every_finding_carries_its_evidence_and_its_picture():
    for d in batch("furuta", "sign", 4, seed=5):
        for finding in examine(d.record, d.rig, d.wiring).wrong:
            assert finding.evidence
            assert finding.panels
            assert finding.advice
            assert finding.sentence.endswith(".")


@pytest.mark.slow
def test_only_what_a_rig_tells_is_left_out_without_one():
    d = batch("rectilinear-2", "sign", 5, seed=6)[0]
    alone = examine(d.record)
    assert {"sign", "scale", "trip"} <= alone.unchecked.keys()
    assert all("--rig" in alone.unchecked[k] for k in ("sign", "scale"))
    assert "sign" in examine(d.record, d.rig, d.wiring).checked
