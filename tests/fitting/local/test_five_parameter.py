"""Five parameters from six currents: against the truth of a synthetic session, and where they cannot be told."""

import dataclasses
import json

import jax.numpy as jnp
import numpy as np
import pytest

from fitting.local.session import FEW_PANELS, LocalSamples, solve_five_parameters, solve_sun_field
from fitting.local.shares import mirror_earth, mirror_light
from fitting.local.solutions import angle_between_attitudes
from fitting.local.sun_body import SIDES, possible_sides
from fitting.observations import tabulate
from jaxsat.cli.session import BUNDLED
from jaxsat.environment import igrf_field, orbit_from_perigee_time_km_deg
from jaxsat.spacecraft import SolarPanels, box_normals
from jaxsat.time import Epoch

CHOSEN = (0, 1, 4, 7, 15, 17, 40)
"""Five panels lit, four at number 7, fewer at 40."""


@pytest.fixture(scope="module")
def truth():
    return json.loads(BUNDLED.with_name("b-specular50.truth.json").read_text())


@pytest.fixture(scope="module")
def samples(truth):
    """Exact currents of some samples; the light and the field are this package's own."""
    e = truth["cfg"]["elements"]
    orbit = orbit_from_perigee_time_km_deg(
        a_km=1e-3 * e["a"], e=e["e"], i_deg=e["i"], raan_deg=e["raan"], argp_deg=e["argp"], t_perigee_s=e["t_peri"]
    )
    t, sun = np.array(truth["t"])[list(CHOSEN)], np.array(truth["sun"])
    field = igrf_field(Epoch.from_utc(2001, 1, 18, 4, 54, 15.0).decimal_year())
    numbers = (jnp.asarray(x) for x in (truth["greenwich0"], 7.2921159e-5, 6371.2e3))
    sun = np.broadcast_to(sun if sun.ndim == 1 else sun[list(CHOSEN)], (len(t), 3))
    table, light = tabulate(orbit, field, *numbers, t, t, sun)
    panels = SolarPanels(box_normals(), jnp.asarray(1e-3 * truth["cfg"]["imax"]), jnp.ones(6))
    currents = 1e-3 * np.array(truth["currents_clean"])[list(CHOSEN)]
    return LocalSamples(currents, np.asarray(table.b_field_eci), mirror_light(light), panels, mirror_earth(), 2e-3)


def test_exact_currents_give_the_attitude_where_five_panels_are_lit(samples, truth):
    found = solve_five_parameters(samples)
    error = np.degrees(angle_between_attitudes(found.quaternion, np.array(truth["q"])[list(CHOSEN)][:, None]))
    five = np.sum(samples.currents >= 2e-3, axis=1) == 5
    assert five.sum() == 5
    # The other program's Sun, field and currents differ in the sixth digit; the ambiguous pair may come first.
    assert np.all(np.nanmin(error[five], axis=1) < 0.05)
    np.testing.assert_allclose(found.albedo[five, 0], 0.5, atol=2e-3)
    np.testing.assert_allclose(found.direct[five, 0], 1.0, atol=1e-3)
    assert np.all(1e3 * found.rms[:-1, 0] < 1e-3)
    four = CHOSEN.index(7)
    assert found.status[four] == "undetermined" and np.isinf(found.sigma[four, 0])
    assert found.status[-1] == "unsolved" and found.reason[-1] == FEW_PANELS and found.count[-1] == 0
    assert np.all(np.isnan(found.quaternion[-1]))


def test_no_samples_give_no_solutions(samples):
    dark = dataclasses.replace(samples, currents=np.zeros_like(samples.currents))
    assert not solve_five_parameters(dark).count.any()


def test_sun_and_two_magnetometers_on_exact_data(samples, truth):
    from scipy.spatial.transform import Rotation

    q = np.array(truth["q"])[list(CHOSEN)]
    field_body = Rotation.from_quat(q, scalar_first=True).inv().apply(samples.b_field_eci.copy())
    field_body[:, 0] = np.nan
    found = solve_sun_field(samples, field_body, sun_sigma=0.17, field_sigma=5e-7)
    lit = found.count > 0
    assert lit.all()
    error = np.degrees(angle_between_attitudes(found.quaternion[lit], q[lit][:, None]))
    # The Earth's light on the Sun's own panels bends its direction, by 10 to 20 deg at most (`sun_on_sides`).
    assert np.all(np.nanmin(error, axis=1) < 20.0)


def test_either_panel_of_a_pair_may_be_the_suns():
    currents = 1e-3 * np.array([[13.0, 16, 0, 216, 0, 128], [13.0, 1, 0, 216, 0, 128], [13.0, 16, 20, 216, 9, 128]])
    allowed = possible_sides(currents, 2e-3)
    np.testing.assert_array_equal(allowed.sum(axis=1), [2, 1, 8])
    np.testing.assert_array_equal(SIDES[allowed[1]], [[True, False, False]])
    np.testing.assert_array_equal(SIDES[allowed[0]], [[True, False, False], [False, False, False]])
