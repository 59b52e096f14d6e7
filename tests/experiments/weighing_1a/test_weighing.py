"""Does experiment 1a say what the rig of the later experiments weighs?"""

import math
from dataclasses import dataclass
from types import SimpleNamespace

import numpy as np
import pytest

from upright.errors import BadInput
from upright.experiments.stand.known import Known
from upright.experiments.stand.twin import TwinStand
from upright.experiments.weighing_1a import from_logs
from upright.experiments.weighing_1a import run as weighing
from upright.experiments.weighing_1a.chapter import chapter
from upright.experiments.weighing_1a.from_logs import weigh_logs
from upright.experiments.weighing_1a.run import Weighing, drawn_twin, first_body, measure_body, run_weighing
from upright.records import Record
from upright.rig.makes import BODIES, MAKES, make_rig


@pytest.mark.parametrize("make", MAKES)
def test_a_body_as_designed_can_be_built(make):
    # ECP 205: disk 2.5e-3, motor and belt 5e-4; ECP 210: carts of 0.5 to 0.8 kg with their base
    bare = first_body(make_rig(make)).bare
    assert 2.9e-3 < bare < 3.4e-3 if make in ("furuta", "torsional") else 0.5 < bare < 0.81


@pytest.mark.slow
@pytest.mark.parametrize("make", MAKES)
def test_what_is_handed_on_is_the_rig_s(make, tmp_path):
    held = []
    for seed in range(1, 7):
        rig = make_rig(make, seed)
        truth = rig.plant.parameters()
        for k in run_weighing(TwinStand(rig=rig), seed, tmp_path / str(seed)).known:
            assert k.value == pytest.approx(truth[k.name], rel=0.01)
            held.append(abs(k.value - truth[k.name]) <= 1.96 * k.stderr)
    assert sum(held) >= len(held) - 2  # of six at 95 %, three or more miss once in 450 times


def test_a_rig_of_another_kind_is_refused(tmp_path):
    rig = make_rig("rectilinear")
    with pytest.raises(BadInput, match="knows carts, disks and pendulums"):
        run_weighing(TwinStand(rig=rig.replace(plant=BODIES["torsional"].rig.plant, counts=(1.0,))), 0, tmp_path)


def test_the_chapter_says_how_far_a_number_is_off_and_whether_its_interval_covers_it(tmp_path):
    """2 % above the truth within 1.96 errors of 1.1 %, and 3 % below it beyond 1.96 errors of 1.5 %."""
    rig = make_rig("rectilinear")
    true = rig.plant.parameters()
    body = measure_body(first_body(rig), counts=(0, 4), shots=1)
    known = tuple(
        Known(name=name, value=off * true[name], stderr=error * true[name])
        for name, off, error in (("m_1", 1.02, 0.011), ("k_12", 0.97, 0.015))
    )
    told = chapter(Weighing(rig=rig, make=MAKES["rectilinear"], folder=tmp_path, campaign=body, known=known))
    assert told.detail == (
        "m_1 is 2 % from the twin's true value, inside its 95 % interval. k_12 is 3 % from the twin's true value, "
        "outside its 95 % interval."
    )
    for finding, k in zip(told.findings, known, strict=True):
        low, high = map(float, finding.interval.split(" to "))
        step = 0.5 * k.stderr  # shown to the digits that its error leaves
        assert float(finding.value) == pytest.approx(k.value, abs=step)
        assert float(finding.truth) == pytest.approx(true[k.name], abs=step)
        assert (low, high) == pytest.approx((k.value - 1.96 * k.stderr, k.value + 1.96 * k.stderr), abs=step)
        assert told.numbers["handed_on"][k.name]["truth"] == true[k.name]


def test_logs_of_one_name_keep_apart_and_weigh_what_their_frequencies_say():
    """A cart of 0.6 kg at 400 N/m, drawn by its closed form; files of three folders may share a name."""
    k, bare, damping, t = 400.0, 0.6, 1.2, np.arange(4000) * 1e-3

    def swing(mass):
        sigma = damping / (2 * mass)
        x = 0.02 * np.exp(-sigma * t) * np.cos(np.sqrt(k / mass - sigma**2) * t)
        return Record(t=t, signals={"x": x}, units={"x": "m"}, outputs=("x",))

    logs = [(swing(bare + added), "log.csv") for added in (0.0, 0.5, 1.0)]
    found, told = weigh_logs(logs, ["0", "500 g", "1 kg"])
    assert [s.label for s in found.swings] == ["log.csv", "log.csv (2)", "log.csv (3)"]
    assert [s.added for s in found.swings] == [0.0, 0.5, 1.0]
    assert (found.k.value, found.bare.value) == pytest.approx((k, bare), rel=1e-3)
    assert found.damping.value == pytest.approx(damping, rel=1e-2)
    assert told.steps[1].command == 'upright plan-inertias --rig rectilinear --bare "0.6 kg"'


@pytest.mark.parametrize("named", [False, True])
def test_a_twin_is_weighed_again_from_its_logs_where_a_folder_keeps_them(tmp_path, monkeypatch, named):
    """With no mass and four, once each: what its swings say lies by the true stiffness, and its steps can be typed."""
    told = []
    twin = drawn_twin(4, "rectilinear")
    body = measure_body(twin, lambda step, share: told.append((step, share)), counts=(0, 2, 4), shots=1)
    assert told == [(f"stepping with {n} masses", pytest.approx(i / 3)) for i, n in enumerate((0, 2, 4))]
    monkeypatch.setattr(from_logs, "measure_body", lambda on: body)
    loadings, page = from_logs.weigh_twin("rectilinear", 4, tmp_path if named else None)
    true = drawn_twin(4, "rectilinear")
    assert loadings.k.value == pytest.approx(true.stiffness, rel=0.02)
    assert page.title == "Experiment 1a on a twin, rectilinear, seed 4"
    assert page.numbers["truth"]["k"] == true.stiffness
    typed = [s.command for s in page.steps]
    assert typed[-1] == "upright plan-inertias --rig rectilinear"
    written = sorted(p.name for p in tmp_path.iterdir())
    assert typed[:-1] == [
        f'upright loadings {" ".join(written)} --added "0 kg" --added "1 kg" --added "2 kg"'
    ] * named  # fmt: skip
    if named:
        again, _ = weigh_logs([(Record.from_csv(tmp_path / name), name) for name in written], ["0 kg", "1 kg", "2 kg"])
        assert again.k.value == pytest.approx(loadings.k.value, rel=1e-3)


def test_twins_are_bodies_on_springs():
    with pytest.raises(BadInput, match=r"--rig is rectilinear or torsional, got 'furuta'"):
        from_logs.weigh_twin("furuta", 0, None)


@dataclass
class Number:
    """A number and its standard error."""

    value: float
    stderr: float


@pytest.mark.parametrize("make", MAKES)
def test_what_is_handed_on_is_the_bare_body_and_what_is_mounted_on_it_later(make, tmp_path, monkeypatch):
    """Errors of the line, of the pieces (each by its tolerance, so by their root) and of the rest add up in squares."""
    m = MAKES[make]
    line = SimpleNamespace(bare=Number(0.5, 0.01), k=Number(400.0, 2.0))
    campaign = SimpleNamespace(loadings=line)
    campaign.written = lambda folder: campaign
    monkeypatch.setattr(weighing, "measure_body", lambda on, progress: campaign)
    done = run_weighing(TwinStand(rig=make_rig(make, 3)), 3, tmp_path)
    body, *spring = done.known
    mounted = m.mounted
    assert body.name == m.body
    assert body.value == pytest.approx(0.5 + mounted.each * mounted.pieces + mounted.rest)
    pieces = m.on_spring.tolerance * mounted.each * math.sqrt(mounted.pieces)
    assert body.stderr**2 == pytest.approx(0.01**2 + pieces**2 + mounted.rest_error**2)
    shaft = make in ("torsional", "rectilinear")
    assert [(k.name, k.value, k.stderr) for k in spring] == [("k_12", 400.0, 2.0)] * shaft
