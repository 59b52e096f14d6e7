"""May a ladder's study be written with what it refused taken out? Only where every refused term has a line."""

from types import SimpleNamespace

import pytest

from upright.study.results import can_be_trimmed

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
