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
def copy(a, b):
    for k in range(a.shape[0]):
        b[k] = a[k]


@scalar
def solve(F, moves, B):
    """Accelerations of the coordinates that move; the others stay."""
    M, A, a = B[0], B[1], B[3]
    n = F.shape[0]
    for i in range(n):
        a[i] = F[i] * moves[i]
        for j in range(n):
            A[i, j] = M[i, j] * moves[i] * moves[j]
        A[i, i] += 1.0 - moves[i]
    for k in range(n):
        for i in range(k + 1, n):
            c = A[i, k] / A[k, k]
            for j in range(k, n):
                A[i, j] -= c * A[k, j]
            a[i] -= c * a[k]
    for k in range(n):
        i = n - 1 - k
        for j in range(i + 1, n):
            a[i] -= A[i, j] * a[j]
        a[i] /= A[i, i]


@scalar
def margins(x, s, at, t, B, moves, g, need):
    """How far each dry joint is from leaving its mode: speed in its direction, or force to spare when stuck.

    Returns the first joint that has left it, -1 when none has.
    """
    M, F, a, dry, hold = B[0], B[2], B[3], B[4], B[5]
    n = F.shape[0]
    for w in range(s.shape[0]):
        g[w] = s[w] * x[n + dry[w]]
        need = need or s[w] == 0.0
    if need:
        terms_at(x, s, at, t, M, F)
        for k in range(n):
            moves[k] = 1.0
        for w in range(s.shape[0]):
            moves[dry[w]] = abs(s[w])
        solve(F, moves, B)
    first = -1
    for w in range(s.shape[0]):
        if s[w] == 0.0:
            c = F[dry[w]]
            for k in range(n):
                c -= M[dry[w], k] * a[k]
            g[w] = hold[w] - abs(c)
        if g[w] < 0.0 and first < 0:
            first = w
    return first


@scalar
def decide(s, g, B, moves, forced):
    """Modes of the joints at rest (s = 0, margins `g`); joint `forced`, if not -1, has reached its break-away level."""
    M, F, a, dry, hold, slide = B[0], B[2], B[3], B[4], B[5], B[6]
    n, nd = F.shape[0], s.shape[0]
    rest, level, f, keep = zeros(nd), zeros(nd), zeros(n), zeros(n)
    again = False
    pull = 0.0
    for w in range(nd):
        rest[w] = 1.0 if s[w] == 0.0 else 0.0
        level[w] = hold[w]
        if s[w] == 0.0 and (w == forced or g[w] < 0.0):
            level[w] = slide[w]
            rest[w] = 2.0
            again = True
    if forced >= 0:
        pull = F[dry[forced]]
        for k in range(n):
            pull -= M[dry[forced], k] * a[k]
    # signs of the accelerations: guessed by coordinate descent, verified by solving exactly
    for turn in range(400):
        if not again:
            break
        for sweep in range(8 * n):
            j = sweep % n
            c = F[j] + M[j, j] * keep[j]
            for k in range(n):
                c -= M[j, k] * keep[k]
            for w in range(nd):
                if dry[w] == j and rest[w] > 0.0:
                    c = c - level[w] if c > level[w] else (c + level[w] if c < -level[w] else 0.0)
            keep[j] = c / M[j, j]
        for j in range(n):
            moves[j] = 1.0
            f[j] = F[j]
        for w in range(nd):
            if rest[w] > 0.0:
                j = dry[w]
                s[w] = 1.0 if keep[j] > 0.0 else (-1.0 if keep[j] < 0.0 else 0.0)
                moves[j] = abs(s[w])
                f[j] = F[j] - s[w] * level[w]
        solve(f, moves, B)
        again = False
        for w in range(nd):
            if rest[w] > 0.0:
                j = dry[w]
                c = f[j]
                for k in range(n):
                    c -= M[j, k] * a[k]
                again = again or s[w] * a[j] < 0.0 or (s[w] == 0.0 and abs(c) > level[w] * (1.0 + 1e-12))
        for w in range(nd):
            if not again and rest[w] == 1.0 and s[w] != 0.0:
                # dragged along by another joint: it slides at its own lower level
                rest[w] = 2.0
                level[w] = slide[w]
                again = True
    if forced >= 0 and s[forced] == 0.0:
        s[forced] = 1.0 if pull > 0.0 else -1.0


@scalar
def redo(x, x1, s, at, B, moves):
    """Step over one substep, event by event: a small machine, so that each search is compiled in one place only."""
    h, n, nd, dry = at[3], B[2].shape[0], s.shape[0], B[4]
    g0, g, x2 = zeros(nd), zeros(nd), zeros(x.shape[0])
    BASE, FULL, MIDDLE, ROOT, DECIDE = 0, 1, 2, 3, 4
    phase, w, forced, count, events, turns, side = 0, -1, -1, 0, 0, 0, 0
    t, c, lo, hi, ga, gb, scale = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    for _ in range(1000):
        if phase == BASE or phase == DECIDE:
            copy(x, x1)
        else:
            leap(x, x1, s, at, t, c)
        first = margins(x1, s, at, t + c, B, moves, g, phase == DECIDE)
        if phase == DECIDE:
            decide(s, g, B, moves, forced)
            phase, forced, turns = BASE, -1, turns + 1
            continue
        if phase == BASE:
            if first >= 0 and s[first] == 0.0 and turns < 2 * nd + 2:
                for k in range(nd):
                    s[k] = 0.0 if x[n + dry[k]] == 0.0 else s[k]
                phase = DECIDE
                continue
            copy(g, g0)
            phase, c, turns = FULL, h - t, 0
            if c <= 0.0:
                break
            continue
        if phase == FULL or phase == MIDDLE:
            if first < 0 or events > 40:
                if phase == MIDDLE:
                    copy(x2, x)
                    break
                copy(x1, x2)
                if events > 0:
                    copy(x1, x)
                    break
                # nothing at the end: has a joint turned twice in between?
                phase, c = MIDDLE, 0.5 * c
                continue
            phase, w = ROOT, first
            lo, hi, ga, gb, count, side, scale = 0.0, c, g0[w], g[w], 0, 0, 0.0
        elif count > 100 or (ga > 0.0 and (abs(g[w]) <= scale or hi - lo <= 4e-16 * h)):
            other = -1
            for k in range(nd):
                if k != w and g[k] < 0.0 and g0[k] > 0.0:
                    other = k
            if other >= 0 and count <= 100:
                w = other
                lo, hi, ga, gb, count, side, scale = 0.0, c, g0[w], g[w], 0, 0, 0.0
            else:
                # the moment is found: stop the joint, or let it break away
                t += c
                copy(x1, x)
                if s[w] != 0.0:
                    x[n + dry[w]] = 0.0
                else:
                    forced = w
                for k in range(nd):
                    s[k] = 0.0 if x[n + dry[k]] == 0.0 else s[k]
                phase, c, events = DECIDE, 0.0, events + 1
                continue
        elif g[w] > 0.0:
            # Illinois: halve the weight of an end that stays
            lo, ga = c, g[w]
            gb = 0.5 * gb if side == 1 else gb
            side = 1
        else:
            hi, gb = c, g[w]
            ga = 0.5 * ga if side == -1 else ga
            side = -1
        count += 1
        if ga > 0.0:
            scale = 1e-13 * (ga - gb) if scale == 0.0 else scale
            c = lo + (hi - lo) * ga / (ga - gb)
            if count % 16 == 15 or not (c > lo and c < hi):
                c = 0.5 * (lo + hi)
        elif count < 40:
            # the mode begins on its border: find a later time at which it still stands
            c = 0.5 * hi
            side = 0
        else:
            # it cannot stand at all
            x[n + dry[w]] = 0.0
            s[w] = 0.0
            phase, c, events, turns = BASE, 0.0, events + 1, 2 * nd + 2
    for w in range(nd):
        # what is left after too many events rests
        if s[w] * x[n + dry[w]] < 0.0:
            x[n + dry[w]] = 0.0
            s[w] = 0.0
'''


def events(p: Layout) -> str:
    """Text of the search of events for one plant, and of the call to it."""
    f, place = p.flavour, {c: k for k, c in enumerate(p.free)}
    states = [f"q{i}" for i in p.free] + [f"v{i}" for i in p.free] + [f"y{i}" for i in f.dahl]
    nf, nd, nx = len(p.free), len(f.dry), len(states)

    def w(name: str) -> str:
        return f"W[{p.rows[name]} * L + i]"

    lines = [
        f"W = carray(data, ({len(p.rows)} * L,))",
        f"x, x1, s, hold, slide = empty({nx}), empty({nx}), empty({nd}), empty({nd}), empty({nd})",
        f"dry, moves = empty({nd}, int64), empty({nf})",
        f"B = (zeros(({nf}, {nf})), zeros(({nf}, {nf})), zeros({nf}), zeros({nf}), dry, hold, slide)",
        *(f"x[{k}] = {w('o' + name)}" for k, name in enumerate(states)),
    ]
    for k, i in enumerate(f.dry):
        lines += [f"s[{k}] = {w(f's{i}')}", f"dry[{k}] = {place[i]}", f"hold[{k}] = {w(f'_Fs{i}')}"]
        lines.append(f"slide[{k}] = {w(f'_Fs{i}' if i in f.stribeck else f'_Fc{i}')}")
    lines.append("redo(x, x1, s, (W, L, i, h), B, moves)")
    lines += [f"{w(name)} = x[{k}]" for k, name in enumerate(states)]
    lines += [f"{w(f's{i}')} = s[{k}]" for k, i in enumerate(f.dry)]
    body = "\n".join(f"    {line}" for line in lines)
    head = '@cfunc("void(CPointer(float64), int64, int64, float64)", error_model="numpy", cache=True)\n'
    return (
        f"{_leap(p)}\n\n{_terms_at(p)}\n{SEARCH}\n\n"
        f'{head}def events(data, L, i, h):\n    """Redo one substep of lane `i`."""\n{body}\n'
    )


def _state(p: Layout) -> dict[str, str]:
    """Where the search keeps what the equations call by name."""
    nf, f = len(p.free), p.flavour
    known = {f"_q{i}": f"x[{k}]" for k, i in enumerate(p.free)}
    known |= {f"_v{i}": f"x[{nf + k}]" for k, i in enumerate(p.free)}
    known |= {f"_y{i}": f"x[{2 * nf + k}]" for k, i in enumerate(f.dahl)}
    known |= {f"_s{i}": f"s[{k}]" for k, i in enumerate(f.dry)}
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
    known, f = _state(p), p.flavour
    known["_h"] = "d"
    for when, z in (("a", "za"), ("m", "zm"), ("b", "zb")):
        known |= {f"_u{when}{j}": _input(p, j, z) for j in range(p.nu)}
        known |= {f"_h{c}{i}{when}": _motion(p, c, i, z) for i in f.held for c in "qva"}
    call = ", ".join(known[a] for a in step_arguments(p))
    states = range(2 * len(p.free) + len(f.dahl))
    result = ", ".join(f"x1[{k}]" for k in states)
    return (
        "@inline\ndef parabola(first, middle, last, z):\n"
        "    return first + z * (4.0 * middle - 3.0 * first - last + z * 2.0 * (first + last - 2.0 * middle))\n\n\n"
        "@scalar\ndef leap(x, x1, s, at, t, d):\n"
        '    """Step `d` from the state `x` at time `t` within the substep."""\n'
        "    W, L, i, h = at\n"
        "    za, zm, zb = t / h, (t + 0.5 * d) / h, (t + d) / h\n"
        f"    {result}, flag = step({call})\n"
    )


def _terms_at(p: Layout) -> str:
    known, f = _state(p), p.flavour
    values = {q: (_motion(p, "q", i, "z") if i in f.held else known[f"_q{i}"]) for i, q in enumerate(p.derived.coordinates)}
    values |= {v: (_motion(p, "v", i, "z") if i in f.held else known[f"_v{i}"]) for i, v in enumerate(p.velocities)}
    values |= {u: _input(p, j, "z") for j, u in enumerate(p.derived.inputs)}
    values |= {f"_ah{i}": _motion(p, "a", i, "z") for i in f.held} | known
    call = ", ".join(values[a] for a in arguments(p))
    return (
        "@scalar\ndef terms_at(x, s, at, t, M, F):\n"
        '    """Mass matrix and forces of state `x` at time `t` within the substep."""\n'
        f"    W, L, i, h = at\n    z = t / h\n    terms({call}, M, F)\n"
    )
