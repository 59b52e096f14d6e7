"""Which joints at rest hold, and which give way?

Text for the few lanes in which a dry joint changes mode. Every joint at rest holds if it can; else modes and
accelerations follow from the one solution of ``min 1/2 a'Ma - f'a + sum F_i |a_i|``, Gauss' principle with dry friction
(Moreau 1988, Unilateral contact). Names in capitals are places, from `upright.simulation.kernel.reach`.
"""

from __future__ import annotations

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
    solve(S, int64(FORCE))
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
        solve(S, int64(RIGHT))
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
