"""Text of the bank of Kalman filters as machine code: one sample of every lane, in microseconds, and what it says.

Its sums go from left to right without contraction, so that a loop stops at the same sample on every machine.
"""

from __future__ import annotations

TEXT = """
@exact
def see(tick, y, u, C, A, B, gains, weights, sizes, moved, numbers,
        x, shown, told, likelihood, since, room, odds, says, best):
    plain, bound, kept, surprise, leading, safe, patience = (
        numbers[0], numbers[1], numbers[2], numbers[3], numbers[4], numbers[5], numbers[6])
    k = tick[0]
    at = min(k, gains.shape[0] - 1)
    filters, coordinates, states, earlier = C.shape[0], C.shape[1], C.shape[2], told.shape[0]
    now, then = k % (earlier + 1), max(k - earlier, 0) % (earlier + 1)
    for lane in range(y.shape[0]):
        total = 0.0
        for j in range(earlier):
            total += told[j, lane]
        evident = 1 if abs(total / earlier) > plain else 0
        for i in range(coordinates):
            shown[now, lane, i] = y[lane, i]
            if abs(y[lane, i] - shown[then, lane, i]) > moved[i]:
                evident = 1
        told[k % earlier, lane] = u[lane]
        for h in range(filters):
            for i in range(coordinates):
                expected = 0.0
                for j in range(states):
                    expected += C[h, i, j] * x[lane, h, j]
                room[i] = y[lane, i] - expected
            square = 0.0
            for i in range(coordinates):
                for j in range(coordinates):
                    square += room[i] * weights[at, h, i, j] * room[j]
            if k > 1:  # the first two readings are the start, of which nothing is known
                likelihood[lane, h] = kept * likelihood[lane, h]
                if evident == 1:
                    likelihood[lane, h] -= 0.5 * (min(square, surprise) + sizes[at, h])
            for j in range(states):
                corrected = x[lane, h, j]
                for i in range(coordinates):
                    corrected += gains[at, h, j, i] * room[i]
                room[coordinates + j] = corrected
            for i in range(states):
                following = u[lane] * B[i]
                for j in range(states):
                    following += A[i, j] * room[coordinates + j]
                x[lane, h, i] = following
        first, top, second = 1, likelihood[lane, 1], likelihood[lane, 0]
        for h in range(2, filters):
            if likelihood[lane, h] > top:
                second = max(second, top)
                first, top = h, likelihood[lane, h]
            else:
                second = max(second, likelihood[lane, h])
        odds[lane], best[lane] = top - likelihood[lane, 0], first
        if odds[lane] > bound:
            since[lane] = k if since[lane] < 0 else since[lane]
        else:
            since[lane] = -1
        wait = k - since[lane]
        says[lane] = 0
        if since[lane] >= 0:
            if top - second > leading or abs(x[lane, first, 2]) > safe or wait >= patience:
                says[lane] = 1
    tick[0] = k + 1
"""
"""``see`` takes the readings `y` and commands `u` of all lanes into the states of the filters and their likelihoods.

The numbers are: mean command that must move something, bound on the odds, share of evidence that is kept, most that a
sample counts, lead of the best suspicion at which it is named, deviation at which nobody waits, and the samples that
anybody does. `since` is the sample from which the odds were beyond their bound, -1 while they are not.
"""
