"""The local methods on a synthetic session of another program: five parameters from six currents, Sun and field."""

import dataclasses
import json

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from fitting.local import sun_and_field
from fitting.local.session import (
    FEW_PANELS,
    NOT_AS_FAR_APART,
    OTHER_WAY,
    LocalSamples,
    solve_field_roll,
    solve_five_parameters,
    solve_sun_field,
)
from fitting.local.shares import mirror_earth, mirror_light
from fitting.local.sun_body import SIDES, possible_sides
from fitting.measurements.sky import Around, sky_at
from jaxsat.bundled import BUNDLED
from jaxsat.environment import igrf_field, orbit_from_perigee_time_km_deg
from jaxsat.math.on_host import angle_between_attitudes
from jaxsat.spacecraft import SolarPanels, box_normals
from jaxsat.time import Epoch

CHOSEN = [0, 1, 4, 7, 13, 15, 17, 40, 45]
"""Five panels lit, four at numbers 7 and 13, fewer at 40; 45 in shadow. The Sun is 80 deg from x at 13."""
TRUTH = json.loads(BUNDLED.with_name("b-specular50.truth.json").read_text())
Q = np.array(TRUTH["q"])[CHOSEN]
ATTITUDE = Rotation.from_quat(Q, scalar_first=True)
SIGMAS = {"sun_sigma": np.radians(10.0), "field_sigma": 5e-7}


@pytest.fixture(scope="module", autouse=True)
def quick_compilation():
    before = jax.config.read("jax_disable_most_optimizations")
    jax.config.update("jax_disable_most_optimizations", True)
    yield
    jax.config.update("jax_disable_most_optimizations", before)


@pytest.fixture(scope="module")
def samples(quick_compilation):
    """Exact currents of some samples; the light and the field are this package's own."""
    e = TRUTH["cfg"]["elements"]
    orbit = orbit_from_perigee_time_km_deg(
        a_km=1e-3 * e["a"], e=e["e"], i_deg=e["i"], raan_deg=e["raan"], argp_deg=e["argp"], t_perigee_s=e["t_peri"]
    )
    t = np.array(TRUTH["t"])[CHOSEN]
    field = igrf_field(Epoch.from_utc(2001, 1, 18, 4, 54, 15.0).decimal_year())
    angle, rate, radius = (np.asarray(x) for x in (TRUTH["greenwich0"], 7.2921159e-5, 6371.2e3))
    sky = sky_at(Around(orbit, field, angle, rate, radius, sharp=True), t, sun_eci(), {})
    assert sky.light is not None
    panels = SolarPanels(box_normals(), jnp.asarray(1e-3 * TRUTH["cfg"]["imax"]), jnp.ones(6))
    currents = 1e-3 * np.array(TRUTH["currents_clean"])[CHOSEN]
    return LocalSamples(t, currents, np.array(sky.b_field_eci), mirror_light(sky.light), panels, mirror_earth(), 2e-3)


def sun_eci():
    sun = np.array(TRUTH["sun"])
    return np.tile(sun, (len(CHOSEN), 1)) if sun.ndim == 1 else sun[CHOSEN]


def off_deg(found):
    """[samples found] from the truth."""
    return np.degrees(angle_between_attitudes(found.quaternion, Q[:, None]))


@pytest.mark.slow
def test_exact_currents_give_the_attitude_where_five_panels_are_lit(samples):
    found = solve_five_parameters(samples)
    error = off_deg(found)
    lit = np.sum(samples.currents >= 2e-3, axis=1)
    five, four, few = lit == 5, lit == 4, lit < 4
    assert (five.sum(), four.sum(), few.sum()) == (5, 2, 2)
    # The other program's Sun, field and currents differ in the sixth digit; the ambiguous pair may come first.
    assert np.all(np.nanmin(error[five], axis=1) < 0.05)
    np.testing.assert_allclose(found.albedo[five, 0], 0.5, atol=2e-3)
    np.testing.assert_allclose(found.direct[five, 0], 1.0, atol=1e-3)
    assert np.all(1e3 * found.rms[~few, 0] < 1e-3)
    assert {found.status[k] for k in np.flatnonzero(four)} == {"undetermined"}
    assert np.all(np.isinf(found.sigma[four, 0]))
    assert not found.count[few].any() and np.all(np.isnan(found.quaternion[few]))
    assert {(found.status[k], found.reason[k]) for k in np.flatnonzero(few)} == {("unsolved", FEW_PANELS)}


@pytest.mark.slow
def test_no_light_gives_no_solutions(samples):
    dark = dataclasses.replace(samples, currents=np.zeros_like(samples.currents))
    assert not solve_five_parameters(dark).count.any()


def field_in_body(samples, missing):
    field = ATTITUDE.inv().apply(samples.b_field_eci)
    field[:, missing] = np.nan
    return field


@pytest.fixture(scope="module")
def direct_only(samples):
    """Currents without the light of the Earth: the Sun in body axes is exact."""
    sun = ATTITUDE.inv().apply(sun_eci())
    currents = 0.25 * np.stack([np.maximum(sun, 0.0), np.maximum(-sun, 0.0)], axis=-1).reshape(-1, 6)
    return dataclasses.replace(samples, currents=currents * (samples.currents.max(axis=1, keepdims=True) > 0.0))


@pytest.mark.slow
@pytest.mark.parametrize("missing", [[], [0]], ids=["three axes", "two axes"])
def test_without_albedo_sun_and_magnetometers_are_exact(direct_only, missing):
    found = solve_sun_field(direct_only, field_in_body(direct_only, missing), **SIGMAS)
    shadow = CHOSEN.index(45)
    assert (found.status[shadow], found.reason[shadow]) == ("unsolved", sun_and_field.STATUSES[sun_and_field.NO_SUN])
    assert found.count[shadow] == 0 and np.all(np.isnan(found.quaternion[shadow]))
    lit = np.arange(len(CHOSEN)) != shadow
    # arccos of a rounded one: 1e-8 rad.
    assert np.all(np.nanmin(off_deg(found)[lit], axis=1) < 1e-5)
    assert np.all(found.count[lit] == 1) or missing
    assert np.all((found.count[lit] == 2) == (np.array(found.status)[lit] == "ambiguous"))


@pytest.mark.slow
def test_albedo_moves_the_sun_and_a_sun_across_x_leaves_its_sign(samples):
    field_body = field_in_body(samples, [0])
    found = solve_sun_field(samples, field_body, **SIGMAS)
    lit = samples.currents.max(axis=1) > 2e-3
    # Spherical triangle: a Sun moved by e, at the distance d from the field, turns about it by asin(sin e/sin d) at
    # most; the field's own weight leaves 2 % of e across.
    sun, c = ATTITUDE.inv().apply(sun_eci()), samples.currents
    seen = np.where(c[:, 0::2] >= c[:, 1::2], c[:, 0::2], -c[:, 1::2])[lit]
    moved = np.arccos(np.sum(seen * sun[lit], axis=1) / np.linalg.norm(seen, axis=1))
    field = samples.b_field_eci[lit]
    across = np.linalg.norm(np.cross(sun_eci()[lit], field), axis=1) / np.linalg.norm(field, axis=1)
    bound = np.degrees(np.arcsin(np.minimum(np.sin(moved) / across, 1.0)) + 0.03 * moved)
    assert np.all(np.nanmin(off_deg(found)[lit], axis=1) < bound) and np.median(bound) < 10.0
    # 80 deg from x the Sun does not tell the sign, and the mirrored attitude explains the currents as well.
    across_x = CHOSEN.index(13)
    assert found.status[across_x] == "ambiguous" and found.count[across_x] == 2
    assert "either sign" in found.reason[across_x]
    assert np.nanmin(off_deg(found)[across_x]) < 10.0 and 130.0 < np.nanmax(off_deg(found)[across_x])
    # The satellite's magnet holds x within 39 deg of the field: that is the sign.
    along = solve_sun_field(samples, field_body, **SIGMAS, directions=(1.0,))
    assert np.all(along.count[lit] == 1) and np.all(off_deg(along)[lit, 0] < bound)
    against = solve_sun_field(samples, field_body, **SIGMAS, directions=(-1.0,))
    refused = np.flatnonzero(np.array(found.status) == "solved")
    assert len(refused) and {against.reason[k] for k in refused} == {OTHER_WAY}
    assert not against.count[refused].any() and against.count[across_x] == 1


@pytest.mark.slow
def test_a_magnet_on_any_axis_and_one_that_is_not_on_the_field(samples):
    """Sunlight alone on satellites whose body z is on the field's line."""
    # Columns: body axes; x is across the field, towards the Sun's side but for a turn that differs from row to row.
    z = samples.b_field_eci / np.linalg.norm(samples.b_field_eci, axis=1, keepdims=True)
    y = np.cross(z, sun_eci())
    y /= np.linalg.norm(y, axis=1, keepdims=True)
    true = Rotation.from_matrix(np.stack([np.cross(y, z), y, z], axis=-1))
    true = true * Rotation.from_rotvec(np.linspace(0.3, 5.0, len(z))[:, None] * [0.0, 0.0, 1.0])
    sun = true.inv().apply(sun_eci())
    currents = 0.23 * np.stack([np.maximum(sun, 0.0), np.maximum(-sun, 0.0)], axis=-1).reshape(-1, 6)
    currents[CHOSEN.index(45)] = 0.0
    here = dataclasses.replace(samples, currents=currents, axis_body=np.array([0.0, 0.0, 1.0]))
    found = solve_field_roll(here)
    lit = np.arange(len(CHOSEN)) != CHOSEN.index(45)
    off = np.degrees(angle_between_attitudes(found.quaternion, true.as_quat(scalar_first=True)[:, None]))[lit]
    # The last scan of rolls steps by 0.001 deg; another roll may explain three currents as well.
    assert np.all(np.nanmin(off, axis=1) < 0.01)
    assert found.fits and found.axis_off == 0.0 and {"solved", "unsolved"} <= set(found.status)
    # Body x taken for the magnet's axis: the residuals say so, and no attitude passes for solved.
    wrong = solve_field_roll(dataclasses.replace(here, axis_body=np.array([1.0, 0.0, 0.0])))
    assert not wrong.fits and wrong.axis_off is not None and wrong.axis_off > np.radians(10.0)
    assert {status for status, one in zip(wrong.status, lit, strict=True) if one} == {"does not fit"}


@pytest.mark.slow
def test_a_field_that_contradicts_the_sun_does_not_fit(samples):
    field_body = field_in_body(samples, [])
    first = int(np.flatnonzero(samples.currents.max(axis=1) > 2e-3)[0])
    field_body[first] *= -1.0
    found = solve_sun_field(samples, field_body, sun_sigma=np.radians(1.0), field_sigma=5e-7)
    assert (found.status[first], found.reason[first]) == ("does not fit", NOT_AS_FAR_APART)


def test_either_panel_of_a_pair_may_be_the_suns():
    currents = 1e-3 * np.array([[13.0, 16, 0, 216, 0, 128], [13.0, 1, 0, 216, 0, 128], [13.0, 16, 20, 216, 9, 128]])
    allowed = possible_sides(currents, 2e-3)
    np.testing.assert_array_equal(allowed.sum(axis=1), [2, 1, 8])
    np.testing.assert_array_equal(SIDES[allowed[1]], [[True, False, False]])
    np.testing.assert_array_equal(SIDES[allowed[0]], [[True, False, False], [False, False, False]])
