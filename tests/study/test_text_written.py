"""Does a study that was written read back as what was meant?"""

import math
import tomllib

import pytest

from upright.quantities import with_unit
from upright.study.text import TomlTable, study_text, toml


@pytest.mark.parametrize(
    "value",
    [True, 3, -1, 0.25, 1e-7, 123456.0, "plain", 'a "quoted" name', "back\\slash", [1, 2.5], ["a", "b"],
     {"guess": "0.35 m", "min": 0, "assumed": True}],
)  # fmt: skip
def test_a_value_reads_back(value):
    assert tomllib.loads(f"key = {toml(value)}")["key"] == value


def test_a_number_keeps_as_many_digits_as_asked():
    assert tomllib.loads(f"pi = {toml(math.pi, 10)}")["pi"] == pytest.approx(math.pi, rel=1e-9)
    assert with_unit(math.pi, "rad") == "3.14 rad"
    assert with_unit(0.2) == with_unit(0.2, "1") == "0.2"


def test_tables_keep_their_keys_and_comments_say_nothing_to_a_program():
    drive, run = TomlTable("[drive]", "what pushes"), TomlTable("[[runs]]")
    drive.key("column", "u", "-1 to 1 V")
    drive.key("sign", -1, off=True)
    run.key("window", [0.5, 12.25], "s", digits=5)
    text = study_text([drive, run])
    assert tomllib.loads(text) == {"drive": {"column": "u"}, "runs": [{"window": [0.5, 12.25]}]}
    assert "# sign = -1" in text.splitlines()
    assert "[drive]   # what pushes" in text.splitlines()
