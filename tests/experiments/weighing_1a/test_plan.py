"""Can every loading that is proposed be bolted on, and is a run more asked for only while it is worth its while?"""

from __future__ import annotations

import pytest

from upright.errors import BadInput
from upright.experiments.weighing_1a.plan import chapter, choices, fewest_runs
from upright.identification.loadings import Loading, Plan


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


def planned(k, bare=0.1, loadings=((0.0, 1), (2.0, 2))):
    """A plan of some loadings, each so many times, with its standard errors."""
    named = tuple(Loading(label=f"{added:g} kg", added=added) for added, _ in loadings)
    return Plan(loadings=named, runs=tuple(n for _, n in loadings), k=k, bare=bare, both=k)


def told(chosen, wanted=None, **errors):
    plans = {int(n[1:]): (planned(k), planned(2 * k, k)) for n, k in errors.items()}
    return chapter(plans, chosen, wanted, "kg")


@pytest.mark.parametrize(
    ("chosen", "wanted", "reason"),
    [
        (3, 0.02, "The fewest runs that reach 2 %: 1× 0 kg, 2× 2 kg; k to 2.00 % (*)."),
        (3, 0.01, "No plan up to 3 runs reaches 1 %; the best is 1× 0 kg, 2× 2 kg; k to 2.00 % (*)."),
        (3, None, "Every run planned is still worth its while: 1× 0 kg, 2× 2 kg; k to 2.00 % (*)."),
        (2, None, "One more run would tighten the stiffness by less than 10 %: 1× 0 kg, 2× 2 kg; k to 3.00 % (*)."),
    ],
)
def test_a_plan_says_why_it_stops_there(chosen, wanted, reason):
    page = told(chosen, wanted, n2=0.03, n3=0.02)
    assert page.verdict.replace("\N{NO-BREAK SPACE}", " ") == reason
    assert page.steps[0].command == 'upright loadings bare.csv heavy.csv --added "0 kg" --added "2 kg"'


def test_every_number_of_runs_has_both_plans_in_percent_and_the_chosen_one_a_star():
    page = told(3, None, n2=0.03, n3=0.02)
    (table,) = page.parts[0].content
    both = "1× 0 kg, 2× 2 kg"
    assert table.rows == (
        ("2", both, "3.00 %", "10.00 %", both, "6.00 %", "3.00 %"),
        ("3 *", both, "2.00 %", "10.00 %", both, "4.00 %", "2.00 %"),
    )
    assert [table.headings[i] for i in table.numbers] == ["runs", "k", "m_0", "k", "m_0"]
    assert page.numbers["chosen"] == 3
    assert page.numbers["plans"]["2"]["both"]["k"] == 0.06
    assert page.numbers["plans"]["3"]["stiffness"]["runs"][1] == {"loading": "2 kg", "added": 2.0, "runs": 2}
