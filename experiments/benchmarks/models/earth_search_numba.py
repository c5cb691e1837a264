"""The closed loop of the Earth search over an even Earth without Sun and Moon once more, for numba: a peer and a check.

Nothing of `jaxsat` but numbers: scan, presence, automaton, observer, actuators and motion are written anew, one case
at a time, from Melnikov et al. 2022 and from what `jaxsat.control.earth_search.law` says of what they leave open.
"""

import math

import numpy as np
from numba import njit  # pyright: ignore[reportMissingImports]

SEARCH, APPROACH, TRACK = 0, 1, 2


@njit(cache=True)
def harmonics(outward, down, cone, theta, rho, level):
    """First and second harmonic of one scan over a disk; `outward`, `down`: the nadir along azimuth and axis."""
    centre = math.sin(cone) * outward + math.cos(cone) * down
    along = math.sin(cone) * down - math.cos(cone) * outward
    size = math.sqrt(centre * centre + along * along)
    if size <= math.cos(rho):
        return 0.0, 0.0
    half, middle = math.acos(math.cos(rho) / size), math.atan2(along, centre)
    begin = min(max((middle - half) / theta, -1.0), 1.0)
    end = min(max((middle + half) / theta, -1.0), 1.0)
    c1, c2 = math.sqrt(1.0 - begin * begin), math.sqrt(1.0 - end * end)
    return 2.0 / math.pi * level * (c1 - c2), 2.0 / math.pi * level * (end * c2 - begin * c1)


@njit(cache=True)
def one_case(q, w, up, along, orbital_rate, rho, level, law, sensor, craft, period, steps):
    """First and last capture [s], inf for none, and the mode at the end.

    `law`: search, approach and track rate, turn, gains of track and drift, first direction in x and y; `sensor`: cone,
    theta, threshold; `craft`: acceleration, lag.
    """
    search, approach, track, turn, gain, drift_gain = law[:6]
    cone, theta, threshold = sensor
    sweep = np.array([law[6], law[7]])
    direction, drift, angle = np.zeros(2), np.zeros(2), np.zeros(2)
    done, blind = np.zeros(2, np.bool_), np.zeros(2, np.bool_)
    seen, offset = np.zeros(4, np.bool_), np.zeros(4)
    command, after = np.zeros(2), np.zeros(3)
    mode, in_mode, first, last = SEARCH, 0.0, np.inf, np.inf
    co, so = math.cos(orbital_rate * period), math.sin(orbital_rate * period)
    lag = 1.0 - math.exp(-drift_gain * period)
    for step in range(steps):
        a, b, c, d = q
        nx = -(up[0] * (1 - 2 * (c * c + d * d)) + up[1] * 2 * (b * c + a * d) + up[2] * 2 * (b * d - a * c))
        ny = -(up[0] * 2 * (b * c - a * d) + up[1] * (1 - 2 * (b * b + d * d)) + up[2] * 2 * (c * d + a * b))
        nz = -(up[0] * 2 * (b * d + a * c) + up[1] * 2 * (c * d - a * b) + up[2] * (1 - 2 * (b * b + c * c)))
        for n in range(4):
            outward = (nx, ny, -nx, -ny)[n]
            one, two = harmonics(outward, nz, cone, theta, rho, level)
            seen[n] = abs(one) >= threshold
            offset[n] = -theta * (two / one if one != 0.0 else 0.0) - (cone - rho)
        some, every = seen.any(), seen.all()
        stale = done[0] and done[1]
        fresh = mode == APPROACH and not stale
        before = direction.copy()
        was_blind = blind.copy()
        for n in range(2):
            plus, minus = seen[n], seen[n + 2]
            way = before[n] if fresh else 0.0
            arrived = minus if way > 0.0 else (plus if way < 0.0 else plus and minus)
            done[n] = (done[n] and fresh) or arrived
            toward = 0.0 if plus and minus else (1.0 if plus else (-1.0 if minus else 0.0))
            blind[n] = was_blind[n] and fresh and not (plus or minus)
            if done[n]:
                way = 0.0
            elif (way == 0.0 or was_blind[n]) and (plus or minus):
                way = toward
            direction[n] = way
        for n in range(2):
            begins = direction[n] == 0.0 and not done[n] and done[1 - n]
            if begins:
                direction[n] = -1.0 if sweep[n] < 0.0 else 1.0
            blind[n] = begins or (blind[n] and not done[n])
        now = TRACK if every else APPROACH
        if not every and (mode == TRACK or (not some and (stale or mode != APPROACH))):
            now = SEARCH
        in_mode = in_mode + period if now == mode else 0.0
        if mode == SEARCH and in_mode * search > turn:
            x, y = sweep
            sweep[0], sweep[1], in_mode = -y, x, 0.0
        for n in range(2):
            measured = -0.5 * (offset[n] - offset[n + 2])
            moved = w[1] if n == 0 else -w[0]
            if mode == TRACK and every and drift_gain > 0.0:
                predicted = angle[n] + (drift[n] - moved) * period
                off = measured - predicted
                angle[n] = predicted + (1.0 - (1.0 - lag) ** 2) * off
                drift[n] += lag * lag / period * off
            else:
                angle[n], drift[n] = measured, 0.0
            if now == SEARCH:
                command[n] = search * sweep[n]
            elif now == APPROACH:
                command[n] = approach * direction[n]
            else:
                command[n] = min(max(gain * angle[n], -track), track) + drift[n]
        if now != APPROACH:
            direction[:], done[:], blind[:] = 0.0, False, False
        if now == TRACK and mode != TRACK:
            last = step * period
            first = min(first, last)
        mode = now
        limit, follows = craft[0] * period, 1.0 - math.exp(-period / craft[1])
        for n in range(3):
            wanted = (-command[1], command[0], 0.0)[n]
            after[n] = w[n] + min(max(follows * (wanted - w[n]), -limit), limit)
        half = 0.25 * period
        rx, ry, rz = half * (w[0] + after[0]), half * (w[1] + after[1]), half * (w[2] + after[2])
        size = math.sqrt(rx * rx + ry * ry + rz * rz)
        c0, s0 = math.cos(size), (math.sin(size) / size if size > 0.0 else 1.0)
        rx, ry, rz = rx * s0, ry * s0, rz * s0
        q[0], q[1] = a * c0 - b * rx - c * ry - d * rz, a * rx + b * c0 + c * rz - d * ry
        q[2], q[3] = a * ry - b * rz + c * c0 + d * rx, a * rz + b * ry - c * rx + d * c0
        w[:] = after
        for n in range(3):
            u, v = up[n], along[n]
            up[n], along[n] = co * u + so * v, co * v - so * u
    return first, last, float(mode)


@njit(cache=True)
def all_cases(q, w, up, along, orbital_rate, rho, level, law, sensor, craft, period, steps):
    """[cases 3] of `one_case`, one after the other."""
    found = np.zeros((len(q), 3))
    for k in range(len(q)):
        motion = q[k].copy(), w[k].copy(), up[k].copy(), along[k].copy()
        found[k] = one_case(*motion, orbital_rate[k], rho[k], level[k], law, sensor, craft, period, steps)
    return found
