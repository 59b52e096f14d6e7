"""Swing-up of a hanging pendulum by its own drive, within its limit and travel: law, design, and how it went.

`design_swing_up` finds the numbers of the law `swing_and_hold`, one function in the kernel as on a rig, from a rig's
model. The feedback that holds is of least
cost (Bryson's weights); the ellipsoid ``x'Px <= c`` from which it takes over is the largest on which the command asked
for stays below twice the limit: there saturation leaves at least half of it, and a least-cost loop bears half its
gain, so that x'Px falls. That is exact for the linear model only; on the nonlinear one the ellipsoid is then shrunk
until a few hundred motions from its surface all come to rest within the travel.

The law is for as much of the travel as all rigs that the fit allows keep, from hanging until they stand, with a
margin: no faster than the limits of speed, and at every moment so that `control.braking` ends within the travel.

Far from upright it pumps: the pivot is moved along with the swing and does the work ``-kappa cos(theta) theta' a``,
by less as the energy comes near that of rest upright (Astrom and Furuta, Automatica 36, 2000), while a spring and a
damper keep the driven body near the middle. Upright, it is a state feedback.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from math import cos, floor, pi, sin
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from upright.control.braking import Braking
from upright.control.trial import Trial, readings, steps_in_period
from upright.errors import BadInput
from upright.gains import filtered, place_sampled
from upright.gains.requests import poles_of
from upright.laws import Rule
from upright.records import Array
from upright.rig import Rig
from upright.rig.variation import allowed
from upright.simulation import simulate

SWINGING, HOLDING, TRIPPED = 0.0, 1.0, 2.0
"""What the law is doing, and where among its numbers that stands."""
MODE = 4

PARAMETERS = (
    "period", "memory", "scale_q", "scale_theta",
    "M", "spin", "kappa", "J", "weight", "viscous", "dry", "gain", "limit",
    "reach", "sharp", "learn", "pause", "centre", "damp",
    "k0", "k1", "k2", "k3",
    "p00", "p01", "p02", "p03", "p11", "p12", "p13", "p22", "p23", "p33",
    "size", "near", "fast", "away", "fade", "allowed", "lost",
)  # fmt: skip
"""In order: servo period and filter; what encoders show over what is true; the rig; pumping; gains; the ellipsoid
``x'Px <= size`` of the catch with bounds of its angle and speed; the angle of a fall; what is left of the handover's
step from sample to sample; the travel; the command that the drive loses."""


def swing_and_hold(t: float, y: Any, r: Any, z: Any, p: Any) -> tuple[Any, Any]:
    """One sample, as a `laws.Rule`; it remembers readings, speeds, what it is doing, the handover's
    fading step, how much more energy than the model's it asks for, and when it last changed that.
    """
    (period, memory, scale_q, scale_theta, M, spin, kappa, J, weight, viscous, dry, gain, limit, reach, sharp,
     learn, pause, centre, damp, k0, k1, k2, k3, p00, p01, p02, p03, p11, p12, p13, p22, p23, p33, size, near, fast,
     away, fade, allowed, lost) = p  # fmt: skip
    q, theta = y[0] * scale_q, y[1] * scale_theta
    v = memory * z[2] + (1.0 - memory) * (q - z[0]) / period
    w = memory * z[3] + (1.0 - memory) * (theta - z[1]) / period
    s, c = sin(theta), cos(theta)
    phi = theta - pi - 2.0 * pi * floor((theta - pi) / (2.0 * pi) + 0.5)
    value = (
        p00 * q * q + p11 * v * v + p22 * phi * phi + p33 * w * w
        + 2.0 * (p01 * q * v + p02 * q * phi + p03 * q * w + p12 * v * phi + p13 * v * w + p23 * phi * w)
    )  # fmt: skip
    hold = min(max(0.0 - (k0 * q + k1 * v + k2 * phi + k3 * w), 0.0 - limit), limit)
    # acceleration of the pivot along with the swing; at rest either side will do
    missing = weight * (1.0 + z[6] + c) - 0.5 * J * w * w
    # a swing that has the energy and turns short of upright needs more; one that went over needs less
    aim, event = z[6], z[7]
    before = z[1] - pi - 2.0 * pi * floor((z[1] - pi) / (2.0 * pi) + 0.5)
    if t - event > pause and c < 0.0 and missing < 5.0 * learn * weight:
        if w * z[3] < 0.0:
            aim, event = min(aim + learn, 10.0 * learn), t
        elif phi * before < 0.0:
            aim, event = max(aim - learn, 0.0 - 10.0 * learn), t
    along = -1.0 if kappa * c * w > 0.0 else 1.0
    a = min(max(sharp * missing / weight, -1.0), 1.0) * reach * along - centre * q - damp * v
    # the force for it, both rows of eq. (3)
    turning = (spin * s * c * v * v - kappa * c * a - weight * s) / J
    force = (M + spin * s * s) * a + kappa * (c * turning - s * w * w) + 2.0 * spin * s * c * w * v + viscous * v
    force = force + (dry if a > 0.0 else 0.0 - dry)
    swing = min(max(force / gain, 0.0 - limit), limit)
    mode, bump = z[4], z[5] * fade
    if mode < 0.5:
        u = swing
        if value <= size and abs(phi) <= near and abs(v) <= fast:
            mode, bump, aim = 1.0, swing - hold, 0.0  # the feedback begins where the pump ends
    else:
        u = hold + bump
        if abs(phi) > away:
            mode, bump, u = 0.0, 0.0, swing
    u = u + lost * min(max(20.0 * u / limit, 0.0 - 1.0), 1.0)  # what is lost is added, about zero by and by
    if abs(q) > allowed or z[4] > 1.5:
        mode, u = 2.0, 0.0
    return (min(max(u, 0.0 - limit), limit),), (q, theta, v, w, mode, bump, aim, event)


TRAVEL = {"m": 0.20, "rad": 2 * math.pi}
"""How far the driven body may go from the middle where the rig does not say: a rail's half, one turn of a cable."""
NEAR = 0.5
"""Angle from upright [rad] beyond which the linear model is not used: sin 0.5 is 4 % below 0.5."""
AWAY = 0.7
"""Angle from upright [rad] at which the pendulum counts as fallen and is swung up again."""
UPRIGHT = math.radians(10)
"""Angle from upright within which the pendulum counts as up [rad]."""
FADE = 0.01
"""Time constant with which the step of the command at the handover fades [s]."""
SHARES = tuple(0.93**k for k in range(17))
"""Of the travel, for which a law is made until all rigs keep within its limits."""
MARGIN = 0.95
"""Share of travel and speeds that a design uses: a speed is measured over a few samples."""
LANES, SECONDS, ASIDE = 24, 14.0, 0.15
"""Rigs of the fit, how long each swings up and stands [s], and how far from the middle it may begin, of the travel."""
ENOUGH = 0.5
"""Share of them that must stand at the end."""
LEARN, PAUSE = 0.04, 0.2
"""By how much of `weight` more energy is asked for when a swing turned short of upright, less when it went over, since
the model's energy is that of another rig; at most ten times, and no sooner again than this [s]."""


@dataclass(frozen=True, kw_only=True)
class Body:
    """A pendulum on a moved pivot, eq. (3) with what both makes have in common; on a cart nothing spins.

    ``(M + spin sin^2) q'' + kappa (cos theta'' - sin theta'^2) + 2 spin sin cos theta' q' + viscous q' = F - dry``
    and ``J theta'' + kappa cos q'' + weight sin - spin sin cos q'^2 = 0``.
    """

    M: float
    spin: float
    kappa: float
    J: float
    weight: float
    viscous: float
    dry: float

    @property
    def omega(self) -> float:
        """Frequency of a small swing on a pivot at rest [rad/s]."""
        return math.sqrt(self.weight / self.J)

    def energy(self, theta: ArrayLike, theta_dot: ArrayLike) -> Array:
        """Energy of the swing over that of rest upright [J]: 0 there, -2 weight hanging."""
        angle, speed = np.asarray(theta, dtype=np.float64), np.asarray(theta_dot, dtype=np.float64)
        return np.asarray(0.5 * self.J * speed**2 - self.weight * (1.0 + np.cos(angle)))

    def power(self, theta: ArrayLike, theta_dot: ArrayLike, a: ArrayLike) -> Array:
        """What the pivot's acceleration `a` adds to that energy per time [W]."""
        angle, speed = np.asarray(theta, dtype=np.float64), np.asarray(theta_dot, dtype=np.float64)
        return np.asarray(-self.kappa * np.cos(angle) * speed * np.asarray(a, dtype=np.float64))


def body(rig: Rig) -> Body:
    """Numbers of a rig's pendulum: mass, stiffness and damping matrix hanging, and the mass at a right angle.

    Raises
    ------
    BadInput
        When the rig is no pendulum on a driven body.
    """
    plant = rig.plant
    names = [c.name for c in plant.coordinates]
    if len(names) != 2 or names[1] != "theta" or not {"hanging", "inverted"} <= set(plant.equilibria):
        raise BadInput(f"a swing-up needs a pendulum theta on a driven body, and {rig.name} has {', '.join(names)}.")
    hanging = rig.linear("hanging")
    m = plant.mass_matrix("hanging")
    stiffness, damping = (-(m @ hanging.A[1::2, i::2]) for i in (0, 1))
    moving, still = plant.energy([[0.0, 1.0, math.pi / 2, 0.0], [0.0, 0.0, math.pi / 2, 0.0]])
    return Body(
        M=float(m[0, 0]), spin=float(2 * (moving - still) - m[0, 0]), kappa=float(m[0, 1]), J=float(m[1, 1]),
        weight=float(stiffness[1, 1]), viscous=float(damping[0, 0]), dry=float(plant.parameters().get("b_1c", 0.0)),
    )  # fmt: skip


@dataclass(frozen=True, kw_only=True, eq=False)
class SwingUp:
    """A swing-up, its catch and its feedback for one model of a rig.

    Attributes
    ----------
    K : array, shape (4,)
        Gains of the feedback on position and speed of the driven body, angle from upright and its speed.
    P : array, shape (4, 4)
    size, sure : float
        c of the ellipsoid of the catch, and what the linear model alone would allow.
    fast : float
        Speed of the driven body up to which it is caught: there its spin lifts the pendulum by a fifth of its weight.
    memory : float
        Of the filtered differences.
    reach : float
        Acceleration of the pivot while pumping [m/s^2 or rad/s^2].
    sharp : float
        How many times the missing energy over `weight` the pump is turned up, 1 being all of `reach`.
    centre, damp : float
        Spring [1/s^2] and damper [1/s] to the middle while pumping.
    travel : float
        The drive is switched off beyond [m or rad].
    period, gain, limit : float
        As in the model of the rig.
    lost : float
        Dead zone of its drive, which the law adds to its command.
    """

    body: Body
    K: Array
    P: Array
    size: float
    sure: float
    fast: float
    memory: float
    reach: float
    sharp: float
    centre: float
    damp: float
    travel: float
    period: float
    gain: float
    limit: float
    lost: float = 0.0

    def rule(self, rig: Rig, start: ArrayLike, *, holding: bool = False) -> Rule:
        """The law with the encoders and the converter of a rig.

        Parameters
        ----------
        rig : Rig
            As it truly is.
        start : array, shape (states,) or (lanes, states)
            Where it is when the law is switched on, as a person sees it who writes zeros where it hangs.
        holding : bool
            Begin with the feedback, which then knows the speeds.
        """
        x: Array = np.asarray(start, dtype=np.float64)
        at = readings(rig, x[..., 0::2])
        speeds = x[..., 1::2] if holding else np.zeros_like(at)
        zero = np.zeros_like(at[..., 0])
        b, (scale_q, scale_theta) = self.body, rig.shown.tolist()
        numbers = dict(zip(("k0", "k1", "k2", "k3"), self.K.tolist(), strict=True))
        numbers |= {f"p{i}{j}": float(self.P[i, j]) for i in range(4) for j in range(i, 4)}
        numbers |= vars(b) | {n: getattr(self, n) for n in PARAMETERS if n in vars(self)}
        numbers |= {
            "scale_q": scale_q, "scale_theta": scale_theta, "near": NEAR, "away": AWAY, "allowed": self.travel,
            "fade": math.exp(-self.period / FADE), "learn": LEARN, "pause": PAUSE,
        }  # fmt: skip
        mode = zero + (HOLDING if holding else SWINGING)
        return Rule(
            function=swing_and_hold, parameters=[numbers[n] for n in PARAMETERS],
            initial=np.array([at[..., 0], at[..., 1], speeds[..., 0], speeds[..., 1], mode, zero, zero, zero - 1.0]),
            resolution=np.abs(rig.resolution / rig.shown), command_resolution=rig.converter,
            measured=tuple(c.name for c in rig.plant.coordinates), period=self.period,
        )  # fmt: skip


def design_swing_up(
    model: Rig, *, travel: float | None = None, speeds: Sequence[float] = (), memory: float = 0.8, seed: int = 0
) -> SwingUp:  # fmt: skip
    """Swing-up and catch for a rig's model, which can be stopped within travel and speed at every moment.

    Parameters
    ----------
    model : Rig
        As it is known; its numbers need not be those of the rig that the law will meet.
    travel : float, optional
        How far the driven body may go from the middle [m or rad]; what the rig says when omitted.
    speeds : sequence of float, optional
        Limits of the driven body's and the pendulum's speed [m/s or rad/s]; the rig's own for the body when omitted.
    memory : float
        Of the filtered differences that give the speeds.
    seed : int
        Of the rigs that the model's fit allows, on which it is tried.

    Raises
    ------
    BadInput
        When the rig has no pendulum to swing up, or no swing-up keeps within limit, speeds and travel.
    """
    known = model.travel if math.isfinite(model.travel) else TRAVEL[model.plant.coordinates[0].unit]
    room, most = known if travel is None else travel, tuple(speeds) or (model.speed_limit, math.inf)
    units = [c.unit for c in model.plant.coordinates]
    b = body(model)
    if 2 * b.omega >= MARGIN * most[1]:
        raise BadInput(
            f"a pendulum of {model.name} that has the energy to stand passes the bottom with {2 * b.omega:.3g} "
            f"{units[1]}/s, and its speed is limited to {most[1]:.3g}; allow more."
        )
    far, fast, stand = math.inf, np.zeros(2), 0.0
    for share in SHARES:
        law = _within(model, b, share * room, room, memory)
        far, fast, stand = _tried(law, model, seed)
        if far <= MARGIN * room and np.all(fast <= MARGIN * np.array(most)):
            if stand >= ENOUGH:
                return law
            break
    raise BadInput(
        f"no swing-up of {model.name} keeps within its limits: the last that was tried moves its driven body with "
        f"{fast[0]:.3g} {units[0]}/s, of {most[0]:.3g}, takes {far:.3g} {units[0]} of travel with what braking needs, "
        f"of {room:.3g}, and brings {stand:.0%} of the rigs upright in {SECONDS:g} s; allow more travel or speed."
    )


def _tried(law: SwingUp, model: Rig, seed: int) -> tuple[float, Array, float]:
    """How far a swing-up may go if it is braked at its worst moment, its largest speeds, and the share that stands.

    Over rigs that the fit allows.
    """
    start = np.tile(model.plant.state("hanging"), (LANES, 1))
    start[:, 0] += np.linspace(-ASIDE, ASIDE, LANES) * law.travel
    x = simulate(
        model.plant, dict(model.drive) | dict(allowed(model, LANES, seed)), start, None, model.period,
        samples=round(SECONDS / model.period), substeps=steps_in_period(model), loop=law.rule(model, start),
    )[:, :4]  # fmt: skip
    braking = Braking(model, "inverted", model.saturation, falls=True)
    fast, last = np.abs(x[:, 1::2]).max(axis=(0, 2)), np.mod(x[-round(0.5 / model.period) :, 2], 2 * math.pi) - math.pi
    stand = float(np.mean(np.abs(last).max(axis=0) < UPRIGHT))
    return float(braking.farthest(x, law.travel).max()), fast, stand


def _within(model: Rig, b: Body, room: float, travel: float, memory: float) -> SwingUp:
    """Of a pump and a feedback for a room within the travel."""
    from scipy.linalg import solve_continuous_are

    linear = model.linear("inverted")
    # Bryson: a quarter of the room, half a radian and half the limit cost alike
    Q, R = np.diag([(4 / room) ** 2, 0.0, 4.0, 0.0]), (2 / model.saturation) ** 2
    P = np.asarray(solve_continuous_are(linear.A, linear.B, Q, np.array([[R]])), dtype=np.float64)
    K = (linear.B.T @ P / R)[0]
    sampled = linear.to_sampled(model.period, (model.delay + model.lag) / model.period)
    gains = place_sampled(sampled, filtered(sampled, memory), poles_of(linear.A - linear.B @ K[None]))
    sure = (2 * model.saturation) ** 2 / float(K @ np.linalg.solve(P, K))
    centre = 0.45 * b.omega
    law = SwingUp(
        body=b, K=gains[0], P=P, size=sure, sure=sure, memory=memory,
        fast=min(math.sqrt(0.2 * b.weight / max(b.spin, 1e-12)), room * b.omega),
        # half of what would hold the pendulum level, and no wider a swing of the pivot than fits
        reach=min(0.5 * b.weight / abs(b.kappa), 0.3 * room * b.omega**2), sharp=4.0,
        centre=centre**2, damp=1.5 * centre, travel=travel, period=model.period, gain=model.gain,
        limit=model.saturation, lost=model.drive.get("actuator.dead_zone", 0.0),
    )  # fmt: skip
    return replace(law, size=0.8 * sure * _share(law, model))


def _share(law: SwingUp, model: Rig, *, rays: int = 40, seconds: float = 2.5) -> float:
    """Share of the sure ellipsoid, in steps of a sixteenth of its radius, from all of whose surface the model rests.

    As many points of each surface are tried as there are `rays`, all of them where the law would catch.
    """
    rng = np.random.default_rng(5)
    shape = np.linalg.inv(np.linalg.cholesky(law.P)).T * math.sqrt(law.sure)
    radii = np.arange(1, 17) / 16
    starts: list[Array] = []
    for radius in radii.tolist():
        rose = rng.normal(size=(4, 200 * rays))
        x = radius * shape @ (rose / np.linalg.norm(rose, axis=0))
        caught = (np.abs(x[2]) <= NEAR) & (np.abs(x[1]) <= law.fast) & (np.abs(x[0]) <= 0.5 * law.travel)
        starts.append(x[:, np.resize(np.flatnonzero(caught), rays)])
    start = np.concatenate(starts, axis=1).T + model.plant.state("inverted")
    out = simulate(
        model.plant, model.drive, start, None, model.period, samples=round(seconds / model.period),
        substeps=steps_in_period(model), loop=law.rule(model, start, holding=True),
    )  # fmt: skip
    rests = np.abs(out[-200:, 2] - math.pi).max(axis=0) < 0.1
    rests &= np.abs(out[:, 0]).max(axis=0) < law.travel
    lost = ~rests.reshape(radii.size, rays).all(axis=1)
    within = int(np.argmax(lost)) if lost.any() else radii.size
    if within == 0:
        raise BadInput(f"no catch of {model.name} keeps within its limit and a travel of {law.travel:g}; allow more.")
    return float(radii[within - 1] ** 2)


@dataclass(frozen=True, kw_only=True, eq=False)
class Ascent:
    """One swing-up; what is read off comes from the log, as on a rig.

    Attributes
    ----------
    mode : array, shape (N,)
        What the law did: `SWINGING`, `HOLDING` or `TRIPPED`.
    angle : array, shape (N,)
        From the nearest upright, as shown [rad].
    speeds : array, shape (N, 2)
        As the law estimates them, of the driven body and of the pendulum.
    energy : array, shape (N,)
        Of the swing over that of rest upright [J].
    """

    trial: Trial
    law: SwingUp
    mode: Array
    angle: Array
    speeds: Array
    energy: Array

    @property
    def up(self) -> float:
        """Time from which the pendulum stands within ten degrees to the end [s]; inf when it does not."""
        out = np.flatnonzero(np.abs(self.angle) > UPRIGHT)
        last = int(out[-1]) + 1 if out.size else 0
        return float(self.trial.t[last]) if last < self.trial.t.size else math.inf

    @property
    def handovers(self) -> tuple[float, ...]:
        """When the feedback took over [s]."""
        return self._changes(SWINGING, HOLDING)

    @property
    def falls(self) -> tuple[float, ...]:
        """When it lost the pendulum again [s]."""
        return self._changes(HOLDING, SWINGING)

    @property
    def tripped(self) -> float:
        """When the travel's end switched the drive off [s]; inf when it did not."""
        off = np.flatnonzero(self.mode == TRIPPED)
        return float(self.trial.t[off[0]]) if off.size else math.inf

    @property
    def swings(self) -> int:
        """Half swings until the first handover, or to the end."""
        speed = self.speeds[:, 1]
        first = int(np.argmax(self.mode != SWINGING)) if np.any(self.mode != SWINGING) else self.mode.size
        sign = np.sign(np.where(np.abs(speed[:first]) > 0.2, speed[:first], 0.0))
        sign = sign[sign != 0.0]
        return int(np.sum(np.diff(sign) != 0)) + 1 if sign.size else 0

    @property
    def peak(self) -> float:
        """Largest command [its unit]."""
        return float(np.abs(self.trial.u).max())

    @property
    def saturated(self) -> float:
        """Share of the samples at the limit, 0 to 1."""
        return float(np.mean(np.abs(self.trial.u) >= self.trial.rig.saturation * (1 - 1e-9)))

    @property
    def travel(self) -> float:
        """Farthest that the driven body truly went from the middle [m or rad]."""
        return float(np.abs(self.trial.x[:, 0]).max())

    def _changes(self, before: float, after: float) -> tuple[float, ...]:
        at = np.flatnonzero((self.mode[:-1] == before) & (self.mode[1:] == after)) + 1
        return tuple(self.trial.t[at].tolist())


def ascent_of(run: Trial, law: SwingUp, rule: Rule) -> Ascent:
    """What a run of a swing-up came to, by its readings and what the law made of them."""
    rig = run.rig
    names = [c.name for c in rig.plant.coordinates]
    measured = np.column_stack([run.record[n] for n in names])
    memory = rule.follow(measured / rig.shown, rig.period)[1]
    memory = np.vstack([memory[1:], memory[-1:]])  # what it knew once it had read this sample
    theta = measured[:, 1]
    return Ascent(
        trial=run, law=law, mode=memory[:, MODE], angle=np.mod(theta, 2 * math.pi) - math.pi,
        speeds=memory[:, 2:4], energy=law.body.energy(theta, memory[:, 3]),
    )  # fmt: skip
