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


ELIMINATION = '''
@scalar
def solve(S, right):
    """Accelerations of the coordinates that move, from the forces at `right`; the others stay."""
    for i in range(NF):
        S[ACC + i] = S[right + i] * S[MOVES + i]
        for j in range(NF):
            S[WORK + NF * i + j] = S[MASS + NF * i + j] * S[MOVES + i] * S[MOVES + j]
        S[WORK + NF * i + i] += 1.0 - S[MOVES + i]
    for k in range(NF):
        for i in range(k + 1, NF):
            c = S[WORK + NF * i + k] / S[WORK + NF * k + k]
            for j in range(k, NF):
                S[WORK + NF * i + j] -= c * S[WORK + NF * k + j]
            S[ACC + i] -= c * S[ACC + k]
    for k in range(NF):
        i = NF - 1 - k
        for j in range(i + 1, NF):
            S[ACC + i] -= S[WORK + NF * i + j] * S[ACC + j]
        S[ACC + i] /= S[WORK + NF * i + i]
'''

PAIR = '''
@scalar
def solve(S, right):
    """Accelerations of the coordinates that move, from the forces at `right`; the others stay."""
    m0, m1 = S[MOVES], S[MOVES + 1]
    a, d = S[MASS] * m0 + (1.0 - m0), S[MASS + 3] * m1 + (1.0 - m1)
    b, f0, f1 = S[MASS + 1] * (m0 * m1), S[right] * m0, S[right + 1] * m1
    c = 1.0 / (a * d - b * b)
    S[ACC] = (d * f0 - b * f1) * c
    S[ACC + 1] = (a * f1 - b * f0) * c
'''

LOAD = '''
@inline_strict
def taken(S, j, right):
    """Force that coordinate `j` takes up."""
    c = S[right + j]
    for k in range(NF):
        c -= S[MASS + NF * j + k] * S[ACC + k]
    return c


@scalar
def load(W, S, L, state, t, h, fresh):
    """Accelerations of a state with the modes as they are, and the margins of the stuck joints.

    Returns the first joint that cannot hold, -1 when all can. Mass and forces are computed when `fresh`.
    """
    if fresh > 0:
        terms_at(W, S, L, state, t, h)
        for k in range(NF):
            S[MOVES + k] = 1.0
    for w in range(ND):
        S[MOVES + joint(w)] = abs(S[MODES + w])
    solve(S, FORCE)
    first = -1
    for w in range(ND):
        if S[MODES + w] == 0.0:
            g = S[HOLD + w] - abs(taken(S, joint(w), FORCE))
            S[MARGIN + w] = g
            first = w if g < 0.0 and first < 0 else first
    return first
'''

ALONE = '''
@inline_strict
def decide(S, forced):
    """Mode of the only dry joint, after `load`: at rest it gives way when it must or has reached its level."""
    if S[MODES] == 0.0 and (forced == 0 or S[MARGIN] < 0.0):
        S[MODES] = 1.0 if taken(S, joint(0), FORCE) > 0.0 else -1.0
'''

TOGETHER = '''
@scalar
def decide(S, forced):
    """Modes of the joints at rest, after `load`; joint `forced`, if not -1, has reached its break-away level."""
    resting, again = 0, False
    pull = taken(S, joint(forced), FORCE) if forced >= 0 else 0.0
    for w in range(ND):
        S[REST + w] = 0.0
        if S[MODES + w] == 0.0:
            resting += 1
            S[REST + w] = 1.0
            S[LEVEL + w] = S[HOLD + w]
            if w == forced or S[MARGIN + w] < 0.0:
                S[REST + w] = 2.0
                S[LEVEL + w] = S[SLIDE + w]
                again = True
    if resting == 1 and again:
        for w in range(ND):
            if S[REST + w] > 0.0:
                S[MODES + w] = 1.0 if taken(S, joint(w), FORCE) > 0.0 else -1.0
        return
    for k in range(NF):
        S[KEEP + k] = 0.0
    # signs of the accelerations: guessed by coordinate descent, verified by solving exactly
    for turn in range(400):
        if not again:
            break
        for sweep in range(8 * NF):
            j = sweep % NF
            c = S[FORCE + j] + S[MASS + NF * j + j] * S[KEEP + j]
            for k in range(NF):
                c -= S[MASS + NF * j + k] * S[KEEP + k]
            for w in range(ND):
                if joint(w) == j and S[REST + w] > 0.0:
                    level = S[LEVEL + w]
                    c = c - level if c > level else (c + level if c < -level else 0.0)
            S[KEEP + j] = c / S[MASS + NF * j + j]
        for j in range(NF):
            S[RIGHT + j] = S[FORCE + j]
        for w in range(ND):
            if S[REST + w] > 0.0:
                j = joint(w)
                c = S[KEEP + j]
                S[MODES + w] = 1.0 if c > 0.0 else (-1.0 if c < 0.0 else 0.0)
                S[MOVES + j] = abs(S[MODES + w])
                S[RIGHT + j] -= S[MODES + w] * S[LEVEL + w]
        solve(S, RIGHT)
        again = False
        for w in range(ND):
            if S[REST + w] > 0.0:
                c = abs(taken(S, joint(w), RIGHT)) - S[LEVEL + w] * (1.0 + 1e-12)
                again = again or S[MODES + w] * S[ACC + joint(w)] < 0.0
                again = again or (S[MODES + w] == 0.0 and c > 0.0)
        for w in range(ND):
            if not again and S[REST + w] == 1.0 and S[MODES + w] != 0.0:
                # dragged along by another joint: it slides at its own lower level
                S[REST + w] = 2.0
                S[LEVEL + w] = S[SLIDE + w]
                again = True
    if forced >= 0 and S[MODES + forced] == 0.0:
        S[MODES + forced] = 1.0 if pull > 0.0 else -1.0
'''


def statics(free: int, dry: int) -> str:
    """Text of ``load`` and ``decide`` for so many free coordinates and dry joints."""
    return "\n".join([PAIR if free == 2 else ELIMINATION, LOAD, ALONE if dry == 1 else TOGETHER])


TURNED = '''
@inline_strict
def turned(S, state, w):
    """Speed of a sliding joint in its direction."""
    return S[MODES + w] * S[state + NF + joint(w)]
'''

HEAD = '''
@separate
def events(W, S, L, h):
    """Redo one substep of the lane at `W`, event by event, with `S` to write on.

    A small machine, so that each search is compiled in one place only; it starts with the whole substep's result.
    """
'''

SEARCH = """\
    FULL, MIDDLE, ROOT = 0, 1, 2
    here, there, none, fresh, known = STATE, NEXT, -1, 1, 0
    phase, w, count, events, turns, side = FULL, -1, 0, 0, 0, 0
    t, c, lo, hi, ga, gb, scale = 0.0, h, 0.0, 0.0, 0.0, 0.0, 0.0
    done, begin = True, True
    for _ in range(1000):
        if begin:
            # modes at the start of what is left
            first = load(W, S, L, here, t, h, fresh)
            if first >= 0 and turns < 2 * ND + 2:
                decide(S, none)
                turns, done = turns + 1, False
                continue
            for k in range(ND):
                S[BEFORE + k] = S[MARGIN + k]
                if S[MODES + k] != 0.0:
                    S[BEFORE + k] = turned(S, STATE, k)
            for k in range(NF):
                S[FIRST + k] = S[ACC + k]
            begin, phase, c, turns = False, FULL, h - t, 0
            if c <= 0.0:
                break
        if not done:
            leap(W, S, L, t, c, h)
        done = False
        first, stuck = -1, False
        for k in range(ND):
            stuck = stuck or S[MODES + k] == 0.0
            if S[MODES + k] != 0.0:
                S[MARGIN + k] = turned(S, NEXT, k)
                first = k if S[MARGIN + k] < 0.0 and first < 0 else first
        if stuck:
            other = load(W, S, L, there, t + c, h, fresh)
            first = other if first < 0 else first
        if phase != ROOT:
            if first < 0 or events > 40:
                if phase == MIDDLE:
                    for k in range(NX):
                        S[STATE + k] = S[WHOLE + k]
                    break
                if events > 0:
                    for k in range(NX):
                        S[STATE + k] = S[NEXT + k]
                    break
                # nothing at the end: has a joint turned twice in between?
                for k in range(NX):
                    S[WHOLE + k] = S[NEXT + k]
                phase, c = MIDDLE, 0.5 * c
                continue
            phase, w = ROOT, first
            lo, hi, ga, gb, count, side = 0.0, c, S[BEFORE + w], S[MARGIN + w], 0, 0
            scale = 1e-6 * (ga - gb) if S[MODES + w] != 0.0 else 1e-14 * (ga - gb)
        else:
            g = S[MARGIN + w]
            if count > 100 or (ga > 0.0 and (abs(g) <= scale or hi - lo <= 4e-16 * h)):
                other = -1
                for k in range(ND):
                    if k != w and S[MARGIN + k] < 0.0 and S[BEFORE + k] > 0.0:
                        other = k
                if other >= 0 and count <= 100:
                    w = other
                    lo, hi, ga, gb, count, side = 0.0, c, S[BEFORE + w], S[MARGIN + w], 0, 0
                    scale = 1e-6 * (ga - gb) if S[MODES + w] != 0.0 else 1e-14 * (ga - gb)
                else:
                    # the moment is found: stop the joint, or let it break away
                    forced = w
                    if not stuck:
                        load(W, S, L, there, t + c, h, fresh)
                    if S[MODES + w] != 0.0:
                        # the last millionth of the way by Taylor's series
                        forced = none
                        k = joint(w)
                        d = -S[NEXT + NF + k] / S[ACC + k]
                        if abs(d) < 2e-6 * h:
                            for k in range(NF):
                                S[NEXT + k] += d * (S[NEXT + NF + k] + 0.5 * d * S[ACC + k])
                                S[NEXT + NF + k] += d * S[ACC + k]
                            c += d
                        S[NEXT + NF + joint(w)] = 0.0
                    t += c
                    for k in range(NX):
                        S[STATE + k] = S[NEXT + k]
                    for k in range(ND):
                        if S[STATE + NF + joint(k)] == 0.0:
                            S[FORCE + joint(k)] += S[MODES + k] * S[SLIDE + k]
                            S[MODES + k] = 0.0
                    load(W, S, L, here, t, h, known)
                    decide(S, forced)
                    begin, events = True, events + 1
                    continue
            elif g > 0.0:
                # Illinois: halve the weight of an end that stays
                lo, ga = c, g
                gb = 0.5 * gb if side == 1 else gb
                side = 1
            else:
                hi, gb = c, g
                ga = 0.5 * ga if side == -1 else ga
                side = -1
        count += 1
        if ga > 0.0:
            c = lo + (hi - lo) * ga / (ga - gb)
            if count == 1 and S[MODES + w] != 0.0:
                # parabola through speed and acceleration at the start and speed at the end
                slope = S[MODES + w] * S[FIRST + joint(w)]
                curve = (gb - ga - slope * hi) / (hi * hi)
                root = slope * slope - 4.0 * curve * ga
                if root >= 0.0:
                    d = -2.0 * ga / (slope - sqrt(root))
                    c = d if d > 0.0 and d < hi else c
            if count % 16 == 15 or not (c > lo and c < hi):
                c = 0.5 * (lo + hi)
        elif count < 40:
            # the mode begins on its border: find a later time at which it still stands
            c = 0.5 * hi
            side = 0
        else:
            # it cannot stand at all
            S[STATE + NF + joint(w)] = 0.0
            S[MODES + w] = 0.0
            begin, events, turns = True, events + 1, 2 * ND + 2
    for w in range(ND):
        # what is left after too many events rests
        if turned(S, STATE, w) < 0.0:
            S[STATE + NF + joint(w)] = 0.0
            S[MODES + w] = 0.0
"""


def events(p: Layout) -> str:
    """Text of the search of events for one plant."""
    help_ = [leap(p), terms_at(p), statics(len(p.free), len(p.flavour.dry)), TURNED, HEAD]
    return located(p, "\n\n".join(help_) + fetch(p) + SEARCH + store(p))
