"""Does `export` say what it wrote, what single precision costs, and what it cannot write?"""

from __future__ import annotations

import json
import math

import numpy as np
import pytest

import upright as up
from upright.errors import BadInput
from upright.laws import Law

LAW = Law(
    np.zeros((0, 0)), np.zeros((0, 1)), np.zeros((1, 0)), [[-3.3]], period=0.1, limit=2.0, command_resolution=0.25,
    measured=("theta",),
)  # fmt: skip


def test_a_law_is_written_with_how_it_tests_itself(tmp_path):
    done = up.export(LAW, to="python", out=tmp_path)
    assert done.numbers["period"] == 0.1
    assert (done.numbers["limit"], done.numbers["samples"], done.numbers["to"]) == (2.0, 48, "python")
    assert done.chapter.verdict.endswith(
        "this law is written for python; its self-test compares 48 samples bit for bit."
    )
    assert done.files == (tmp_path / "law.py",)
    assert done.value == (str(tmp_path / "law.py"),)
    assert not done.chapter.warnings
    assert any("limited to 2.0 either way, in steps of 0.25" in s for s in done.chapter.parts[0].content[0].sentences)


def test_a_law_without_a_limit_is_written_with_a_warning(tmp_path):
    from dataclasses import replace

    (warned,) = up.export(replace(LAW, limit=math.inf), to="python", out=tmp_path).chapter.warnings
    assert warned.startswith("The command's limit is not specified")


def test_single_precision_is_said_to_miss_by_as_much_as_it_may(tmp_path):
    """A converter's step hides what is less than one; without steps nothing does."""
    from dataclasses import replace

    done = up.export(LAW, to="c", single=True, out=tmp_path)
    assert done.numbers["single_precision_misses"] == pytest.approx(0.25, rel=1e-3)
    assert "its self-test compares 48 samples to within 0.25" in done.chapter.verdict
    assert not done.chapter.warnings
    (warned,) = up.export(replace(LAW, command_resolution=0.0), to="c", single=True, out=tmp_path).chapter.warnings
    assert "with no converter step; a longer period reduces it" in warned


@pytest.mark.parametrize(
    ("content", "said"),
    [
        (None, "does not exist; `upright design"), ("{", "is not a design.json; `upright design"),
        (json.dumps({"plant": "x", "parameters": {}}), "is a fit, not a law"),
        ("[]", "is not a design.json; it needs the keys"),
    ],
)  # fmt: skip
def test_a_file_that_holds_no_law_is_refused(content, said, tmp_path):
    if content is not None:
        (tmp_path / "design.json").write_text(content, encoding="utf-8")
    for source in (tmp_path / "design.json", tmp_path):
        if source.exists() and (content is not None or source.is_dir()):
            with pytest.raises(BadInput, match=said):
                up.export(source, to="python", out=tmp_path / "out")


def test_a_limit_is_for_forms_that_take_one(tmp_path):
    with pytest.raises(BadInput, match="the limit is that of the fit; limit is for gymnasium"):
        up.export(up.Pendulum(m_p=0.2, l_cg=0.2), to="mjcf", limit=1.0, out=tmp_path)
    with pytest.raises(BadInput, match="an environment draws its rigs from a fit"):
        up.export(up.Pendulum(m_p=0.2, l_cg=0.2), to="gymnasium", limit=1.0, out=tmp_path)
