"""A turn in three dimensions: what stands about the satellite at its instant, as a picture and as a page to turn."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from matplotlib.figure import Figure
from scipy.spatial.transform import Rotation

from fitting.session import PreparedSession
from jaxsat.environment import CylinderShadow, magnetic_field_eci
from jaxsat.files.json_files import plain
from jaxsat.panel_names import PANEL_COLOURS, PAPER_COLOURS
from jaxsat.plotting import draw_turn_in_space
from jaxsat.report import Live, Picture, page

ELLIPSE = 361
"""Points of the orbit."""
REACH = 10.0
"""Largest residual that a strip shows [sigma], if the chosen angle's are not larger."""


@dataclass(frozen=True)
class Surroundings:
    """Orbit, Sun and field at one instant; inertial axes."""

    t_s: float
    radius_m: float
    ellipse: np.ndarray
    """[points 3] one revolution, in radii, from where the satellite is."""
    velocity_m_s: np.ndarray
    sun: np.ndarray
    field_T: np.ndarray
    greenwich: float
    """[rad]"""

    @staticmethod
    def of(prepared: PreparedSession, t_s: float) -> "Surroundings":
        """Those of a session `t_s` seconds after its epoch."""
        around, orbit = prepared.around, prepared.orbit_fit.orbit
        times = t_s + np.linspace(0.0, 2.0 * math.pi / float(orbit.mean_motion), ELLIPSE)
        position, velocity = (np.asarray(x) for x in jax.jit(jax.vmap(orbit))(jnp.asarray(times)))
        greenwich = float(around.greenwich_angle + around.rotation_rate * t_s)
        field = magnetic_field_eci(around.field, jnp.asarray(position[0]), jnp.asarray(greenwich))
        radius = float(around.earth_radius)
        sun = np.asarray(prepared.sun_eci(np.array([t_s]))[0])
        return Surroundings(t_s, radius, position / radius, velocity[0], sun, np.asarray(field), greenwich)

    @cached_property
    def lit(self) -> np.ndarray:
        """[points] bool: where the orbit is in sunlight, the shadow being a cylinder."""
        return np.asarray(jax.jit(jax.vmap(CylinderShadow(1.0), (0, None)))(self.ellipse, self.sun)) > 0.0

    def picture(self, q: np.ndarray, angles_deg: Sequence[float], *, title: str, subtitle: str) -> Figure:
        """The picture of attitudes [angles 4], the first of them large."""
        return draw_turn_in_space(
            Rotation.from_quat(q, scalar_first=True).as_matrix(),
            angles_deg,
            position=self.ellipse[0],
            velocity=self.velocity_m_s,
            ellipse=self.ellipse,
            lit=self.lit,
            sun=self.sun,
            field=self.field_T,
            greenwich=self.greenwich,
            title=title,
            subtitle=subtitle,
        )

    def scene(self, angles_deg: np.ndarray, q: np.ndarray) -> dict[str, Any]:
        """As of a fit's motion, all of it at one instant: the angle of the turn is in the place of time."""
        many, radius_km = len(angles_deg), self.radius_m / 1e3
        km = np.round(self.ellipse * radius_km, 1)
        return {
            "begin_s": float(angles_deg[0]),
            "end_s": float(angles_deg[-1]),
            "earth": {"radius_km": radius_km, "greenwich_angle_rad": self.greenwich, "rotation_rate_rad_s": 0.0},
            "sun_eci": [self.sun] * 2,
            "shadow_s": [] if self.lit[0] else [[float(angles_deg[0]), float(angles_deg[-1])]],
            # So long that no part of it is flown meanwhile.
            "orbit": {"period_s": 1e9, "position_km": km, "lit": self.lit.astype(int)},
            "track": {
                "position_km": [km[0]] * many,
                "velocity_km_s": [np.round(self.velocity_m_s / 1e3, 4)] * many,
                "field_uT": [np.round(1e6 * self.field_T, 3)] * many,
            },
            "field_lines_km": None,
            "attitude": {"t_s": angles_deg, "quaternion_inertial_from_body": np.round(q, 5)},
        }


@dataclass(frozen=True)
class Turned:
    """Currents at each angle of a turn, and those measured."""

    angles_deg: np.ndarray
    q: np.ndarray
    """[angles 4]"""
    direct_mA: np.ndarray
    """[angles 6]"""
    modelled_mA: np.ndarray
    measured_mA: np.ndarray
    """[6]"""
    noise_mA: float

    def channel(self, chosen: int) -> dict[str, Any]:
        """The currents as a page shows them, against the angle; scales are such that the chosen angle's are seen."""
        off = (self.measured_mA - self.modelled_mA) / self.noise_mA
        reach = float(np.ceil(max(REACH, 1.2 * np.abs(off[chosen]).max())))
        top = 1.1 * max(float(self.modelled_mA.max()), float(self.measured_mA.max()), 1.0)
        named = list(enumerate(PANEL_COLOURS.items()))
        one = np.ones(len(self.angles_deg), int)
        return {
            "name": "currents",
            "unit": "mA",
            "note": "Against the angle of the turn; the factors of direct and returned light are the best at each.",
            "reach": reach,
            "paired": True,
            "scale": [round(-0.03 * top, 2), round(top, 2)],
            "t_s": self.angles_deg,
            "use": one,
            "readings": [
                {
                    "name": name.upper(),
                    "colour": colour,
                    "measured": np.round(self.measured_mA[k] * one, 2),
                    "modelled": np.round(self.modelled_mA[:, k], 2),
                    "direct": np.round(self.direct_mA[:, k], 2),
                }
                for k, (name, colour) in named
            ],
            "residuals": [
                {"name": name.upper(), "colour": colour, "residual": np.round(off[:, k], 2), "promised": one}
                for k, (name, colour) in named
            ],
        }


def turn_page(
    turned: Turned,
    around: Surroundings,
    *,
    about: str,
    chosen_deg: float,
    epoch_utc: str,
    title: str,
    subtitle: str,
    message: str,
    pictures: dict[str, bytes],
) -> str:
    """The page of a turn: Earth, orbit and satellite under one slider of its angle, the currents below."""
    angles, field = turned.angles_deg, around.field_T / np.linalg.norm(around.field_T)
    body_x = Rotation.from_quat(turned.q, scalar_first=True).apply([1.0, 0.0, 0.0])
    none = [None] * len(angles)
    data = {
        "schema": "jaxsat.page/1",
        "epoch_utc": epoch_utc,
        "turn": {"about": about, "t_s": around.t_s, "angle_deg": chosen_deg},
        "panels": [{"name": name.upper(), "colour": colour} for name, colour in PANEL_COLOURS.items()],
        "paper": {colour: PAPER_COLOURS[name] for name, colour in PANEL_COLOURS.items()},
        "size": [1.0, 1.0, 1.0],
        "held_s": [],
        "samples": {
            "t_s": angles,
            "lit": np.full(len(angles), int(around.lit[0])),
            "field_angle_deg": np.round(np.degrees(np.arccos(np.clip(body_x @ field, -1.0, 1.0))), 3),
            "field_angle_sigma_deg": none,
        },
        "channels": [turned.channel(int(np.argmin(np.abs(angles - chosen_deg))))],
        "scene": around.scene(angles, turned.q),
    }
    sections = [
        Live("motion", "Turn", Picture("space.png", pictures["space.png"], "the satellite on its orbit, turned")),
        Live("channel-0", "Currents", Picture("turn.png", pictures["turn.png"], "residual, currents at each angle")),
    ]
    return page(
        title,
        subtitle=subtitle,
        verdict="plain",
        verdict_text=f"By {chosen_deg:.4g} deg.",
        message=message,
        sections=sections,
        data=plain(data)[0],
    )
