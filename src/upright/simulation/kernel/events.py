"""When exactly does a joint stick, break away or turn?

Text of the path for the few lanes in which a dry joint changed mode within a substep. Modes are +1, -1 (sliding, the
sign of the velocity) and 0 (stuck). The moment is found inside the substep; there the velocity is set to exactly zero,
statics decide on the new modes, and the rest of the substep follows.
Names in capitals are places, from `upright.simulation.kernel.reach`.
"""

from __future__ import annotations

from upright.simulation.kernel.flavour import Layout
from upright.simulation.kernel.reach import fetch, leap, located, store, terms_at
from upright.simulation.kernel.statics import statics

TURNED = '''
@inline_strict
def turned(S, state, w):
    """Speed of a sliding joint in its direction."""
    return S[MODES + w] * S[state + NF + joint(w)]
'''

HEAD = '''
{decorator}
def events(W, S, L, h):
    """Redo one substep of the lane at `W`, event by event, with `S` to write on.

    A small machine, so that each search is compiled in one place only; it starts with the whole substep's result.
    """
'''

SEARCH = """\
    FULL, MIDDLE, ROOT = 0, 1, 2
    # not literals: Numba would compile what they are passed to once for each
    here, there, none, fresh, known = int64(STATE), int64(NEXT), int64(-1), int64(1), int64(0)
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
                    forced = int64(w)
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


BY_ADDRESS = '@cfunc("void(CPointer(float64), CPointer(float64), int64, float64)", error_model="numpy", cache=True)'


def events(p: Layout) -> str:
    """Text of the search of events for one plant."""
    head = HEAD.format(decorator="@scalar" if p.plain else BY_ADDRESS)
    help_ = [leap(p), terms_at(p), statics(len(p.free), len(p.flavour.dry)), TURNED, head]
    return located(p, "\n\n".join(help_) + fetch(p) + SEARCH + store(p))
