"""Do the notebooks of docs/ still run, say what they said, and tell nothing about whoever ran them last?"""

import copy
import re
import subprocess
import sys
from pathlib import Path

import nbformat
import pytest
from nbformat.v4 import new_code_cell, new_notebook, new_output

from docs import nomenclature
from docs.notebook import CellFailed, alike, differences, executed
from upright.physics import BUILT_IN

ROOT = Path(__file__).parents[1]
NOTEBOOKS = sorted((ROOT / "docs" / "tutorials").glob("*.ipynb"))
LARGEST = 200_000  # bytes, pictures included, so that a clone stays quick
OWN_FOLDERS = re.compile(r"(?<![\w.:/])/(home|root|tmp|opt|Users|work|mnt|var)/|[A-Z]:\\\\")


def stem(path):
    return path.stem


def cells(notebook):
    return [cell for cell in notebook.cells if cell.cell_type == "code"]


def stored_in(path):
    return nbformat.read(path, as_version=4)


def sources(path):
    return "\n".join(cell.source for cell in cells(stored_in(path)))


def of(*code):
    """Notebook of these cells, never run."""
    return new_notebook(cells=[new_code_cell(source) for source in code])


@pytest.mark.slow
@pytest.mark.parametrize("path", NOTEBOOKS, ids=stem)
def test_a_notebook_runs_and_says_what_is_stored(path):
    done = subprocess.run(
        [sys.executable, "-m", "docs", "--check", path.stem],
        cwd=ROOT, capture_output=True, encoding="utf-8", check=False,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr


@pytest.mark.parametrize("path", NOTEBOOKS, ids=stem)
def test_a_notebook_is_stored_as_it_was_run_from_top_to_bottom(path):
    stored = stored_in(path)
    assert [cell.execution_count for cell in cells(stored)] == list(range(1, len(cells(stored)) + 1))
    assert {output.output_type for cell in cells(stored) for output in cell.outputs} <= {
        "stream",
        "display_data",
        "execute_result",
    }


@pytest.mark.parametrize("path", NOTEBOOKS, ids=stem)
def test_a_notebook_is_small_and_tells_nothing_of_a_machine(path):
    assert path.stat().st_size < LARGEST
    stored = stored_in(path)
    assert set(stored.metadata) == {"kernelspec", "language_info"}
    assert set(stored.metadata.language_info) == {"name"}
    said = "".join(o.get("text", "") for cell in cells(stored) for o in cell.outputs)
    assert not OWN_FOLDERS.search(said)


@pytest.mark.parametrize("path", NOTEBOOKS, ids=stem)
def test_every_picture_and_table_of_a_notebook_is_introduced(path):
    """A student is never shown a cell without a sentence between it and the one before the last."""
    kinds = "".join(cell.cell_type[0] for cell in stored_in(path).cells)
    assert kinds.startswith("m")
    assert "ccc" not in kinds


@pytest.mark.parametrize("path", NOTEBOOKS, ids=stem)
def test_a_section_of_a_notebook_begins_a_line_and_comes_once(path):
    """Two cells that a merge ran into one show here."""
    text = "\n".join(cell.source for cell in stored_in(path).cells if cell.cell_type == "markdown")
    text = re.sub(r"```.*?```", "", text, flags=re.S)
    sections = re.findall(r"^#+ .*", text, re.M)
    assert sections == list(dict.fromkeys(sections))
    assert not re.findall(r"^.*\w.*#+ .*", text, re.M)


@pytest.mark.slow
@pytest.mark.parametrize("path", NOTEBOOKS, ids=stem)
def test_the_hidden_solution_of_an_exercise_runs_by_itself(path, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    hidden = [cell.source for cell in stored_in(path).cells if cell.source.startswith("<details>")]
    solutions = [code for source in hidden for code in re.findall(r"```python\n(.*?)```", source, re.S)]
    assert len(solutions) == len(hidden) > 0
    for solution in solutions:
        exec(compile(solution, path.stem, "exec"), {})


def test_a_notebook_imports_nothing_of_the_checkout():
    """So that it runs where only the package is installed."""
    for path in NOTEBOOKS:
        imported = re.findall(r"^(?:from|import) (docs|tests|benchmarks|examples)\b", sources(path), re.M)
        assert not imported, path.name


@pytest.mark.parametrize("path", NOTEBOOKS, ids=stem)
def test_a_notebook_uses_public_names_alone_and_shows_a_rig_that_moves(path):
    assert re.findall(r"^ *(?:from|import) upright.*", sources(path), re.M) == ["import upright as up"]
    assert re.search(r"\.play\(", sources(path))


@pytest.mark.slow
@pytest.mark.parametrize(
    ("right", "wrong"),
    [
        ("inertia(rod, J_a, J_p, J_p)", "inertia(rod, J_p, J_p, J_p)"),  # its first exercise: the rod as printed
        ("(theta, arm.y)", "(-theta, arm.y)"),  # the rod turned the other way
        ("place.dt(ground)", "place.dt(arm)"),  # a velocity as the arm sees it
    ],
)
def test_the_derivation_of_eq_3_notices_a_mistake(right, wrong):
    notebook = stored_in(ROOT / "docs" / "tutorials" / "experiment_4.ipynb")
    code = [cell.source for cell in cells(notebook)]
    assert sum(right in source for source in code) == 1
    with pytest.raises(CellFailed, match=r"cell 7 raises AssertionError"):
        executed(of(*(source.replace(right, wrong) for source in code)))


def test_cells_share_their_names_and_show_print_picture_and_last_value():
    import base64

    fresh = executed(
        of(
            "x = 20\nprint('printed')\nx + 1",
            "import matplotlib.pyplot as plt\nplt.plot([0, x]);",
            "from matplotlib.figure import Figure\nFigure()",
            "class Formula:\n    def _repr_latex_(self):\n        return '$x$'\nFormula()",
            "display(x)\nx = None\nx",
        )
    )
    printed, drawn, figure, formula, last = (cell.outputs for cell in cells(fresh))
    assert [o.output_type for o in printed] == ["stream", "execute_result"]
    assert printed[1].data == {"text/plain": "21"}
    for output in (drawn[0], figure[-1]):
        assert base64.b64decode(output.data["image/png"]).startswith(b"\x89PNG")
        assert output.metadata["image/png"]["alt"] == output.data["text/plain"]
    assert formula[0].data == {"text/latex": "$x$", "text/plain": "a formula or table"}
    assert [o.data["text/plain"] for o in last] == ["20"]


def test_a_cell_that_raises_is_named():
    with pytest.raises(CellFailed, match="cell 2 raises ZeroDivisionError"):
        executed(of("x = 0", "1 / x"))


def test_a_notebook_that_says_something_else_is_told():
    stored = executed(of("print('gain', 3.14)", "1"))
    assert list(differences(stored, stored)) == []
    other = copy.deepcopy(stored)
    cells(other)[0].outputs[0].text = "gain 3.24\n"
    assert len(list(differences(stored, other))) == 1
    in_pieces = copy.deepcopy(stored)  # as Jupyter may store them
    cells(in_pieces)[0].outputs = [new_output("stream", text=text) for text in ("gain ", "3.14\n")]
    assert list(differences(stored, in_pieces)) == []
    silent = copy.deepcopy(stored)
    cells(silent)[1].outputs = []
    assert len(list(differences(stored, silent))) == 1


@pytest.mark.parametrize(
    ("stored", "fresh", "same"),
    [
        ("k = 390.1 N/m", "k = 390.2 N/m", True),  # one in the last digit printed
        ("k = 390.1 N/m", "k = 390.3 N/m", False),
        ("k = 390.1 N/m", "k = 390.1 N/mm", False),
        ("2.93e-05", "2.94e-05", True),
        ("2.93e-05", "2.93e-04", False),
        ("-0.0", "0.0", True),  # the sign of nothing
        ("99", "100", True),  # rounding may add a digit
        ("a 1", "a  1", True),  # columns shift with it
        ("1 2", "1", False),
    ],
)
def test_numbers_may_differ_by_one_in_their_last_digit(stored, fresh, same):
    assert alike(stored, fresh) is same


def test_the_nomenclature_is_that_of_the_plants():
    assert (ROOT / "docs" / "reference" / "nomenclature.md").read_text(encoding="utf-8") == nomenclature.page()


@pytest.mark.parametrize("plant", BUILT_IN)
def test_the_nomenclature_knows_every_name_of_a_plant(plant):
    """Bodies of a chain are alike: what holds for 2 and its neighbour holds for 3."""
    told = set(re.findall(r"^\| `(\w+)` \| .+? \| .+? \| .+? \|", nomenclature.page(), re.M))
    kind = BUILT_IN[plant]
    names = {*kind.names(), *(c.name for c in kind.coordinates), *(i.name for i in kind.inputs)}
    assert {name.replace("23", "12").replace("_3", "_2") for name in names} <= told
