"""Does a comparison name the fit that predicts best, what beats it, and which parameters differ?"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from upright.identification import Estimate, RunScore
from upright.identification.inference.agreement import ParameterAgreement
from upright.physics import Furuta
from upright.report.fit.compare import BLACK_BOX, ComparedRun, Comparison, chapter, compared_figure

T = np.arange(4.0)
Y = np.column_stack([[0.0, 1.0, 0.0, -1.0], [20.0, 10.0, 0.0, -10.0]])


def score(psi, theta, off=0.0):
    return RunScore(
        role="predict", fit_percent={"psi": psi, "theta": theta}, horizon=None, t=T, y=Y, simulated=Y - off,
        measured=("psi", "theta"),
    )  # fmt: skip


def run(one=(90.0, 80.0), other=(70.0, 95.0), box=(60.0, 75.0), fitted_by=()):
    scores = {"A": score(*one), "B": score(*other), BLACK_BOX: score(*box)}
    return ComparedRun(scores=scores, fitted_by=fitted_by)


def agreement(word, difference=0.0, relative=0.0, stderr=0.1, p=0.5):
    return ParameterAgreement(word=word, difference=difference, relative=relative, stderr=stderr, p=p)


AGREE = {"J_d": agreement("agree", 0.05, 0.025), "b_1": agreement("agree", 0.02, 0.02)}
NUMBERS = {"J_d": Estimate.within(2.0, 0.1, 0.2, "kg m^2"), "b_1": Estimate.within(1.0, 0.1, 0.2, "N m s/rad")}


def compared(runs=None, agree=None, joint=(0.3, 2, 0.86), **more):
    return Comparison(
        plant=Furuta, runs={"new": run()} if runs is None else runs, parameters={"A": NUMBERS, "B": NUMBERS},
        agree={"B": AGREE if agree is None else agree}, joint={"B": joint}, **more,
    )  # fmt: skip


def told(comparison):
    return chapter(comparison, command="upright compare A B")


def test_the_best_fit_is_that_whose_worst_signal_of_all_new_runs_is_predicted_best():
    """A reaches 80 and 40, B 70 and 65: in the worst B is better."""
    runs = {"new": run(), "newer": run(one=(40.0, 99.0), other=(65.0, 99.0), box=(30.0, 90.0)),
            "old": run(other=(5.0, 5.0), fitted_by=("B",))}  # fmt: skip
    comparison = compared(runs)
    assert list(comparison.new) == ["new", "newer"]
    assert comparison.best == "B"
    page = told(comparison)
    assert page.title == "A and B compared"
    assert page.verdict == (
        "B predicts best. It explains 65.0 % of the worst signal (A 40.0 %, black box 30.0 %). All parameters that "
        "both know agree."
    )
    assert page.sound
    assert page.warnings == ("'old' was fitted by B: what these reach there is no prediction.",)
    assert [(s.sentence, s.command) for s in page.steps] == [("Design with B.", "upright design OUT/fit.json")]
    assert page.numbers["best"] == "B"


def test_one_fit_alone_predicts_and_has_nothing_to_agree_with():
    alone = replace(
        compared({"new": ComparedRun(scores={"A": score(90.0, 80.0)})}), parameters={"A": NUMBERS}, agree={}, joint={}
    )
    assert told(alone).verdict == "A predicts it. It explains 80.0 % of the worst signal."
    (_, parameters) = told(alone).parts
    assert parameters.content[0].headings == ("symbol", "A", "unit")


def test_runs_that_a_fit_has_seen_test_none():
    page = told(compared({"old": run(fitted_by=("A", "B"))}))
    assert page.verdict.startswith("Every run has been seen by one of the fits, so none tests them. All parameters")
    assert not page.sound
    assert page.steps[0].command == "upright compare A B OTHER.csv"
    assert "'old' was fitted by A, B:" in page.warnings[0]
    assert told(compared({})).verdict.startswith("No run was compared.")
    assert [part.key for part in told(compared({})).parts] == ["parameters"]


def test_an_equation_without_physics_that_does_better_is_named_and_nothing_is_designed():
    for box, beaten in ((80.0, False), (80.5, True)):
        page = told(compared({"new": run(box=(box, 99.0))}))
        assert page.sound is not beaten
        assert ("The black box does better on new." in page.verdict) == beaten
        assert page.steps[0].command == (
            "upright ladder STUDY.toml -o OUT" if beaten else "upright design OUT/fit.json"
        )


def test_a_fit_that_doubts_itself_is_no_sound_winner():
    assert not told(compared(trusted={"A": False, "B": True})).sound
    page = told(compared(trusted={"A": True, "B": False}, related=("B",)))
    assert page.sound
    assert page.warnings[0] == "Do not rely on B yet: that is its own verdict."
    assert page.warnings[1].startswith("B rests on a log of the first fit too;")


@pytest.mark.parametrize(
    ("agree", "joint", "said"),
    [
        (AGREE, 0.05, "All parameters that both know agree."),
        (AGREE, 0.049, "Each parameter agrees by itself, but together those of B differ."),
        ({"J_d": AGREE["J_d"]}, 0.5, "The parameter that both know agrees."),
        ({"J_d": agreement("given alike")}, 0.5, "No parameter is known to both, so none can be compared."),
        (
            {**AGREE, "b_2": agreement("differ", 0.5, 0.25)}, 0.5,
            "Parameters differ: b2 of B by +25 %, 5.0 standard errors.",
        ),
        (
            {f"b_{i}": agreement("differ", -0.5, -0.25) for i in range(4)}, 0.01,
            f"Parameters differ: {'; '.join(f'b{i} of B by −25 %, 5.0 standard errors' for i in range(3))} and others.",
        ),
    ],
)  # fmt: skip
def test_parameters_agree_each_by_itself_and_all_at_once(agree, joint, said):
    page = told(compared(agree=agree, joint=(9.5, 2, joint)))
    assert page.verdict.endswith(said)
    content = page.parts[-1].content
    word = "differ" if joint < 0.05 else "agree"
    joined = f"B and A, all at once: {word} (chi-square 9.50 with 2 degrees of freedom, p = "
    assert content[1].sentences[0].startswith(joined)
    changed = [n for n, a in agree.items() if a.word == "differ"]
    assert ("Find out what changed" in page.steps[0].sentence) == bool(changed)
    for name in changed:
        assert name.replace("_", "") in page.steps[0].sentence


def test_every_signal_is_a_row_and_what_a_fit_has_seen_says_so():
    (runs, parameters) = told(compared({"new": run(fitted_by=("B",))})).parts
    table = runs.content[0]
    assert table.headings == ("run", "signal", "A", "B", BLACK_BOX)
    assert [tuple(map(str, row[2:])) for row in table.rows] == [
        ("90.0 %", "70.0 % (seen)", "60.0 %"), ("80.0 %", "95.0 % (seen)", "75.0 %"),
    ]  # fmt: skip
    assert table.numbers == (2, 3, 4)
    estimates = parameters.content[0]
    assert estimates.headings == ("symbol", "A", "B", "unit", "do they agree?")
    assert [str(row[-1]) for row in estimates.rows] == [
        "agree (+2.5 %, 0.5 standard errors)",
        "agree (+2 %, 0.2 standard errors)",
    ]
    assert [str(row[1]) for row in estimates.rows] == ["2.000 (1.80 to 2.20)", "1.000 (0.800 to 1.20)"]
    assert estimates.numbers == (1, 2)


def test_a_model_that_runs_away_flattens_neither_the_data_nor_the_residuals():
    """Half the range of a signal is the room about it, and twice that bounds what is left over."""
    scores = {"A": score(90.0, 80.0, off=np.array([0.1, 1.0])), "B": score(-900.0, 80.0, off=np.array([500.0, 2.0]))}
    axes = compared_figure(scores, Furuta, title="new").axes
    for j, (low, high) in enumerate(((-1.0, 1.0), (-10.0, 20.0))):
        above, below = axes[2 * j : 2 * j + 2]
        room = 0.5 * (high - low)
        assert above.get_ylim() == (low - room, high + room)
        lines = {line.get_label(): np.array(line.get_ydata()) for line in above.lines}
        np.testing.assert_allclose(lines["measured"], Y[:, j])
        np.testing.assert_allclose(lines["A"], scores["A"].simulated[:, j])
        np.testing.assert_allclose(below.lines[0].get_ydata(), np.full(4, (0.1, 1.0)[j]))
        assert below.get_ylim()[0] == -below.get_ylim()[1]
    assert axes[1].get_ylim()[1] == 2.0  # 500 would be out of sight
    assert 2.0 <= axes[3].get_ylim()[1] < 2.5
