"""upright: identify a laboratory rig hanging, hold it upright. In a notebook::

    import upright as up

    log = up.read("swing.csv")                      # a record: columns, units, where they came from
    up.doctor(log)                                  # what looks wrong with it, in sentences
    fit = up.identify(log, up.Pendulum, known={"m_p": 0.2235})
    fit                                             # numbers with intervals, scores, verdict; fit.plot(), fit.report()

    rig = up.Furuta(m_p=0.135, l_cg=0.19, r=0.16, J_d=0.011, J_p=6e-4)
    gains = up.place(rig.linear("inverted"), [-4 + 2j, -4 - 2j, -17, -3])
    up.simulate(rig, gains, start={"theta": 0.2}, seconds=5).plot()

Every verb of the command line, `upright NAME`, stands here under the same name and takes the same options
(`upright plan-inertias` is `up.plan_inertias`, `upright log show` is `up.log_show`). Numbers are in SI and radians;
text is written with its unit: ``"12 deg"``.

==========  ==================================================================================================
Log         read, show, doctor, init, law; Record
Runs        run, rig_doctor, rig_check; log_show, log_tail, log_recover, log_convert, log_replay;
            firmware_build, firmware_flash, firmware_pins
Model       identify, predict, ladder, frequency, loadings, plan_inertias
Plants      Pendulum, CartPendulum, Furuta, DoublePendulum, DoublePendulumAbsolute, FlexibleLink, chain
Rig         Rig: a plant with drive, encoders and servo, and where each number comes from; from_mjcf: that of MuJoCo
Control     StateSpace, from_matlab, place, lqr, dlqr, prefilter, hold, observer, margins, simulate, chance, design,
            export, regulate, swing_up, track, play, bench; Law, Rule
Course      lab, reproduce, survey
Own plants  Plant, Coordinate, Input, Joint, quantity
==========  ==================================================================================================

What they return is shown by name at a prompt and as tables and pictures in a notebook. A wrong argument is answered
with one sentence: `BadInput`, `ImpossiblePhysics` or `NotIdentifiable`, all of them `UprightError`.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

from upright import shown
from upright._version import __version__

if TYPE_CHECKING:
    from upright.errors import BadInput, ImpossiblePhysics, NotIdentifiable, UprightError
    from upright.laws import Law, Rule
    from upright.physics import (
        CartPendulum,
        Coordinate,
        DoublePendulum,
        DoublePendulumAbsolute,
        FlexibleLink,
        Furuta,
        Input,
        Joint,
        Pendulum,
        Plant,
        chain,
    )
    from upright.quantities import quantity
    from upright.records import Record
    from upright.rig import Rig
    from upright.systems import StateSpace
    from upright.verbs.control.bench import bench
    from upright.verbs.control.chance import chance
    from upright.verbs.control.design import design
    from upright.verbs.control.play import play
    from upright.verbs.control.regulate import regulate
    from upright.verbs.control.swing_up import swing_up
    from upright.verbs.control.track import track
    from upright.verbs.course import lab, reproduce, survey
    from upright.verbs.export import export
    from upright.verbs.firmware import firmware_build, firmware_flash, firmware_pins
    from upright.verbs.linear.feedback import dlqr, hold, lqr, margins, observer, place, prefilter
    from upright.verbs.linear.matlab import from_matlab
    from upright.verbs.log import doctor, init, law, read, show
    from upright.verbs.logs import log_convert, log_recover, log_replay, log_show, log_tail
    from upright.verbs.mjcf import from_mjcf
    from upright.verbs.model.compare import compare
    from upright.verbs.model.frequency import frequency
    from upright.verbs.model.identify import identify
    from upright.verbs.model.ladder import ladder
    from upright.verbs.model.loadings import loadings, plan_inertias
    from upright.verbs.model.predict import predict
    from upright.verbs.motion import simulate
    from upright.verbs.rig import rig_check, rig_doctor, run

shown.look_with(lambda: import_module("upright.views"))

_HOMES = {
    "errors": ("BadInput", "ImpossiblePhysics", "NotIdentifiable", "UprightError"),
    "laws": ("Law", "Rule"),
    "physics": (
        "CartPendulum",
        "Coordinate",
        "DoublePendulum",
        "DoublePendulumAbsolute",
        "FlexibleLink",
        "Furuta",
        "Input",
        "Joint",
        "Pendulum",
        "Plant",
        "chain",
    ),
    "quantities": ("quantity",),
    "records": ("Record",),
    "rig": ("Rig",),
    "verbs.control.bench": ("bench",),
    "verbs.control.chance": ("chance",),
    "verbs.control.design": ("design",),
    "verbs.control.play": ("play",),
    "verbs.control.regulate": ("regulate",),
    "verbs.control.swing_up": ("swing_up",),
    "verbs.control.track": ("track",),
    "verbs.course": ("lab", "reproduce", "survey"),
    "verbs.export": ("export",),
    "verbs.firmware": ("firmware_build", "firmware_flash", "firmware_pins"),
    "verbs.rig": ("rig_check", "rig_doctor", "run"),
    "verbs.log": ("doctor", "init", "law", "read", "show"),
    "verbs.logs": ("log_convert", "log_recover", "log_replay", "log_show", "log_tail"),
    "systems": ("StateSpace",),
    "verbs.linear.feedback": ("dlqr", "hold", "lqr", "margins", "observer", "place", "prefilter"),
    "verbs.linear.matlab": ("from_matlab",),
    "verbs.mjcf": ("from_mjcf",),
    "verbs.model.compare": ("compare",),
    "verbs.model.frequency": ("frequency",),
    "verbs.model.identify": ("identify",),
    "verbs.model.ladder": ("ladder",),
    "verbs.model.loadings": ("loadings", "plan_inertias"),
    "verbs.model.predict": ("predict",),
    "verbs.motion": ("simulate",),
}
_HOME = {name: home for home, names in _HOMES.items() for name in names}

__all__ = [
    "BadInput", "CartPendulum", "Coordinate", "DoublePendulum", "DoublePendulumAbsolute", "FlexibleLink", "Furuta",
    "ImpossiblePhysics", "Input", "Joint", "Law", "NotIdentifiable", "Pendulum", "Plant", "Record", "Rig", "Rule",
    "StateSpace",
    "UprightError", "__version__", "bench", "chain", "chance", "compare", "design", "dlqr", "doctor", "export",
    "firmware_build", "firmware_flash", "firmware_pins", "frequency", "from_matlab", "from_mjcf", "hold",
    "identify", "init", "lab", "ladder", "law", "loadings", "log_convert", "log_recover", "log_replay", "log_show",
    "log_tail", "lqr", "margins", "observer", "place", "plan_inertias", "play", "predict", "prefilter", "quantity",
    "read", "regulate", "reproduce", "rig_check", "rig_doctor", "run", "show", "simulate", "survey", "swing_up",
    "track",
]  # fmt: skip


def __getattr__(name: str) -> Any:
    """Fetch a name from its home when it is first used, so that `import upright` waits for nothing."""
    if name not in _HOME:
        raise AttributeError(f"module 'upright' has no attribute {name!r}")
    value = getattr(import_module(f"upright.{_HOME[name]}"), name)
    if _HOME[name].startswith("verbs."):
        from upright.verbs.in_python import worded_for_python

        value = worded_for_python(value)
        value.__module__, value.__qualname__ = "upright", name  # where pickle finds it
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted(__all__)
