"""Is the code for a GPU whole: one kernel, double precision, nothing that it would have to find elsewhere?"""

from __future__ import annotations

import re
import shutil
import subprocess

import pytest

from tests.simulation.driver import words
from tests.simulation.kernel.test_interpreted import CASES
from upright.simulation import choose
from upright.simulation.kernel.compiled import Kernel, source
from upright.simulation.kernel.flavour import lay_out
from upright.simulation.kernel.lanes import room


def ptx(case, *, record=True):
    """Code of a flavour, commands late by four samples at most."""
    plant, more, loop, held = CASES[case]
    values = {**plant.parameters(), **more}
    derived = plant.derived_for(values)
    layout = lay_out(derived, choose(derived, values, held=held, loop=loop and loop(1), record=record))
    return Kernel(source(layout)).ptx(room(layout, 1, 7)).decode()


@pytest.mark.parametrize("record", [True, False])
@pytest.mark.parametrize(
    "case", ["smooth", "a rule", "a linear law", "dry friction at two joints", "elementary functions and kinks"]
)
def test_the_code_is_one_kernel_and_all_it_needs(case, record):
    code = ptx(case, record=record)
    assert re.findall(r"\.visible \.entry (\w+)\(", code) == ["lanes"]
    assert ".visible .func" not in code
    assert ".target sm_80" in code
    assert ".extern" not in code
    assert "fma.rn.f64" in code
    # neither single precision nor what is only nearly right
    assert not re.search(r"\.f32|\.approx", code)


def test_the_kernel_takes_what_the_launch_gives():
    """37 words of 8 bytes: eight numbers, ten arrays, and their nineteen sizes."""
    head = ptx("smooth").split(".entry lanes(")[1].split("\n)")[0]
    kinds = re.findall(r"\.param \.(\w)64", head)
    assert len(kinds) == len(words()) == 8 + 10 + 19
    assert [k for k, kind in enumerate(kinds) if kind == "f"] == [
        k for k, word in enumerate(words()) if word.__name__ == "c_double"
    ]


@pytest.mark.parametrize("case", ["smooth", "a rule"])
def test_a_lane_lives_in_registers(case):
    """Where nobody searches for events and no command is on its way; `.local` is memory, a hundred times slower."""
    assert ".local" not in ptx(case)


@pytest.mark.skipif(shutil.which("ptxas") is None, reason="no ptxas at hand; nvidia-cuda-nvcc brings it")
@pytest.mark.slow
@pytest.mark.parametrize("case", CASES)
def test_nvidias_own_assembler_takes_it(case, tmp_path):
    (tmp_path / "lanes.ptx").write_text(ptx(case), encoding="utf-8")
    for gpu in ("sm_80", "sm_90"):
        subprocess.run(["ptxas", f"-arch={gpu}", "lanes.ptx", "-o", "lanes.cubin"], cwd=tmp_path, check=True)
