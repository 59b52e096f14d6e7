"""What the rig is: plants, their equations of motion and their linear models."""

from __future__ import annotations

import importlib.util
import sys
import traceback
from collections.abc import Generator
from contextlib import contextmanager
from contextvars import ContextVar
from pathlib import Path

from upright.declared import Declared
from upright.errors import BadInput, UprightError, nearest
from upright.files import OWN_FILE, regular
from upright.physics.equations import Derived, DryJoint
from upright.physics.furuta import Furuta
from upright.physics.links import DoublePendulum, DoublePendulumAbsolute, FlexibleLink
from upright.physics.oscillators import added_inertia, added_mass, chain
from upright.physics.pendulums import CartPendulum, Pendulum
from upright.physics.plant import Plant
from upright.physics.statement import Coordinate, Input, Joint

__all__ = [
    "BUILT_IN",
    "PLANTS",
    "CartPendulum",
    "Coordinate",
    "Derived",
    "DoublePendulum",
    "DoublePendulumAbsolute",
    "DryJoint",
    "FlexibleLink",
    "Furuta",
    "Input",
    "Joint",
    "Pendulum",
    "Plant",
    "added_inertia",
    "added_mass",
    "chain",
    "find",
    "name_of",
]

BUILT_IN: dict[str, type[Plant]] = {
    "pendulum": Pendulum,
    "cart-pendulum": CartPendulum,
    "furuta": Furuta,
    "double-pendulum": DoublePendulum,
    "double-pendulum-absolute": DoublePendulumAbsolute,
    "flexible-link": FlexibleLink,
    **{f"{kind}-{n}": chain(n, kind) for kind in ("rectilinear", "torsional") for n in (1, 2, 3)},
}
PLANTS = Declared(
    "plant", "upright.plants", lambda: BUILT_IN, lambda value: isinstance(value, type) and issubclass(value, Plant)
)
"""Every plant that has a name: the built-in ones, then those of entry points."""
_ALIASES = {
    "pendubot": "double-pendulum",
    "chain": "rectilinear-2",
    "rectilinear": "rectilinear-2",
    "torsional": "torsional-2",
} | {f"chain-{n}": f"rectilinear-{n}" for n in (1, 2, 3)}


_IN_MEMORY: ContextVar[type[Plant] | None] = ContextVar("in_memory", default=None)


@contextmanager
def called_by_its_name(plant: type[Plant]) -> Generator[str]:
    """The name by which `find` gives a class that stands in no file, while this lasts."""
    before = _IN_MEMORY.set(plant)
    try:
        yield plant.__name__
    finally:
        _IN_MEMORY.reset(before)


def find(name: str, folder: Path | None = None) -> type[Plant]:
    """Plant class by name.

    Parameters
    ----------
    name : str
        ``"furuta"``, ``"cart-pendulum"``, ``"pendulum"``, ``"chain"`` (two carts), ``"torsional-3"``, ...,
        or ``"my_plant.py:DoublePendulum"``: a class in a file of the user's own; or one that a package adds.
    folder : Path, optional
        Where a relative file is looked for; the current folder when omitted.

    Raises
    ------
    BadInput
        When there is no such plant, file or class.
    """
    own = _IN_MEMORY.get()
    if own is not None and name == own.__name__:
        return own
    if ".py:" in name:
        file, _, class_name = name.rpartition(":")
        return _from_file((folder or Path()) / file, class_name)
    if name.endswith(".py"):
        raise BadInput(f"name the class in the file too, such as '{name}:DoublePendulum'.")
    key = _ALIASES.get(name.lower(), name.lower())
    if key in BUILT_IN:
        return BUILT_IN[key]
    kind, _, bodies = key.replace("chain", "rectilinear").partition("-")
    if kind in ("rectilinear", "torsional") and bodies.isdigit():
        return chain(int(bodies), kind)
    if name in PLANTS:
        return PLANTS[name]
    raise BadInput(f"no plant is called '{name[:60]}'; {nearest(name, [*PLANTS, 'chain', 'my_plant.py:ClassName'])}")


def name_of(plant: type[Plant]) -> str:
    """Name by which `find` gives a plant; empty for one in a file of the user's own."""
    bodies = len(plant.coordinates)
    chains = {f"{kind}-{bodies}": chain(bodies, kind) for kind in ("rectilinear", "torsional") if bodies <= 9}
    return next((name for name, kind in {**PLANTS.sound(), **chains}.items() if kind is plant), "")


def _from_file(path: Path, class_name: str) -> type[Plant]:
    if not path.exists():
        raise BadInput(f"the plant's file {path} does not exist; give it relative to the study file.")
    regular(path)
    spec = importlib.util.spec_from_file_location(OWN_FILE + path.stem, path)
    if spec is None or spec.loader is None:
        raise BadInput(f"the plant's file {path} is no Python file.")
    module = importlib.util.module_from_spec(spec)
    sys.modules[spec.name] = module
    try:
        spec.loader.exec_module(module)
    except UprightError as error:
        raise type(error)(f"{path}: {error}") from error
    except SyntaxError as error:
        raise BadInput(f"the plant's file {path} has a syntax error in line {error.lineno}: {error.msg}.") from error
    except Exception as error:
        lines = [f.lineno for f in traceback.extract_tb(error.__traceback__) if Path(f.filename) == path]
        where = f" stops in line {lines[-1]}" if lines else " does not run"
        raise BadInput(f"the plant's file {path}{where}: {type(error).__name__}: {error}.") from error
    plants = {k: v for k, v in vars(module).items() if isinstance(v, type) and issubclass(v, Plant) and v is not Plant}
    if class_name not in plants:
        raise BadInput(f"{path} has no plant '{class_name}'; {nearest(class_name, plants)}")
    return plants[class_name]
