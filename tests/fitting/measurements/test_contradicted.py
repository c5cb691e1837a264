"""Light in the computed shadow and darkness outside of it."""

import dataclasses

import jax.numpy as jnp
import numpy as np
import pytest

from fitting.measurements.assembly import usable
from fitting.measurements.contradicted import contradicted

BRIGHT = [0, 1, 4]
"""Of the samples, those with light; 0 to 2 are outside the shadow, 3 is in the penumbra."""


@pytest.fixture(scope="module")
def case(munin_case):
    return munin_case("b-specular50", ["state"], samples=16, only=["albedo.specular"])


def made_up(case, **changes):
    """The problem with other light and brightness, of all channels alike."""
    problem = case.problem
    share = np.ones(len(problem.valid))
    share[3], share[4:] = 0.5, 0.0
    bright = np.zeros(np.shape(problem.bright), bool)
    bright[BRIGHT] = True
    light = dataclasses.replace(problem.sky.light, illumination=jnp.asarray(share))
    sky = dataclasses.replace(problem.sky, light=light)
    return dataclasses.replace(problem, sky=sky, bright=bright, **changes)


def test_a_box_of_panels(case):
    problem = made_up(case)
    found = contradicted(problem)
    assert np.flatnonzero(found[:, 0]).tolist() == [2, 4] and not found[:, 1].any()
    weight = usable(problem, case.samples)[:, 0]
    # What the penumbra makes of a reading is not known, and contradicts nothing.
    assert np.flatnonzero(weight).tolist() == [0, 1, *range(5, 16)]


def test_panels_that_do_not_look_everywhere_may_be_dark(case):
    known = np.array(case.problem.known)
    known[:, 2] = False
    assert np.flatnonzero(contradicted(made_up(case, known=known))[:, 0]).tolist() == [4]


def test_a_sample_with_a_gap_may_be_dark(case):
    known = np.array(case.problem.known)
    known[2, 0] = False
    assert np.flatnonzero(contradicted(made_up(case, known=known))[:, 0]).tolist() == [4]
