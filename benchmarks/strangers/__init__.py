"""From a hanging log to a controller that stabilises, on a simulator that shares nothing with ours: forty rigs.

20 Furuta pendulums and 20 pendulums on carts move in `rig.c`, whose equations were written by hand. They have what a
real rig has:

- dry friction by impulses, larger at rest by up to a quarter
- encoder counts, a 12-bit converter, delay and lag
- a cable that pulls the arm back, an axis or rail out of level by up to 0.3 degrees
- at the run, dry friction and drive of another day (within 20 % and 2 %)

Each rig goes through the same steps: it logs 12 s of steps while it hangs, and `init` drafts a study. What a ruler, a
scale and data sheets give (five edits) and what the verdict proposes is written into the draft. The rig is then
identified, its controller designed as `design` proposes and exported to C, and run 12 times for 10 s from tilts within
4 degrees.

Required: 32 of 40 fits trusted, no trusted rig lost, a Brier score of the predicted probabilities within 0.01 of its
expectation, and 10 s in all. A fit that is not trusted gives no probability.
"""

from __future__ import annotations

import math
import re
import shutil
import subprocess
import tempfile
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.measure import Line, Spread, of_each, page
from upright.workers import HERE, Workers

SOURCE = Path(__file__).with_name("rig.c")
LOGGED, HELD, STARTS, TILT, SWING = 12.0, 10.0, 12, math.radians(4), math.radians(70)


@dataclass(frozen=True, kw_only=True)
class Stranger:
    """A rig: numbers of `rig.c`, and how long its pendulum is."""

    kind: str
    seed: int
    numbers: dict[str, float]


@dataclass(frozen=True, kw_only=True)
class Ending:
    """What became of one: whether it was trusted, what was told of its loop, and what it did."""

    kind: str
    seed: int
    ended: str
    trusted: bool = False
    chance: float | str = ""
    """Probability of stabilisation, or that none is supported."""
    held: tuple[bool, ...] = ()
    effort: float | None = None
    """Root mean square of the command over that which was told."""
    off: dict[str, float] = field(default_factory=dict[str, float])
    """Estimate over truth by name."""
    missed: tuple[str, ...] = ()
    """Numbers that were called well determined by a trusted fit, and whose intervals miss the truth."""
    seconds: float = 0.0


def stranger(kind: str, seed: int) -> Stranger:
    """A rig drawn at random."""
    g = np.random.default_rng([seed, 20, kind == "cart"])
    length = g.uniform(0.15, 0.4) if kind == "furuta" else g.uniform(0.3, 0.6)
    rod, tip = g.uniform(0.02, 0.15), g.choice([0.0, g.uniform(0.01, 0.08)])
    m = rod + tip
    centre = (rod / 2 + tip) * length / m
    J = rod * length**2 / 12 + rod * (centre - length / 2) ** 2 + tip * (length - centre) ** 2
    numbers = {
        "m": m, "l": centre, "J": J, "rest": g.uniform(1.0, 1.25), "limit": 10.0, "delay": g.uniform(0, 3e-3),
        "lag": g.uniform(0.2e-3, 2e-3), "counts2": float(g.choice([2000, 2048, 4096, 8192])),
        "period": float(g.choice([1e-3, 2e-3, 5e-3])),
    }  # fmt: skip
    A, weight = J + m * centre**2, m * 9.81 * centre
    numbers |= {
        "b2": 2 * g.uniform(0.001, 0.008) * math.sqrt(A * weight),
        "dry2": g.uniform(0, 0.004) * weight,
    }
    tilt, towards = math.sin(math.radians(g.uniform(0, 0.3))), g.uniform(0, 2 * math.pi)
    if kind == "furuta":
        r = g.uniform(0.08, 0.2)
        carried = g.uniform(0.5, 4) * m * r**2
        most = g.uniform(3, 8) * weight
        numbers |= {
            "cart": 0.0, "carried": carried, "r": r, "volt": most / 10 * g.choice([-1, 1]),
            "b1": (carried + m * r**2) / g.uniform(0.2, 1.0), "dry1": g.uniform(0.01, 0.05) * most,
            "spring": g.choice([0.0, g.uniform(0, 0.03) * most]), "tilt_x": tilt * math.cos(towards),
            "tilt_y": tilt * math.sin(towards), "counts1": float(g.choice([2000, 2048, 4096, 8192])), "travel": 2.5,
        }  # fmt: skip
    else:
        carried = g.uniform(0.3, 1.5)
        most = g.uniform(0.8, 2.0) * (carried + m) * 9.81
        numbers |= {
            "cart": 1.0, "carried": carried, "r": 0.0, "volt": most / 10 * g.choice([-1, 1]),
            "b1": (carried + m) / g.uniform(0.1, 0.6), "dry1": g.uniform(0.01, 0.06) * most, "spring": 0.0,
            "tilt_x": tilt * math.cos(towards), "tilt_y": 0.0, "counts1": g.uniform(2e4, 1e5), "travel": 0.45,
        }  # fmt: skip
    return Stranger(kind=kind, seed=seed, numbers={n: float(v) for n, v in numbers.items()})


def commands(rig: Stranger, most: float) -> np.ndarray:
    """Steps of random height, to either side in turn [V], between rest at either end."""
    g = np.random.default_rng([rig.seed, 21])
    period = rig.numbers["period"]
    u = np.zeros(round(LOGGED / period))
    k, end, sign = round(1.0 / period), round((LOGGED - 1.5) / period), most
    while k < end:
        n = round(g.uniform(0.1, 0.5) / period)
        u[k : min(k + n, end)] = sign * g.uniform(0.3, 1.0)
        sign, k = -sign, k + n
    return u


def built(folder: Path, *, law: Path | None = None) -> Path:
    """The simulator, with a law in its loop or without."""
    program = folder / ("loop" if law else "rig")
    loop = ["-DLOOP", f"-I{law}", str(law / "law.c")] if law else []
    subprocess.run(["cc", "-O2", str(SOURCE), *loop, "-lm", "-o", str(program)], check=True, capture_output=True)
    return program


def logged(rig: Stranger, folder: Path) -> Path:
    """The log of a hanging rig, in counts and volts, under steps as strong as swing and travel allow."""
    said, program, p = folder / "rig.txt", built(folder), rig.numbers
    said.write_text("".join(f"{n} {v!r}\n" for n, v in p.items()), encoding="utf-8")
    turn = 1.0 if rig.kind == "cart" else 2 * math.pi
    most = 10.0
    while True:
        given = "".join(f"{u:.6f}\n" for u in commands(rig, most))
        rows = subprocess.run([str(program), str(said)], input=given, capture_output=True, text=True, check=True).stdout
        y = np.array([row.split() for row in rows.splitlines()], float)
        far = np.abs(y[:, 1]).max() * turn / p["counts1"] / p["travel"]
        if max(far, np.abs(y[:, 2]).max() * 2 * math.pi / p["counts2"] / SWING) <= 1:
            break
        most *= 0.85
    driven = "x" if rig.kind == "cart" else "psi"
    rows = "\n".join(",".join(row.split()) for row in rows.splitlines())
    log = folder / "hanging.csv"
    log.write_text(f"t [s],{driven} [counts],theta [counts],u [V]\n{rows}\n", encoding="utf-8")
    return log


def edited(text: str, rig: Stranger) -> str:
    """The draft with what a ruler (half a millimetre), a scale (half a percent) and data sheets give."""
    g, p = np.random.default_rng([rig.seed, 22]), rig.numbers
    m, J = p["m"] * (1 + 0.005 * g.normal()), p["J"] * (1 + 0.02 * g.normal())
    known = {
        "m_p": f'{{ value = "{m:.6g} kg", uncertainty = "{0.005 * m:.3g} kg" }}',
        "J_p": f'{{ value = "{J:.6g} kg m^2", uncertainty = "{0.02 * J:.3g} kg m^2" }}',
        "servo_period": f'"{p["period"]:g} s"', "limit": '"10 V"',
        "travel": f'"{p["travel"]:g} {"m" if rig.kind == "cart" else "rad"}"',
    }  # fmt: skip
    if rig.kind == "furuta":
        r = p["r"] + 5e-4 * g.normal()
        known["r"] = f'{{ value = "{r:.6g} m", uncertainty = "0.5 mm" }}'
    else:
        cart = p["carried"] * (1 + 0.005 * g.normal())
        known["m_c"] = f'{{ value = "{cart:.6g} kg", uncertainty = "{0.005 * cart:.3g} kg" }}'
    for name, value in known.items():
        text, times = re.subn(rf"^(# )?{name} = .*$", f"{name} = {value}", text, count=1, flags=re.MULTILINE)
        if not times and name not in ("J_p",):
            table = "[actuator]" if name == "limit" else "[rig]"
            text = text.replace(f"{table}\n", f"{table}\n{name} = {value}\n", 1)
    driven = "x" if rig.kind == "cart" else "psi"
    for name, counts in ((driven, p["counts1"]), ("theta", p["counts2"])):
        said = f"counts_per_{'m' if name == 'x' else 'rev'} = {{ value = {counts:.9g}, measured = true }}"
        head, mark, rest = text.partition(f"[sensors.{name}]")
        text = head + mark + re.sub(r"^counts_per_\w+ = .*$", said, rest, count=1, flags=re.MULTILINE)
    return text


def with_proposed(text: str, numbers: Mapping[str, float]) -> str:
    """The study with the lines that the verdict of its fit proposes."""
    for name, value in numbers.items():
        key, table = name.rpartition(".")[2], "actuator" if name.startswith("actuator.") else "parameters"
        head, mark, rest = text.partition(f"[{table}]\n")
        own, bracket, others = rest.partition("\n[")
        own = re.sub(rf"^(# )?{key} = .*\n?", "", own, count=1, flags=re.MULTILINE)
        text = f"{head}{mark}{key} = {{ guess = {value:.6g} }}\n{own}{bracket}{others}"
    return text


def truth(rig: Stranger) -> dict[str, float]:
    """Numbers of the rig as a plant of ours calls them."""
    p = rig.numbers
    body = {"m_c": p["carried"]} if rig.kind == "cart" else {"J_d": p["carried"]}
    return body | {"l_cg": p["l"], "b_1": p["b1"], "b_1c": p["dry1"], "b_2": p["b2"], "actuator.gain": abs(p["volt"]),
                   "actuator.delay": p["delay"], "actuator.lag": p["lag"]}  # fmt: skip


def met(rig: Stranger) -> Ending:
    """One rig, from its log to its runs."""
    import upright as up
    from upright.errors import UprightError

    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        log = logged(rig, folder)
        about: dict[str, Any] = {"kind": rig.kind, "seed": rig.seed}
        began = time.perf_counter()
        step = "init"
        try:
            study = folder / "study.toml"
            up.init(log, out=study, plant="cart-pendulum" if rig.kind == "cart" else "furuta")
            study.write_text(edited(study.read_text(encoding="utf-8"), rig), encoding="utf-8")
            step = "identify"
            fit = up.identify(study)
            if fit.proposed:
                study.write_text(with_proposed(study.read_text(encoding="utf-8"), fit.proposed), encoding="utf-8")
                fit = up.identify(study)
            step = "design"
            design = up.design(fit)
            step = "chance"
            told = up.chance(fit, design.K, start={"theta": TILT / 2})
            step = "export"
            up.export(design, to="c", out=folder / "law")
        except UprightError as error:
            return Ending(**about, ended=f"{step}: {error}", seconds=time.perf_counter() - began)
        seconds = time.perf_counter() - began
        program = built(folder, law=folder / "law")
        g, day = np.random.default_rng([rig.seed, 23]), dict(rig.numbers)
        for n in ("dry1", "dry2"):
            day[n] *= float(g.uniform(0.8, 1.2))
        day["volt"] *= float(g.uniform(0.98, 1.02))
        said = folder / "day.txt"
        said.write_text("".join(f"{n} {v!r}\n" for n, v in day.items()), encoding="utf-8")
        runs = [_run(program, said, float(tilt)) for tilt in g.uniform(-TILT, TILT, STARTS)]
        true = truth(rig)
        off = {n: e.value / true[n] for n, e in fit.estimates.items() if true.get(n)}
        missed = tuple(
            n for n, e in fit.estimates.items()
            if fit.trusted and e.status == "well determined" and not e.rests_on and n in true
            and not e.interval[0] <= true[n] <= e.interval[1]
        )  # fmt: skip
        return Ending(
            **about, ended="" if fit.trusted else fit.verdict, trusted=fit.trusted, chance=told.numbers["chance"],
            held=tuple(math.isinf(fell) for fell, *_ in runs), off=off, missed=missed, seconds=seconds,
            effort=float(np.median([effort for _, effort, *_ in runs])),
        )  # fmt: skip


def _run(program: Path, rig: Path, tilt: float) -> tuple[float, ...]:
    out = subprocess.run(
        [str(program), str(rig), f"{tilt:.6f}", f"{HELD:g}"], capture_output=True, text=True, check=True
    )
    return tuple(float(x) for x in out.stdout.split())


def run(
    *, quick: bool, progress: Callable[[str], None], markdown: Path | None = None, workers: Workers = HERE
) -> list[Line]:
    """A line of each kind of rig and of all."""
    if shutil.which("cc") is None:
        return [Line(contender="all", note="left out: no C compiler (cc)")]
    endings: dict[str, list[Ending]] = {}
    taken: dict[str, Spread] = {}
    for kind in ("furuta", "cart"):
        rigs = [stranger(kind, seed) for seed in range(1 if quick else 20)]
        progress(f"{len(rigs)} rigs: {kind}")
        endings[kind], taken[kind] = of_each(met, rigs, workers)
    every = [e for each in endings.values() for e in each]
    lines = [Line(contender=kind, seconds=taken[kind], note=told(each)) for kind, each in endings.items()]
    lines.append(Line(contender="all", note=told(every)))
    if markdown is not None:
        markdown.write_text(_page(lines, every), encoding="utf-8")
    return lines


def told(endings: list[Ending]) -> str:
    """What became of them."""
    designed = [e for e in endings if e.held]
    trusted = [e for e in designed if e.trusted]
    parts = [f"{len(trusted)} of {len(endings)} trusted"]
    if designed:
        whole, held = [all(e.held) for e in designed], sum(sum(e.held) for e in designed)
        parts.append(f"{sum(whole)} of {len(designed)} held {STARTS} times of {STARTS}, "
                     f"{held} of {STARTS * len(designed)} runs")  # fmt: skip
        parts.append(f"{sum(not all(e.held) for e in trusted)} of the trusted lost a run")
        given = [(e.chance, h) for e in designed for h in e.held if not isinstance(e.chance, str)]
        chances, came = np.array(given, dtype=np.float64).reshape(-1, 2).T
        brier, expected = float(np.mean((chances - came) ** 2)), float(np.mean(chances * (1 - chances)))
        parts.append(f"Brier {brier:.3f} (expected {expected:.3f}) of {chances.size // STARTS} probabilities given")
    parts.append(f"{sum(len(e.missed) for e in trusted)} intervals of usable numbers miss the truth")
    parts.append(
        f"median {np.median([e.seconds for e in endings]):.2g} s, longest {max(e.seconds for e in endings):.2g} s"
    )
    return "; ".join(parts)


def headline(trusted: int, fits: int, held: int) -> str:
    """The result in a sentence; of the rigs whose fits were trusted, `held` stood in every run."""
    return (
        f"{trusted} of {fits} fits were trusted, and {held} of these rigs were stabilised in every run ({STARTS} each)."
    )


def _page(lines: list[Line], endings: list[Ending]) -> str:
    body = ["", "| rigs | result |", "|---|---|", *(f"| {x.contender} | {x.note} |" for x in lines)]
    body += ["", "| rig | trusted | probability [%] | runs held | command rms [V] | time [s] | verdict |",
             "|---|---|---|---|---|---|---|"]  # fmt: skip
    for e in endings:
        chance = e.chance if isinstance(e.chance, str) else f"{100 * e.chance:.0f}"
        held = f"{sum(e.held)} of {len(e.held)}" if e.held else ""
        effort = "" if e.effort is None else f"{e.effort:.2g}"
        said = e.ended.splitlines()[0].replace("|", "/")[:200] if e.ended else ""
        trusted = "yes" if e.trusted else "no"
        body.append(f"| {e.kind} {e.seed} | {trusted} | {chance} | {held} | {effort} | {e.seconds:.1f} | {said} |")
    trusted = [e for e in endings if e.trusted and e.held]
    result = headline(len(trusted), len(endings), sum(all(e.held) for e in trusted))
    return page("strangers", "Strangers' rigs", __doc__, body, result)
