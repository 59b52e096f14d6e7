"""What does `python -m benchmarks` make of a benchmark that fails, and of one that misses its target?"""

import sys
from types import SimpleNamespace

import pytest

from benchmarks.__main__ import main
from benchmarks.measure import Line, Target


@pytest.fixture
def stand_in(monkeypatch):
    """Put a function in the place of a benchmark."""

    def put(name, run):
        monkeypatch.setitem(sys.modules, f"benchmarks.{name}", SimpleNamespace(__doc__="A question?", run=run))

    return put


def took(seconds):
    return lambda **_: [Line(contender="x", seconds=(seconds,) * 3, target=Target(most=1.0, of="seconds"))]


def fails(**_):
    raise ZeroDivisionError("float division by zero")


def test_a_missed_target_is_not_an_error_and_both_are_told_by_the_exit_code(stand_in, capsys):
    stand_in("nist", took(0.5))
    stand_in("fit", took(2.0))
    assert main(["nist", "--quick"]) == 0
    assert main(["nist", "fit", "--quick"]) == 3
    stand_in("lab", fails)
    assert main(["lab", "fit", "nist", "--quick"]) == 1
    shown = capsys.readouterr()
    assert "ZeroDivisionError" in shown.err
    assert "ended with an error: lab" in shown.err
    assert shown.out.rindex("nist: A question?") > shown.out.rindex("fit: A question?")  # the others run all the same
