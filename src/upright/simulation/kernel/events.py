"""Text of the search for the moment at which a dry joint sticks, breaks away or turns.

It is the path of the few lanes in which a dry joint changed mode within a substep. Modes are +1, -1 (sliding, the sign
of the velocity) and 0 (stuck). The moment is found inside the substep; there the velocity is set to exactly zero,
statics decide on the new modes, and the rest of the substep follows. Every joint at rest holds if it can; else modes
and accelerations follow from the one solution of ``min 1/2 a'Ma - f'a + sum F_i |a_i|``, Gauss' principle with dry
friction (Moreau 1988, Unilateral contact).

The text sees two pointers: ``W``, the numbers of one lane, `L` apart, and ``S``, a few places to write on, whose names
are in capitals (`places`).
"""

from __future__ import annotations

import re
from collections.abc import Sequence

from upright.physics.combination import spelled
from upright.simulation.kernel.drive import nodes
from upright.simulation.kernel.equations import arguments, step_arguments
from upright.simulation.kernel.flavour import Array, Layout
from upright.simulation.kernel.texts import kernel_text


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
    """Names of the lane's numbers that make its state."""
    return [f"q{i}" for i in p.free] + [f"v{i}" for i in p.free] + [f"y{i}" for i in p.flavour.dahl]


def _mixed(p: Layout, matrix: Array, states: Sequence[str]) -> list[str]:
    """A state whose coordinates and speeds are turned by a matrix, as text."""
    nf = len(p.free)
    turned = [spelled(row, part) for part in (states[:nf], states[nf : 2 * nf]) for row in matrix]
    return [*turned, *states[2 * nf :]]


def fetch(p: Layout) -> str:
    """Lines that copy the lane's state before and after the substep, its modes and levels."""
    rows, lines = p.rows, []
    for place, when in (("STATE", "o"), ("NEXT", "")):
        state = _mixed(p, p.to_joints, [f"W[{rows[when + name]} * L]" for name in _states(p)])
        lines += [f"S[{place} + {k}] = {text}" for k, text in enumerate(state)]
    for k, i in enumerate(p.flavour.dry):
        slide = f"_Fs{i}" if i in p.flavour.stribeck else f"_Fc{i}"
        for name, row in (("MODES", f"s{i}"), ("HOLD", f"_Fs{i}"), ("SLIDE", slide)):
            lines.append(f"S[{name} + {k}] = W[{rows[row]} * L]")
    return "".join(f"    {line}\n" for line in lines)


def store(p: Layout) -> str:
    """Lines that give the lane its new state and modes."""
    state = _mixed(p, p.from_joints, [f"S[STATE + {k}]" for k in range(len(_states(p)))])
    lines = [f"W[{p.rows[name]} * L] = {text}" for name, text in zip(_states(p), state, strict=True)]
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
    # fewer additions to write and to fold
    return re.sub(r"(?<=\[)(\d+) \+ (\d+)(?= \+|\])", lambda m: str(int(m[1]) + int(m[2])), text)


def _known(p: Layout, state: str) -> dict[str, str]:
    """Where the search keeps what the equations call by name."""
    f, modes = p.flavour, places(p)["MODES"]
    names = [*(f"_{c}{i}" for c in "qv" for i in p.free), *(f"_y{i}" for i in f.dahl)]
    states = _mixed(p, p.from_joints, [f"S[{state} + {k}]" for k in range(len(names))])
    known = dict(zip(names, states, strict=True))
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
    new = [f"n{k}" for k in range(len(_states(p)))]
    turned = _mixed(p, p.to_joints, new) if p.slanted else []
    written = ", ".join(new if p.slanted else (f"S[NEXT + {k}]" for k in range(len(new))))
    return (
        "@inline\ndef parabola(first, middle, last, z):\n"
        "    return first + z * (4.0 * middle - 3.0 * first - last + z * 2.0 * (first + last - 2.0 * middle))\n\n\n"
        "@scalar\ndef leap(W, S, L, t, d, h):\n"
        '    """Step `d` from the state at time `t` within the substep `h`."""\n'
        "    za, zm, zb = t / h, (t + 0.5 * d) / h, (t + d) / h\n"
        f"    {written}, flag = step({call})\n" + "".join(f"    S[NEXT + {k}] = {t}\n" for k, t in enumerate(turned))
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


def statics(free: int, dry: int) -> str:
    """Text of ``load`` and ``decide`` for so many free coordinates and dry joints."""
    return "\n".join([
        kernel_text("solve_pair" if free == 2 else "solve"), kernel_text("load"),
        kernel_text("decide_alone" if dry == 1 else "decide"),
    ])  # fmt: skip


def events(p: Layout) -> str:
    """Text of the search of events for one plant."""
    search = kernel_text("events").replace("    FETCH\n", fetch(p)).replace("    STORE\n", store(p))
    return located(p, "\n\n".join([leap(p), terms_at(p), statics(len(p.free), len(p.flavour.dry)), search]))
