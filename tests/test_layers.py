"""Does data go one way? Plant -> record -> fit -> new plant -> report; every import in the source is read."""

import ast
from collections.abc import Iterator
from pathlib import Path

import pytest

import upright

SOURCE = Path(upright.__file__).parent

BASE = {"errors", "quantities", "units"}
MAY_IMPORT = {
    "errors": set(),
    "quantities": {"errors"},
    "units": {"errors", "quantities"},
    "records": BASE,
    "readers": BASE | {"records"},
    "physics": {"errors", "quantities"},
    "design": BASE | {"physics"},
    "simulation": {"errors", "quantities", "physics"},
    "identification": BASE | {"records", "readers", "physics", "simulation"},
    "survey": BASE,
    "control": BASE | {"records", "physics", "design", "simulation"},
    "doctor": BASE | {"records", "readers", "physics", "simulation", "identification"},
    "report": BASE
    | {"survey", "records", "readers", "physics", "design", "simulation", "control", "identification", "doctor"},
    "lab": BASE | {"records", "readers", "physics", "design", "simulation", "control", "identification", "report"},
    "cli": BASE
    | {"survey", "records", "readers", "physics", "design", "simulation", "control", "identification", "doctor"}
    | {"report", "lab"},
    "__main__": {"cli"},
    "__init__": BASE | {"records", "readers", "physics", "simulation", "identification", "doctor", "report", "lab"},
}
SAME_LAYER = {"exchange": "records"}  # a Record's ways to and from other tools: one layer in two files
# A heavy library has one door, opened when it is first needed.
DOORS = {
    "sympy": "physics",
    "numba": "simulation",
    "scipy.optimize": "identification",
    "lmfit": "identification",
    "mpmath": "design",
    "matplotlib": "report",
    "jinja2": "report",
    "typst": "report",
    "pint": "units",
    "typer": "cli",
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


def layer_of(name: str) -> str:
    """Layer that a dotted name of ours belongs to: `upright.physics.plant.Plant` -> `physics`."""
    first = [*name.split("."), "__init__"][1]
    first = SAME_LAYER.get(first, first)
    is_module = first in MAY_IMPORT or (SOURCE / first).is_dir() or (SOURCE / f"{first}.py").is_file()
    return first if is_module else "__init__"  # a name defined in upright/__init__.py


def wrong_arrows(source: str, module: str) -> list[str]:
    """Sentences about the imports of one module, named as in `upright.physics.plant`, that point back."""
    layer = module.split(".")[1]
    layer = SAME_LAYER.get(layer, layer)
    if layer not in MAY_IMPORT:
        return [f"{module}: '{layer}' is no layer; give it a place in MAY_IMPORT"]
    found = []
    for line, name in imports(ast.parse(source), module.split(".")[:-1]):
        if name == "upright" or name.startswith("upright."):
            to = layer_of(name)
            if to not in MAY_IMPORT[layer] | {layer} and name != "upright.__version__":
                found.append(f"{module}:{line}: {layer} may not import {name}")
        for library, door in DOORS.items():
            if f"{name}.".startswith(f"{library}.") and layer != door:
                found.append(f"{module}:{line}: only {door} may import {library}")
    return found


def module_name(path: Path) -> str:
    parts = path.relative_to(SOURCE.parent).with_suffix("").parts
    return ".".join(parts)


@pytest.mark.parametrize("path", sorted(SOURCE.rglob("*.py")), ids=module_name)
def test_no_import_points_back(path):
    assert wrong_arrows(path.read_text(encoding="utf-8"), module_name(path)) == []


def test_no_file_is_called_after_a_drawer():
    drawers = {"utils", "util", "misc", "manager", "helpers", "common"}
    assert [module_name(p) for p in SOURCE.rglob("*") if p.stem in drawers] == []


@pytest.mark.parametrize(
    ("source", "module"),
    [
        ("import upright.simulation", "upright.physics.plant"),
        ("from upright.report import figures", "upright.identification.fit"),
        ("from upright import records", "upright.physics.plant"),
        ("def later():\n    from upright.cli import app", "upright.lab.free_swing_4.run"),
        ("from ..simulation import simulate", "upright.physics.plant"),
        ("import sympy as sp", "upright.simulation.kernel"),
        ("def later():\n    from sympy import sin", "upright.lab.free_swing_4.run"),
        ("from scipy import optimize", "upright.simulation.kernel"),
        ("import scipy.optimize", "upright.report.figures"),
        ("from scipy.optimize import brentq", "upright.physics.plant"),
        ("import lmfit", "upright.report.tables"),
        ("from matplotlib import pyplot", "upright.identification.fit"),
        ("import numba", "upright.physics.derived"),
        ("import pint", "upright.study.load"),
        ("x = 1", "upright.drawer.thing"),
    ],
)
def test_an_arrow_that_points_back_is_refused(source, module):
    assert len(wrong_arrows(source, module)) == 1


@pytest.mark.parametrize(
    ("source", "module"),
    [
        ("from upright.errors import BadInput", "upright.physics.plant"),
        ("from .lagrange import derive", "upright.physics.plant"),
        ("from ..physics import find", "upright.simulation.kernel"),
        ("import scipy.linalg", "upright.physics.linear"),
        ("from upright import __version__", "upright.report.document"),
        ("def later():\n    from upright.lab import release", "upright.cli.lab"),
        ("import sympy", "upright.physics.lagrange"),
    ],
)
def test_an_arrow_that_points_down_is_welcome(source, module):
    assert wrong_arrows(source, module) == []
