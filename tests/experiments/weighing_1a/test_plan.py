"""Can every loading that is proposed be bolted on, and is a run more asked for only while it is worth its while?"""

from __future__ import annotations

import pytest

from upright.errors import BadInput
from upright.experiments.weighing_1a.plan import choices, fewest_runs


def test_a_cart_carries_up_to_four_brass_masses_of_half_a_kilogram():
    assert [loading.added for loading in choices("rectilinear")] == [0.0, 0.5, 1.0, 1.5, 2.0]
    with pytest.raises(BadInput, match="--radius is for disks"):
        choices("rectilinear", [0.05])


def test_a_disk_carries_them_in_pairs_on_its_bolt_circles():
    """Balanced: two or four, each a cylinder of 0.5 kg about a parallel axis, its own share the same on any circle."""
    two, four = ([w.added for w in choices("torsional", [0.03, 0.05]) if w.label.startswith(f"{n} at")] for n in (2, 4))
    assert two[1] - two[0] == pytest.approx(2 * 0.5 * (0.05**2 - 0.03**2))
    assert four == pytest.approx([2 * J for J in two])
    assert two[0] > 2 * 0.5 * 0.03**2
    assert choices("torsional", [0.03])[0].added == 0.0
    default = [w.label for w in choices("torsional")]
    assert default[:2] == ["none", "2 at 2 cm"]
    assert default[-1] == "4 at 9 cm"
    assert len(default) == 1 + 2 * 8


@pytest.mark.parametrize(
    ("k", "wanted", "runs"),
    [
        ({2: 0.10, 3: 0.05, 4: 0.02, 5: 0.01}, 0.05, 3),  # the fewest that reach it
        ({2: 0.10, 3: 0.05, 4: 0.02, 5: 0.01}, 0.049, 4),
        ({2: 0.10, 3: 0.05, 4: 0.02, 5: 0.01}, 0.001, 5),  # none does
        ({2: 0.10, 3: 0.08, 4: 0.075, 5: 0.01}, None, 3),  # a fourth tightens by 6 %
        ({2: 0.10, 3: 0.099, 4: 0.01}, None, 2),
        ({2: 0.10, 3: 0.08, 4: 0.06}, None, 4),
        ({4: 0.06, 2: 0.10, 3: 0.08}, None, 4),
    ],
)
def test_runs_are_added_while_they_tighten_the_stiffness_by_a_tenth(k, wanted, runs):
    assert fewest_runs(k, wanted) == runs
