"""What the report's three-dimensional view shows: orbit, shadow, Sun, field and its lines, and the motion.

Only the motion waits for the fit; all else is computed beside it, by one stored program of fixed shape.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import jax
import jax.numpy as jnp
import numpy as np

from fitting.measurements.sky import Around
from fitting.stored import Stored
from jaxsat.environment import CylinderShadow, KeplerOrbit, magnetic_field_eci
from jaxsat.environment.field_lines import field_line
from jaxsat.frames import dcm_eci_from_ecef
from jaxsat.math.attitude_between import attitude_between

if TYPE_CHECKING:
    from fitting.outcome.result import FitResult

SCHEMA = "jaxsat.scene/1"
LARGEST_TURN = np.radians(6.0)
"""Between two attitudes that the page joins by a great arc [rad]."""
TRACK, ELLIPSE, EDGES, LINES, SUNS = 513, 361, 4097, 97, 9
"""Instants along the arc and round the orbit; those that the shadow's edges, field lines and Sun are found at."""
POINTS, SKIP = 120, 2
"""Steps of each half of a field line, of which every second is kept."""
LONGEST_LINE_STEP_S = 120.0
"""Between field lines; the satellite goes 6 deg meanwhile. Longer arcs have none."""


@dataclass(frozen=True)
class Sky:
    """All that does not wait for the attitude, over the arc `t_s` = (begin, end)."""

    t_s: tuple[float, float]
    earth: dict[str, float]
    sun_eci: np.ndarray
    """[SUNS 3] unit vectors."""
    ellipse_t_s: np.ndarray
    """[ELLIPSE] over one revolution."""
    ellipse_m: np.ndarray
    ellipse_lit: np.ndarray
    position_m: np.ndarray
    """[TRACK 3], and so the next two."""
    velocity_m_s: np.ndarray
    b_field_T: np.ndarray
    shadow_s: list[tuple[float, float]]
    lines_m: np.ndarray | None
    """[LINES points 3], inertial axes at the instant of each."""


def _survey(orbit, revolution, field, greenwich, rate, radius, times, sun):
    """Position, velocity, field and lines of it along the track, position round the orbit, light at all times."""
    track, ellipse, edges, lines = times
    position, velocity = jax.vmap(orbit)(track)
    b_field = jax.vmap(lambda r, t: magnetic_field_eci(field, r, greenwich + rate * t))(position, track)

    def line(t):
        dcm = dcm_eci_from_ecef(greenwich + rate * t)
        points = field_line(field, orbit(t)[0] @ dcm, steps=POINTS, radius=radius)
        return points[::SKIP] @ dcm.T

    def lit(path, t, sun):
        r = jax.vmap(lambda t: path(t)[0])(t)
        return r, jax.vmap(CylinderShadow(radius))(r, sun)

    round_it, there = lit(revolution, ellipse, sun[0]), lit(orbit, edges, sun[1])[1]
    return position, velocity, b_field, jax.vmap(line)(lines), *round_it, there


survey = Stored(_survey, seldom=True)


def sky_over(
    around: Around, revolution: KeplerOrbit, span_s: tuple[float, float], sun_eci: Callable[[np.ndarray], np.ndarray]
) -> Sky:
    """Returns the sky of an arc; `revolution` is the ellipse that is drawn, `sun_eci` gives unit vectors at times."""
    begin, end = span_s
    period = 2.0 * math.pi * math.sqrt(float(revolution.semi_major_axis) ** 3 / float(revolution.mu))
    times = (
        np.linspace(begin, end, TRACK),
        np.linspace(begin, begin + period, ELLIPSE),
        np.linspace(begin, end, EDGES),
        np.linspace(begin, end, LINES),
    )

    scalars = (around.greenwich_angle, around.rotation_rate, around.earth_radius)
    position, velocity, b_field, lines, ellipse, ellipse_lit, lit = (
        np.asarray(array)
        for array in survey(
            around.orbit,
            revolution,
            around.field,
            *(jnp.asarray(float(x)) for x in scalars),
            times,
            (sun_eci(times[1]), sun_eci(times[2])),
        )
    )
    names = ("greenwich_angle_rad", "rotation_rate_rad_s", "radius_m")
    return Sky(
        (begin, end),
        dict(zip(names, map(float, scalars), strict=True)),
        sun_eci(np.linspace(begin, end, SUNS)),
        times[1],
        ellipse,
        ellipse_lit,
        position,
        velocity,
        b_field,
        dark_spans(times[2], lit > 0.5),
        lines if times[3][1] - times[3][0] <= LONGEST_LINE_STEP_S else None,
    )


def dark_spans(t_s: np.ndarray, lit: np.ndarray) -> list[tuple[float, float]]:
    """Returns the stretches [s] between the first dark instant and the next lit one."""
    change = np.flatnonzero(np.diff(np.concatenate(([True], lit, [True])).astype(int)))
    last = len(t_s) - 1
    return [(float(t_s[a]), float(t_s[min(b, last)])) for a, b in zip(change[::2], change[1::2], strict=True)]


def scene_document(result: "FitResult", sky: Sky) -> dict[str, Any] | None:
    """Returns the content of scene.json, rounded to what a picture shows; units are those of the names.

    None where there is no motion: fewer than two samples have a finite attitude.
    """
    q, rate = result.quaternion_inertial_from_body, result.angular_velocity_rad_s
    known = np.isfinite(q).all(axis=1) & np.isfinite(rate).all(axis=1)
    if known.sum() < 2:
        return None
    between = result.between
    if between is None:
        t_nodes, q_nodes = attitude_between(result.t_s[known], q[known], rate[known], largest_turn=LARGEST_TURN)
    else:
        t_nodes, q_nodes = between.t_s, between.quaternion_inertial_from_body
    begin, end = sky.t_s
    # One list a line: x, y, z of its points one after the other.
    lines = None if sky.lines_m is None else np.rint(sky.lines_m / 1e3).astype(int).reshape(LINES, -1).tolist()
    return {
        "schema": SCHEMA,
        "begin_s": begin,
        "end_s": end,
        "earth": {
            "radius_km": sky.earth["radius_m"] / 1e3,
            "greenwich_angle_rad": sky.earth["greenwich_angle_rad"],
            "rotation_rate_rad_s": sky.earth["rotation_rate_rad_s"],
        },
        "sun_eci": np.round(sky.sun_eci, 6).tolist(),
        "shadow_s": np.round(sky.shadow_s, 1).tolist(),
        "orbit": {
            "period_s": float(sky.ellipse_t_s[-1] - sky.ellipse_t_s[0]),
            "position_km": np.round(sky.ellipse_m / 1e3, 1).tolist(),
            "lit": np.round(sky.ellipse_lit).astype(int).tolist(),
        },
        "track": {
            "position_km": np.round(sky.position_m / 1e3, 2).tolist(),
            "velocity_km_s": np.round(sky.velocity_m_s / 1e3, 4).tolist(),
            "field_uT": np.round(sky.b_field_T * 1e6, 2).tolist(),
        },
        "field_lines_km": lines,
        "attitude": {
            "t_s": np.round(t_nodes, 3).tolist(),
            "quaternion_inertial_from_body": np.round(q_nodes, 5).tolist(),
        },
    }
