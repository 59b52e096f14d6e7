"""A linear model to design for, of plain matrices: from a file in TOML, python-control's system, or arrays."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from upright.errors import BadInput, nearest

if TYPE_CHECKING:
    from upright.files import PathLike
    from upright.study.text import Section
    from upright.systems import StateSpace

KEYS = ("A", "B", "C", "D", "dt", "states", "inputs", "outputs", "units")


def is_linear(source: Any) -> bool:
    """Whether it is a linear model in one of its forms, rather than a rig."""
    return isinstance(source, tuple) or any(hasattr(source, name) for name in ("A", "num", "frdata"))


def linear_model(model: Any) -> StateSpace:
    """Model of a `control.StateSpace` or TransferFunction, a plant's ``linear(...)``, what `hold` gives, or arrays.

    Raises
    ------
    BadInput
        When it is none of these, or sampled without saying how often.
    """
    from upright.systems import StateSpace

    system = StateSpace.of(model)
    return system if system.name else replace(system, name="a linear model")


def read_matrices(path: PathLike) -> StateSpace:
    """Model of a file in TOML: A and B, and where they are not what goes without saying C, D, dt, names and units.

    Raises
    ------
    BadInput
        When the file cannot be read, or its matrices do not make a model.
    """
    from upright import units
    from upright.study.text import StudyText
    from upright.systems import StateSpace

    path = Path(path)
    if not path.exists():
        raise BadInput(f"{path} does not exist; name a file in TOML that holds A and B.")
    root = StudyText(path).root()
    for key in root.values:
        if key not in KEYS:
            raise root.error(key, f"matrices come with no '{key}'; {nearest(key, KEYS)}")
    for key in ("A", "B"):
        if key not in root:
            raise BadInput(f"{path} has no {key}; a model needs A and B, as in {key} = [[0, 1], [20, 0]].")
    with root.at("A"):
        model = StateSpace(*(_rows(root, key) for key in "ABCD"))  # type: ignore[arg-type] # None where there is none
    names = {kind: _names(root, kind, tuple(getattr(model, kind))) for kind in ("states", "inputs", "outputs")}
    if "outputs" not in root and "C" not in root:
        names["outputs"] = names["states"]
    period = root.number("dt", "s", 0.0)
    if "dt" in root and not 1e-6 <= period <= 10.0:
        raise root.error(
            "dt", f"a loop is closed every 1e-6 to 10 s, got {period:g} s; leave dt out if A is continuous"
        )
    section_of_units = root.section("units")
    known = [n for kind in names.values() for n in kind]
    for name, unit in section_of_units.values.items():
        if name not in known:
            raise section_of_units.error(
                name, f"[units] names states, inputs and outputs, got '{name}'; {nearest(name, known)}"
            )
        if not isinstance(unit, str):
            raise section_of_units.error(name, f'a unit is text, such as {name} = "rad", got {unit!r:.40}')
        with section_of_units.at(name):
            units.scale(unit)
    return replace(model, dt=period or None, units=dict(section_of_units.values), name=path.stem, **names)


def _rows(root: Section, key: str) -> list[list[float]] | None:
    """Matrix under a key, row by row; None where the file has none. Numbers alone are a column of B, a row else."""
    if key not in root:
        return None
    rows = root.values[key] if isinstance(root.values[key], list) else [root.values[key]]
    if rows and not any(isinstance(row, list) for row in rows):
        rows = [[number] for number in rows] if key == "B" else [rows]
    for i, row in enumerate(rows):
        if not isinstance(row, list) or len(row) != len(rows[0]):
            got = f"row {i + 1} has {len(row)} numbers and row 1 has {len(rows[0])}" if isinstance(row, list) else (
                f"row {i + 1} is {row!r:.40}"
            )  # fmt: skip
            raise root.error(key, f"{key} is a list of rows of the same length, such as [[0, 1], [20, 0]], but {got}")
        for j, number in enumerate(row):
            if isinstance(number, bool) or not isinstance(number, int | float) or not abs(number) < 1e300:
                raise root.error(key, f"{key} holds finite numbers, got {number!r:.40} in row {i + 1}, column {j + 1}")
    if not rows or not rows[0]:
        raise root.error(key, f"{key} is empty; a model has at least one state and one input")
    return rows


def _names(root: Section, kind: str, default: tuple[str, ...]) -> tuple[str, ...]:
    if kind not in root:
        return default
    names: Any = root.values[kind]
    good = isinstance(names, list) and all(isinstance(n, str) and n.strip() for n in names)  # type: ignore[reportUnknownVariableType]
    if not good or len(names) != len(default) or len(set(names)) != len(names):
        raise root.error(kind, f"{kind} needs {len(default)} different names in quotes, got {names!r:.60}")
    return tuple(names)
