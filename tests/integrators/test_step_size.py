"""The bound on the step: its coefficient from growth factors, its promise from a turn at a constant rate."""

import math
from fractions import Fraction

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from jaxsat.integrators import DORMAND_PRINCE_8, RK4, StepGrid, integrate, step_for, tableau_step
from jaxsat.integrators.step_size import turn_error_coefficient
from jaxsat.math import quaternion

METHODS = {"RK4": RK4, "DP8": DORMAND_PRINCE_8}


def test_coefficients_of_the_growth_factor():
    """RK4 multiplies by 1 + z + z^2/2 + z^3/6 + z^4/24, which lacks z^5/120; DP8 by rational arithmetic."""
    assert turn_error_coefficient(RK4) == pytest.approx(1 / 120, rel=1e-12)
    # b A^8 1 in rationals of the same floats: nothing is lost.
    slopes = [Fraction(1)] * 12
    for _ in range(8):
        slopes = [sum((Fraction(a) * slopes[j] for j, a in row.items()), Fraction(0)) for row in DORMAND_PRINCE_8.rows]
    growth = sum(Fraction(b) * slopes[j] for j, b in DORMAND_PRINCE_8.weights.items())
    exact = abs(float(growth - Fraction(1, math.factorial(9))))
    # The products in floats are good to 1e-15 of sums of 1e-5.
    assert turn_error_coefficient(DORMAND_PRINCE_8) == pytest.approx(exact, abs=1e-18)


@jax.jit(static_argnums=0)
def turned(name, lengths, rate):
    axis = jnp.asarray([1.0, 0.0, 0.0])

    def spin(q, point):
        return 0.5 * quaternion.times_vector(q, rate * axis)

    def advance(q, h, points):
        return quaternion.normalize(tableau_step(METHODS[name], spin, q, h, points))

    stride = len(METHODS[name].inner_nodes) + 1
    return integrate(advance, jnp.asarray([1.0, 0, 0, 0]), jnp.zeros(stride * lengths.shape[0] + 1), lengths)


def turn_error(name, rate, duration, tolerance):
    """Attitude error of a turn at a constant rate, at the step that the bound allows."""
    h = step_for(METHODS[name], rate, duration, tolerance)
    grid = StepGrid.through(np.array([duration]), start=0.0, max_step=h, tableau=METHODS[name], pad_steps=512)
    q = turned(name, jnp.asarray(grid.step), jnp.asarray(rate))[grid.sample_index[0]]
    # Exact half-angle; the turn is about body x.
    w, x = float(q[0]), float(q[1])
    half = 0.5 * rate * duration
    return 2 * abs(np.arctan2(x * np.cos(half) - w * np.sin(half), w * np.cos(half) + x * np.sin(half)))


@pytest.mark.parametrize(
    ("rate", "duration", "tolerance"),
    [(0.011, 4500.0, 1e-5), (0.05, 1000.0, 1e-3), (0.05, 1000.0, 1e-6), (1.0, 20.0, 1e-4)],
)
def test_bound_on_the_step_holds_and_is_not_timid(rate, duration, tolerance):
    error = turn_error("RK4", rate, duration, tolerance)
    # The bound is the leading term of the error: the rest is a few per cent.
    assert 0.9 * tolerance < error <= tolerance


@pytest.mark.parametrize(
    ("rate", "duration", "tolerance"), [(0.05, 4500.0, 1e-6), (0.05, 4500.0, 1e-9), (1.0, 200.0, 1e-8)]
)
def test_bound_for_order_eight(rate, duration, tolerance):
    error = turn_error("DP8", rate, duration, tolerance)
    assert 0.5 * tolerance < error <= tolerance


def test_bound_scales_as_the_order_says():
    for tableau in (RK4, DORMAND_PRINCE_8):
        h = step_for(tableau, 0.02, 1000.0, 1e-6)
        p = tableau.order
        assert step_for(tableau, 0.02, 1000.0, 1e-6 / 2**p) == pytest.approx(h / 2)
        assert step_for(tableau, 0.02, 1000.0 * 2**p, 1e-6) == pytest.approx(h / 2)
        # Twice as fast for half as long: the same motion on half the scale.
        assert step_for(tableau, 0.04, 500.0, 1e-6) == pytest.approx(h / 2)
