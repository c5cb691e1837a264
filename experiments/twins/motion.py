"""True motion of a rigid body with the parts that a satellite file may name, in NumPy and SciPy, without `jaxsat`.

Scalars in plain Python in the right-hand side: arrays of three cost ten times as much. Quaternions are scalar first and
inertial from body.
"""

import math
from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import solve_ivp

from experiments.twins.world import NODE_S, World

Array = NDArray[np.float64]

MU = 3.986004418e14
"""Of the Earth [m3/s2]."""
MU_0 = 4e-7 * math.pi
REFERENCE_FIELD = 3.0e-5
"""Field in which the moment of a linear rod is quoted [T]."""
RELATIVE, ABSOLUTE = 1e-10, 1e-12
"""Tolerances of the integration."""


def to_inertial(q: Array) -> Array:
    """Rotation matrices inertial from body [... 3 3] of unit quaternions [... 4]."""
    w, x, y, z = np.moveaxis(q, -1, 0)
    rows = [
        [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
        [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
        [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
    ]
    return np.moveaxis(np.array(rows), (0, 1), (-2, -1))


def _hysteresis(rod: dict[str, Any]) -> Callable[[float, float, float], tuple[float, float]]:
    """Moment along a rod [A m2] and rate of its flux density [T/s] in a field [T] along it that changes [T/s].

    Flatley and Henretty (1995): with k = tan(pi Br / 2 Bs) / Hc the boundary loops are B = (2 Bs/pi) atan(k (H -+ Hc));
    dB/dH is their slope at the same B times F^2, F the way from the loop left behind to the one ahead. The moment is
    theirs too, V B / mu0: less the field's own share, V H, it would be two thousandths smaller.
    """
    coercive, saturation = rod["Hc"], rod["Bs"]
    steepness = math.tan(0.5 * math.pi * rod["Br"] / saturation) / coercive

    def law(flux: float, along: float, along_rate: float) -> tuple[float, float]:
        angle = 0.5 * math.pi * min(max(flux / saturation, -0.999999), 0.999999)
        middle = math.tan(angle) / steepness
        strength, strength_rate = along / MU_0, along_rate / MU_0
        lag = (strength - middle) / coercive
        way = 0.5 * (1.0 + (lag if strength_rate >= 0.0 else -lag))
        slope = 2.0 / math.pi * saturation * steepness * math.cos(angle) ** 2
        return rod["volume"] * flux / MU_0, slope * min(max(way, 0.0), 1.0) ** 2 * strength_rate

    return law


def right_hand_side(cfg: dict[str, Any], world: World, commanded: Array) -> Callable[[float, Array], list[float]]:
    """y' of y = (quaternion, rate, flux density of each hysteresis rod), with moments of coils [3] held.

    J w' = 3 mu/r^5 (r x J r) + m x B + k (w x B) x B + residual - f v^2 (d x v/v) - w x J w,   q' = q (0, w) / 2

    The last but one is the air's: `drag` is f d, half of density, drag coefficient and area times the place of the
    centre of pressure in the body [kg]; the air does not turn with the Earth.
    """
    J = np.array(cfg["inertia"])
    (a, b, c), (_, d, e), (_, _, f) = J.tolist()
    (ia, ib, ic), (_, id_, ie), (_, _, if_) = np.linalg.inv(J).tolist()
    fixed = (np.array(cfg["magnet"]) + commanded).tolist()
    linear = [
        (unit_axis(rod["axis"]), rod["moment"] / REFERENCE_FIELD) for rod in cfg.get("rods", ()) if "moment" in rod
    ]
    soft = [(unit_axis(rod["axis"]), _hysteresis(rod)) for rod in cfg.get("rods", ()) if "Hc" in rod]
    eddy, residual = cfg.get("eddy", 0.0), cfg.get("residual", [0.0, 0.0, 0.0])
    (dx, dy, dz), pushed = cfg.get("drag", [0.0, 0.0, 0.0]), "drag" in cfg
    first, coefficients = float(world.nodes[0]), np.ascontiguousarray(np.moveaxis(world.spline.c, 1, 0))

    def slope(t: float, y: Array) -> list[float]:
        since = t - first
        piece = min(max(int(since // NODE_S), 0), len(coefficients) - 1)
        h = since - piece * NODE_S
        c3, c2, c1, c0 = coefficients[piece]
        here = (((c3 * h + c2) * h + c1) * h + c0).tolist()
        w, x, y_, z, p, q, r, *flux = y.tolist()
        size = math.sqrt(w * w + x * x + y_ * y_ + z * z)
        w, x, y_, z = w / size, x / size, y_ / size, z / size
        xx, yx, zx = 1 - 2 * (y_ * y_ + z * z), 2 * (x * y_ + w * z), 2 * (x * z - w * y_)
        xy, yy, zy = 2 * (x * y_ - w * z), 1 - 2 * (x * x + z * z), 2 * (y_ * z + w * x)
        xz, yz, zz = 2 * (x * z + w * y_), 2 * (y_ * z - w * x), 1 - 2 * (x * x + y_ * y_)
        rx, ry, rz, bx, by, bz = here
        ux, uy, uz = xx * rx + yx * ry + zx * rz, xy * rx + yy * ry + zy * rz, xz * rx + yz * ry + zz * rz
        mx, my, mz = fixed
        fx, fy, fz = xx * bx + yx * by + zx * bz, xy * bx + yy * by + zy * bz, xz * bx + yz * by + zz * bz
        for (ex, ey, ez), factor in linear:
            moment = factor * (fx * ex + fy * ey + fz * ez)
            mx, my, mz = mx + moment * ex, my + moment * ey, mz + moment * ez
        flux_rates = []
        if soft:
            jx, jy, jz = ((3.0 * c3 * h + 2.0 * c2) * h + c1)[3:].tolist()
            vx = xx * jx + yx * jy + zx * jz - (q * fz - r * fy)
            vy = xy * jx + yy * jy + zy * jz - (r * fx - p * fz)
            vz = xz * jx + yz * jy + zz * jz - (p * fy - q * fx)
            for ((ex, ey, ez), law), state in zip(soft, flux, strict=True):
                moment, rate = law(state, fx * ex + fy * ey + fz * ez, vx * ex + vy * ey + vz * ez)
                mx, my, mz = mx + moment * ex, my + moment * ey, mz + moment * ez
                flux_rates.append(rate)
        mx, my, mz = mx + eddy * (q * fz - r * fy), my + eddy * (r * fx - p * fz), mz + eddy * (p * fy - q * fx)
        if pushed:
            vx, vy, vz = ((3.0 * c3 * h + 2.0 * c2) * h + c1)[:3].tolist()
            speed = math.sqrt(vx * vx + vy * vy + vz * vz)
            ax, ay, az = (
                -speed * (ex * vx + ey * vy + ez * vz) for ex, ey, ez in ((xx, yx, zx), (xy, yy, zy), (xz, yz, zz))
            )
        else:
            ax = ay = az = 0.0
        gravity = 3.0 * MU / (ux * ux + uy * uy + uz * uz) ** 2.5
        gx, gy, gz = a * ux + b * uy + c * uz, b * ux + d * uy + e * uz, c * ux + e * uy + f * uz
        hx, hy, hz = a * p + b * q + c * r, b * p + d * q + e * r, c * p + e * q + f * r
        tx = gravity * (uy * gz - uz * gy) + my * fz - mz * fy + residual[0] + dy * az - dz * ay - (q * hz - r * hy)
        ty = gravity * (uz * gx - ux * gz) + mz * fx - mx * fz + residual[1] + dz * ax - dx * az - (r * hx - p * hz)
        tz = gravity * (ux * gy - uy * gx) + mx * fy - my * fx + residual[2] + dx * ay - dy * ax - (p * hy - q * hx)
        return [
            0.5 * (-x * p - y_ * q - z * r),
            0.5 * (w * p + y_ * r - z * q),
            0.5 * (w * q + z * p - x * r),
            0.5 * (w * r + x * q - y_ * p),
            ia * tx + ib * ty + ic * tz,
            ib * tx + id_ * ty + ie * tz,
            ic * tx + ie * ty + if_ * tz,
            *flux_rates,
        ]

    return slope


def unit_axis(axis: Any) -> list[float]:
    """Three numbers, made a unit vector."""
    return (np.array(axis, float) / np.linalg.norm(axis)).tolist()


class Motion:
    """Attitude and rate at any time of a session; rods start demagnetised, a `kick` changes the rate at its time."""

    def __init__(self, cfg: dict[str, Any], world: World) -> None:
        soft = sum("Hc" in rod for rod in cfg.get("rods", ()))
        y = np.array([*cfg["q0"], *cfg["w0"], *[0.0] * soft])
        scale = np.array([1.0] * 4 + [0.01] * 3 + [0.01] * soft)
        changes, moments = coil_moments(cfg)
        kick = cfg.get("kick", {"t": np.inf, "rate": [0.0, 0.0, 0.0]})
        inside = {float(t) for t in [*changes, kick["t"]] if world.start < t < world.stop}
        edges = [world.start, *sorted(inside), world.stop]
        self._edges, self._pieces = np.array(edges), []
        for start, stop in zip(edges[:-1], edges[1:], strict=True):
            if start == kick["t"]:
                y = y + np.concatenate([np.zeros(4), kick["rate"], np.zeros(soft)])
            slope = right_hand_side(cfg, world, moments[int(np.searchsorted(changes, start, side="right"))])
            done = solve_ivp(slope, (start, stop), y, "DOP853", dense_output=True, rtol=RELATIVE, atol=ABSOLUTE * scale)
            if not done.success:
                raise ArithmeticError(f"the integration stops at {done.t[-1]:g} s: {done.message}")
            self._pieces.append(done.sol)
            y = done.y[:, -1]

    def __call__(self, t: Array) -> tuple[Array, Array]:
        """Quaternions [n 4] and rates [n 3] (rad/s, body axes) at times [n]."""
        piece = np.clip(np.searchsorted(self._edges, t, side="right") - 1, 0, len(self._pieces) - 1)
        y = np.empty((len(t), 7))
        for k in np.unique(piece):
            y[piece == k] = self._pieces[k](t[piece == k])[:7].T
        return y[:, :4] / np.linalg.norm(y[:, :4], axis=1, keepdims=True), y[:, 4:]


def coil_moments(cfg: dict[str, Any]) -> tuple[Array, Array]:
    """Times at which commands change [n], and the sum of the coils' moments before the first and after each [n+1 3]."""
    commands = cfg.get("commands", {"t": [], "current": []})
    currents = np.array(commands["current"], float).reshape(len(commands["t"]), len(cfg.get("coils", ())))
    axes = np.array([coil["area_turns_m2"] * np.array(unit_axis(coil["axis"])) for coil in cfg.get("coils", ())])
    moments = currents @ axes if len(axes) else np.zeros((len(currents), 3))
    return np.array(commands["t"], float), np.concatenate([np.zeros((1, 3)), moments])
