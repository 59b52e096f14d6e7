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
def solve(M, F, A, b, a, moves):
    """Accelerations of the joints that move; the others stay."""
    for i in range(NF):
        b[i] = F[i] if moves[i] else 0.0
        for j in range(NF):
            A[i, j] = M[i, j] if moves[i] and moves[j] else 0.0
        if not moves[i]:
            A[i, i] = 1.0
    for k in range(NF):
        for i in range(k + 1, NF):
            c = A[i, k] / A[k, k]
            for j in range(k, NF):
                A[i, j] -= c * A[k, j]
            b[i] -= c * b[k]
    for i in range(NF - 1, -1, -1):
        c = b[i]
        for j in range(i + 1, NF):
            c -= A[i, j] * a[j]
        a[i] = c / A[i, i]


@scalar
def hold(i, M, F, a):
    """Force that coordinate `i` must take up."""
    c = F[i]
    for j in range(NF):
        c -= M[i, j] * a[j]
    return c


@scalar
def equilibrium(x, s, W, L, i, t, h, M, F, A, b, a, moves):
    """Mass matrix, forces and accelerations with the modes as they are."""
    terms_at(x, s, W, L, i, t, h, M, F)
    moves[:] = True
    for w in range(ND):
        if s[w] == 0.0:
            moves[DRY[w]] = False
    solve(M, F, A, b, a, moves)


@scalar
def violated(x, s, W, L, i, t, h, M, F, A, b, a, moves, but):
    """Index of a dry joint that contradicts its mode, -1 when none does."""
    stuck = False
    for w in range(ND):
        stuck = stuck or s[w] == 0.0
        if w != but and s[w] * x[NF + DRY[w]] < 0.0:
            return w
    if stuck:
        equilibrium(x, s, W, L, i, t, h, M, F, A, b, a, moves)
        for w in range(ND):
            if w != but and s[w] == 0.0 and abs(hold(DRY[w], M, F, a)) > W[BREAK[w] * L + i]:
                return w
    return -1


@scalar
def decide(x, s, W, L, i, t, h, M, F, A, b, a, moves, forced):
    """Modes of every dry joint at rest; joint `forced` (if not -1) has just reached its break-away level."""
    rest = zeros(ND, int64)
    loose = zeros(ND, int64)
    level = zeros(ND)
    for w in range(ND):
        if s[w] == 0.0 or x[NF + DRY[w]] == 0.0:
            rest[w] = 1
            s[w] = 0.0
    equilibrium(x, s, W, L, i, t, h, M, F, A, b, a, moves)
    pull = hold(DRY[forced], M, F, a) if forced >= 0 else 0.0
    some = False
    for w in range(ND):
        if rest[w] == 1 and (w == forced or abs(hold(DRY[w], M, F, a)) > W[BREAK[w] * L + i]):
            loose[w] = 1
            some = True
    if not some:
        return
    g = zeros(NF)
    for _ in range(ND + 1):
        for w in range(ND):
            level[w] = W[SLIDE[w] * L + i] if loose[w] == 1 else W[BREAK[w] * L + i]
        slide(M, F, A, b, a, moves, g, rest, level, s)
        more = False
        for w in range(ND):
            if rest[w] == 1 and s[w] != 0.0 and loose[w] == 0:
                loose[w] = 1
                more = True
        if not more:
            break
    if forced >= 0 and s[forced] == 0.0:
        s[forced] = 1.0 if pull > 0.0 else -1.0


@scalar
def slide(M, F, A, b, a, moves, g, rest, level, s):
    """Signs of the accelerations of the joints at rest: guess by coordinate descent, verify by solving exactly."""
    for j in range(NF):
        a[j] = 0.0
    for _ in range(50):
        for _ in range(8):
            for j in range(NF):
                c = F[j]
                for k in range(NF):
                    if k != j:
                        c -= M[j, k] * a[k]
                for w in range(ND):
                    if DRY[w] == j and rest[w] == 1:
                        c = c - level[w] if c > level[w] else (c + level[w] if c < -level[w] else 0.0)
                a[j] = c / M[j, j]
        for j in range(NF):
            moves[j] = True
            b[j] = F[j]
            g[j] = F[j]
        for w in range(ND):
            if rest[w] == 1:
                j = DRY[w]
                s[w] = 1.0 if a[j] > 0.0 else (-1.0 if a[j] < 0.0 else 0.0)
                moves[j] = s[w] != 0.0
                g[j] = F[j] - s[w] * level[w]
        keep = a.copy()
        solve(M, g, A, b, a, moves)
        good = True
        for w in range(ND):
            if rest[w] == 1:
                j = DRY[w]
                if s[w] * a[j] < 0.0 or (s[w] == 0.0 and abs(hold(j, M, g, a)) > level[w] * (1.0 + 1e-12)):
                    good = False
        if good:
            return
        a[:] = keep


@scalar
def margin(w, x, s, W, L, i, t, h, M, F, A, b, a, moves):
    """How far joint `w` is from leaving its mode: speed in its direction, or force to spare."""
    if s[w] != 0.0:
        return s[w] * x[NF + DRY[w]]
    equilibrium(x, s, W, L, i, t, h, M, F, A, b, a, moves)
    return W[BREAK[w] * L + i] - abs(hold(DRY[w], M, F, a))


@scalar
def moment(w, x, x1, s, W, L, i, t, hi, h, M, F, A, b, a, moves):
    """Time in [0, hi] at which joint `w` leaves its mode; 0 when it cannot stay in it at all."""
    lo = 0.0
    glo = margin(w, x, s, W, L, i, t, h, M, F, A, b, a, moves)
    leap(x, x1, s, W, L, i, t, hi, h)
    ghi = margin(w, x1, s, W, L, i, t + hi, h, M, F, A, b, a, moves)
    if not ghi < 0.0:
        return hi
    if glo <= 0.0:
        c = 0.5 * hi
        for _ in range(40):
            leap(x, x1, s, W, L, i, t, c, h)
            g = margin(w, x1, s, W, L, i, t + c, h, M, F, A, b, a, moves)
            if g > 0.0:
                lo, glo = c, g
                break
            hi, ghi = c, g
            c *= 0.5
        if glo <= 0.0:
            return 0.0
    scale = glo - ghi
    side = 0
    ga, gb = glo, ghi
    for k in range(60):
        c = lo + (hi - lo) * ga / (ga - gb)
        if k > 12 and k % 3 == 0:
            c = 0.5 * (lo + hi)
        if not (c > lo and c < hi):
            break
        leap(x, x1, s, W, L, i, t, c, h)
        g = margin(w, x1, s, W, L, i, t + c, h, M, F, A, b, a, moves)
        if abs(g) <= 1e-15 * scale:
            return c
        # Illinois: halve the weight of an end that stays
        if g > 0.0:
            lo, ga = c, g
            gb = 0.5 * gb if side == 1 else gb
            side = 1
        else:
            hi, gb = c, g
            ga = 0.5 * ga if side == -1 else ga
            side = -1
        if hi - lo <= 4e-16 * h:
            break
    return hi


@scalar
def events(W, L, i, h):
    """Redo one substep of one lane, event by event."""
    x, x1, s = empty(NX), empty(NX), empty(ND)
    M, F, A, b, a, moves = zeros((NF, NF)), zeros(NF), zeros((NF, NF)), zeros(NF), zeros(NF), zeros(NF, bool_)
    for k in range(NX):
        x[k] = W[OLD[k] * L + i]
    for w in range(ND):
        s[w] = W[MODE[w] * L + i]
    t = 0.0
    for _ in range(ND):
        w = violated(x, s, W, L, i, t, h, M, F, A, b, a, moves, -1)
        if w < 0:
            break
        decide(x, s, W, L, i, t, h, M, F, A, b, a, moves, -1)
    for _ in range(40):
        left = h - t
        leap(x, x1, s, W, L, i, t, left, h)
        w = violated(x1, s, W, L, i, h, h, M, F, A, b, a, moves, -1)
        c = left
        if w < 0:
            # a joint may have turned twice within the substep
            leap(x, x1, s, W, L, i, t, 0.5 * left, h)
            w = violated(x1, s, W, L, i, t + 0.5 * left, h, M, F, A, b, a, moves, -1)
            c = 0.5 * left
            if w < 0:
                break
        for _ in range(ND + 1):
            c = moment(w, x, x1, s, W, L, i, t, c, h, M, F, A, b, a, moves)
            leap(x, x1, s, W, L, i, t, c, h)
            other = violated(x1, s, W, L, i, t + c, h, M, F, A, b, a, moves, w)
            if other < 0 or c == 0.0:
                break
            w = other
        t = t + c
        if c > 0.0:
            x[:] = x1
        if s[w] == 0.0:
            decide(x, s, W, L, i, t, h, M, F, A, b, a, moves, w)
        else:
            x[NF + DRY[w]] = 0.0
            s[w] = 0.0
            if c > 0.0:
                decide(x, s, W, L, i, t, h, M, F, A, b, a, moves, -1)
        if t >= h:
            break
    if t < h:
        leap(x, x1, s, W, L, i, t, h - t, h)
        x[:] = x1
    for w in range(ND):
        # what is left after too many events rests
        if s[w] * x[NF + DRY[w]] < 0.0:
            x[NF + DRY[w]] = 0.0
            s[w] = 0.0
        W[MODE[w] * L + i] = s[w]
    for k in range(NX):
        W[NEW[k] * L + i] = x[k]
'''


def events(p: Layout) -> str:
    """Text of the search of events for one plant."""
    f, place = p.flavour, {c: k for k, c in enumerate(p.free)}
    states = [f"q{i}" for i in p.free] + [f"v{i}" for i in p.free] + [f"y{i}" for i in f.dahl]
    slide = [f"_Fs{i}" if i in f.stribeck else f"_Fc{i}" for i in f.dry]
    tables = {
        "DRY": [place[i] for i in f.dry],
        "OLD": [p.rows[f"o{s}"] for s in states],
        "NEW": [p.rows[s] for s in states],
        "MODE": [p.rows[f"s{i}"] for i in f.dry],
        "BREAK": [p.rows[f"_Fs{i}"] for i in f.dry],
        "SLIDE": [p.rows[name] for name in slide],
    }
    sizes = [f"NF, ND, NX = {len(p.free)}, {len(f.dry)}, {len(states)}"]
    lines = sizes + [f"{name} = ({', '.join(map(str, values))},)" for name, values in tables.items()]
    return "\n".join(lines) + "\n\n\n" + _leap(p) + "\n\n" + _terms_at(p) + "\n" + SEARCH


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
        "@scalar\ndef leap(x, x1, s, W, L, i, t, d, h):\n"
        '    """Step `d` from the state `x` at time `t` within the substep `h`."""\n'
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
        "@scalar\ndef terms_at(x, s, W, L, i, t, h, M, F):\n"
        '    """Mass matrix and forces of state `x` at time `t` within the substep `h`."""\n'
        f"    z = t / h\n    terms({call}, M, F)\n"
    )
