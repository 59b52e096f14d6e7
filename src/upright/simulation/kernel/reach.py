"""Where does the search of events find one lane's numbers, and where does it write?

Its text sees two pointers: ``W``, the numbers of one lane, `L` apart, and ``S``, a few places to write on.
"""

from __future__ import annotations

import re

from upright.simulation.kernel.drive import nodes
from upright.simulation.kernel.equations import arguments, step_arguments
from upright.simulation.kernel.flavour import Layout


def places(p: Layout) -> dict[str, int]:
    """Places of the search behind the lanes' numbers, and their total under ``"END"``."""
    nf, nd = len(p.free), len(p.flavour.dry)
    nx = 2 * nf + len(p.flavour.dahl)
    sizes = {"STATE": nx, "NEXT": nx, "WHOLE": nx, "MASS": nf * nf, "FORCE": nf, "WORK": nf * nf}
    sizes |= dict.fromkeys(("ACC", "RIGHT", "KEEP", "MOVES", "FIRST"), nf)
    sizes |= dict.fromkeys(("MODES", "HOLD", "SLIDE", "MARGIN", "BEFORE", "REST", "LEVEL"), nd)
    places, end = {}, 0
    for name, size in sizes.items():
        places[name] = end
        end += size
    return places | {"END": end}


def _states(p: Layout) -> list[str]:
    return [f"q{i}" for i in p.free] + [f"v{i}" for i in p.free] + [f"y{i}" for i in p.flavour.dahl]


def fetch(p: Layout) -> str:
    """Lines that copy the lane's state before and after the substep, its modes and levels."""
    rows, lines = p.rows, []
    for k, name in enumerate(_states(p)):
        lines.append(f"S[STATE + {k}] = W[{rows['o' + name]} * L]")
        lines.append(f"S[NEXT + {k}] = W[{rows[name]} * L]")
    for k, i in enumerate(p.flavour.dry):
        slide = f"_Fs{i}" if i in p.flavour.stribeck else f"_Fc{i}"
        for name, row in (("MODES", f"s{i}"), ("HOLD", f"_Fs{i}"), ("SLIDE", slide)):
            lines.append(f"S[{name} + {k}] = W[{rows[row]} * L]")
    return "".join(f"    {line}\n" for line in lines)


def store(p: Layout) -> str:
    """Lines that give the lane its new state and modes."""
    lines = [f"W[{p.rows[name]} * L] = S[STATE + {k}]" for k, name in enumerate(_states(p))]
    lines += [f"W[{p.rows[f's{i}']} * L] = S[MODES + {k}]" for k, i in enumerate(p.flavour.dry)]
    return "".join(f"    {line}\n" for line in lines)


def located(p: Layout, text: str) -> str:
    """Text with numbers in place of the names in capitals, and the coordinate of each dry joint."""
    where = [p.free.index(i) for i in p.flavour.dry]
    if where == list(range(len(where))):
        text = re.sub(r"\bjoint\((\w+)\)", r"\1", text)
    else:
        chosen = "".join(f"{k} if w == {j} else " for j, k in enumerate(where))
        text = f"@inline\ndef joint(w):\n    return {chosen}0\n\n\n{text}"
    numbers = places(p) | {"NF": len(p.free), "ND": len(where), "NX": len(_states(p))}
    text = re.sub(r"\b[A-Z]{2,}\b", lambda m: str(numbers.get(m[0], m[0])), text)
    # fewer additions for Numba to type
    return re.sub(r"(?<=\[)(\d+) \+ (\d+)(?= \+|\])", lambda m: str(int(m[1]) + int(m[2])), text)


def _known(p: Layout, state: str) -> dict[str, str]:
    """Where the search keeps what the equations call by name."""
    nf, f, modes = len(p.free), p.flavour, places(p)["MODES"]
    known = {f"_q{i}": f"S[{state} + {k}]" for k, i in enumerate(p.free)}
    known |= {f"_v{i}": f"S[{state} + {nf + k}]" for k, i in enumerate(p.free)}
    known |= {f"_y{i}": f"S[{state} + {2 * nf + k}]" for k, i in enumerate(f.dahl)}
    known |= {f"_s{i}": f"S[{modes + k}]" for k, i in enumerate(f.dry)}
    return known | {name: f"W[{p.rows[name]} * L]" for name in p.constants}


def _input(p: Layout, j: int, z: str, c: str = "u") -> str:
    """Input `j`, or what its drive does, at the fraction `z` of the substep, along which it runs straight."""
    if not p.flavour.dynamic:
        return f"W[{p.rows[f'um{j}']} * L]"
    first, last = (f"W[{p.rows[f'{c}{w}{j}']} * L]" for w in "ab")
    return f"{first} + ({last} - {first}) * {z}"


def _motion(p: Layout, c: str, i: int, z: str) -> str:
    """Held motion at the fraction `z`: a parabola through start, middle and end of the substep."""
    first, middle, last = (f"W[{p.rows[f'h{c}{i}{w}']} * L]" for w in "amb")
    return f"parabola({first}, {middle}, {last}, {z})"


def leap(p: Layout) -> str:
    """Text of ``leap``: a Runge-Kutta step over part of the substep, from the state to the next."""
    known, f = _known(p, "STATE"), p.flavour
    known["_h"] = "d"
    for when, z in (("a", "za"), ("m", "zm"), ("b", "zb")):
        known |= {f"_{c}{when}{j}": _input(p, j, z, c) for c in ("u", *nodes(f)) for j in range(p.nu)}
        known |= {f"_h{c}{i}{when}": _motion(p, c, i, z) for i in f.held for c in "qva"}
    call = ", ".join(known[a] for a in step_arguments(p))
    result = ", ".join(f"S[NEXT + {k}]" for k in range(2 * len(p.free) + len(f.dahl)))
    return (
        "@inline\ndef parabola(first, middle, last, z):\n"
        "    return first + z * (4.0 * middle - 3.0 * first - last + z * 2.0 * (first + last - 2.0 * middle))\n\n\n"
        "@scalar\ndef leap(W, S, L, t, d, h):\n"
        '    """Step `d` from the state at time `t` within the substep `h`."""\n'
        "    za, zm, zb = t / h, (t + 0.5 * d) / h, (t + d) / h\n"
        f"    {result}, flag = step({call})\n"
    )


def terms_at(p: Layout) -> str:
    """Text of ``terms_at``: mass matrix and forces of a state within the substep."""
    known, f = _known(p, "state"), p.flavour
    for i, (q, v) in enumerate(zip(p.derived.coordinates, p.velocities, strict=True)):
        known[q], known[v] = (
            (_motion(p, "q", i, "z"), _motion(p, "v", i, "z")) if i in f.held else (known[f"_q{i}"], known[f"_v{i}"])
        )
    known |= {u: _input(p, j, "z") for j, u in enumerate(p.derived.inputs)}
    known |= {f"_{c}{j}": _input(p, j, "z", c) for c in nodes(f) for j in range(p.nu)}
    known |= {f"_ah{i}": _motion(p, "a", i, "z") for i in f.held}
    call = ", ".join(known[a] for a in arguments(p))
    return (
        "@scalar\ndef terms_at(W, S, L, state, t, h):\n"
        '    """Mass matrix and forces of a state at time `t` within the substep `h`."""\n'
        f"    z = t / h\n    terms({call}, S)\n"
    )
