"""Panels that never show light: taken for dead where a fit begins, and the others left as bright as they are."""

import jax.numpy as jnp
import numpy as np
import pytest

from fitting.parameters.names import GAINS, parse_free
from fitting.parameters.nominal import Nominal
from fitting.parameters.parametrization import GAINS_SLICE, parametrization
from fitting.settings import PriorSigma
from fitting.starts.first_guesses import filled_in, first_unknowns, silent_panels, sun_direction_body

NOMINAL = Nominal(
    magnet=np.array([0.3, 0.0, 0.0]),
    rods=np.array([0.03, 0.02]),
    reference_field=3e-5,
    inertia=np.array([0.05, 0.06, 0.07, 0.0, 0.0, 0.0]),
    max_current=0.24,
    gains=np.array([1.0, 1.1, 0.9, 1.0, 1.05, 0.95]),
    albedo=np.zeros(2),
)
SUN_BODY = np.array([0.5, 0.1, -np.sqrt(0.74)])


def parameters(free):
    return parametrization(NOMINAL, parse_free(free), PriorSigma())


def box_currents(sun, dead=None):
    normals = np.repeat(np.eye(3), 2, axis=0) * np.tile([1.0, -1.0], 3)[:, None]
    currents = 0.24 * np.maximum(normals @ sun, 0.0)
    if dead is not None:
        currents[dead] = 0.0
    return currents


def currents_of_dead() -> float:
    """What panel -z would show."""
    return float(box_currents(SUN_BODY)[5])


def test_only_a_panel_dark_in_every_sample_with_a_free_gain_is_silent():
    currents = [box_currents(SUN_BODY, dead=5), box_currents(-SUN_BODY, dead=5)]
    np.testing.assert_array_equal(silent_panels(np.array(currents), 2e-3, parameters("gains")), np.arange(6) == 5)
    assert not silent_panels(np.array(currents), 2e-3, parameters("magnet")).any()
    assert not silent_panels(
        np.array([box_currents(SUN_BODY), box_currents(-SUN_BODY)]), 2e-3, parameters("gains")
    ).any()
    assert not silent_panels(np.zeros((3, 6)), 2e-3, parameters("gains")).any()


def test_the_sun_on_a_dead_panel_is_found_from_the_others():
    currents = [box_currents(SUN_BODY, dead=5), box_currents(-SUN_BODY, dead=5)]
    filled = filled_in(np.array(currents), 2e-3, np.arange(6) == 5, 0.24)
    np.testing.assert_allclose(sun_direction_body(jnp.asarray(filled[0])), SUN_BODY, atol=1e-12)
    # With the Sun on the other side the opposite panel says so, and nothing is filled in.
    np.testing.assert_array_equal(filled[1], currents[1])
    # Light of the Earth on the opposite panel is not the Sun, and currents beyond the largest leave nothing.
    earthlit = np.array(currents[:1])
    earthlit[0, 4] = 0.05
    np.testing.assert_allclose(filled_in(earthlit, 2e-3, np.arange(6) == 5, 0.24)[0, 5], currents_of_dead(), rtol=1e-12)
    bright = 2.0 * np.array(currents)
    np.testing.assert_array_equal(filled_in(bright, 2e-3, np.arange(6) == 5, 0.12), bright)


@pytest.mark.parametrize("free", ["gains", "gains,imax"])
def test_a_dead_panel_leaves_the_others_as_bright_as_they_are(free):
    own = parameters(free)
    x = first_unknowns(own, np.arange(6) == 3)
    values = np.asarray(own.values(jnp.asarray(x[6:])))
    current = values[11] * values[GAINS_SLICE]
    expected = 0.24 * NOMINAL.gains * (np.arange(6) != 3)
    np.testing.assert_allclose(current, expected, rtol=1e-12, atol=1e-15)
    assert x[own.names.index(GAINS[3])] == pytest.approx(-10.0) and not first_unknowns(own, np.zeros(6, bool)).any()
