"""Names of free parameters, the map to physical values, its gauge and its bounds."""

import dataclasses

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from fitting.parameters import (
    MODEL,
    STATE,
    TO_UNIT,
    UNITS,
    Nominal,
    Parametrization,
    PriorSigma,
    build_model,
    parametrization,
    parse_free,
)
from jaxsat.errors import InputError

MAGNET = ("magnet.x", "magnet.y", "magnet.z")
RODS = ("rods.y", "rods.z")
INERTIA = ("inertia.xx", "inertia.yy", "inertia.zz", "inertia.xy", "inertia.xz", "inertia.yz")
GAINS = ("gains.+x", "gains.-x", "gains.+y", "gains.-y", "gains.+z", "gains.-z")
ALBEDO = ("albedo.specular", "albedo.diffuse")
EVERYTHING = "magnet,rods,imax,gains,inertia,albedo"

NOMINAL = Nominal(
    magnet=np.array([0.3, 0.0, 0.04]),
    rods=np.array([0.03, 0.02]),
    reference_field=3e-5,
    inertia=np.array([0.05, 0.06, 0.07, 0.001, -0.002, 0.003]),
    max_current=0.24,
    gains=np.array([1.0, 1.1, 0.9, 1.0, 1.05, 0.95]),
    albedo=np.array([0.1, 0.3]),
)
VALUES = np.array(
    [0.3, 0, 0.04, 0.03, 0.02, 0.05, 0.06, 0.07, 0.001, -0.002, 0.003, 0.24, 1, 1.1, 0.9, 1, 1.05, 0.95, 0.1, 0.3]
)
MEAN_INERTIA = 0.06
SIGMA = np.array([0.05] * 5 + [0.15 * MEAN_INERTIA] * 6 + [0.2 * 0.24] + [0.1] * 6 + [0.5] * 2)


def some(free: str) -> Parametrization:
    return parametrization(NOMINAL, parse_free(free), PriorSigma())


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("state", ()),
        ("als", ()),
        ("magnet", MAGNET),
        ("rods", RODS),
        ("imax", ("imax",)),
        ("gains", GAINS),
        ("inertia", INERTIA),
        ("albedo", ALBEDO),
        (EVERYTHING, (*MAGNET, *RODS, *INERTIA, "imax", *GAINS, *ALBEDO)),
        ("albedo,imax , rods, magnet", (*MAGNET, *RODS, "imax", *ALBEDO)),
        ("als,albedo", ALBEDO),
        ("alsI0,albedo.specular,alsImax", (*MAGNET, "imax", "albedo.specular")),
        ("gains.-z,gains.+x", ("gains.+x", "gains.-z")),
        ("rate.x,attitude.z", ()),
        ("magnet.y,magnet", MAGNET),
    ],
)
def test_groups_single_names_and_mixtures(text, expected):
    assert parse_free(text) == expected
    assert parse_free(text.split(",")) == expected


@pytest.mark.parametrize("change", [str, str.lower, str.upper], ids=["as printed", "lower", "upper"])
@pytest.mark.parametrize(
    ("names", "expected"),
    [
        (("als",), ()),
        (("alsI0", "alsIO", "als10"), MAGNET),
        (("alsI23",), RODS),
        (("alsImax",), ("imax",)),
        (("alsJ",), INERTIA),
        (("alsI0J", "alsIOJ", "als10J"), (*MAGNET, *INERTIA)),
    ],
)
def test_classic_names_in_every_spelling(names, expected, change):
    assert [parse_free(change(name)) for name in names] == [expected] * len(names)


@pytest.mark.parametrize("bad", ["magnt", "als1", "alsI2", "alsI0I23", "Magnet", "gains.x", "", "als I0"])
def test_unknown_item_is_named_with_what_was_expected(bad):
    with pytest.raises(ValueError) as caught:
        parse_free(f"imax,{bad},nonsense")
    message = str(caught.value)
    assert f"unknown free parameter {bad!r}" in message and "nonsense" not in message
    assert all(name in message for name in ("state", "magnet", "albedo", "alsI0J", "magnet.x"))


def test_every_name_has_a_unit():
    assert set(UNITS) == set(MODEL) | set(STATE) and len(MODEL) == 20
    assert UNITS["imax"] == "mA" and TO_UNIT["imax"] == 1e3
    assert UNITS["rods.y"] == "A m2" and UNITS["inertia.xy"] == "kg m2" and UNITS["gains.+x"] == "1"


def test_values_without_gauge_are_nominal_plus_shift_times_prior():
    rng = np.random.default_rng(0)
    for free in ("rods,gains,inertia,albedo", "magnet,rods,imax,albedo", "state"):
        parameters = some(free)
        assert not parameters.gauged and parameters.names[:6] == STATE
        x = rng.normal(size=len(parameters.free))
        expected = VALUES.copy()
        for name, shift in zip(parameters.free, x, strict=True):
            expected[MODEL.index(name)] += SIGMA[MODEL.index(name)] * shift
        np.testing.assert_allclose(parameters.values(jnp.asarray(x)), expected, rtol=1e-14, atol=1e-17)


def test_gauges_hold_the_magnet_and_the_mean_gain_and_nothing_else():
    parameters = some(EVERYTHING)
    assert parameters.gauged
    x = np.random.default_rng(1).normal(size=20)
    values = np.asarray(parameters.values(jnp.asarray(x)))
    plain = VALUES + SIGMA * x
    assert np.linalg.norm(values[:3]) == pytest.approx(np.hypot(0.3, 0.04), rel=1e-14)
    np.testing.assert_allclose(np.cross(values[:3], plain[:3]), 0.0, atol=1e-16)
    assert np.mean(values[12:18]) == pytest.approx(1.0, rel=1e-14)
    np.testing.assert_allclose(values[12:18] / values[12], plain[12:18] / plain[12], rtol=1e-14)
    np.testing.assert_allclose(np.delete(values[3:], range(9, 15)), np.delete(plain[3:], range(9, 15)), rtol=1e-14)
    # A longer magnet along the same line is the same model, and so are gains all larger: derivatives along both vanish.
    jacobian = np.asarray(jax.jacfwd(parameters.values)(jnp.asarray(x)))
    np.testing.assert_allclose(jacobian[:, :3] @ plain[:3], 0.0, atol=1e-16)
    np.testing.assert_allclose(jacobian[:, 12:18] @ plain[12:18], 0.0, atol=1e-15)
    assert np.linalg.matrix_rank(jacobian) == 18


def test_the_gauge_binds_only_where_all_that_it_ties_is_free():
    assert some("magnet,inertia").gauged and not some("magnet.y,inertia").gauged and not some("inertia,rods").gauged
    partial = some("magnet.y,inertia.xx")
    assert float(partial.values(jnp.array([2.0, 0.5]))[0]) == 0.3


def test_no_magnet_cannot_hold_the_gauge():
    without = dataclasses.replace(NOMINAL, magnet=np.zeros(3))
    with pytest.raises(InputError, match="must hold their common scale"):
        parametrization(without, parse_free("magnet,inertia"), PriorSigma())
    assert not parametrization(without, parse_free("magnet"), PriorSigma()).gauged


def test_bounds_are_those_of_physical_values():
    parameters = some(EVERYTHING)
    lower, upper = parameters.bounds()
    assert np.all(np.isinf(lower[:6])) and np.all(np.isinf(upper[:6]))
    with np.errstate(invalid="ignore"):
        low, high = VALUES + SIGMA * lower[6:], VALUES + SIGMA * upper[6:]
    table = {name: (low[k], high[k]) for k, name in enumerate(MODEL)}
    for name in RODS:
        assert table[name] == (pytest.approx(0.0, abs=1e-17), np.inf)
    for name in ALBEDO:
        assert table[name] == (pytest.approx(0.0, abs=1e-16), pytest.approx(1.5))
    for name in GAINS:
        assert table[name] == (pytest.approx(0.0, abs=1e-15), np.inf)
    for name in INERTIA[:3]:
        assert table[name] == (pytest.approx(0.05 * MEAN_INERTIA), np.inf)
    for name in (*MAGNET, *INERTIA[3:]):
        assert table[name] == (-np.inf, np.inf)
    assert table["imax"] == (pytest.approx(0.05 * 0.24), np.inf)


def test_model_has_each_value_in_its_place():
    spacecraft, albedo = build_model(jnp.asarray(VALUES), jnp.asarray(3e-5))
    expected = [[0.05, 0.001, -0.002], [0.001, 0.06, 0.003], [-0.002, 0.003, 0.07]]
    np.testing.assert_array_equal(spacecraft.inertia, expected)
    np.testing.assert_array_equal(spacecraft.magnet, [0.3, 0.0, 0.04])
    # In the reference field along its axis a rod has the moment of its name.
    field = jnp.array([3e-5, 3e-5, 3e-5])
    np.testing.assert_allclose(spacecraft.rods.dipole(field), [0.0, 0.03, 0.02], rtol=1e-14)
    assert float(spacecraft.panels.max_current) == 0.24 and float(spacecraft.panels.gains[1]) == 1.1
    assert (float(albedo.specular), float(albedo.diffuse)) == (0.1, 0.3)
