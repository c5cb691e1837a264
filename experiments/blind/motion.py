"""True motion and currents of a satellite of the Munin kind, in NumPy and SciPy and without `jaxsat`.

A rigid body with a magnet and two linear rods under the gravity gradient; DOP853 with field and position from splines
over `NODE_S`. Quaternions scalar first, inertial-from-body.
"""

import datetime as dt
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import solve_ivp
from scipy.interpolate import CubicSpline
from surroundings import MU, apparent_sun, greenwich_angle, is_lit, kepler, magnetic_field, mirrored, scattered

Array = NDArray[np.float64]

REFERENCE_FIELD = 3.0e-5
"""Field in which the moments of the rods are quoted [T]."""
NODE_S = 5.0
"""Cubic splines over it hold the field of degree 13 to 1e-9 of itself."""
RELATIVE, ABSOLUTE = 1e-10, 1e-12
"""Tolerances of the integration."""
NORMALS = np.array([[1.0, 0, 0], [-1.0, 0, 0], [0, 1.0, 0], [0, -1.0, 0], [0, 0, 1.0], [0, 0, -1.0]])


def dcm_eci_from_body(q: Array) -> Array:
    """[... 3 3] of unit quaternions [... 4]."""
    w, x, y, z = np.moveaxis(q, -1, 0)
    rows = [
        [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
        [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
        [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
    ]
    return np.moveaxis(np.array(rows), (0, 1), (-2, -1))


def _cross(a: Array, b: Array) -> Array:
    # np.cross costs ten times as much on single vectors.
    return np.array([a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]])


def attitude(cfg: dict[str, Any], start: dt.datetime, greenwich: float, t: Array) -> tuple[Array, Array]:
    """[time 4] quaternions and [time 3] rates [rad/s] from `q0` and `w0` at t = 0.

    J w' = 3 mu/r^5 (r x J r) + (m + I (B . e)/B_ref e) x B - w x J w,   q' = q (0, w) / 2
    """
    J, magnet = np.array(cfg["inertia"]), np.array(cfg["magnet"])
    rods = np.array([0.0, *cfg["rods"]]) / REFERENCE_FIELD
    nodes = np.arange(0.0, t[-1] + 2.0 * NODE_S, NODE_S)
    position, _ = kepler(cfg["elements"], nodes)
    field = magnetic_field(position, start, nodes, greenwich)
    path = CubicSpline(nodes, np.concatenate([position, field], axis=1))
    J_inverse = np.linalg.inv(J)

    def slope(time: float, y: Array) -> Array:
        q, rate = y[:4] / np.sqrt(y[:4] @ y[:4]), y[4:]
        here = path(time)
        to_body = dcm_eci_from_body(q).T
        r, b = to_body @ here[:3], to_body @ here[3:]
        torque = 3.0 * MU / (r @ r) ** 2.5 * _cross(r, J @ r) + _cross(magnet + rods * b, b) - _cross(rate, J @ rate)
        turn = np.array([-q[1:] @ rate, *(q[0] * rate + _cross(q[1:], rate))])
        return np.concatenate([0.5 * turn, J_inverse @ torque])

    start_at = np.array([*cfg["q0"], *cfg["w0"]])
    scale = np.array([1.0] * 4 + [0.01] * 3)
    solution = solve_ivp(slope, (0.0, t[-1]), start_at, method="DOP853", t_eval=t, rtol=RELATIVE, atol=ABSOLUTE * scale)
    q = solution.y[:4].T
    return q / np.linalg.norm(q, axis=1, keepdims=True), solution.y[4:].T


def simulate(
    cfg: dict[str, Any], *, sun: Array | None = None, motion: tuple[Array, Array] | None = None
) -> dict[str, Any]:
    """What a truth file holds, as arrays, with positions [m], velocities [m/s] and body field [T] beside.

    `sun` [3] replaces the apparent Sun of each sample by one direction, `motion` (quaternions and rates at the samples)
    that of `attitude`. Currents in mA; a panel whose `panel_ratio` is zero is dead; `normals` of the settings are those
    of panels that do not stand square.
    """
    start = dt.datetime.fromisoformat(cfg["start"])
    t = np.arange(0.0, cfg["duration"] + 1e-9, cfg["cadence"])
    greenwich = greenwich_angle(start)
    position, velocity = kepler(cfg["elements"], t)
    to_sun = apparent_sun(start, t) if sun is None else np.broadcast_to(sun, position.shape)
    q, w = attitude(cfg, start, greenwich, t) if motion is None else motion
    axes = dcm_eci_from_body(q)
    field_body = np.einsum("tji,tj->ti", axes, magnetic_field(position, start, t, greenwich))
    normals = np.array(cfg.get("normals", NORMALS)) @ np.swapaxes(axes, -1, -2)
    lit = is_lit(position, to_sun)
    image, share = mirrored(position, to_sun)

    def on_panels(direction: Array) -> Array:
        return np.maximum(np.einsum("tpi,ti->tp", normals, direction), 0.0)

    light = lit[:, None] * on_panels(to_sun) + cfg["albedo_specular"] * share[:, None] * on_panels(image)
    if cfg["albedo_diffuse"] > 0.0:
        light += cfg["albedo_diffuse"] * scattered(position, to_sun, normals)
    return {
        "cfg": cfg,
        "t": t,
        "q": q,
        "w": w,
        "theta": np.degrees(np.arccos(np.clip(field_body[:, 0] / np.linalg.norm(field_body, axis=1), -1.0, 1.0))),
        "sun": to_sun[len(t) // 2],
        "greenwich0": greenwich,
        "lit": lit,
        "currents_clean": cfg["imax"] * np.array(cfg["panel_ratio"]) * light,
        "position": position,
        "velocity": velocity,
        "field_body": field_body,
    }
