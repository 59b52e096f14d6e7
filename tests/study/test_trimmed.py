"""May a ladder's study be written with what it refused taken out? Only where every refused term has a line."""

from types import SimpleNamespace

import pytest

from upright.identification.ladder.decision import RungComparison
from upright.identification.ladder.growth import RungResult
from upright.identification.ladder.repeats import Repeats
from upright.identification.ladder.rungs import Rung
from upright.physics import find
from upright.study.results import can_be_trimmed, chosen_study, ladder_content

LINES = """\
[parameters]
m_p = "100 g"
"b_2" = {{ guess = "1e-4 N m s/rad" }}
{rest}
[actuator]
lag = "3 ms"
"""


@pytest.mark.parametrize(
    ("rest", "refused", "plant", "can"),
    [
        ("b_2c = 0.1", ["b_2c"], "pendulum", True),
        ("b_2c = 0.1", ["b_2", "b_2c", "actuator.lag"], "pendulum", True),
        ("", ["b_2"], "pendulum.py:Mine", False),  # whose file is beside the study
        ("b_1 = 1.0", ["b_1", "b_2c"], "pendulum", False),  # b_2c stands nowhere
    ],
)
def test_every_refused_term_stands_on_a_line_of_its_own(rest, refused, plant, can, tmp_path):
    path = tmp_path / "study.toml"
    path.write_text(LINES.format(rest=rest), encoding="utf-8")
    assert can_be_trimmed(SimpleNamespace(path=path, plant=plant), SimpleNamespace(left_out=refused)) is can


STUDY = """\
[rig]
plant = "furuta"
[parameters]
m_p = "100 g"
J_p = { guess = "1e-3 kg m^2" }
b_1c = 0.1
[[ladder]]
name = "dry"
adds = ["b_1c"]
[actuator]
lag = "3 ms"
[ [ ladder ] ]
name = "late"
[[runs]]
file = "log.csv"
"""


def rung(name, *, unknown=()):
    return SimpleNamespace(rung=Rung(name=name, unknown=unknown))


def test_the_chosen_study_says_what_was_refused_and_has_no_rungs_left(tmp_path):
    """What has a default goes; an inertia that must be given is 0, as it is where it does nothing."""
    path = tmp_path / "mine.toml"
    path.write_text(STUDY.replace("[ [ ladder ] ]", "[[ladder]]"), encoding="utf-8")
    study = SimpleNamespace(path=path, model=SimpleNamespace(plant=find("furuta")))
    ladder = SimpleNamespace(
        left_out=["b_1c", "J_p", "actuator.lag"], accepted=[rung("a"), rung("b", unknown=("offset",))]
    )
    first, *lines = chosen_study(study, ladder).splitlines()
    assert first.startswith("# mine.toml as far as the ladder kept it")
    assert lines == [
        "[rig]", 'plant = "furuta"', "[parameters]", 'm_p = "100 g"',
        '# not kept: J_p = { guess = "1e-3 kg m^2" }', "J_p = 0", "# not kept: b_1c = 0.1",
        "[actuator]", '# not kept: lag = "3 ms"',
        "[[runs]]", 'file = "log.csv"',
        "# The ladder kept, run by run: add offset to unknown of each of [[runs]].",
    ]  # fmt: skip
    kept = chosen_study(study, SimpleNamespace(left_out=[], accepted=[rung("a")]))
    assert "not kept" not in kept
    assert "run by run" not in kept
    assert kept.endswith('file = "log.csv"\n')


def test_a_ladder_s_file_holds_every_step_and_what_repeats_allow():
    one = RungResult(
        rung=Rung(name="dry", adds=("b_1c",)), accepted=True, reason="better", fitted={"run": {"theta": 95.0}},
        predicted={"other": {"theta": 91.5}}, cost=1.25, parameters=4, per_run=2, values={"b_1c": 0.01},
        seconds=1.23456,
        comparison=RungComparison(gain=0.5, scatter=0.1, pairs=3, between="runs"),
    )  # fmt: skip
    two = RungResult(
        rung=Rung(name="late"), accepted=False, reason="no better", fitted={}, predicted={}, cost=1.2, parameters=5,
        per_run=0, values={}, seconds=0.5,
    )  # fmt: skip
    repeats = Repeats(labels=("a", "b"), percents={"theta": (97.0, 99.0, 98.0)}, errors={"a": 0.1, "b": 0.2})
    ladder = SimpleNamespace(
        accepted=[one], steps=(one, two), held_out="run by run", left_out=("actuator.lag",), stopped="", warnings=(),
        interrupted=False, seconds=2.34567, repeats=(repeats,),
    )  # fmt: skip
    study = SimpleNamespace(
        title="Mine", plant="furuta", path=SimpleNamespace(name="mine.toml"), sha256="abc", source="me",
        runs=[SimpleNamespace(label="run", source="log.csv")],
    )  # fmt: skip
    content = ladder_content(ladder, study)
    assert (content["title"], content["plant"], content["chosen"]) == ("Mine", "furuta", ["dry"])
    assert (content["seconds"], content["held_out"], content["left_out"]) == (2.346, "run by run", ["actuator.lag"])
    dry, late = content["steps"]
    assert (dry["name"], dry["adds"], dry["kept"], late["kept"]) == ("dry", ["b_1c"], True, False)
    assert (dry["gain"], dry["scatter"], dry["seconds"], dry["per_run"]) == (0.5, 0.1, 1.235, 2)
    assert (late["gain"], late["scatter"]) == (None, None)
    assert dry["fit_percent"] == one.fit_percent
    (group,) = content["repeats"]
    assert (group["runs"], group["range"]) == (["a", "b"], {"theta": [97.0, 99.0]})
    assert content["provenance"]["study"] == "mine.toml"
    assert content["provenance"]["runs"] == {"run": "log.csv"}
