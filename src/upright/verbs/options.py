"""Options that several verbs share, each declared and explained once; verbs take ``**on: Unpack[RigOptions]``.

`cli.build` makes options of the command line of them.
"""

from __future__ import annotations

import re
import sys
from collections.abc import Mapping, Sequence
from inspect import Parameter
from typing import TYPE_CHECKING, Any, TypedDict, TypeVar, cast, is_typeddict

from upright.errors import BadInput, nearest
from upright.verbs.command import parameter_texts
from upright.verbs.values import Start, si_if_given

if TYPE_CHECKING:
    from upright.physics import Plant
    from upright.rig import Rig
    from upright.rig.hardware import Entry

Counts = float | str | Sequence[float] | Mapping[str, float]
FIT = "fit.json or its folder; "
"""How the command line begins to explain a source."""
Options = TypeVar("Options", bound=Mapping[str, Any])


class RigOptions(TypedDict, total=False):
    """Properties of a rig that its study and data sheet leave out, or that replace theirs.

    Parameters
    ----------
    limit : float or str, optional
        Largest command, "5 V" or a number in the command's unit; the study's when omitted.
    period : float or str, optional
        Servo period [s]; the study's when omitted.
    counts : float, str, sequence or mapping, optional
        Encoder counts per turn or metre, "4096", "20000, 4096" or "x=20000, theta=4096"; the study's when omitted.
    vendor : str, optional
        Data sheet for what neither the call nor the study states: "ECP 205" or "ECP 210".
    """

    limit: float | str | None
    period: float | str | None
    counts: Counts | None
    vendor: str | None


class TravelOptions(RigOptions, total=False):
    """The same of a rig whose driven body may go only so far.

    Parameters
    ----------
    travel : float or str, optional
        Travel of the driven body either way, "30 cm", "120 deg" or a number [m or rad]; the study's when omitted.
    """

    travel: float | str | None


class LoopOptions(RigOptions, total=False):
    """The same, and how a loop on it comes to its velocities.

    Parameters
    ----------
    speed : str, optional
        Velocity estimator: plain or filtered difference, or kalman; filtered when omitted.
    memory : float, optional
        Coefficient of the filtered difference, 0 to 1; 0.5 when omitted.
    """

    speed: str | None
    memory: float


class HoldingOptions(LoopOptions, TravelOptions, total=False):
    """All of these."""


class TrialOptions(HoldingOptions, total=False):
    """The same, and how a pendulum is let go on how many rigs.

    Parameters
    ----------
    start : str or mapping, optional
        Start of the pendulum, from upright and moving outwards: ``"12 deg"``, ``{"theta": 0.2, "theta_dot": 1.5}``
        [SI]; 5 degrees at rest, or the rig model's own start, when omitted.
    seconds : float, optional
        Length of a run; 6 when omitted, 3 in a page.
    draws : int, optional
        Rigs drawn from the fit's covariance; 200 when omitted.
    """

    start: Start | None
    seconds: float
    draws: int


class MotionOptions(TypedDict, total=False):
    """What a motion has of a rig that the rig does not say, or says otherwise.

    Parameters
    ----------
    limit : float or str, optional
        Largest command; the rig's when omitted, none of a plant alone.
    counts : float or mapping of coordinate to float, optional
        Encoder counts per turn or metre; the rig's when omitted, and readings of a plant alone are not rounded.
    memory : float, optional
        Of the low pass on the differences, 0 to below 1; 0 when omitted.
    actuator : mapping, optional
        Numbers of the drive, such as ``{"gain": 0.5, "lag": 2e-3, "delay": 1e-3}``.
    strict : bool, optional
        Round every operation by itself, so that every processor gives the same samples; the log says so.
    """

    limit: float | str | None
    counts: float | Mapping[str, float] | None
    memory: float
    actuator: Mapping[str, float] | None
    strict: bool


class RunOptions(TypedDict, total=False):
    """How a law runs on a rig.

    Parameters
    ----------
    reference : str, optional
        Signal that the tracked coordinate follows, written as for `excite` [rad or m].
    start : str or mapping, optional
        Deviation of a twin's last coordinate when it is released, ``"5 deg"``; a number is [rad or m]. Under a law 3
        degrees, or 3 mm, when omitted.
    mode : str, optional
        ``"host"``, or ``"mcu"`` for the loop on the rig's own controller.
    accept : str, optional
        Reason for running a law on hardware although its model is not trusted; stored in the log. Without it such a law
        is not armed.
    """

    start: Start | None
    reference: str | None
    mode: str | None
    accept: str | None


class LabOptions(TypedDict, total=False):
    """What the rigs of a laboratory are.

    Parameters
    ----------
    seed : int, optional
        Random seed of the rig model, 0 when omitted, the nominal one; on hardware, of the rigs drawn from its fit.
    nonideal : bool, optional
        Twins with physics that models leave out, of which fits read as those of real rigs do.
    accept : str, optional
        Reason for running laws on hardware although their fit is not trusted; stored in the logs. Without it such laws
        are not armed.
    """

    seed: int
    nonideal: bool
    accept: str | None


class DesignOptions(LoopOptions, total=False):
    """What gains are to do, and what a design asks of a rig besides.

    Parameters
    ----------
    effort_weight : float, optional
        Weight of the effort; set by the limit when omitted.
    track : str, optional
        Coordinate that follows a reference.
    sampled : bool, optional
        Place the poles of the sampled loop instead of the continuous one.
    delay : float, optional
        Total delay of the command in samples; when omitted the fit's, or one sample if it has none. StateSpace matrices
        have their own.
    lag : float or str, optional
        Lag of the drive [s]; the fit's when omitted.
    """

    effort_weight: float | None
    track: str | None
    sampled: bool | None
    delay: float | None
    lag: float | str | None


def shared_parameters(verb: Parameter, module: str) -> tuple[dict[str, Parameter], dict[str, str]]:
    """Options that ``**on: Unpack[...]`` of a verb of a module stands for, as parameters, with their texts."""
    named = re.fullmatch(r"(?:\w+\.)?Unpack\[(\w+)\]", str(verb.annotation))
    kind: Any = getattr(sys.modules[module], named[1], None) if named else None
    if not is_typeddict(kind):
        return {}, {}
    kin = [k for k in vars(sys.modules[kind.__module__]).values() if is_typeddict(k)]  # 3.11 forgets what a kind is of
    texts = {n: text for k in (*kin, kind) for n, text in parameter_texts(k).items()}
    annotations: dict[str, Any] = kind.__annotations__
    shared = {
        name: Parameter(name, Parameter.KEYWORD_ONLY, default=None, annotation=getattr(a, "__forward_arg__", a))
        for name, a in annotations.items()
    }
    return shared, texts


def known_options(kind: type[Options], options: Mapping[str, Any], verb: str) -> Options:
    """The options that were given, arrays and numbers of NumPy as Python's.

    Raises
    ------
    BadInput
        When one is none of this kind.
    """
    for name in options:
        if name not in kind.__annotations__:
            raise BadInput(f"{verb} has no option '{name}'; {nearest(name, kind.__annotations__)}")
    options = {n: v.tolist() if hasattr(v, "tolist") else v for n, v in options.items()}
    empty = {n for n, v in options.items() if v is None or (isinstance(v, str | list | tuple | dict) and not v)}
    return cast("Options", {n: v for n, v in options.items() if n not in empty})


def rig_entries(plant: Plant, unit: str, on: RigOptions) -> dict[str, Entry]:
    """Entries of a rig that options give; `unit` is that of the command.

    Raises
    ------
    BadInput
        When one of them is no such number.
    """
    from upright.rig.hardware import Entry, counts_unit, driven_unit

    place, every = driven_unit(type(plant)), si_if_given(on.get("period"), "s")
    if every is not None and not 1e-6 <= every <= 10.0:
        raise BadInput(f"a loop is closed every 1e-6 to 10 s, got a period of {every:g} s.")
    far = above_zero(on, "travel", place)
    numbers = (("limit", above_zero(on, "limit", unit), unit), ("servo_period", every, "s"), ("travel", far, place))
    options = {"limit": "--limit", "servo_period": "--period", "travel": "--travel"}
    out = {n: Entry(value=v, unit=u, source=options[n]) for n, v, u in numbers if v is not None}
    units = {c.name: c.unit for c in plant.coordinates}
    for name, number in _counts(on.get("counts"), list(units)).items():
        out[f"counts.{name}"] = Entry(value=number, unit=counts_unit(units[name]), source="--counts")
    return out


def above_zero(on: Mapping[str, Any], name: str, unit: str) -> float | None:
    """Number of an option in its unit, of a text with its own unit or without; None where it was not given.

    Raises
    ------
    BadInput
        When it is no such number, or not above 0.
    """
    from upright.units import in_unit

    value_of_option = on.get(name)
    if value_of_option is None:
        return None
    try:
        value = float(value_of_option)
    except (TypeError, ValueError):
        value = in_unit(str(value_of_option), unit)
    if not 0 < value < 1e9:
        raise BadInput(
            f'--{name} must be above 0 and below 1e9 {unit}, got {value_of_option}; as in --{name} "2 {unit}".'
        )
    return value


def as_typed(on: Mapping[str, Any]) -> str:
    """Options of a rig as a command line says them again, a space before each."""
    out = ""
    for name in ("limit", "period", "counts", "travel", "vendor"):
        value = on.get(name)
        if isinstance(value, Mapping):
            value = ", ".join(f"{k}={v}" for k, v in value.items())
        if isinstance(value, list | tuple):
            value = ", ".join(str(v) for v in value)
        if value not in (None, ""):
            out += f" --{name} " + (f"{value:g}" if isinstance(value, int | float) else f'"{value}"')
    return out


def vendor_of(known: Rig, rig: str, on: RigOptions, source: str) -> str | None:
    """Data sheet chosen by the name of a make, ``--rig``, or of the vendor."""
    vendor = on.get("vendor")
    if not rig:
        return vendor
    from upright.rig.makes import make_of_rig

    make = make_of_rig(known)
    if rig != make.key:
        raise BadInput(f"{source} is a '{make.key}', not '{rig}'; leave --rig out.")
    return vendor or make.vendor


def _counts(counts: Counts | None, names: list[str]) -> dict[str, float]:
    """Counts by coordinate; a number alone is for all of them, several are for one each."""
    if isinstance(counts, Mapping):
        pieces = [f"{name}={value}" for name, value in counts.items()]
    elif isinstance(counts, list | tuple):
        pieces = [str(value) for value in counts]
    else:
        pieces = ("" if counts is None else str(counts)).split(",")
    if not "".join(pieces).strip():
        return {}
    plain = sum("=" not in piece for piece in pieces)
    if plain > 1 and not plain == len(pieces) == len(names):
        raise BadInput(
            f"counts takes one number for all coordinates, one for each of {', '.join(names)}, or named ones such as "
            f'"{names[0]}=4096", got {str(counts)[:40]}.'
        )
    per: dict[str, float] = {}
    for i, piece in enumerate(pieces):
        name, equals, value = piece.rpartition("=")
        name = name.strip()
        if equals and name not in names:
            raise BadInput(
                f"--counts names coordinates as in \"{names[0]}=4096\", got '{name}'; {nearest(name, names)}"
            )
        try:
            number = float(value)
        except ValueError:
            number = 0.0
        if not 0 < number < 1e15:
            raise BadInput(
                f"--counts takes numbers above 0, got '{piece.strip()[:40]}'; write 4096 or \"{names[0]}=4096\"."
            )
        per |= {name: number} if equals else {names[i]: number} if plain > 1 else dict.fromkeys(names, number)
    return per
