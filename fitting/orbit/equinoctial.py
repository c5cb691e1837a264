"""Equinoctial elements about a given plane: Kepler motion that is regular for circular and for equatorial orbits.

Elements (a, k, h, l, p, q): semi-major axis [m], e cos and e sin of the perigee's longitude, mean longitude at t = 0
[rad], tangents of half the tilt of the orbital plane (Broucke & Cefola 1972). Longitudes run from the first row of
`frame` [3 3], whose rows are two axes of a reference plane near the orbit's and its normal, in inertial components.
"""

import math

import numpy as np

ELEMENT_UNITS = {
    "semi_major_axis": "m",
    "eccentricity": "1",
    "inclination": "rad",
    "raan": "rad",
    "argument_of_perigee": "rad",
    "mean_anomaly": "rad",
}
"""Names of the classical elements, in order, and their units; the mean anomaly is that at t = 0."""


def positions_and_jacobian(t, elements, frame, mu) -> tuple[np.ndarray, np.ndarray]:
    """Positions [time 3] and their derivatives [time 3 6] in (a, k, h, l, p, q) (Broucke & Cefola 1972).

    Kepler's equation is l + n t = F - k sin F + h cos F, with F the eccentric longitude.
    """
    a, k, h, longitude, p, q = elements
    n = math.sqrt(mu / a**3)
    f = _eccentric_longitude(longitude + n * t, k, h)
    s, c = np.sin(f), np.cos(f)
    d = 1.0 - k * c - h * s
    root = math.sqrt(1.0 - k * k - h * h)
    beta = 1.0 / (1.0 + root)
    x = (1.0 - h * h * beta) * c + h * k * beta * s - k
    y = (1.0 - k * k * beta) * s + h * k * beta * c - h

    dx_df = -(1.0 - h * h * beta) * s + h * k * beta * c
    dy_df = (1.0 - k * k * beta) * c - h * k * beta * s
    dbeta_dk, dbeta_dh = k * beta**2 / root, h * beta**2 / root
    df = {"k": s / d, "h": -c / d, "l": 1.0 / d}
    dx_dk = (-h * h * c + h * k * s) * dbeta_dk + h * beta * s - 1.0 + dx_df * df["k"]
    dy_dk = (-k * k * s + h * k * c) * dbeta_dk - 2.0 * k * beta * s + h * beta * c + dy_df * df["k"]
    dx_dh = (-h * h * c + h * k * s) * dbeta_dh - 2.0 * h * beta * c + k * beta * s + dx_df * df["h"]
    dy_dh = (-k * k * s + h * k * c) * dbeta_dh + k * beta * c - 1.0 + dy_df * df["h"]
    dx_dl, dy_dl = dx_df * df["l"], dy_df * df["l"]
    dl_da = -1.5 * n * t / a

    plane, plane_p, plane_q = _plane(p, q)
    in_plane = [
        (x + a * dx_dl * dl_da, y + a * dy_dl * dl_da),
        (a * dx_dk, a * dy_dk),
        (a * dx_dh, a * dy_dh),
        (a * dx_dl, a * dy_dl),
    ]
    columns = [np.stack(xy, axis=1) @ plane for xy in in_plane]
    xy = a * np.stack([x, y], axis=1)
    columns += [xy @ plane_p, xy @ plane_q]
    return xy @ plane @ frame, np.stack([column @ frame for column in columns], axis=2)


def classical_elements(elements, frame) -> dict[str, float]:
    """Classical elements, keys of `ELEMENT_UNITS`; undefined angles (node, perigee) are zero."""
    a, k, h, longitude, p, q = elements
    axes = _plane(p, q)[0] @ frame
    normal = np.cross(axes[0], axes[1])
    raan = math.atan2(normal[0], -normal[1]) if math.hypot(normal[0], normal[1]) > 1e-15 else 0.0
    node = axes @ np.array([math.cos(raan), math.sin(raan), 0.0])
    perigee = math.atan2(h, k)
    values = (
        a,
        math.hypot(k, h),
        math.atan2(math.hypot(normal[0], normal[1]), normal[2]),
        raan % (2.0 * math.pi),
        (perigee - math.atan2(node[1], node[0])) % (2.0 * math.pi),
        (longitude - perigee) % (2.0 * math.pi),
    )
    return {name: float(value) for name, value in zip(ELEMENT_UNITS, values, strict=True)}


def argument_of_latitude(elements: dict[str, float]) -> float:
    """Angle from the ascending node to the satellite at t = 0 [rad, -pi to pi], from classical elements."""
    e, mean = elements["eccentricity"], elements["mean_anomaly"]
    ecc_anomaly = float(_eccentric_longitude(np.array([mean]), e, 0.0)[0])
    true = 2.0 * math.atan2(math.sqrt(1 + e) * math.sin(ecc_anomaly / 2), math.sqrt(1 - e) * math.cos(ecc_anomaly / 2))
    return math.remainder(elements["argument_of_perigee"] + true, 2.0 * math.pi)


def mean_longitude(true_longitude, k, h):
    """Mean longitude of a point seen in direction `true_longitude` from the focus."""
    ecc = np.hypot(k, h)
    perigee = np.arctan2(h, k)
    true_anomaly = true_longitude - perigee
    ecc_anomaly = 2.0 * np.arctan2(
        np.sqrt(1.0 - ecc) * np.sin(0.5 * true_anomaly), np.sqrt(1.0 + ecc) * np.cos(0.5 * true_anomaly)
    )
    return ecc_anomaly - ecc * np.sin(ecc_anomaly) + perigee


def _plane(p, q) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Equinoctial axes [2 3] of a plane tilted by i, tan(i/2) = hypot(p, q), and their derivatives in p and q."""
    w = 1.0 + p * p + q * q
    axes = np.array([[1.0 - p * p + q * q, 2.0 * p * q, -2.0 * p], [2.0 * p * q, 1.0 + p * p - q * q, 2.0 * q]]) / w
    d_p = np.array([[-2.0 * p, 2.0 * q, -2.0], [2.0 * q, 2.0 * p, 0.0]]) / w - axes * (2.0 * p / w)
    d_q = np.array([[2.0 * q, 2.0 * p, 0.0], [2.0 * p, -2.0 * q, 2.0]]) / w - axes * (2.0 * q / w)
    return axes, d_p, d_q


def _eccentric_longitude(longitude, k, h) -> np.ndarray:
    f = longitude + k * np.sin(longitude) - h * np.cos(longitude)
    for _ in range(50):
        s, c = np.sin(f), np.cos(f)
        # A step is held to one radian: Newton's can leave the basin at high eccentricity.
        step = np.clip((f - k * s + h * c - longitude) / (1.0 - k * c - h * s), -1.0, 1.0)
        f = f - step
        if np.max(np.abs(step)) < 1e-13:
            break
    return f
