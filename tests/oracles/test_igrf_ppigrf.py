"""The main field against ppigrf, an independent implementation in spherical coordinates."""

import datetime

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest

from jaxsat.environment import igrf_field
from jaxsat.time import Epoch

evaluate = eqx.filter_jit(lambda field, points: jax.vmap(field)(points))
ppigrf = pytest.importorskip("ppigrf")


@pytest.mark.parametrize("date", [(1913, 7, 3), (1999, 12, 31), (2001, 1, 18), (2012, 2, 29), (2027, 6, 1)])
def test_random_points(date):
    rng = np.random.default_rng(date[0])
    r_km, colatitude, longitude = rng.uniform(6371.2, 9000, 40), rng.uniform(0.1, 179.9, 40), rng.uniform(-180, 180, 40)
    expected = np.stack([x[0] for x in ppigrf.igrf_gc(r_km, colatitude, longitude, datetime.datetime(*date))])

    theta, phi = np.radians(colatitude), np.radians(longitude)
    st, ct, sp, cp = np.sin(theta), np.cos(theta), np.sin(phi), np.cos(phi)
    axes = np.stack([[st * cp, st * sp, ct], [ct * cp, ct * sp, -st], [-sp, cp, 0 * phi]]).transpose(2, 0, 1)
    # Before 1960 there is no UTC: the calendar alone dates the model.
    start = datetime.date(date[0], 1, 1)
    days = (datetime.date(date[0] + 1, 1, 1) - start).days
    year = date[0] + (datetime.date(*date) - start).days / days
    if date[0] >= 1960:
        assert Epoch.from_utc(*date).decimal_year() == pytest.approx(year, abs=1e-12)
    b_field = evaluate(igrf_field(year), jnp.asarray(1e3 * r_km[:, None] * axes[:, 0]))
    np.testing.assert_allclose(np.einsum("nij,nj->in", axes, b_field) * 1e9, expected, atol=1e-6)
