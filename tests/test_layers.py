"""Does data go one way? Plant -> record -> fit -> new plant -> report; every import in the source is read."""

import ast
from collections.abc import Iterator
from pathlib import Path

import pytest

import upright

SOURCE = Path(upright.__file__).parent
BENCHMARKS = Path(__file__).parents[1] / "benchmarks"

# Rooms from the ground up: each imports from those above its own line only. Rooms on one line do not see each other.
FLOORS = """
basis _version errors progress renamed shown
declared files
trust workers
quantities
units
signals
records
logs
readers
systems
physics
laws
logs.replay
simulation.lowering
simulation.kernel
simulation
gains
closed_loop
identification.model
identification.problem
identification.search
identification.inference
identification.checks identification.frequency identification.loadings
identification.ladder
identification
rig
study
study.draft
control
rigs
realtime
report
report.rig report.planes
report.fit
report.ladder report.law report.log
report.run
live
diagnosis questionnaire designing
paper
running
experiments.parallel
experiments.stand
experiments.weighing_1a
experiments.frequency_1b
experiments.regulation_2
experiments.swing_up_2b experiments.tracking_3 experiments.free_swing_4
experiments
exports
browser
verbs
views
cli
__main__
"""
FLOOR = {room: floor for floor, line in enumerate(FLOORS.split("\n")) for room in line.split()}
# What a room has no business to know although it stands above it.
BLIND = {
    "systems": {"units", "signals", "records", "readers"},
    "physics": {"signals", "records", "readers"},
    "laws": {"units", "signals", "records", "readers", "physics", "systems"},
    "simulation.lowering": {"units", "signals", "records", "readers", "physics", "laws"},
    "simulation.kernel": {"units", "signals", "records", "readers"},
    "simulation": {"units", "signals", "records", "readers"},
    "gains": {"signals", "records", "readers", "simulation", "simulation.kernel"},
    "rig": {"readers", "identification"},
    "control": {"readers", "identification", "study"},
    "rigs": {"identification"},
    "realtime": {"identification", "study", "readers"},
    "questionnaire": {"records", "readers", "physics", "simulation", "identification", "study", "control"},
}
# How a page is written is one thing, what it says another.
BLIND["report"] = FLOOR.keys() - {"_version", "basis", "errors", "files", "progress", "quantities", "units"}
# A heavy library has one door, opened when it is first needed: a room, or files of a name.
DOORS = {
    "sympy": "physics",
    "llvmlite": "machine",
    "cuda": "gpu",
    "scipy.optimize": "identification closed_loop",
    "lmfit": "identification",
    "mpmath": "gains",
    "matplotlib": "report views figures",
    "jinja2": "report",
    "typst": "report",
    "pint": "units",
    "typer": "cli",
    "starlette": "browser",
    "uvicorn": "browser",
    "mcap": "logs",
    "zstandard": "logs",
    "serial": "line",
    "gymnasium": "environment",
    "loky": "workers",
    "cloudpickle": "workers",
    "distributed": "workers",
    "threadpoolctl": "workers",
}


def imports(tree: ast.AST, package: list[str]) -> Iterator[tuple[int, str]]:
    """Line and dotted name of every import, also inside functions; relative ones made absolute."""
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            for alias in node.names:
                yield node.lineno, alias.name
        elif isinstance(node, ast.ImportFrom):
            above = package[: len(package) - node.level + 1] if node.level else []
            origin = ".".join([*above, *filter(None, [node.module])])
            for alias in node.names:
                yield node.lineno, f"{origin}.{alias.name}"
        elif isinstance(node, ast.Call) and ast.unparse(node.func).endswith("import_module") and node.args:
            named = node.args[0].values[0] if isinstance(node.args[0], ast.JoinedStr) else node.args[0]
            if isinstance(named, ast.Constant):  # the part of a name that is written out
                yield node.lineno, str(named.value).rstrip(".")


def room_of(name: str) -> str:
    """Room that a dotted name of ours stands in, the innermost that has a floor; "" for the front door itself."""
    parts = name.split(".")[1:]
    for n in range(len(parts), 0, -1):
        if ".".join(parts[:n]) in FLOOR:
            return ".".join(parts[:n])
    return ""


def wrong_arrows(source: str, module: str) -> list[str]:
    """Sentences about the imports of one module, named as in `upright.physics.plant`, that point up or aside."""
    room = room_of(module)
    if not room:
        return [f"{module} stands in no room; give it a floor in FLOORS"]
    found = []
    for line, name in imports(ast.parse(source), module.split(".")[:-1]):
        to = room_of(name) if name.startswith("upright.") else ""
        if to and to != room and (FLOOR[to] >= FLOOR[room] or to in BLIND.get(room, ())):
            found.append(f"{module}:{line}: {room} may not import {name}")
        elif not to and (name == "upright" or name.startswith("upright.")):
            found.append(f"{module}:{line}: the front door is for users; import {name} from its room")
        for library, door in DOORS.items():
            doors = {room.split(".")[0], module.rpartition(".")[2]}
            if f"{name}.".startswith(f"{library}.") and not doors & set(door.split()):
                found.append(f"{module}:{line}: only {door} may import {library}")
    return found


def module_name(path: Path, root: Path = SOURCE) -> str:
    parts = path.relative_to(root.parent).with_suffix("").parts
    return ".".join(parts[:-1] if parts[-1] == "__init__" else parts)


def circles(root: Path) -> list[list[str]]:
    """Modules that import each other, whether at once or when a function is called."""
    files = {module_name(path, root): path for path in root.rglob("*.py")}
    arrows: dict[str, set[str]] = {}
    for module, path in files.items():
        package = module.split(".") if path.name == "__init__.py" else module.split(".")[:-1]
        names = {name for _, name in imports(ast.parse(path.read_text(encoding="utf-8")), package)}
        arrows[module] = {n if n in files else n.rpartition(".")[0] for n in names} & files.keys() - {module}
    order: dict[str, int] = {}
    stack: list[str] = []
    found: list[list[str]] = []

    def visit(module: str) -> int:  # Tarjan's strongly connected components
        lowest = order[module] = len(order)
        stack.append(module)
        for other in sorted(arrows[module]):
            if other not in order:
                lowest = min(lowest, visit(other))
            elif other in stack:
                lowest = min(lowest, order[other])
        if lowest == order[module]:
            circle = stack[stack.index(module) :]
            del stack[stack.index(module) :]
            if len(circle) > 1:
                found.append(sorted(circle))
        return lowest

    for module in sorted(arrows):
        if module not in order:
            visit(module)
    return found


FILES = sorted(path for path in SOURCE.rglob("*.py") if path != SOURCE / "__init__.py")


@pytest.mark.parametrize("path", FILES, ids=module_name)
def test_no_import_points_up(path):
    assert wrong_arrows(path.read_text(encoding="utf-8"), module_name(path)) == []


@pytest.mark.parametrize("root", [SOURCE, BENCHMARKS], ids=lambda root: root.name)
def test_no_two_modules_import_each_other(root):
    assert circles(root) == []


def test_a_circle_is_found(tmp_path):
    house = tmp_path / "house"
    house.mkdir()
    (house / "a.py").write_text("from house import b")
    (house / "b.py").write_text("def later():\n    from house.c import thing")
    (house / "c.py").write_text("import house.a")
    (house / "d.py").write_text("import house.a")
    assert circles(house) == [["house.a", "house.b", "house.c"]]


def test_no_folder_is_a_heap():
    """More than about a dozen files side by side means that a concept is missing a name; 16 is the limit."""
    crowded = {folder: len(list(folder.glob("*.py"))) for folder in {path.parent for path in FILES}}
    assert {module_name(folder / "x").rpartition(".")[0]: n for folder, n in crowded.items() if n > 16} == {}


def test_no_two_types_share_a_name():
    homes: dict[str, list[str]] = {}
    for path in FILES:
        for node in ast.parse(path.read_text(encoding="utf-8")).body:
            if isinstance(node, ast.ClassDef) and not node.name.startswith("_"):
                homes.setdefault(node.name, []).append(module_name(path))
    assert {name: where for name, where in homes.items() if len(where) > 1} == {}


def test_few_functions_share_a_name():
    """Verbs are called as their engines, chapters and readers as their rooms; the house asks for 12 at most."""
    homes: dict[str, list[str]] = {}
    for path in FILES:
        for node in ast.parse(path.read_text(encoding="utf-8")).body:
            if isinstance(node, ast.FunctionDef) and not node.name.startswith("_"):
                homes.setdefault(node.name, []).append(module_name(path))
    shared = {name: where for name, where in homes.items() if len(where) > 1}
    assert len(shared) <= 12, shared


def test_no_file_is_called_after_a_drawer():
    drawers = {"utils", "util", "misc", "manager", "helpers"}
    assert [module_name(p) for p in SOURCE.rglob("*") if p.stem in drawers] == []


@pytest.mark.parametrize(
    ("source", "module"),
    [
        ("import upright.simulation", "upright.physics.plant"),
        ("from upright.report import figures", "upright.identification.estimate"),
        ("from upright import records", "upright.physics.plant"),
        ("from upright import identify", "upright.cli.model.identify"),
        ("def later():\n    from upright.cli import app", "upright.experiments.laboratory"),
        ("from ..simulation import simulate", "upright.physics.plant"),
        ("from upright.identification.estimate import identify", "upright.identification.problem.residuals"),
        ("from upright.experiments.tracking_3 import run", "upright.experiments.free_swing_4.run"),
        ("import sympy as sp", "upright.simulation.kernel.compiled"),
        ("def later():\n    from sympy import sin", "upright.experiments.laboratory"),
        ("from scipy import optimize", "upright.simulation.kernel.compiled"),
        ("import scipy.optimize", "upright.report.fit.figures"),
        ("from scipy.optimize import brentq", "upright.physics.plant"),
        ("import lmfit", "upright.report.fit.tables"),
        ("import upright.records", "upright.report.page"),
        ("import jinja2", "upright.experiments.weighing_1a.chapter"),
        ("import matplotlib", "upright.experiments.weighing_1a.chapter"),
        ("from matplotlib.figure import Figure", "upright.diagnosis.chapter"),
        ("import llvmlite", "upright.physics.equations"),
        ("import pint", "upright.study.load"),
        ("from loky import get_reusable_executor", "upright.identification.estimate"),
        ("x = 1", "upright.drawer.thing"),
        ("from importlib import import_module\nimport_module('upright.views')", "upright.records.record"),
        ("import importlib\nimportlib.import_module(f'upright.cli.{x}')", "upright.verbs.log"),
    ],
)
def test_an_arrow_that_points_up_is_refused(source, module):
    assert len(wrong_arrows(source, module)) == 1


@pytest.mark.parametrize(
    ("source", "module"),
    [
        ("from upright.errors import BadInput", "upright.physics.plant"),
        ("from .lagrange import derive", "upright.physics.plant"),
        ("from ..physics import find", "upright.simulation.simulate"),
        ("import scipy.linalg", "upright.physics.plant"),
        ("from upright._version import __version__", "upright.report.html"),
        ("from matplotlib.figure import Figure", "upright.experiments.weighing_1a.figures"),
        ("import matplotlib", "upright.report.drawing"),
        ("def later():\n    from upright.experiments import laboratory", "upright.cli.course.lab"),
        ("import sympy", "upright.physics.lagrange"),
        ("from upright.identification.problem.residuals import Problem", "upright.identification.search.descent"),
    ],
)
def test_an_arrow_that_points_down_is_welcome(source, module):
    assert wrong_arrows(source, module) == []
