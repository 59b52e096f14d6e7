"""Does everything that is shown also run? Scripts, plants and studies in examples/, commands in the pages."""

import ast
import importlib.util
import json
import os
import re
import shlex
import subprocess
import sys
from dataclasses import MISSING, fields
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

from upright.cli import COMMANDS, NESTED, app
from upright.physics import Plant, find
from upright.simulation import simulate

ROOT = Path(__file__).parents[1]
EXAMPLES = ROOT / "examples"
NOTEBOOKS = sorted((ROOT / "docs" / "tutorials").glob("*.ipynb"))
WRITTEN = [path for path in sorted((ROOT / "docs").glob("**/*.md")) if "_build" not in path.parts]
PAGES = [ROOT / "README.md", ROOT / "CONTRIBUTING.md", *WRITTEN, *NOTEBOOKS]


def classes(path: Path) -> list[str]:
    """Names of the plants in a file, read without running it."""
    tree = ast.parse(path.read_text(encoding="utf-8"))
    bases = {"Plant", "Pendulum", "CartPendulum", "Furuta"}
    return [
        node.name
        for node in tree.body
        if isinstance(node, ast.ClassDef) and bases & {getattr(b, "id", getattr(b, "attr", "")) for b in node.bases}
    ]


PLANTS = [(path, name) for path in sorted(EXAMPLES.glob("plants/*.py")) for name in classes(path)]
SCRIPTS = sorted(EXAMPLES.glob("*.py"))
STUDIES = sorted(EXAMPLES.glob("studies/*.toml"))


def name_of(value: object) -> str:
    return value.name if isinstance(value, Path) else str(value)


def test_there_is_something_to_run():
    assert PLANTS
    assert STUDIES


def told(script: Path) -> str:
    """What a script says of itself."""
    return ast.get_docstring(ast.parse(script.read_text(encoding="utf-8"))) or ""


def marked(script: Path):
    """A script that works on DATA, the folder of public logs, needs them."""
    return pytest.param(script, id=script.name, marks=[pytest.mark.real_data] if "DATA" in told(script) else [])


def sources(path: Path) -> str:
    """Python of a script, or of a notebook's cells."""
    text = path.read_text(encoding="utf-8")
    if path.suffix == ".py":
        return text
    cells = [cell["source"] for cell in json.loads(text)["cells"] if cell["cell_type"] == "code"]
    return "\n".join("".join(lines) for lines in cells)


@pytest.mark.parametrize("path", [*SCRIPTS, *NOTEBOOKS], ids=name_of)
def test_what_is_imported_exists(path):
    """Long before the slow tests run it all."""
    for node in ast.walk(ast.parse(sources(path))):
        if isinstance(node, ast.ImportFrom) and (node.module or "").partition(".")[0] == "upright":
            module = importlib.import_module(node.module)
            for alias in node.names:
                found = hasattr(module, alias.name) or importlib.util.find_spec(f"{node.module}.{alias.name}")
                assert found, f"{path.name} imports {alias.name} from {node.module}, which has no such thing"


@pytest.mark.slow
@pytest.mark.parametrize("script", [marked(script) for script in SCRIPTS])
def test_a_script_runs_as_its_first_lines_say(script, tmp_path):
    """The command in the docstring; pictures it promises are there."""
    shown = re.search(r"^ +python (.+)$", told(script), re.M)
    assert shown, f"{script.name} should show how it is run"
    data = os.environ.get("UPRIGHT_REAL_DATA", "")
    words = [data if word == "DATA" else word for word in shlex.split(shown[1])]
    words = [str(ROOT / word) if (ROOT / word).is_file() else word for word in words]
    done = subprocess.run(
        [sys.executable, *words],
        cwd=tmp_path, env=os.environ | {"MPLBACKEND": "Agg"}, capture_output=True, encoding="utf-8", check=False,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    pictures = re.findall(r"\w+\.(?:png|svg)", told(script))
    assert pictures
    assert set(pictures) == {path.name for path in tmp_path.iterdir()}


@pytest.mark.parametrize(("path", "name"), PLANTS, ids=name_of)
def test_a_plant_from_a_file_stays_where_it_hangs(path, name):
    """An equilibrium is a place that is not left: the one named first is stable in every example."""
    plant = find(f"{path.name}:{name}", folder=path.parent)
    assert issubclass(plant, Plant)
    rig = plant(**{f.name: 0.1 for f in fields(plant) if f.default is MISSING})
    place = next(iter(plant.equilibria))
    assert np.all(np.isfinite(rig.linear(place).A))
    x0 = np.zeros(len(plant.state_names()))
    motion = simulate(rig, {}, x0, None, 1e-3, samples=201)
    np.testing.assert_allclose(motion[:, :, 0], np.broadcast_to(x0, (201, x0.size)), atol=1e-12)


@pytest.mark.real_data
@pytest.mark.parametrize("path", STUDIES, ids=name_of)
def test_a_study_finds_its_logs_and_says_whose_they_are(path, monkeypatch):
    from upright.study.load import load_study

    study = load_study(path, data=os.environ["UPRIGHT_REAL_DATA"])
    assert study.runs
    assert study.source, f"{path.name} should name the public source of its data"


def commands(page: Path) -> list[tuple[str, list[str]]]:
    """Every `upright COMMAND --option` shown on a page."""
    words = "|".join(f"{first} {name}" for first, names in NESTED.items() for name in names)
    pattern = rf"upright ({words}|[a-z]+(?:-[a-z]+)*)((?: [^\s`#|&;]+)*)"
    known = {*COMMANDS, *words.split("|")}
    shown = re.findall(pattern, page.read_text(encoding="utf-8"))
    return [(name, re.findall(r"(?<!\S)(--?[a-z][a-z-]*)", rest)) for name, rest in shown if name in known]


@pytest.mark.parametrize("page", PAGES, ids=name_of)
def test_pages_show_options_that_exist(page):
    for name, options in commands(page):
        listing = CliRunner().invoke(app, [*name.split(), "--help"], terminal_width=200).stdout
        for option in options:
            assert re.search(rf"{re.escape(option)}\b", listing), f"{page.name}: upright {name} has no {option}"


@pytest.mark.parametrize("page", PAGES, ids=name_of)
def test_pages_link_to_files_that_exist(page):
    for target in re.findall(r"\]\(([^)#:]+)\)", page.read_text(encoding="utf-8")):
        assert (page.parent / target).exists(), f"{page.name} links to {target}"


def test_the_index_of_the_pages_leaves_none_out():
    """Each page stands in the tree of contents of the first one, or of one that does."""
    docs = ROOT / "docs"
    named = {"index"}
    for page in WRITTEN:
        for tree in re.findall(r"```\{toctree\}\n(.*?)```", page.read_text(encoding="utf-8"), re.S):
            entries = [line for line in tree.splitlines() if line and not line.startswith(":")]
            named |= {(page.parent / entry).relative_to(docs).as_posix() for entry in entries}
    pages = {path.relative_to(docs).with_suffix("").as_posix() for path in [*WRITTEN, *NOTEBOOKS]}
    assert pages <= named
