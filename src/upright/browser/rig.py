"""A rig of the bench as it is known before anything moves: its files, its law, and what a page draws it by."""

from __future__ import annotations

import json
import math
import re
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np

from upright.basis import Basis
from upright.browser.facts import facts
from upright.designing.proposal import design_unasked
from upright.designing.run import DesignRequest
from upright.errors import BadInput
from upright.files import replace_file
from upright.gains import Estimator, feedback, filtered, place, prefilter
from upright.gains.placement import swift_gains
from upright.gains.requests import read_poles
from upright.laws import Law, Rule, as_values
from upright.live.twin import Loop, unplayable
from upright.paper.reproduce import TABLE_1
from upright.records import Array
from upright.rig import Rig
from upright.rigs.rigfile import RigFile, read_rig_file
from upright.running.rig import LEAN, model_and_truth, read_law
from upright.systems import StateSpace

MEMORY, LONGEST_MEMORY = 0.5, 0.99
"""Of the filter that gives speeds, where nobody chose another, and the longest that may be chosen."""
TWIN, HARDWARE = "TWIN", "HARDWARE"


@dataclass(frozen=True, kw_only=True, eq=False)
class BenchRig:
    """A rig and its law.

    Attributes
    ----------
    name : str
        In addresses: lower case letters, digits and hyphens.
    rig_path, law_path : Path
        RIG.toml, and the file of the law.
    loop : Loop or None
        The law as state feedback; None where it is another.
    follows : bool
        Whether the law follows a reference.
    fit, fit_of : str
        Which fit of the bench describes it, and of which log that is; empty where its own RIG.toml does.
    """

    name: str
    rig_path: Path
    law_path: Path
    file: RigFile
    model: Rig
    law: Law | Rule
    basis: Basis
    loop: Loop | None
    follows: bool
    fit: str = ""
    fit_of: str = ""

    @property
    def kind(self) -> str:
        """Whether something can really move."""
        return HARDWARE if self.file.hardware else TWIN

    @property
    def zero(self) -> str:
        """Equilibrium at which its encoders are zeroed."""
        return (
            self.file.zero if self.file.zero in self.model.plant.equilibria else next(iter(self.model.plant.equilibria))
        )

    @property
    def at(self) -> str:
        """Equilibrium that is held."""
        return self.file.at if self.file.at in self.model.plant.equilibria else self.zero

    @property
    def still(self) -> str:
        """Why no page can move it by itself; empty where one can."""
        if self.loop is None:
            return f"the law of {self.name} is no feedback of states, so that nothing of it can be dragged."
        lacks = unplayable(self.model)
        return "" if lacks is None else f"a twin in the page needs {lacks}."

    @property
    def memory(self) -> float | None:
        """Of the filter that gives the velocities, 0 for plain differences; None where the law has others."""
        if self.loop is None:
            return None
        p, A = len(self.model.per_unit), self.loop.estimator.A
        return float(A[p, p]) if len(A) > p else 0.0

    def with_memory(self, memory: float, folder: Path) -> BenchRig:
        """The same gains on velocities of another filter; its law is stored in the folder.

        Raises
        ------
        BadInput
            When the law is no state feedback from differences, or there is no such filter.
        """
        if self.loop is None:
            raise BadInput(f"the law of {self.name} has no filter for its velocities.")
        if not 0.0 <= memory <= LONGEST_MEMORY:
            raise BadInput(f"a filter's a lies from 0 to {LONGEST_MEMORY:g}, got {memory:g}.")
        loop = _looped(self.model, self.linear, _differences(self.model, self.at, memory), self.loop.K, self.follows)
        path = folder / f"law_{memory:g}.json"
        path.parent.mkdir(parents=True, exist_ok=True)
        replace_file(path, json.dumps({"law": as_values(loop.law), "basis": self.basis.plain()}).encode())
        return replace(self, law_path=path, law=loop.law, loop=loop)

    @cached_property
    def linear(self) -> StateSpace:
        """Its linear model about what is held."""
        return self.model.linear(self.at)

    def poles(self, K: Array) -> list[list[float]]:
        """Poles of continuous feedback of the states [1/s], as pairs."""
        linear = self.linear
        return [[z.real, z.imag] for z in np.linalg.eigvals(linear.A - linear.B @ K).tolist()]

    def with_poles(self, poles: Sequence[complex], *, soon: bool = False) -> Loop:
        """The loop with the gains that `upright design` has for these poles.

        Parameters
        ----------
        soon : bool
            Whether it is to come within a millisecond, or not at all.

        Raises
        ------
        BadInput
            When the law is no state feedback, or the model cannot have these poles.
        TimeoutError
            When it would not come so soon.
        """
        if self.loop is None:
            raise BadInput(f"the law of {self.name} is no feedback of states, so that its poles cannot be placed.")
        if any(not p.real < 0 or abs(p) * self.model.period > 1.0 for p in poles):
            raise BadInput(f"poles lie left of 0, within {1 / self.model.period:.4g} 1/s.")
        linear = self.linear
        K = swift_gains(linear.A, linear.B, poles)
        if K is None and soon:
            raise TimeoutError
        K = place(linear.A, linear.B, poles).K if K is None else K
        return _looped(self.model, linear, self.loop.estimator, K, self.follows)

    @cached_property
    def scene(self) -> dict[str, Any]:
        """What stays the same however it runs, as JSON holds it."""
        model, plant = self.model, self.model.plant
        held, zeroed = plant.equilibrium(self.at), plant.equilibrium(self.zero)
        coordinates = [
            {"name": c.name, "unit": c.unit, "meaning": c.meaning, "per_unit": abs(per)}
            for c, per in zip(plant.coordinates, model.per_unit, strict=True)
        ]
        return {
            "type": "scene", "name": self.name, "title": model.name, "kind": self.kind, "coordinates": coordinates,
            "command": {"unit": model.unit, "limit": model.limit, "step": model.converter},
            "period": model.period, "travel": model.travel if math.isfinite(model.travel) else None,
            "moved": [c.name for c in plant.coordinates].index(plant.inputs[0].on),
            "point": [held[c.name] - zeroed[c.name] for c in plant.coordinates],
            "zero": [zeroed[c.name] for c in plant.coordinates], "equilibrium": self.at,
            "poles": [] if self.loop is None else self.poles(self.loop.K),
            "K": [] if self.loop is None else self.loop.K[0].tolist(),
            "follows": self.follows, "basis": self.basis.plain(), **self._loop_to_follow,
            "model": {"fit": self.fit, "of": self.fit_of}, "memory": self.memory, "still": self.still,
            "lean": self.lean, "facts": facts(self.model, self.at, self.tracked),
        }  # fmt: skip

    @property
    def lean(self) -> float | None:
        """How far from upright the supervisor lets it go [rad or m]; None where it stands by itself."""
        unit = self.model.plant.coordinates[-1].unit
        lean = self.file.lean(unit, LEAN if unit == "rad" else math.inf)
        return lean if self.at != self.zero and math.isfinite(lean) else None

    @property
    def tracked(self) -> int | None:
        """Index of what follows a reference: the body driven below a pendulum, the far body of a shaft."""
        plant = self.model.plant
        names = [c.name for c in plant.coordinates]
        if not self.follows or not isinstance(self.law, Law):
            return None
        return names.index(plant.inputs[0].on) if "inverted" in plant.equilibria else len(names) - 1

    @property
    def _loop_to_follow(self) -> dict[str, Any]:
        """Where the law follows a reference, what predicts its answer."""
        if self.tracked is None or not isinstance(self.law, Law):
            return {}
        linear = self.linear
        return {
            "tracked": self.tracked,
            "linear": {"A": linear.A.tolist(), "B": linear.B[:, 0].tolist(), "delay": self.model.delay},
            "law": numbers(self.law),
        }


def numbers(law: Law) -> dict[str, Any]:
    """Matrices of a law, and its memories at the start by readings, as JSON holds them."""
    begin = np.zeros((len(law.A), law.readings)) if law.begin is None else np.asarray(law.begin)
    return {name: np.asarray(getattr(law, name)).tolist() for name in ("A", "B", "C", "D")} | {"begin": begin.tolist()}


def known_rig(path: Path, law: Path | None, folder: Path) -> BenchRig:
    """The rig of a RIG.toml with its law.

    Parameters
    ----------
    law : Path or None
        design.json; for a twin, one is designed where there is none, and stored in the folder.

    Raises
    ------
    BadInput
        When a file cannot be used, or a rig that can really move has no law.
    """
    draft = _without_law(path, law, folder)
    if law is not None:
        read, basis = read_law(law)
        follows = isinstance(read, Law) and bool(np.any(read.D[:, read.readings :]))
        loop = _recognized(read, draft.model, draft.at)
        return replace(draft, law=read, basis=draft.basis & basis, loop=loop, follows=follows)
    if draft.file.hardware:
        raise BadInput(f"{path} is a rig that can really move, so say which law it runs: --law design.json.")
    loop = _proposed(draft)
    draft.law_path.parent.mkdir(parents=True, exist_ok=True)
    replace_file(draft.law_path, json.dumps(as_values(loop.law)).encode())
    return replace(draft, law=loop.law, loop=loop, follows=bool(np.any(loop.law.D[:, loop.law.readings :])))


def write_proposed_law(path: Path, law: Path) -> str:
    """Design a law for the rig of a RIG.toml as `upright design` proposes one, and store it with its basis."""
    draft = _without_law(path, law, law.parent)
    content = {"law": as_values(_proposed(draft).law), "basis": draft.basis.plain()}
    replace_file(law, json.dumps(content).encode())
    return ""


def _without_law(path: Path, law: Path | None, folder: Path) -> BenchRig:
    file = read_rig_file(path)
    model, _ = model_and_truth(file)
    name = re.sub(r"[^a-z0-9]+", "-", (file.name or _name(path)).lower()).strip("-")[:40] or "rig"
    return BenchRig(
        name=name, rig_path=path, law_path=law or folder / name / "law.json", file=file, model=model, law=NO_LAW,
        basis=model.basis, loop=None, follows=False,
    )  # fmt: skip


NO_LAW = Law(np.zeros((0, 0)), np.zeros((0, 1)), np.zeros((1, 0)), np.zeros((1, 1)))


def _name(path: Path) -> str:
    """What a file is called after: itself, or its folder where it is called RIG.toml as all are."""
    return path.stem if path.stem.lower() != "rig" else path.resolve().parent.name


def _proposed(rig: BenchRig) -> Loop:
    """The loop of the paper's first pole set for its own rig, else as `upright design` proposes one."""
    model, at = rig.model, rig.at
    linear, way = model.linear(at), _differences(model, at, MEMORY)
    if rig.file.known is None and rig.file.make == "furuta":
        K = place(linear.A, linear.B, read_poles(TABLE_1[0])).K
    else:
        K = design_unasked(model, DesignRequest(
            at=at, period=model.period, speed="filtered", memory=MEMORY, resolution=tuple(model.resolution.tolist()),
            limit=model.saturation, on=model,
        )).continuous  # fmt: skip
    return _looped(model, linear, way, K, follow=True)


def _differences(model: Rig, at: str, memory: float) -> Estimator:
    return filtered(model.linear(at).to_sampled(model.period, model.delay / model.period, model.lag), memory)


def _looped(model: Rig, linear: StateSpace, way: Estimator, K: Array, follow: bool) -> Loop:
    """Feedback of the states; where it follows, a constant reference moves the driven coordinate there."""
    k_pf = 0.0
    if follow:
        moved = [c.name for c in model.plant.coordinates].index(model.plant.inputs[0].on)
        try:
            k_pf = prefilter(linear.A, linear.B, np.eye(len(linear.A))[2 * moved], K)
        except BadInput:  # no constant command holds it elsewhere
            k_pf = 0.0
    law = feedback(way, K, k_pf)
    return Loop(estimator=way, K=np.atleast_2d(K), law=replace(law, references=np.zeros((1, 1))) if k_pf else law)


def _recognized(law: Law | Rule, model: Rig, at: str) -> Loop | None:
    """A law as feedback of states from filtered or plain differences; None where it is another."""
    p = len(model.per_unit)
    if not isinstance(law, Law) or law.D.shape[0] != 1 or law.readings != p or len(law.A) not in (p, 2 * p):
        return None
    memory = float(law.A[p, p]) if len(law.A) == 2 * p else 0.0
    if not 0.0 <= memory < 1.0:
        return None
    way = _differences(model, at, memory)
    if law.A.shape != way.A.shape or not np.allclose(law.A, way.A) or not np.allclose(law.B[:, :p], way.B):
        return None
    states, commands = np.hstack([way.C, way.D]), -np.hstack([law.C, law.D[:, :p]])
    K: Array = np.linalg.lstsq(states.T, commands.T, rcond=None)[0].T.astype(np.float64)
    return Loop(estimator=way, K=K, law=law) if np.allclose(K @ states, commands) else None
