"""Does the study of logs from a stand say what its owner or its maker says, what was found, and no more?"""

from __future__ import annotations

import tomllib

import pytest

from tests.experiments.rigs import OWN, made
from upright.experiments.stand.known import Known, bench_values, model_of
from upright.experiments.stand.live import live_stand
from upright.experiments.stand.studies import write_study
from upright.rig.makes import MAKES, make_rig
from upright.units import parse

RUN = {"label": "swing", "file": "swing.csv", "window": [0.1234567891, 2.0]}


def own(folder, *changes):
    text = OWN
    for old, new in changes:
        assert old in text
        text = text.replace(old, new)
    (folder / "study.toml").write_text(text, encoding="utf-8")
    (folder / "RIG.toml").write_text('kind = "twin"\nstudy = "study.toml"\n', encoding="utf-8")
    return live_stand(folder / "RIG.toml")


def written(stand, path, **more):
    return tomllib.loads(write_study(stand, path, "Title", [RUN], **more).read_text(encoding="utf-8"))


def test_what_an_owner_wrote_stands_and_what_was_found_takes_its_place(tmp_path):
    study = written(own(tmp_path), tmp_path / "1b" / "study.toml", known=[Known(name="J_d", value=9e-5, stderr=2e-6)])
    said = tomllib.loads(OWN)
    assert study["title"] == "Title"
    assert study["rig"]["plant"] == "furuta"
    assert parse(study["rig"]["servo_period"], "s") == pytest.approx(2e-3)
    found = study["parameters"].pop("J_d")
    assert (parse(found["value"], "kg m^2"), parse(found["uncertainty"], "kg m^2")) == pytest.approx((9e-5, 2e-6))
    assert study["parameters"] == {n: v for n, v in said["parameters"].items() if n != "J_d"}
    assert study["actuator"] == said["actuator"]
    assert study["drive"] == {"column": "u_applied", "unit": "V"}
    assert study["sensors"]["psi"] == {"column": "psi", "unit": "rad", "counts_per_rev": 2048}
    assert study["defaults"] == {"unknown": ["initial"]}
    assert study["runs"] == [RUN]  # windows to ten digits


def test_a_silent_drive_is_no_part_of_a_study(tmp_path):
    study = written(own(tmp_path), tmp_path / "study2.toml", drive=False)
    assert "actuator" not in study
    assert "drive" not in study


@pytest.mark.parametrize(
    ("actuator", "late"),
    [
        ('delay = "2 ms"\n', "2 ms"),  # as its owner says
        ("", {"guess": "0.002 s", "min": 0}),  # a sample, and to be found
        ('lag = "5 ms"\n', "0.002 s"),  # something else is late already
    ],
)
def test_a_drive_is_late_by_a_sample_where_nobody_says(tmp_path, actuator, late):
    study = written(own(tmp_path, ('delay = "2 ms"\n', actuator)), tmp_path / "1b" / "study.toml")
    assert study["actuator"]["delay"] == late
    more = {"dead_zone": {"guess": "0.1 V", "min": 0}, "limit": "3 V"}
    said = written(own(tmp_path, ('delay = "2 ms"\n', actuator)), tmp_path / "1b" / "study.toml", actuator=more)
    assert said["actuator"]["dead_zone"] == more["dead_zone"]
    assert said["actuator"]["limit"] == tomllib.loads(OWN)["actuator"]["limit"]  # the owner's own word goes first


def test_a_plant_of_one_s_own_is_named_from_where_the_study_lies(tmp_path):
    """And a name without a file as it is."""
    source = "from upright.physics import Furuta\n\n\nclass Mine(Furuta):\n    pass\n"
    (tmp_path / "mine.py").write_text(source, encoding="utf-8")
    stand = own(tmp_path, ('plant = "furuta"', 'plant = "mine.py:Mine"'))
    assert written(stand, tmp_path / "out" / "1b" / "study.toml")["rig"]["plant"] == "../../mine.py:Mine"
    assert written(stand, tmp_path / "other.toml")["rig"]["plant"] == "mine.py:Mine"


@pytest.mark.parametrize("seed", [0, 3])
def test_a_twin_of_a_make_starts_from_its_design_and_what_its_bench_says(tmp_path, seed):
    stand = made(tmp_path, f'kind = "twin"\nmake = "furuta"\nseed = {seed}\n')
    study = written(stand, tmp_path / "1b" / "study.toml")
    make, rig = MAKES["furuta"], make_rig("furuta", seed)
    start = model_of(make, bench_values(rig, make), make.bench).parameters
    assert study["rig"]["vendor"] == make.vendor
    entries = {**study["parameters"], **{f"actuator.{n}": v for n, v in study["actuator"].items()}}
    assert set(entries) == set(start)
    for name, p in start.items():
        entry = entries[name] if isinstance(entries[name], dict) else {"value": entries[name]}
        value = entry.get("guess", entry.get("value"))
        assert (parse(value, p.unit) if p.unit not in ("", "1") else float(value)) == pytest.approx(p.value, rel=1e-9)
        assert ("guess" in entry) == p.estimate
        assert entry.get("min") == (0 if p.estimate else None)
        assert ("uncertainty" in entry) == bool(p.uncertainty)
        if p.uncertainty:
            assert parse(entry["uncertainty"], p.unit) == pytest.approx(p.uncertainty, rel=1e-3)
