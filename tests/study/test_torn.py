"""Is any study at all, however torn or strange, either read or answered with a sentence?"""

from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from tests.study.good_study import GOOD
from upright.errors import BadInput
from upright.study.load import load_study


def complaints(folder):
    """None or one sentence about the study in `folder`."""
    try:
        load_study(folder / "study.toml")
    except BadInput as error:
        return [str(error)]
    return []


SLIPS = ["", "[rig", "[rig.plant]", "[runs]", "[[sensors]]", "[parameters.m_c]", "[[runs]]\nlabel = 3", "x = 1"]
JUNK = [
    "",
    "0",
    "-1",
    "1e400",
    "nan",
    "inf",
    '""',
    '"x"',
    '"1 m"',
    "[]",
    "[1]",
    "{}",
    "{ a = 1 }",
    "true",
    "1979-05-27",
    '"a/b"',
]


@settings(max_examples=200, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(line=st.integers(0, GOOD.count("\n") - 1), junk=st.sampled_from(JUNK), more=st.sampled_from(SLIPS))
def test_no_value_makes_the_study_stumble(folder, line, junk, more):
    lines = GOOD.splitlines()
    key, equals, _ = lines[line].partition(" = ")
    lines[line] = f"{key} = {junk}" if equals else more
    (folder / "study.toml").write_text("\n".join(lines) + "\n", encoding="utf-8")
    for answer in complaints(folder):
        assert "study.toml, line " in answer
        assert "\n" not in answer


@settings(max_examples=200, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(at=st.integers(0, len(GOOD)), cut=st.integers(0, 30), put=st.text(max_size=5))
def test_no_torn_text_makes_the_study_stumble(folder, at, cut, put):
    (folder / "study.toml").write_text(GOOD[:at] + put + GOOD[at + cut :], encoding="utf-8", errors="replace")
    for answer in complaints(folder):
        assert "study.toml" in answer
