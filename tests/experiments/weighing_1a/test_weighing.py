"""Does experiment 1a say what the rig of the later experiments weighs?"""

import pytest

from upright.errors import BadInput
from upright.experiments.weighing_1a.run import first_body, run_weighing
from upright.rig.makes import MAKES, OSCILLATORS, make_rig


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
        for k in run_weighing(rig, seed, tmp_path / str(seed)).known:
            assert k.value == pytest.approx(truth[k.name], rel=0.01)
            held.append(abs(k.value - truth[k.name]) <= 1.96 * k.stderr)
    assert sum(held) >= len(held) - 2  # of six at 95 %, three or more miss once in 450 times


def test_a_rig_of_another_kind_is_refused(tmp_path):
    rig = make_rig("rectilinear")
    with pytest.raises(BadInput, match="knows carts, disks and pendulums"):
        run_weighing(rig.replace(plant=OSCILLATORS["torsional"].plant, counts=(1.0,)), 0, tmp_path)
