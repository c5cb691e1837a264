"""A session made by the simulator: motion, field, Sun, currents and angles at the samples, with their truth document.

What the program `Orfs` gives (Penkov et al. 2009, section 3.8), and in `raw_sun_text` the file that a fit reads.
"""

import math
from collections.abc import Mapping
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from jaxsat.constants import EARTH_RADIUS_MEAN
from jaxsat.dynamics import AttitudeState
from jaxsat.environment import CylinderShadow, DiffuseAlbedo, SpecularAlbedo, Surroundings, tabulate_light
from jaxsat.estimation import sun_magnetic_angles
from jaxsat.integrators import DORMAND_PRINCE_8
from jaxsat.math import angle_between, quaternion
from jaxsat.sensors import Albedo, albedo_currents, direct_currents, limb_distance, limb_turn
from jaxsat.simulate import simulate
from jaxsat.spacecraft import Spacecraft
from jaxsat.time import Epoch
from jaxsat.torques.abstract import required

SCHEMA = "jaxsat.truth/1"
_MANY_SAMPLES = 2000


class Truth(eqx.Module):
    """Everything that a session is made of at its samples, SI, without noise."""

    t: Float[np.ndarray, "time"]
    """[s] after the epoch."""
    quaternion: Float[Array, "time 4"]
    """inertial-from-body, scalar first."""
    angular_velocity: Float[Array, "time 3"]
    """Body axes [rad/s]."""
    position_eci: Float[Array, "time 3"]
    """[m]"""
    velocity_eci: Float[Array, "time 3"]
    """[m/s]"""
    b_field_eci: Float[Array, "time 3"]
    """Magnetic field [T]."""
    b_field_body: Float[Array, "time 3"]
    """[T]"""
    sun_eci: Float[Array, "time 3"]
    """Unit vectors."""
    illumination: Float[Array, "time"]
    """Visible share of the Sun."""
    direct_current: Float[Array, "time 6"]
    """Of the Sun's own light, panels +X -X +Y -Y +Z -Z [A]."""
    specular_current: Float[Array, "time 6"]
    """Of light mirrored by the Earth [A]."""
    diffuse_current: Float[Array, "time 6"]
    """Of light scattered by the Earth [A]."""
    sun_magnetic: Float[Array, "time 3"]
    """Deviation of body x from the field, its azimuth, roll about x [rad], see `sun_magnetic_angles`."""
    sun_angle: Float[Array, "time"]
    """Between body x and the Sun [rad]."""
    sun_field_angle: Float[Array, "time"]
    """Between the field and the Sun [rad]."""
    limb: Float[Array, "time 2"]
    """Distance of body x from the Earth's limb and turn about it [rad], see `jaxsat.sensors.limb`."""
    error: float = eqx.field(static=True)
    """Of the integrated attitude [rad]."""

    @property
    def current(self) -> Float[Array, "time 6"]:
        """Of all light [A]."""
        return self.direct_current + self.specular_current + self.diffuse_current


def simulate_session(
    spacecraft: Spacecraft,
    initial: AttitudeState,
    surroundings: Surroundings,
    t_s: Float[np.ndarray, "time"],
    sun_eci: Float[np.ndarray, "time 3"],
    *,
    albedo: Albedo,
    earth_radius: float = EARTH_RADIUS_MEAN,
    tolerance: float = 1e-8,
) -> Truth:
    """Returns the motion from `initial` at t = 0 and all else at increasing times `t_s` [s], the first not negative.

    `sun_eci` are unit vectors at those times, `earth_radius` [m] is that of shadow, albedo and limb. `tolerance` is of
    the attitude [rad]; ValueError where no step holds it.
    """
    # It compiles in a fifth of the time that Adams takes, but has to stop at each sample.
    tableau = DORMAND_PRINCE_8 if len(t_s) < _MANY_SAMPLES else None
    motion = simulate(spacecraft, initial, surroundings, t_s, tolerance=tolerance, tableau=tableau)
    values = _observe(
        spacecraft,
        surroundings,
        albedo,
        jnp.asarray(float(earth_radius)),
        (jnp.asarray(t_s), motion.quaternion, motion.angular_velocity, jnp.asarray(sun_eci)),
    )
    return Truth(t=t_s, error=float(motion.error or 0.0), **values)


@eqx.filter_jit
def _observe(craft, surroundings, albedo, radius, samples):
    t, q, w, sun = samples
    table = surroundings(t)
    light = tabulate_light(
        surroundings.orbit,
        t,
        sun,
        shadow=CylinderShadow(radius),
        specular=SpecularAlbedo(radius),
        diffuse=DiffuseAlbedo(radius),
    )
    none = jnp.zeros_like(albedo.specular)

    def at(q, position, b_field, light):
        x_axis = jnp.array([1.0, 0.0, 0.0], dtype=q.dtype)
        b_body = quaternion.rotate_inverse(q, b_field)
        return {
            "b_field_body": b_body,
            "direct_current": direct_currents(q, craft.panels, light),
            "specular_current": albedo_currents(q, craft.panels, Albedo(albedo.specular, none), light),
            "diffuse_current": albedo_currents(q, craft.panels, Albedo(none, albedo.diffuse), light),
            "sun_magnetic": sun_magnetic_angles(q, b_field, light.sun_eci),
            "sun_angle": angle_between(x_axis, quaternion.rotate_inverse(q, light.sun_eci)),
            "sun_field_angle": angle_between(b_field, light.sun_eci),
            "limb": jnp.stack([limb_distance(q, position, radius), limb_turn(q, position)]),
        }

    _, velocity = jax.vmap(surroundings.orbit)(t)
    return {
        "quaternion": q,
        "angular_velocity": w,
        "position_eci": table.position_eci,
        "velocity_eci": velocity,
        "b_field_eci": table.b_field_eci,
        "sun_eci": sun,
        "illumination": light.illumination,
        **jax.vmap(at)(q, table.position_eci, table.b_field_eci, light),
    }


def truth_document(
    truth: Truth, spacecraft: Spacecraft, albedo: Albedo, epoch: Epoch, *, elements: Mapping[str, float], **more: Any
) -> dict[str, Any]:
    """Returns truth as plain data: settings under `cfg`, then arrays over the samples; angles in degrees.

    `elements` are those of the orbit at t = 0, keys and units as the leaves of `KeplerOrbit` with `mu`; `more` are
    further settings, among them `cadence`, `noise`, `clip` and `tle`. Currents are before limiting and noise [mA].
    """
    turn = math.radians(360.0)
    rods = required(spacecraft.rods, "truth_document", "Spacecraft.rods", "the rods, as MagneticRods")
    panels = required(spacecraft.panels, "truth_document", "Spacecraft.panels", "the panels, as SolarPanels")
    rate = math.sqrt(elements["mu"] / elements["semi_major_axis"] ** 3)
    cfg = {
        "start": epoch.iso(3).removesuffix(".000"),
        "elements": {
            "a": elements["semi_major_axis"],
            "e": elements["eccentricity"],
            "i": math.degrees(elements["inclination"]),
            "raan": math.degrees(elements["raan"]),
            "argp": math.degrees(elements["argument_of_perigee"]),
            "t_peri": (-elements["mean_anomaly"] % turn) / rate,
        },
        "q0": truth.quaternion[0],
        "w0": truth.angular_velocity[0],
        "inertia": spacecraft.inertia,
        "magnet": spacecraft.magnet,
        "rods": rods.moments,
        "rod_reference_field": rods.reference_field,
        "imax": 1e3 * panels.max_current,
        "panel_ratio": panels.gains,
        "albedo_specular": albedo.specular,
        "albedo_diffuse": albedo.diffuse,
        **more,
    }
    document = {
        "schema": SCHEMA,
        "cfg": cfg,
        "t": truth.t,
        "q": truth.quaternion,
        "w": truth.angular_velocity,
        "theta": np.degrees(truth.sun_magnetic[:, 0]),
        "sun": truth.sun_eci[0],
        "sun_eci": truth.sun_eci,
        "lit": np.asarray(truth.illumination) > 0.5,
        "currents_clean": 1e3 * truth.current,
    }
    return {key: _plain(value) for key, value in document.items()}


def _plain(value: Any) -> Any:
    if isinstance(value, Mapping):
        return {key: _plain(item) for key, item in value.items()}
    return np.asarray(value).tolist() if isinstance(value, np.ndarray | np.generic | jax.Array) else value
