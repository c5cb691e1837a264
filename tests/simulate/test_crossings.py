"""The first fall of a cubic through zero against the roots that NumPy finds."""

import jax.numpy as jnp
import numpy as np
import pytest

from jaxsat.simulate.lanes.crossings import NEVER, Cubic


def of(*roots, scale=1.0):
    """The cubic with these roots: values and slopes at both ends."""
    p = np.poly1d(roots, r=True) * scale
    return Cubic(*(jnp.asarray([float(f(x))]) for x in (0.0, 1.0) for f in (p, p.deriv()))), p


@pytest.mark.parametrize(
    ("roots", "scale", "expected"),
    [
        ((0.3, 1.7, -0.4), 1.0, 0.3),
        ((0.5, -1.0, 3.0), 2.0, 0.5),
        ((0.2, 0.4, 0.9), -1.0, 0.2),
        ((0.2, 0.4, 0.9), 1.0, 0.4),
        ((0.9985, -2.0, 4.0), 1e-6, 0.9985),
        ((1.2, 1.4, 2.0), 1.0, NEVER),
        ((-0.001, -1.0, 3.0), 1.0, NEVER),
    ],
)
def test_first_fall_and_what_is_left_after_it(roots, scale, expected):
    cubic, p = of(*roots, scale=scale)
    found = cubic.first_fall()
    np.testing.assert_allclose(found, [expected], rtol=1e-10)
    if expected != NEVER:
        whole = p.integ()
        np.testing.assert_allclose(cubic.since(found), [whole(1.0) - whole(expected)], rtol=1e-7, atol=1e-14 * scale)
