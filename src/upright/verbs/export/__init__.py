"""A designed law or an identified rig, written for a loop that runs elsewhere."""

from __future__ import annotations

from typing import TYPE_CHECKING

from upright.errors import BadInput, nearest
from upright.files import keeps_its_inputs
from upright.verbs.answer import Answer
from upright.verbs.command import command
from upright.verbs.export.exported import Exported
from upright.verbs.export.law import controller_of, write_law
from upright.verbs.export.rig import write_rig
from upright.verbs.pages import folder_if_given

if TYPE_CHECKING:
    from upright.control.sensors import Scales
    from upright.designing.run import Designed
    from upright.experiments.swing_up_2b.run import SwingUpRun
    from upright.files import PathLike
    from upright.laws import Law, Rule
    from upright.verbs.forms import RigLike


@command(
    "Control",
    names={"single": "--float"},
    metavars={"source": "GAINS_OR_FIT", "to": "FORM"},
    defaults={"out": "upright-export"},
    helps={
        "source": "design.json, swing_up.json or fit.json, or its folder.",
        "to": "A law as c, arduino, python, matlab or simulink; a rig as gymnasium, mjcf, fmu.",
        "single": "Single precision instead of double.",
    },
    more="""
    upright export out/design.json --to c
    upright export out --to arduino --float
    upright export out/fit.json --to gymnasium
    """,
)
@keeps_its_inputs
def export(
    source: RigLike | Law | Rule | Answer[Designed] | Answer[SwingUpRun | Scales], *, to: str,
    out: PathLike | None = None, single: bool = False, limit: float | None = None,
) -> Exported:  # fmt: skip
    """Write a designed law as a program that tests itself, or an identified rig for other simulators.

    A law's program has sampling, differences or observer, limit and rounding in it. It repeats the commands of
    upright's own kernel bit for bit in double precision, and carries a replay by which it tests itself.

    Parameters
    ----------
    source : path, answer of `design`, `swing_up` or `identify`, Law, Rule or plant
        Of a law design.json, swing_up.json or its folder; of a rig what `identify` answered, fit.json or its folder, or
        a plant.
    to : str
        One of `upright.exports.targets.TARGETS`: of a law ``"c"``, ``"arduino"``, ``"python"``, ``"matlab"`` (GNU
        Octave too) or ``"simulink"``; of a rig ``"gymnasium"``, an environment whose every episode has another rig
        that the fit allows, ``"mjcf"``, a model of MuJoCo, or ``"fmu"``, a unit for co-simulation (FMI 3.0).
    out : path, optional
        Folder for the files; without one they are only in `contents`.
    single : bool
        Of a law, single precision (the command line's ``--float``); its commands miss by a converter's step at times.
        Not of a rule.
    limit : float, optional
        Of a rig, the largest command, in its unit; the fit's when omitted.

    Returns
    -------
    Exported
        Of the names of the files; ``.contents["law.c"]`` is what is in one.

    Raises
    ------
    BadInput
        When there is no such form, or what was given cannot be written in it.
    """
    from upright.exports.targets import TARGETS, LawTarget, RigTarget

    to, at = str(to), folder_if_given(out)
    if to not in TARGETS:
        raise BadInput(f"--to must name a form to export in, got '{to}'; {nearest(to, TARGETS)}")
    target = TARGETS[to]
    if isinstance(target, LawTarget):
        if limit is not None:
            raise BadInput("the limit of a law is the one that it was designed with; give --limit to upright design.")
        made, name = controller_of(source)
        return write_law(made, name, target, at, single)
    if single:
        raise BadInput("--float is for laws; a rig is simulated in double precision.")
    assert isinstance(target, RigTarget)  # there are no others
    return write_rig(source, target, at, limit)
