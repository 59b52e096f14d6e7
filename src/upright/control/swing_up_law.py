"""What does the swing-up compute at every sample? One function, in the kernel as on a rig.

Far from upright it pumps: the pivot is moved along with the swing and does the work ``-kappa cos(theta) theta' a``,
by less as the energy comes near that of rest upright (Astrom and Furuta, Automatica 36, 2000), while a spring and a
damper keep the driven body near the middle. Upright, it is a state feedback.
"""

from __future__ import annotations

from math import cos, floor, pi, sin
from typing import Any

SWINGING, HOLDING, TRIPPED = 0.0, 1.0, 2.0
"""What the law is doing, and where among its numbers that stands."""
MODE = 4

PARAMETERS = (
    "period", "memory", "scale_q", "scale_theta",
    "M", "spin", "kappa", "J", "weight", "viscous", "dry", "gain", "limit",
    "reach", "sharp", "learn", "pause", "centre", "damp",
    "k0", "k1", "k2", "k3",
    "p00", "p01", "p02", "p03", "p11", "p12", "p13", "p22", "p23", "p33",
    "size", "near", "fast", "away", "fade", "allowed",
)  # fmt: skip
"""In order: servo period and filter; what encoders show over what is true; the rig; pumping; gains; the ellipsoid
``x'Px <= size`` of the catch with bounds of its angle and speed; the angle of a fall; what is left of the handover's
step from sample to sample; the travel."""


def swing_and_hold(t: float, y: Any, r: Any, z: Any, p: Any) -> tuple[Any, Any]:
    """One sample, as a `law.Rule`; it remembers readings, speeds, what it is doing, the handover's
    fading step, how much more energy than the model's it asks for, and when it last changed that.
    """
    (period, memory, scale_q, scale_theta, M, spin, kappa, J, weight, viscous, dry, gain, limit, reach, sharp,
     learn, pause, centre, damp, k0, k1, k2, k3, p00, p01, p02, p03, p11, p12, p13, p22, p23, p33, size, near, fast,
     away, fade, allowed) = p  # fmt: skip
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
    if abs(q) > allowed or z[4] > 1.5:
        mode, u = 2.0, 0.0
    return (min(max(u, 0.0 - limit), limit),), (q, theta, v, w, mode, bump, aim, event)
