"""A satellite turned about one axis: what its panels see then, and where the turn is counted from.

Turned about a fixed line, a panel's cosine to a fixed light is a constant plus a sinusoid of the angle. A search over
the angle needs these three numbers of each panel and no rotation at all.
"""

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from fitting.local.shares import Limit, LocalFit, explained, factors_from_products, patterns
from jaxsat.environment import LightTable
from jaxsat.estimation.vectors import triad
from jaxsat.math import cross, quaternion, safe_norm, unit
from jaxsat.sensors.solar_panels import Albedo
from jaxsat.spacecraft import SolarPanels


class PanelSinusoids(eqx.Module):
    """Cosines of panels to lights as constant + cosine cos(angle) + sine sin(angle), times the strengths; Sun first."""

    constant: Float[Array, "lights panels"]
    cosine: Float[Array, "lights panels"]
    sine: Float[Array, "lights panels"]

    def patterns(self, angle: Float[Array, ""]) -> tuple[Float[Array, " panels"], Float[Array, " panels"]]:
        """Currents of direct and of returned sunlight [A] after a turn [rad]; as `shares.patterns` there."""
        seen = self.constant + self.cosine * jnp.cos(angle) + self.sine * jnp.sin(angle)
        lit = jnp.maximum(seen, 0.0)
        return lit[0], jnp.sum(lit[1:], axis=0)

    def squares(
        self, c: Float[Array, " angles"], s: Float[Array, " angles"], measured: Float[Array, " panels"], limit: Limit
    ) -> Float[Array, " angles"]:
        """Sum of squares that the best factors leave of the measured currents [A^2], to 1e-16 of their own.

        The angles are given by their cosines and sines, which cost more than all the rest.
        """
        zero = jnp.zeros_like(c)
        ff = fs = ss = fm = sm = zero
        # A loop over the panels, so that each array is as long as the angles and no sum is over six numbers.
        for k in range(measured.shape[0]):
            seen = self.constant[:, k, None] + self.cosine[:, k, None] * c[None] + self.sine[:, k, None] * s[None]
            lit = jnp.maximum(seen, 0.0)
            direct, albedo = lit[0], jnp.sum(lit[1:], axis=0)
            second = albedo if limit is None else direct + limit * albedo
            ff, fs, ss = ff + direct * direct, fs + direct * second, ss + second * second
            fm, sm = fm + direct * measured[k], sm + second * measured[k]
        a, b = factors_from_products(ff, fs, ss, fm, sm)
        # At the best factors the residual is across the model, whichever bounds hold.
        return jnp.maximum(measured @ measured - (a * fm + b * sm), zero)


def panel_sinusoids(
    q_inertial_from_body: Float[Array, "4"],
    axis_body: Float[Array, "3"],
    panels: SolarPanels,
    earth: Albedo,
    light: LightTable,
) -> PanelSinusoids:
    """Those of a turn from an attitude about a unit vector of the body, right-handed as in `attitude_after`."""
    normals = panels.normals @ quaternion.to_dcm(q_inertial_from_body).T
    axis = quaternion.rotate(q_inertial_from_body, axis_body)
    toward = jnp.concatenate([light.sun_eci[None], light.specular_direction_eci[None], light.diffuse_direction_eci])
    strength = jnp.concatenate(
        [
            light.illumination[None],
            (earth.specular * light.specular_factor)[None],
            earth.diffuse * light.diffuse_weight,
        ]
    )
    along_axis = (toward @ axis)[:, None] * (normals @ axis)[None]
    at_zero = toward @ normals.T
    quarter = toward @ cross(jnp.broadcast_to(axis, normals.shape), normals).T
    scale = strength[:, None] * (panels.max_current * panels.gains)[None]
    return PanelSinusoids(scale * along_axis, scale * (at_zero - along_axis), scale * quarter)


def attitude_after(
    q_inertial_from_body: Float[Array, "4"], axis_eci: Float[Array, "3"], angle: Float[Array, ""]
) -> Float[Array, "4"]:
    """The attitude after the satellite has turned by `angle` [rad] about an inertial unit vector, right-handed.

    The rotation of Penkov et al. (2009, sec. 3.3), there as a matrix.
    """
    return quaternion.multiply(quaternion.from_rotation_vector(angle * axis_eci), q_inertial_from_body)


def initial_attitude(axis_eci: Float[Array, "3"], axis_body: Float[Array, "3"]) -> Float[Array, "4"]:
    """Attitude with a body vector along an inertial one, from which the programs `OrB` and `OrS` count their turn.

    With body x along the axis, body y is parallel to the plane OXY, or, where the axis is within 45.6 deg of Z, to OYZ
    (Penkov et al. 2009, sec. 3.3: |Z| <= 0.7, their rule for `orsaij0` with the modulus added, as it fails at -Z too).
    So it is with another body vector where y can be in that plane, else y is as near to it as it can; z takes the place
    of y where that is nearly the body vector. Neither vector need be a unit.
    """
    toward, own = unit(axis_eci), unit(axis_body)
    eye = jnp.eye(3, dtype=toward.dtype)
    normal = jnp.where(jnp.abs(toward[2]) <= 0.7, eye[2], eye[0])
    second = jnp.where(jnp.abs(own[1]) <= 0.9, eye[1], eye[2])
    # Directions of the plane, near the axis and across it: the second vector is as far from the axis as in the body.
    near, across = toward - (normal @ toward) * normal, unit(cross(normal, toward))
    share = (own @ second) / safe_norm(near)
    left = 1.0 - share**2
    aside = jnp.where(left > 0.0, jnp.sqrt(jnp.where(left > 0.0, left, 1.0)), 0.0)
    return triad(own, second, toward, share * unit(near) + aside * across)


class TurnedSample(eqx.Module):
    """A satellite turned by some angles about an axis, against the currents of one sample."""

    fit: LocalFit
    direct: Float[Array, "*angles panels"]
    """Modelled currents of direct sunlight, their factor in [A]."""
    albedo: Float[Array, "*angles panels"]
    """Those of the Earth's light [A]."""
    field_body: Float[Array, "*angles 3"]
    """What three magnetometers would read, body axes [T]; an output of `OrS`."""


def turned_sample(
    angles: Float[Array, " angles"],
    axis_eci: Float[Array, "3"],
    axis_body: Float[Array, "3"],
    measured: Float[Array, " panels"],
    b_field_eci: Float[Array, "3"],
    panels: SolarPanels,
    earth: Albedo,
    light: LightTable,
    max_albedo: Limit = None,
) -> TurnedSample:
    """What `OrB` (axis along the field) and `OrS` (to the Sun) show for angles [rad] from `initial_attitude`."""
    base, axis = initial_attitude(axis_eci, axis_body), unit(axis_eci)

    def at(angle):
        q = attitude_after(base, axis, angle)
        fit = explained(q, measured, panels, earth, light, max_albedo)
        direct, albedo = patterns(q, panels, earth, light)
        field_body = quaternion.rotate_inverse(q, b_field_eci)
        return TurnedSample(fit, fit.direct * direct, fit.albedo * albedo, field_body)

    return jax.vmap(at)(angles)
