"""Records of random rigs, each with one fault put in: what `benchmarks.doctor` and the tests examine.

Rigs, friction, encoders, noise and excitation are drawn anew for every record; the motion comes from the kernel, all
records of one plant and fault in lanes.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

PLANTS = ("pendulum", "cart-pendulum", "furuta", "rectilinear-2", "torsional-2")
FAULTS = {
    "sign": {"sign"},
    "scale x2": {"scale"},
    "scale x10": {"scale"},
    "scale x0.5": {"scale"},
    "degrees as radians": {"scale"},
    "dead": {"dead"},
    "stuck": {"stuck"},
    "wrap": {"wrap"},
    "lost counts": {"jump"},
    "effort is the reference": {"effort"},
    "effort is the position": {"effort"},
    "effort is constant": {"effort"},
    "saturated": {"saturation"},
    "jitter": {"jitter"},
    "gaps": {"gap"},
    "doubled rows": {"doubled"},
    "trip": {"trip"},
    "spikes": {"spike"},
}
"""Kinds of finding that count as a hit, by fault."""
KNOWN_TO = 0.03
"""Relative error (one sigma) of the inertias, stiffnesses and gains that the doctor is told."""
LOOPED = ("effort is the reference",)
DRIVEN = ("sign", "scale x2", "scale x10", "scale x0.5", "degrees as radians", "effort is the position",
          "effort is constant", "saturated", "trip", "dead")  # fmt: skip


@dataclass
class Doctored:
    """One record with what the doctor is told about its rig, and what was put in."""

    record: Any
    rig: Any
    wiring: Any
    fault: str
    plant: str
    how: str
    channel: str


def rigs(plant: str, n: int, rng: np.random.Generator) -> tuple[dict[str, np.ndarray], np.ndarray, np.ndarray]:
    """Parameters (n,) by name, a force (n,) that moves the rig well, and its slowest angular frequency (n,)."""

    def log(low: float, high: float) -> np.ndarray:
        return np.exp(rng.uniform(math.log(low), math.log(high), n))

    if plant in ("pendulum", "cart-pendulum", "furuta"):
        m, length = log(0.05, 0.5), log(0.1, 0.4)
        p = {"m_p": m, "l_cg": length, "J_p": m * length**2 * rng.uniform(0.1, 0.35, n)}
        inertia, torque = p["J_p"] + m * length**2, m * 9.81 * length
        w = np.sqrt(torque / inertia)
        p |= {"b_2": 2 * log(0.003, 0.03) * w * inertia, "b_2c": torque * log(1e-3, 1e-2)}
        if plant == "pendulum":
            return p, torque * rng.uniform(0.25, 0.6, n), w
        if plant == "cart-pendulum":
            p["m_c"] = m * log(1.5, 10)
            total, reach = p["m_c"] + m, 1.0
        else:
            p["r"] = length * log(0.5, 1.2)
            p["J_d"] = m * p["r"] ** 2 * log(1.0, 6.0)
            total, reach = p["J_d"] + m * p["r"] ** 2, p["r"]
        force = total * rng.uniform(1.5, 4.0, n) / reach
        p |= {"b_1": total * log(0.5, 4.0), "b_1c": force * log(0.01, 0.06)}
        return p, force, w
    one, two = ("m_1", "m_2") if plant == "rectilinear-2" else ("J_1", "J_2")
    base = log(0.3, 3.0) if plant == "rectilinear-2" else log(1e-3, 2e-2)
    ratio = log(0.5, 2.0)
    w = 2 * math.pi * log(0.8, 2.5)
    p = {one: base, two: base * ratio, "k_12": base * w**2 * log(0.7, 2.0)}
    if plant == "rectilinear-2":
        p["k_1"] = base * w**2 * log(0.7, 2.0)
    force = base * w**2 * (0.01 if plant == "rectilinear-2" else 0.3) * log(0.7, 1.5)
    for i, body in ((1, base), (2, base * ratio)):
        p |= {f"c_{i}": body * w * log(0.02, 0.15), f"f_{i}c": force * log(0.005, 0.05)}
    return p, force, w


def excitation(how: str, t: np.ndarray, w: float, rng: np.random.Generator) -> np.ndarray:
    """Command (N,) of amplitude 1."""
    end = float(t[-1])
    if how == "step":
        on, off = rng.uniform(0.08, 0.2) * end, rng.uniform(0.55, 0.8) * end
        return np.where((t >= on) & (t < off), 1.0, 0.0) * rng.choice([-1.0, 1.0])
    if how == "sine":
        return np.sin(w * rng.uniform(0.4, 1.6) * t)
    if how == "chirp":
        low, high = 0.2 * w, 2.5 * w
        return np.sin(low * t + (high - low) * t**2 / (2 * end))
    if how == "steps":
        edges = np.sort(rng.uniform(0.08, 0.95, 6)) * end
        levels = np.concatenate([[0.0], rng.uniform(-1, 1, 6)])
        return levels[np.searchsorted(edges, t, side="right")]
    return np.zeros(t.size)


def batch(plant: str, fault: str, n: int, seed: int) -> list[Doctored]:
    """Records of one plant with one fault ("" for none), `n` of them."""
    from upright.laws import state_feedback
    from upright.physics import find
    from upright.simulation import simulate

    rng = np.random.default_rng([seed, PLANTS.index(plant), sorted(["", *FAULTS]).index(fault)])
    cls = find(plant)
    looped = n if fault in LOOPED else 0 if fault in ("trip", "saturated") else n // 5
    out: list[Doctored] = []
    for loop, lanes in ((False, n - looped), (True, looped)):
        if not lanes:
            continue
        p, force, w = rigs(plant, lanes, rng)
        dt, samples = float(rng.choice([2e-3, 4e-3, 5e-3])), int(rng.integers(1200, 1800))
        t = np.arange(samples) * dt
        ways = ["step", "sine", "chirp", "steps"] if fault not in ("saturated",) else ["sine", "chirp"]
        hows = [str(rng.choice(ways)) for _ in range(lanes)]
        if not loop and fault not in DRIVEN:
            hows = ["free" if rng.random() < 0.2 else h for h in hows]
        gain = np.exp(rng.uniform(-1.5, 1.5, lanes))
        u = np.stack([excitation(h, t, w[i], rng) * force[i] / gain[i] for i, h in enumerate(hows)])
        limit = np.full(lanes, np.inf)
        if fault == "saturated":
            limit = np.abs(u).max(axis=1) * rng.uniform(0.5, 0.85, lanes)
            u = np.clip(u, -limit[:, None], limit[:, None])
        logged, trips = u.copy(), np.zeros(lanes)
        if fault == "trip":
            for i in range(lanes):
                live = np.flatnonzero(u[i])
                a, b = t[live[0]], t[live[-1]]
                trips[i] = a + rng.uniform(0.3, 0.7) * (b - a)
                u[i, t >= trips[i]] = 0.0
        x0 = np.zeros((lanes, 2 * len(cls.coordinates)))
        for i, h in enumerate(hows):
            if h == "free":
                swing = rng.uniform(0.3, 1.5) if "pendulum" in plant or plant == "furuta" else force[i] / p["k_12"][i]
                x0[i, 2 * (len(cls.coordinates) - 1)] = swing
        lag = rng.uniform(0.0, 0.008, lanes)
        actuator = {"actuator.gain": gain, "actuator.lag": lag}
        extra: dict[str, Any] = {}
        if loop:
            K, r = feedback(plant, cls, p, force, w, gain, rng)
            shape = excitation("steps", t, 1.0, rng)
            extra = {"loop": state_feedback(K, dt, k_pf=K[0, 0] * r, references=shape)}
            u, logged = np.zeros((1, samples)), np.zeros((lanes, samples))
            hows = ["loop"] * lanes
        parameters = {
            **{name: 0.0 for name in cls.names() if name not in p and name != "g"},
            "g": 9.81,
            **p,
            **actuator,
        }
        parameters = {k: v for k, v in parameters.items() if k.startswith("actuator") or k in cls.names()}
        motion = simulate(cls, parameters, x0, u.reshape(-1, 1), dt, samples=samples, substeps=2,
                          start=np.arange(lanes) * samples * (not loop), **extra)  # fmt: skip
        for i in range(lanes):
            y = motion[:, : 2 * len(cls.coordinates) : 2, i]
            command = motion[:, -1, i] if loop else logged[i]
            reference = shape * r[i] if loop else None
            own = {k: float(v[i]) for k, v in p.items()}
            made = _record(cls, plant, fault, hows[i], t, y, command, reference, own, float(gain[i]), rng)
            out.append(made)
    return out


def feedback(
    plant: str, cls: Any, p: dict[str, np.ndarray], force: np.ndarray, w: np.ndarray, gain: np.ndarray,
    rng: np.random.Generator,
) -> tuple[np.ndarray, np.ndarray]:  # fmt: skip
    """PD gains (1, states, lanes) on the driven coordinate and the size (lanes,) of a step of its reference."""
    if plant == "pendulum":
        inertia = p["J_p"] + p["m_p"] * p["l_cg"] ** 2
    elif plant == "cart-pendulum":
        inertia = p["m_c"] + p["m_p"]
    elif plant == "furuta":
        inertia = p["J_d"] + p["m_p"] * p["r"] ** 2
    else:
        inertia = p["m_1" if plant == "rectilinear-2" else "J_1"]
    wc = w * rng.uniform(0.6, 1.5, w.size)
    K = np.zeros((1, 2 * len(cls.coordinates), w.size))
    K[0, 0], K[0, 1] = inertia * wc**2 / gain, 1.2 * inertia * wc / gain
    return K, force / (inertia * wc**2)


def _record(
    cls: Any, plant: str, fault: str, how: str, t: np.ndarray, y: np.ndarray, u: np.ndarray,
    reference: np.ndarray | None, own: dict[str, float], gain: float, rng: np.random.Generator,
) -> Doctored:  # fmt: skip
    """Sensors, log and fault of one motion."""
    from upright.records import Provenance, Record
    from upright.rig import Rig
    from upright.study.sensors import Drive, Sensor, Wiring

    names = [c.name for c in cls.coordinates]
    encoders = rng.random() < 0.7
    columns: dict[str, np.ndarray] = {}
    sensors: dict[str, Any] = {}
    k = int(rng.integers(len(names)))
    channel = names[k]
    steps: list[float] = []
    for j, c in enumerate(cls.coordinates):
        x, span = y[:, j], float(np.ptp(y[:, j])) or 1e-3
        if encoders:
            q = 2 * math.pi / float(rng.choice([4096, 8192, 16000])) if c.unit == "rad" else 2e-5
            q = min(q, span / 300)
            noise = 0.2 * q
        else:
            q, noise = span / 4000, span / 3000
        steps.append(q)
        columns[c.name] = x + noise * rng.normal(size=x.size)
        sensors[c.name] = Sensor(coordinate=c, column=c.name, unit=c.unit)
    if fault == "jitter":
        t, columns, u = _jittered(t, columns, u, rng)
    columns = {n: np.round(x / q) * q for (n, x), q in zip(columns.items(), steps, strict=True)}
    columns["u"] = u.copy()
    x, q = columns[channel], steps[k]
    if fault == "wrap" and (cls.coordinates[k].unit != "rad" or encoders):
        angle = cls.coordinates[k].unit == "rad"
        counts = np.round(x / q)
        turn = round(2 * math.pi / q) if angle and abs(2 * math.pi / q - round(2 * math.pi / q)) < 1e-6 else 65536
        crossing = counts[_moving(counts, rng)]
        columns[channel] = np.mod(counts - crossing, turn)
        sensors[channel] = Sensor(coordinate=cls.coordinates[k], column=channel, unit="counts", scale=q,
                                  offset=-float(crossing))  # fmt: skip
    elif fault == "wrap":
        crossing = x[_moving(x, rng)]
        columns[channel] = np.round((np.mod(x - crossing, 2 * math.pi) - math.pi) / q) * q
        sensors[channel] = Sensor(coordinate=cls.coordinates[k], column=channel, unit="rad",
                                  offset=-float(crossing) - math.pi)  # fmt: skip
    elif fault:
        t, columns, channel = inject(fault, t, columns, channel, cls, q, reference, rng)
    known: dict[str, float] = {}
    for n in cls.names():
        value = 9.81 if n == "g" else own.get(n, 0.0)
        if n in ("g",) or n.startswith(("m_", "l_", "J_", "r", "k_", "a_", "tilt")):
            off = 1.0 if n == "g" else 1 + KNOWN_TO * rng.normal()
            known[n] = value * off
    guessed = {n: 0.0 for n in cls.names() if n not in known}
    rig = Rig(
        plant=cls(**known, **{n: v for n, v in guessed.items() if n not in cls.optional}), name=plant,
        gain=gain * (1 + KNOWN_TO * rng.normal()), sources=dict.fromkeys(guessed, "guessed"),
    )  # fmt: skip
    wiring = Wiring(sensors=sensors, drive=Drive(what="`u`"))
    units = {n: s.unit for n, s in sensors.items()}
    record = Record(t=t, signals=columns, units=units, provenance=Provenance(file="log.csv", reader="table"))
    return Doctored(record=record, rig=rig, wiring=wiring, fault=fault, plant=plant, how=how, channel=channel)


def _moving(x: np.ndarray, rng: np.random.Generator, share: float = 0.3) -> int:
    """A sample, not near the ends, at which a column moves at this `share` of its top speed."""
    w = 8
    speed = np.abs(x[w:] - x[:-w])
    inner = np.arange(speed.size // 5, 4 * speed.size // 5)
    fast = inner[speed[inner] > share * speed[inner].max()]
    return int(rng.choice(fast if fast.size else inner)) + w // 2


def _jittered(
    t: np.ndarray, columns: dict[str, np.ndarray], u: np.ndarray, rng: np.random.Generator
) -> tuple[np.ndarray, dict[str, np.ndarray], np.ndarray]:
    """The same motion sampled at uneven instants, which the log states."""
    dt = t[1] - t[0]
    late = t + dt * np.clip(rng.uniform(0.05, 0.2) * rng.normal(size=t.size), -0.45, 0.45)
    held = u[np.clip(np.searchsorted(t, late, side="right") - 1, 0, None)]
    return late, {n: np.interp(late, t, x) for n, x in columns.items()}, held


def inject(
    fault: str, t: np.ndarray, columns: dict[str, np.ndarray], channel: str, cls: Any, q: float,
    reference: np.ndarray | None, rng: np.random.Generator,
) -> tuple[np.ndarray, dict[str, np.ndarray], str]:  # fmt: skip
    """A log with one fault in one channel."""
    x, n = columns[channel], t.size
    any_channel = str(rng.choice([*(c.name for c in cls.coordinates), "u"]))
    angles = [c.name for c in cls.coordinates if c.unit == "rad"]
    if fault == "sign":
        channel = any_channel
        columns[channel] = -columns[channel]
    elif fault.startswith("scale"):
        channel = any_channel
        columns[channel] = columns[channel] * float(fault.split("x")[1])
    elif fault == "degrees as radians":
        channel = str(rng.choice(angles)) if angles else channel
        columns[channel] = columns[channel] * 180 / math.pi
    elif fault == "dead":
        columns[channel] = np.full(n, x[0])
    elif fault == "stuck":
        i = _moving(x, rng)
        columns[channel] = np.where(np.arange(n) < i, x, x[i])
    elif fault == "lost counts":
        size = rng.uniform(0.05, 0.3) * np.ptp(x) * rng.choice([-1, 1])
        columns[channel] = x + np.where(t > t[int(rng.integers(n // 10, 9 * n // 10))], round(size / q) * q, 0.0)
    elif fault == "effort is the reference" and reference is not None:
        columns["u"], channel = reference.copy(), "u"
    elif fault == "effort is the position":
        columns["u"], channel = columns[cls.coordinates[0].name] * rng.uniform(0.5, 5.0), "u"
    elif fault == "effort is constant":
        columns["u"], channel = np.full(n, float(np.abs(columns["u"]).max())), "u"
    elif fault == "gaps":
        keep = np.ones(n, bool)
        for _ in range(int(rng.integers(1, 4))):
            i = int(rng.integers(n // 10, 9 * n // 10))
            keep[i : i + int(rng.integers(3, 50))] = False
        t, columns = t[keep], {k: v[keep] for k, v in columns.items()}
    elif fault == "doubled rows":
        rows = np.unique([_moving(x, rng, 0.6) for _ in range(n // 100)])
        if rng.random() < 0.5:  # a row is written again in place of the next
            for k in columns:
                columns[k][rows] = columns[k][rows - 1]
        else:  # a row is written again and all others come later
            columns = {k: np.insert(v, rows, v[rows - 1])[:n] for k, v in columns.items()}
    elif fault == "spikes":
        at = rng.choice(np.arange(20, n - 20), int(rng.integers(1, 6)), replace=False)
        size = rng.uniform(0.1, 0.6, at.size) * np.ptp(x) * rng.choice([-1, 1], at.size)
        x = x.copy()
        x[at] += np.round(size / q) * q
        columns[channel] = x
    return t, columns, channel
