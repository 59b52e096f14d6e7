"""An MJCF file as MuJoCo compiles it, without constraints and actuators: masses and forces at any state."""

from __future__ import annotations

from collections.abc import Sequence
from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np

from upright.errors import BadInput
from upright.files import regular
from upright.records import Array

HINGE, SLIDE = 3, 2
OWN = "write its energies as a plant of your own (tutorial 'Your own plant'), or simplify the file"


class Bodies:
    """A compiled model without constraints and actuators: masses and forces at any state."""

    def __init__(self, path: Path) -> None:
        regular(path)
        try:
            mujoco: Any = import_module("mujoco")
        except ImportError:
            raise BadInput(f"to read {path.name}, MuJoCo is needed: pip install 'upright[mujoco]'.") from None
        self.mujoco, self.file = mujoco, path.name
        try:
            self.model: Any = mujoco.MjModel.from_xml_path(str(path))
        except (ValueError, mujoco.FatalError) as error:
            reason = " ".join(str(error).split())
            raise BadInput(f"MuJoCo cannot read {path.name}: {reason.removeprefix('XML Error: ')}") from error
        m = self.model
        self.data: Any = mujoco.MjData(m)
        self.name = m.names[: m.names.index(b"\0")].decode()
        self.name = "" if self.name == "MuJoCo Model" else self.name
        self.kinds = [int(k) for k in m.jnt_type]
        self._check()
        m.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_CONSTRAINT | mujoco.mjtDisableBit.mjDSBL_ACTUATION
        self.place(m.qpos0.copy())

    def _check(self) -> None:
        m = self.model
        if not m.njnt:
            raise self.error("it has no joint, so that nothing moves")
        bad = [self.joint(i) for i, kind in enumerate(self.kinds) if kind not in (HINGE, SLIDE)]
        if bad:
            raise self.error(f"joint {bad[0]} is free or a ball; upright's plants have hinges and slides; {OWN}")
        for count, what in ((m.neq, "equality constraints"), (m.nflex, "flexible bodies"), (m.nplugin, "plug-ins")):
            if count:
                raise self.error(f"it has {what}, which no plant of upright has; {OWN}")

    def error(self, reason: str) -> BadInput:
        """What is wrong with the file."""
        return BadInput(f"{self.file}: {reason}.")

    def joint(self, i: int) -> str:
        """Name of a joint, in quotes, or its place in the file."""
        return f"'{self.model.joint(i).name}'" if self.model.joint(i).name else f"{i + 1} of the file"

    def place(self, q: Array, v: Array | None = None, force: Array | None = None) -> Any:
        """MuJoCo's data at a state, with generalised forces applied."""
        d = self.data
        d.qpos, d.qvel = q, np.zeros(self.model.nv) if v is None else v
        d.qfrc_applied = np.zeros(self.model.nv) if force is None else force
        self.mujoco.mj_forward(self.model, d)
        return d

    def mass(self, q: Array) -> Array:
        """Mass matrix, armature included, shape (n, n)."""
        d, columns = self.place(q), np.zeros((self.model.nv, self.model.nv))
        for column, unit in zip(columns, np.eye(self.model.nv), strict=True):
            self.mujoco.mj_mulM(self.model, d, column, unit)
        return columns

    def passive(self, q: Array, v: Array | None = None) -> Array:
        """Forces of springs and dampers, shape (n,)."""
        return self.place(q, v).qfrc_passive.copy()

    def stiffness_and_damping(self) -> tuple[Array, Array, Array]:
        """K and D (n, n), and the joints' positions (n,) at which the springs are at rest."""
        q, one = self.model.qpos0.copy(), np.eye(self.model.nv)
        rest = self.passive(q)
        K = np.column_stack([rest - self.passive(q + e) for e in one])
        D = np.column_stack([rest - self.passive(q, e) for e in one])
        return K, D, q + np.linalg.pinv(K, rcond=1e-9) @ rest

    def parents(self) -> list[int]:
        """By joint, the joint that carries its body: -1 for the ground."""
        body_of = [int(b) for b in self.model.jnt_bodyid]
        if len(set(body_of)) < len(body_of):
            raise self.error(f"a body has several joints; upright's plants have one for each body; {OWN}")
        out: list[int] = []
        for body in body_of:
            above = int(self.model.body_parentid[body])
            while above and above not in body_of:
                above = int(self.model.body_parentid[above])
            out.append(body_of.index(above) if above else -1)
        return out

    def left_out(self, behind: Sequence[int]) -> list[str]:
        """What is in the file and does not come along; `behind` are the joints after the driven one."""
        m, out = self.model, list[str]()
        limited = [self.joint(int(j)) for j in behind if m.jnt_limited[j]]
        if limited:
            out.append(f"Left out: the range of joint {', '.join(limited)}.")
        if m.ntendon and np.any(m.tendon_frictionloss):
            out.append("Left out: friction of tendons.")
        contact = self.mujoco.mjtDisableBit.mjDSBL_CONTACT
        weld, parent = m.body_weldid, m.body_parentid
        pairs = (
            (int(weld[m.geom_bodyid[i]]), int(weld[m.geom_bodyid[j]]))
            for i in range(m.ngeom) for j in range(i)
            if (m.geom_contype[i] & m.geom_conaffinity[j]) | (m.geom_contype[j] & m.geom_conaffinity[i])
        )  # fmt: skip
        near = ((a, b) for a, b in pairs if a != b and weld[parent[a]] != b and weld[parent[b]] != a)
        if not m.opt.disableflags & contact and any(near):
            out.append("Left out: contacts between bodies.")
        return out


def actuated(bodies: Bodies) -> int | None:
    """The joint that the one actuator turns."""
    m, transmission = bodies.model, bodies.mujoco.mjtTrn
    if not m.nu:
        return None
    if m.nu > 1:
        raise bodies.error(f"it has {m.nu} actuators, and upright's plants have one drive; take the others out")
    if int(m.actuator_trntype[0]) not in (transmission.mjTRN_JOINT, transmission.mjTRN_JOINTINPARENT):
        raise bodies.error("its actuator does not act on a joint, as a drive of upright does; let it name one")
    return int(m.actuator_trnid[0, 0])
