"""Do the names of files lead to what a stranger looks for, with `ls` alone?"""

from pathlib import Path

import pytest

import upright

SOURCE = Path(upright.__file__).parent
FILES = [p.relative_to(SOURCE).as_posix() for ending in ("py", "md") for p in SOURCE.rglob(f"*.{ending}")]
SOUGHT = {
    "equation (3) of the paper": ("furuta", "equation (3)", "def energies("),
    "Ackermann's formula": ("placement", "Ackermann's formula", "def ackermann("),
    "the covariance of an estimate": ("covariance", "Covariance", "def assess("),
    "the supervisor": ("supervisor", "supervisor", "class Supervisor"),
    "a plant's simulation": ("simulation/simulate", "Simulation", "def simulate("),
    "the linear-quadratic regulator": ("lqr", "LQR", "def lqr("),
    "stability margins": ("margins", "Stability margins", "class Margins"),
    "a dead encoder": ("dead_encoder", "encoder", "class StillPendulum"),
    "the swing-up": ("control/swing_up", "Swing-up", "class SwingUp"),
    "the protocol of a rig": ("protocol", "protocol of every rig", "class Limits"),
}
"""What is looked for: the word in a file's path, words of its first line, and what stands in it."""


@pytest.mark.parametrize("thing", SOUGHT)
def test_one_file_is_called_by_what_a_stranger_looks_for_and_says_so_in_its_first_line(thing):
    word, said, there = SOUGHT[thing]
    named = [f for f in FILES if word in f.removesuffix(".py") and not f.startswith("verbs/")]
    assert len(named) == 1, named
    text = (SOURCE / named[0]).read_text(encoding="utf-8")
    assert said in text.partition("\n")[0]
    assert there in text


@pytest.mark.parametrize("number", ["1a", "1b", "2", "2b", "3", "4"])
def test_the_folder_of_an_experiment_ends_with_its_number_and_has_its_page(number):
    (folder,) = [p for p in (SOURCE / "experiments").iterdir() if p.name.endswith(f"_{number}")]
    assert f"Experiment {number}" in (folder / "__init__.py").read_text(encoding="utf-8").partition("\n")[0]
    assert any((folder / name).exists() for name in ("chapter.md", "chapter.py"))


def test_every_file_says_in_its_first_line_what_it_computes():
    silent = [f for f in FILES if f.endswith(".py") and not (SOURCE / f).read_text("utf-8").startswith(('"""', 'r"""'))]
    assert silent == []
