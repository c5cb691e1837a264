"""Where a quantity whose values and slopes are known at both ends of a step falls through zero."""

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Float

LOOKS = 8
"""Parts of a step in which a zero is looked for."""
NEVER = 3.0
"""The share of a step at which there is none."""


class Cubic(eqx.Module):
    """The polynomial through value and slope over the step at both ends; of the share of the step that is done."""

    value: Float[Array, " n"]
    slope: Float[Array, " n"]
    end_value: Float[Array, " n"]
    end_slope: Float[Array, " n"]

    @property
    def _square(self):
        return 3.0 * (self.end_value - self.value) - 2.0 * self.slope - self.end_slope

    @property
    def _cube(self):
        return self.slope + self.end_slope - 2.0 * (self.end_value - self.value)

    def at(self, share: float | Float[Array, " n"]) -> Float[Array, " n"]:
        """Its value."""
        return self.value + share * (self.slope + share * (self._square + share * self._cube))

    def since(self, share: Float[Array, " n"]) -> Float[Array, " n"]:
        """Its integral over the rest of the step."""

        def integral(x):
            return x * (self.value + x * (self.slope / 2.0 + x * (self._square / 3.0 + x * self._cube / 4.0)))

        return integral(1.0) - integral(share)

    def first_fall(self) -> Float[Array, " n"]:
        """Share of the step at which it first falls from above zero to zero or below; NEVER where it does not."""
        looked = [self.value, *(self.at(k / LOOKS) for k in range(1, LOOKS)), self.end_value]
        left, high, low = jnp.full_like(self.value, NEVER), self.value, self.end_value
        for k in range(LOOKS - 1, -1, -1):
            falls = (looked[k] > 0.0) & (looked[k + 1] <= 0.0)
            left = jnp.where(falls, k / LOOKS, left)
            high, low = jnp.where(falls, looked[k], high), jnp.where(falls, looked[k + 1], low)
        falls = left < NEVER
        begin = jnp.where(falls, left, 0.0)
        root = begin + high / jnp.where(falls, high - low, 1.0) / LOOKS
        for _ in range(4):
            steep = self.slope + root * (2.0 * self._square + root * 3.0 * self._cube)
            newton = root - self.at(root) / jnp.where(steep == 0.0, 1.0, steep)
            root = jnp.minimum(jnp.maximum(newton, begin), begin + 1.0 / LOOKS)
        return jnp.where(falls, root, NEVER)
