"""The closed loop of Sun pointing with the published estimator once more, for numba: a peer and a check.

Nothing of `jaxsat` but numbers: sensor, reconstruction, law, thrusters and rigid body are written anew from Zhukov 2019
and from what `jaxsat.control` documents of its law.
"""

import math

import numpy as np
from numba import njit  # pyright: ignore[reportMissingImports]

S, C = math.sin(math.radians(22.0)), math.cos(math.radians(22.0))
EDGE, HOOD = math.cos(math.radians(83.0)), math.cos(math.radians(74.0))
HOOD_DISTANCE = math.sin(math.radians(96.0)) / math.sin(math.radians(16.0))
A_, B_ = math.sqrt(2.0) * S / C, math.sqrt(2.0) * EDGE / C
TWO_LIMIT = (A_ * B_ + math.sqrt(A_**2 - B_**2 + 1.0)) / (A_**2 + 1.0)
DAMPING, SEARCH, SLEW, HOLD = 0, 1, 2, 3


@njit(cache=True)
def currents(x, y, z, out):
    """Of the four faces over the largest one."""
    share = 1.0
    if x < HOOD:
        share = HOOD_DISTANCE * x / (S * x + C * math.sqrt(1.0 - x * x))
    out[0], out[1], out[2], out[3] = x * S + z * C, x * S - z * C, x * S + y * C, x * S - y * C
    for n in range(4):
        out[n] = share * out[n] if x > 0.0 and out[n] > EDGE else 0.0


@njit(cache=True)
def possible(x, y, z):
    """The checks of a solution by two currents, mirrored into the first quadrant."""
    return 0.0 <= x < TWO_LIMIT and y > 0.0 and z > 0.0


@njit(cache=True)
def reconstruct(i, out):
    """Number of lit faces; the direction goes to `out`."""
    lit = 0
    for n in range(4):
        lit += i[n] > 0.0
    if lit == 0:
        out[0], out[1], out[2] = 1.0, 0.0, 0.0
        return 0
    sign_z, sign_y = (-1.0 if i[1] > i[0] else 1.0), (-1.0 if i[3] > i[2] else 1.0)
    p, p_far, q, q_far = max(i[0], i[1]), min(i[0], i[1]), max(i[2], i[3]), min(i[2], i[3])
    if lit >= 3:
        x = (p + p_far) / (2.0 * S) if p_far > q_far else (q + q_far) / (2.0 * S)
        y, z = (q - x * S) / C, (p - x * S) / C
    elif p > 0.0 and q > 0.0:
        root = 2.0 * p * q * S**2 + C**2 * (1.0 + S**2) - p**2 - q**2
        x, y, z = 0.0, q / C, p / C
        if root >= 0.0:
            for way in (-1.0, 1.0):
                x_try = ((p + q) * S + way * math.sqrt(root)) / (1.0 + S**2)
                y_try, z_try = (q - x_try * S) / C, (p - x_try * S) / C
                if possible(x_try, y_try, z_try):
                    x, y, z = x_try, y_try, z_try
    else:
        only = max(p, q)
        toward = only * C + S * math.sqrt(max(1.0 - only**2, 0.0))
        x = max((only - toward * C) / S, 0.0)
        y, z = (0.0, toward) if p > q else (toward, 0.0)
    y, z = sign_y * y, sign_z * z
    size = math.sqrt(x * x + y * y + z * z)
    out[0], out[1], out[2] = x / size, y / size, z / size
    return lit


@njit(cache=True)
def slope(q, w, torque, J, J_inverse, dq, dw):
    """Kinematics and Euler's equation."""
    dq[0] = 0.5 * (-q[1] * w[0] - q[2] * w[1] - q[3] * w[2])
    dq[1] = 0.5 * (q[0] * w[0] + q[2] * w[2] - q[3] * w[1])
    dq[2] = 0.5 * (q[0] * w[1] + q[3] * w[0] - q[1] * w[2])
    dq[3] = 0.5 * (q[0] * w[2] + q[1] * w[1] - q[2] * w[0])
    h0 = J[0, 0] * w[0] + J[0, 1] * w[1] + J[0, 2] * w[2]
    h1 = J[1, 0] * w[0] + J[1, 1] * w[1] + J[1, 2] * w[2]
    h2 = J[2, 0] * w[0] + J[2, 1] * w[1] + J[2, 2] * w[2]
    m0 = torque[0] - (w[1] * h2 - w[2] * h1)
    m1 = torque[1] - (w[2] * h0 - w[0] * h2)
    m2 = torque[2] - (w[0] * h1 - w[1] * h0)
    for n in range(3):
        dw[n] = J_inverse[n, 0] * m0 + J_inverse[n, 1] * m1 + J_inverse[n, 2] * m2


@njit(cache=True)
def one_case(q, w, J, J_inverse, law, torque_max, lever, min_pulse, periods):
    """Settling time [s], inf for none, and impulse [N s]; the Sun is +x of inertial axes, the period a second.

    `law` holds attitude gain, rate gain, slew rate, search rate, search turn, damped rate, dead band, settled angle,
    settled rate, hold time.
    """
    k_att, k_rate, slew, search, turn, damped, band, near, slow, hold = law
    mode, in_mode, settled_at, impulse = DAMPING, 0.0, np.inf, 0.0
    i, s, torque = np.zeros(4), np.zeros(3), np.zeros(3)
    dq, dw = np.zeros((4, 4)), np.zeros((4, 3))
    stage_q, stage_w = np.zeros(4), np.zeros(3)
    for step in range(periods):
        # The Sun in body axes, then in those of the instrument: x_i = -z_b, y_i = y_b, z_i = x_b.
        bx = 1.0 - 2.0 * (q[2] ** 2 + q[3] ** 2)
        by = 2.0 * (q[1] * q[2] - q[0] * q[3])
        bz = 2.0 * (q[1] * q[3] + q[0] * q[2])
        currents(-bz, by, bx, i)
        known = reconstruct(i, s) > 0
        # Least turn from (1, 0, 0) to s as modified Rodrigues parameters, in instrument axes: about (1, 0, 0) x s.
        e0, e1, e2 = 1.0 + s[0], -s[2], s[1]
        if e0 < 1e-9:
            e0, e1, e2 = 0.0, 0.0, 1.0
        size = math.sqrt(e0**2 + e1**2 + e2**2)
        my, mz = e1 / (size + e0), e2 / (size + e0)
        # Into body axes: x_b = z_i, y_b = y_i, z_b = -x_i.
        error = (mz, my, 0.0)
        angle = 4.0 * math.atan(math.sqrt(my**2 + mz**2))
        rate = math.sqrt(w[0] ** 2 + w[1] ** 2 + w[2] ** 2)
        after = mode
        if mode == DAMPING and rate < damped:
            after = SLEW if known else SEARCH
        elif mode == SEARCH and known:
            after = SLEW
        elif mode == SLEW:
            after = SEARCH if not known else (HOLD if angle < near and rate < slow else SLEW)
        elif mode == HOLD and (not known or angle > 3.0 * near):
            after = SLEW if known else SEARCH
        in_mode = in_mode + 1.0 if after == mode else 0.0
        mode = after
        if mode == HOLD and in_mode >= hold:
            settled_at = min(settled_at, float(step))
        about_z = math.floor(in_mode * search / turn) % 2 == 1
        wanted = 4.0 * k_att * math.sqrt(my**2 + mz**2)
        factor = 4.0 * k_att * (slew / wanted if wanted > slew else 1.0)
        spent = 0.0
        off = np.zeros(3)
        for n in range(3):
            command = 0.0
            if mode == SEARCH:
                command = search if (n == 0 and about_z) or (n == 1 and not about_z) else 0.0
            elif mode != DAMPING:
                command = factor * error[n]
            off[n] = command - w[n]
        h = J @ w
        gyro = (w[1] * h[2] - w[2] * h[1], w[2] * h[0] - w[0] * h[2], w[0] * h[1] - w[1] * h[0])
        for n in range(3):
            asked = k_rate * (J[n, 0] * off[0] + J[n, 1] * off[1] + J[n, 2] * off[2]) + gyro[n]
            quiet = k_rate * band * J[n, n] if mode == HOLD else 0.0
            on = min(abs(asked) / torque_max, 1.0)
            if abs(asked) <= quiet or on < min_pulse:
                on = 0.0
            torque[n] = math.copysign(torque_max * on, asked)
            spent += torque_max * on
        impulse += spent / lever
        for n in range(4):
            part = (0.0, 0.5, 0.5, 1.0)[n]
            for m in range(4):
                stage_q[m] = q[m] + part * (dq[n - 1, m] if n > 0 else 0.0)
            for m in range(3):
                stage_w[m] = w[m] + part * (dw[n - 1, m] if n > 0 else 0.0)
            slope(stage_q, stage_w, torque, J, J_inverse, dq[n], dw[n])
        for m in range(4):
            q[m] += (dq[0, m] + 2.0 * dq[1, m] + 2.0 * dq[2, m] + dq[3, m]) / 6.0
        for m in range(3):
            w[m] += (dw[0, m] + 2.0 * dw[1, m] + 2.0 * dw[2, m] + dw[3, m]) / 6.0
        q /= math.sqrt(q[0] ** 2 + q[1] ** 2 + q[2] ** 2 + q[3] ** 2)
    return settled_at, impulse


@njit(cache=True)
def all_cases(q, w, J, J_inverse, law, torque_max, lever, min_pulse, periods):
    """[cases 2] of `one_case`, one after the other."""
    found = np.zeros((len(q), 2))
    for case in range(len(q)):
        found[case] = one_case(q[case].copy(), w[case].copy(), J, J_inverse, law, torque_max, lever, min_pulse, periods)
    return found
