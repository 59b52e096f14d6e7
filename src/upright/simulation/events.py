"""When exactly does a joint stick, break away or turn, and what does it do next?

Text of the path for the few lanes in which a dry joint changed mode within a substep. Modes are +1, -1 (sliding, the
sign of the velocity) and 0 (stuck). The moment is found inside the substep; there the velocity is set to exactly zero
and the new modes follow from statics (every joint at rest holds if it can) and else from the one solution of
``min 1/2 a'Ma - f'a + sum F_i |a_i|``, Gauss' principle with dry friction (Moreau 1988, Unilateral contact).
"""

from __future__ import annotations

from upright.simulation.equations import arguments, step_arguments
from upright.simulation.flavour import Layout

SEARCH = '''
@scalar
def solve(W, o, right):
    """Accelerations of the coordinates that move, from the forces at `right`; the others stay."""
    for i in range(NF):
        W[o + ACC + i] = W[o + right + i] * W[o + MOVES + i]
        for j in range(NF):
            W[o + WORK + NF * i + j] = W[o + MASS + NF * i + j] * W[o + MOVES + i] * W[o + MOVES + j]
        W[o + WORK + NF * i + i] += 1.0 - W[o + MOVES + i]
    for k in range(NF):
        for i in range(k + 1, NF):
            c = W[o + WORK + NF * i + k] / W[o + WORK + NF * k + k]
            for j in range(k, NF):
                W[o + WORK + NF * i + j] -= c * W[o + WORK + NF * k + j]
            W[o + ACC + i] -= c * W[o + ACC + k]
    for k in range(NF):
        i = NF - 1 - k
        for j in range(i + 1, NF):
            W[o + ACC + i] -= W[o + WORK + NF * i + j] * W[o + ACC + j]
        W[o + ACC + i] /= W[o + WORK + NF * i + i]


@inline_strict
def taken(W, o, j, right):
    """Force that coordinate `j` takes up."""
    c = W[o + right + j]
    for k in range(NF):
        c -= W[o + MASS + NF * j + k] * W[o + ACC + k]
    return c


@scalar
def load(W, L, i, o, state, t, h, fresh):
    """Accelerations of a state with the modes as they are, and the margins of the stuck joints.

    Returns the first joint that cannot hold, -1 when all can. Mass and forces are computed when `fresh`.
    """
    if fresh > 0:
        terms_at(W, L, i, o, state, t, h)
        for k in range(NF):
            W[o + MOVES + k] = 1.0
    for w in range(ND):
        W[o + MOVES + joint(w)] = abs(W[o + MODES + w])
    solve(W, o, int64(FORCE))
    first = -1
    for w in range(ND):
        if W[o + MODES + w] == 0.0:
            g = W[o + HOLD + w] - abs(taken(W, o, joint(w), FORCE))
            W[o + MARGIN + w] = g
            first = w if g < 0.0 and first < 0 else first
    return first


@inline_strict
def turned(W, o, state, w):
    """Speed of a sliding joint in its direction."""
    return W[o + MODES + w] * W[o + state + NF + joint(w)]


@scalar
def decide(W, o, forced):
    """Modes of the joints at rest, after `load`; joint `forced`, if not -1, has reached its break-away level."""
    resting, again = 0, False
    pull = taken(W, o, joint(forced), FORCE) if forced >= 0 else 0.0
    for w in range(ND):
        W[o + REST + w] = 0.0
        if W[o + MODES + w] == 0.0:
            resting += 1
            W[o + REST + w] = 1.0
            W[o + LEVEL + w] = W[o + HOLD + w]
            if w == forced or W[o + MARGIN + w] < 0.0:
                W[o + REST + w] = 2.0
                W[o + LEVEL + w] = W[o + SLIDE + w]
                again = True
    if resting == 1 and again:
        for w in range(ND):
            if W[o + REST + w] > 0.0:
                W[o + MODES + w] = 1.0 if taken(W, o, joint(w), FORCE) > 0.0 else -1.0
        return
    for k in range(NF):
        W[o + KEEP + k] = 0.0
    # signs of the accelerations: guessed by coordinate descent, verified by solving exactly
    for turn in range(400):
        if not again:
            break
        for sweep in range(8 * NF):
            j = sweep % NF
            c = W[o + FORCE + j] + W[o + MASS + NF * j + j] * W[o + KEEP + j]
            for k in range(NF):
                c -= W[o + MASS + NF * j + k] * W[o + KEEP + k]
            for w in range(ND):
                if joint(w) == j and W[o + REST + w] > 0.0:
                    level = W[o + LEVEL + w]
                    c = c - level if c > level else (c + level if c < -level else 0.0)
            W[o + KEEP + j] = c / W[o + MASS + NF * j + j]
        for j in range(NF):
            W[o + RIGHT + j] = W[o + FORCE + j]
        for w in range(ND):
            if W[o + REST + w] > 0.0:
                j = joint(w)
                c = W[o + KEEP + j]
                W[o + MODES + w] = 1.0 if c > 0.0 else (-1.0 if c < 0.0 else 0.0)
                W[o + MOVES + j] = abs(W[o + MODES + w])
                W[o + RIGHT + j] -= W[o + MODES + w] * W[o + LEVEL + w]
        solve(W, o, int64(RIGHT))
        again = False
        for w in range(ND):
            if W[o + REST + w] > 0.0:
                c = abs(taken(W, o, joint(w), RIGHT)) - W[o + LEVEL + w] * (1.0 + 1e-12)
                again = again or W[o + MODES + w] * W[o + ACC + joint(w)] < 0.0
                again = again or (W[o + MODES + w] == 0.0 and c > 0.0)
        for w in range(ND):
            if not again and W[o + REST + w] == 1.0 and W[o + MODES + w] != 0.0:
                # dragged along by another joint: it slides at its own lower level
                W[o + REST + w] = 2.0
                W[o + LEVEL + w] = W[o + SLIDE + w]
                again = True
    if forced >= 0 and W[o + MODES + forced] == 0.0:
        W[o + MODES + forced] = 1.0 if pull > 0.0 else -1.0


@scalar
def redo(W, L, i, o, h):
    """Step over one substep, event by event: a small machine, so that each search is compiled in one place only.

    It starts with the whole substep's result in NEXT, as the lanes computed it.
    """
    FULL, MIDDLE, ROOT = 0, 1, 2
    # not literals: Numba would compile what they are passed to once for each
    here, there, none, fresh, known = int64(STATE), int64(NEXT), int64(-1), int64(1), int64(0)
    phase, w, count, events, turns, side = FULL, -1, 0, 0, 0, 0
    t, c, lo, hi, ga, gb, scale = 0.0, h, 0.0, 0.0, 0.0, 0.0, 0.0
    done, begin = True, True
    for _ in range(1000):
        if begin:
            # modes at the start of what is left
            first = load(W, L, i, o, here, t, h, fresh)
            if first >= 0 and turns < 2 * ND + 2:
                decide(W, o, none)
                turns, done = turns + 1, False
                continue
            for k in range(ND):
                W[o + BEFORE + k] = W[o + MARGIN + k]
                if W[o + MODES + k] != 0.0:
                    W[o + BEFORE + k] = turned(W, o, STATE, k)
            for k in range(NF):
                W[o + FIRST + k] = W[o + ACC + k]
            begin, phase, c, turns = False, FULL, h - t, 0
            if c <= 0.0:
                break
        if not done:
            leap(W, L, i, o, t, c, h)
        done = False
        first, stuck = -1, False
        for k in range(ND):
            stuck = stuck or W[o + MODES + k] == 0.0
            if W[o + MODES + k] != 0.0:
                W[o + MARGIN + k] = turned(W, o, NEXT, k)
                first = k if W[o + MARGIN + k] < 0.0 and first < 0 else first
        if stuck:
            other = load(W, L, i, o, there, t + c, h, fresh)
            first = other if first < 0 else first
        if phase != ROOT:
            if first < 0 or events > 40:
                if phase == MIDDLE:
                    for k in range(NX):
                        W[o + STATE + k] = W[o + WHOLE + k]
                    break
                if events > 0:
                    for k in range(NX):
                        W[o + STATE + k] = W[o + NEXT + k]
                    break
                # nothing at the end: has a joint turned twice in between?
                for k in range(NX):
                    W[o + WHOLE + k] = W[o + NEXT + k]
                phase, c = MIDDLE, 0.5 * c
                continue
            phase, w = ROOT, first
            lo, hi, ga, gb, count, side = 0.0, c, W[o + BEFORE + w], W[o + MARGIN + w], 0, 0
            scale = 1e-6 * (ga - gb) if W[o + MODES + w] != 0.0 else 1e-14 * (ga - gb)
        else:
            g = W[o + MARGIN + w]
            if count > 100 or (ga > 0.0 and (abs(g) <= scale or hi - lo <= 4e-16 * h)):
                other = -1
                for k in range(ND):
                    if k != w and W[o + MARGIN + k] < 0.0 and W[o + BEFORE + k] > 0.0:
                        other = k
                if other >= 0 and count <= 100:
                    w = other
                    lo, hi, ga, gb, count, side = 0.0, c, W[o + BEFORE + w], W[o + MARGIN + w], 0, 0
                    scale = 1e-6 * (ga - gb) if W[o + MODES + w] != 0.0 else 1e-14 * (ga - gb)
                else:
                    # the moment is found: stop the joint, or let it break away
                    forced = int64(w)
                    if not stuck:
                        load(W, L, i, o, there, t + c, h, fresh)
                    if W[o + MODES + w] != 0.0:
                        # the last millionth of the way by Taylor's series
                        forced = none
                        k = joint(w)
                        d = -W[o + NEXT + NF + k] / W[o + ACC + k]
                        if abs(d) < 2e-6 * h:
                            for k in range(NF):
                                W[o + NEXT + k] += d * (W[o + NEXT + NF + k] + 0.5 * d * W[o + ACC + k])
                                W[o + NEXT + NF + k] += d * W[o + ACC + k]
                            c += d
                        W[o + NEXT + NF + joint(w)] = 0.0
                    t += c
                    for k in range(NX):
                        W[o + STATE + k] = W[o + NEXT + k]
                    for k in range(ND):
                        if W[o + STATE + NF + joint(k)] == 0.0:
                            W[o + FORCE + joint(k)] += W[o + MODES + k] * W[o + SLIDE + k]
                            W[o + MODES + k] = 0.0
                    load(W, L, i, o, here, t, h, known)
                    decide(W, o, forced)
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
            if count == 1 and W[o + MODES + w] != 0.0:
                # parabola through speed and acceleration at the start and speed at the end
                slope = W[o + MODES + w] * W[o + FIRST + joint(w)]
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
            W[o + STATE + NF + joint(w)] = 0.0
            W[o + MODES + w] = 0.0
            begin, events, turns = True, events + 1, 2 * ND + 2
    for w in range(ND):
        # what is left after too many events rests
        if turned(W, o, STATE, w) < 0.0:
            W[o + STATE + NF + joint(w)] = 0.0
            W[o + MODES + w] = 0.0
'''


def scratch(p: Layout) -> dict[str, int]:
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


def events(p: Layout) -> str:
    """Text of the search of events for one plant, and of the call to it."""
    f, place, rows = p.flavour, {c: k for k, c in enumerate(p.free)}, p.rows
    states = [f"q{i}" for i in p.free] + [f"v{i}" for i in p.free] + [f"y{i}" for i in f.dahl]
    at = scratch(p)
    lines = [f"o = {len(rows)} * L", f"W = carray(data, (o + {at['END']},))"]
    for k, name in enumerate(states):
        lines.append(f"W[o + {at['STATE'] + k}] = W[{rows['o' + name]} * L + i]")
        lines.append(f"W[o + {at['NEXT'] + k}] = W[{rows[name]} * L + i]")
    for k, i in enumerate(f.dry):
        slide = f"_Fs{i}" if i in f.stribeck else f"_Fc{i}"
        for name, row in (("MODES", f"s{i}"), ("HOLD", f"_Fs{i}"), ("SLIDE", slide)):
            lines.append(f"W[o + {at[name] + k}] = W[{rows[row]} * L + i]")
    lines.append("redo(W, L, i, o, h)")
    lines += [f"W[{rows[name]} * L + i] = W[o + {at['STATE'] + k}]" for k, name in enumerate(states)]
    lines += [f"W[{rows[f's{i}']} * L + i] = W[o + {at['MODES'] + k}]" for k, i in enumerate(f.dry)]
    body = "\n".join(f"    {line}" for line in lines)
    sizes = f"NF, ND, NX = {len(p.free)}, {len(f.dry)}, {len(states)}\n"
    sizes += "\n".join(f"{name} = {value}" for name, value in at.items())
    joint = " else ".join(f"{place[i]} if w == {k}" for k, i in enumerate(f.dry)) + " else 0"
    joint = "w" if [place[i] for i in f.dry] == list(range(len(f.dry))) else joint
    head = '@cfunc("void(CPointer(float64), int64, int64, float64)", error_model="numpy", cache=True)\n'
    return (
        f"{sizes}\n\n\n@inline\ndef joint(w):\n    return {joint}\n\n\n{_leap(p)}\n\n{_terms_at(p)}\n{SEARCH}\n\n"
        f'{head}def events(data, L, i, h):\n    """Redo one substep of lane `i`."""\n{body}\n'
    )


def _known(p: Layout, state: str) -> dict[str, str]:
    """Where the search keeps what the equations call by name."""
    nf, f, modes = len(p.free), p.flavour, scratch(p)["MODES"]
    known = {f"_q{i}": f"W[o + {state} + {k}]" for k, i in enumerate(p.free)}
    known |= {f"_v{i}": f"W[o + {state} + {nf + k}]" for k, i in enumerate(p.free)}
    known |= {f"_y{i}": f"W[o + {state} + {2 * nf + k}]" for k, i in enumerate(f.dahl)}
    known |= {f"_s{i}": f"W[o + {modes + k}]" for k, i in enumerate(f.dry)}
    return known | {name: f"W[{p.rows[name]} * L + i]" for name in p.constants}


def _input(p: Layout, j: int, z: str) -> str:
    """Input `j` at the fraction `z` of the substep, along which it runs straight."""
    if not p.flavour.dynamic:
        return f"W[{p.rows[f'um{j}']} * L + i]"
    first, last = (f"W[{p.rows[f'u{w}{j}']} * L + i]" for w in "ab")
    return f"{first} + ({last} - {first}) * {z}"


def _motion(p: Layout, c: str, i: int, z: str) -> str:
    """Held motion at the fraction `z`: a parabola through start, middle and end of the substep."""
    first, middle, last = (f"W[{p.rows[f'h{c}{i}{w}']} * L + i]" for w in "amb")
    return f"parabola({first}, {middle}, {last}, {z})"


def _leap(p: Layout) -> str:
    known, f = _known(p, "STATE"), p.flavour
    known["_h"] = "d"
    for when, z in (("a", "za"), ("m", "zm"), ("b", "zb")):
        known |= {f"_u{when}{j}": _input(p, j, z) for j in range(p.nu)}
        known |= {f"_h{c}{i}{when}": _motion(p, c, i, z) for i in f.held for c in "qva"}
    call = ", ".join(known[a] for a in step_arguments(p))
    result = ", ".join(f"W[o + NEXT + {k}]" for k in range(2 * len(p.free) + len(f.dahl)))
    return (
        "@inline\ndef parabola(first, middle, last, z):\n"
        "    return first + z * (4.0 * middle - 3.0 * first - last + z * 2.0 * (first + last - 2.0 * middle))\n\n\n"
        "@scalar\ndef leap(W, L, i, o, t, d, h):\n"
        '    """Step `d` from STATE at time `t` within the substep `h`, into NEXT."""\n'
        "    za, zm, zb = t / h, (t + 0.5 * d) / h, (t + d) / h\n"
        f"    {result}, flag = step({call})\n"
    )


def _terms_at(p: Layout) -> str:
    known, f = _known(p, "state"), p.flavour
    for i, (q, v) in enumerate(zip(p.derived.coordinates, p.velocities, strict=True)):
        known[q], known[v] = (
            (_motion(p, "q", i, "z"), _motion(p, "v", i, "z")) if i in f.held else (known[f"_q{i}"], known[f"_v{i}"])
        )
    known |= {u: _input(p, j, "z") for j, u in enumerate(p.derived.inputs)}
    known |= {f"_ah{i}": _motion(p, "a", i, "z") for i in f.held}
    call = ", ".join(known[a] for a in arguments(p))
    return (
        "@scalar\ndef terms_at(W, L, i, o, state, t, h):\n"
        '    """Mass matrix and forces of a state at time `t` within the substep `h`."""\n'
        f"    z = t / h\n    terms({call}, W, o + MASS)\n"
    )
