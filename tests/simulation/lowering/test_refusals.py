"""Is what cannot be compiled refused in a sentence that says what and where?"""

from __future__ import annotations

import textwrap

import numpy as np
import pytest

from tests.simulation.lowering.machine_code import compiled
from upright.simulation.lowering.operands import Unsupported

REFUSED = {
    "x = [1.0, 2.0]": ("'[1.0, 2.0]' is more than numbers", 1),
    "x = 'text'": ("is no number", 1),
    "OUT[0] = later": ("'later' is not known", 1),
    "try:\n    x = 1\nfinally:\n    x = 2": ("'try' is not known", 1),
    "x = 1\nif x > 0:\n    y = lambda: 2": ("is more than numbers", 3),
    "x, y = (1, 2, 3)": ("as many names as numbers", 1),
    "x = (1, 2)\nOUT[0] = x[2]": ("number 2 is read from a tuple of 2", 2),
    "OUT[0] = (1, 2)": ("a tuple stands where a number is needed", 1),
    "OUT[0] = OUT": ("an array stands where a number is needed", 1),
    "for x in OUT:\n    pass": ("a for runs over range(...) or over a tuple", 1),
    "for k in range(0, 4, n):\n    pass": ("range needs a step that is a number of the text", 1),
    "x = (1.0,)\nfor k in range(3):\n    x = x + (1.0,)": ("tuple of one length in one place", 3),
    "OUT[0] = abs(n, n)": ("abs with 2 arguments is not known", 1),
    "OUT[0] = open(n)": ("'open' is not known", 1),
    "OUT[0] = n.real": ("'n.real' is not known", 1),
    "OUT[0] = 9000000000000000000 * 9": ("is no whole number of 64 bits", 1),
    "OUT[0] = 99999999999999999999": ("is no whole number of 64 bits", 1),
    "OUT[0] = n @ n": ("matrices are not known", 1),
    "OUT[0] = n is None": ("compares in a way that numbers do not have", 1),
    "while n:\n    n -= 1\nelse:\n    n = 2": ("a while has no else here", 1),
    "if n:\n    return 1.0": ("returns something in one place and nothing in another", 0),
    "OUT[0] = 2.5 << n": ("'<<' needs whole numbers", 1),
    "del n": ("'del' is not known", 1),
    "x = (OUT, 1)": ("an array cannot be part of a tuple", 1),
    "n[0] = 1.0": ("'n' is no array", 1),
    "OUT[0] = round(2.5, 1)": ("round takes one number here", 1),
    "n.real = 1": ("'n.real' cannot be assigned to", 1),
    "n.real += 1": ("'n.real' cannot be added to", 1),
    "OUT[0] = max(())": ("max of nothing", 1),
}  # fmt: skip


@pytest.mark.parametrize("body", REFUSED)
def test_what_the_text_may_not_use_is_said_with_its_line(body):
    words, line = REFUSED[body]
    with pytest.raises(Unsupported) as caught:
        compiled("@entry\ndef entered(OUT, n):\n" + textwrap.indent(body, "    "))(np.zeros(3), 2)
    assert words in caught.value.what
    assert caught.value.line == (line and line + 1)  # the function itself begins in the first


@pytest.mark.parametrize(
    ("call", "words"),
    [
        ("OUT[0] = twice(1.0, 2.0)", "twice takes 1 arguments, got 2"),
        ("OUT[0] = twice()", "twice takes 1 arguments, got 0"),
        ("OUT[0] = put(OUT)", "'put' returns nothing"),
    ],
)
def test_a_function_of_the_text_is_called_as_it_is_written(call, words):
    helpers = "def twice(x):\n    return 2.0 * x\ndef put(OUT):\n    OUT[1] = 3.0\n"
    with pytest.raises(Unsupported) as caught:
        compiled(f"{helpers}@entry\ndef entered(OUT, n):\n    {call}\n")(np.zeros(3), 2)
    assert words in caught.value.what
    out = np.zeros(3)
    compiled(f"{helpers}@entry\ndef entered(OUT, n):\n    OUT[0] = twice(n)\n    put(OUT)\n")(out, 2)
    assert out.tolist() == [4.0, 3.0, 0.0]
