"""The values of all leaves of a model by a fit's unknowns: what compiled programs take of the parameters."""

from typing import NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool, Float

from fitting.parameters.transforms import dipole_from_polar, physical_inertia, polar_from_dipole
from jaxsat.math import entries_at, with_entries
from jaxsat.satellites.model import INERTIA_PLACE, MAGNET_PLACE, POLAR_PLACE, Spot


class Gauge(NamedTuple):
    """Leaves whose common size no channel tells while what scales with it is free too."""

    name: str
    """As the satellite file has it: `magnet`, or the gains of a sensor, `cells.gain`."""
    leaves: tuple[int, ...]
    beside: tuple[int, ...]
    """Leaves that must be free with them."""

    def size(self, values: Float[Array, " leaves"]) -> Float[Array, ""]:
        """The modulus of a dipole, the mean of gains."""
        return jnp.sqrt(jnp.sum(values**2)) if self.name == "magnet" else jnp.mean(values)


class FreeLeaves(eqx.Module):
    """The values of all leaves as a function of `x`."""

    nominal: Float[Array | np.ndarray, " leaves"]
    """SI"""
    tangent: Float[Array | np.ndarray, "leaves unknowns"]
    """Change of each leaf for a unit of each unknown after the state; columns of zeros are padding."""
    inertia_root: Float[Array | np.ndarray, "3 3"]
    """`transforms.second_moment_root` of the nominal inertia."""
    inertia_root_inverse: Float[Array | np.ndarray, "3 3"]
    keeps_body: Float[Array | np.ndarray, ""]
    """1 where the inertia stays that of a body whatever the shift, 0 where its entries move by themselves."""
    by_angles: Float[Array | np.ndarray, ""]
    """1 where the dipole moves by its modulus and angles, 0 where by its components."""
    gauge_on: Float[Array | np.ndarray, " gauges"]
    """1 where the size of its leaves is held at the nominal one, for nothing tells it; 0 where it moves."""
    gauges: tuple[Gauge, ...] = eqx.field(static=True)
    spots: tuple[Spot, ...] = eqx.field(static=True)
    moving: int = eqx.field(static=True)
    """Unknowns after the state that move the satellite, padding included."""

    def values(self, x_model: Float[Array, " unknowns"]) -> Float[Array, " leaves"]:
        """Values of all leaves, SI. Differentiable."""
        shift = jnp.asarray(self.tangent) @ x_model
        found = self._dipole_moved(self._inertia_moved(jnp.asarray(self.nominal) + shift, shift))
        length_held = jnp.asarray(False)
        for number, gauge in enumerate(self.gauges):
            index = np.array(gauge.leaves)
            held = jnp.asarray(self.gauge_on)[number] > 0.0
            # A size of zero is divided by where nothing is held.
            own, nominal = entries_at(found, index), entries_at(jnp.asarray(self.nominal), index)
            share = gauge.size(nominal) / jnp.where(held, gauge.size(own), 1.0)
            found = with_entries(found, index, own * jnp.where(held, share, 1.0))
            length_held = held if gauge.name == "magnet" else length_held
        return self._restated(found, length_held)

    def _inertia_moved(self, found: Float[Array, " leaves"], shift: Float[Array, " leaves"]) -> Float[Array, " leaves"]:
        index = self._at(INERTIA_PLACE)
        if len(index) != 6:
            return found
        root, inverse = jnp.asarray(self.inertia_root), jnp.asarray(self.inertia_root_inverse)
        body, own = physical_inertia(root, inverse, entries_at(shift, index)), entries_at(found, index)
        return with_entries(found, index, jnp.where(jnp.asarray(self.keeps_body) > 0.0, body, own))

    def _dipole_moved(self, found: Float[Array, " leaves"]) -> Float[Array, " leaves"]:
        magnet, polar = self._at(MAGNET_PLACE), self._at(POLAR_PLACE)
        if len(polar) != 3:
            return found
        moved, own = dipole_from_polar(entries_at(found, polar)), entries_at(found, magnet)
        return with_entries(found, magnet, jnp.where(jnp.asarray(self.by_angles) > 0.0, moved, own))

    def _restated(self, found: Float[Array, " leaves"], length_held: Bool[Array, ""]) -> Float[Array, " leaves"]:
        """With modulus and angles of the dipole that the components have become."""
        magnet, polar = self._at(MAGNET_PLACE), self._at(POLAR_PLACE)
        if len(polar) != 3:
            return found
        restated = polar_from_dipole(entries_at(found, magnet))
        # Held by definition: no rounding shall pass for a slope.
        length = jnp.where(length_held, jax.lax.stop_gradient(restated[0]), restated[0])
        return with_entries(found, polar, jnp.concatenate([length[None], restated[1:]]))

    def _at(self, place: str) -> np.ndarray:
        """Numbers of the leaves of an array."""
        return np.flatnonzero([each == place for each, _ in self.spots])
