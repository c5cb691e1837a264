"""Names of free parameters, the map to physical values, its gauge and its bounds."""

import dataclasses

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest

from fitting.parameters.names import MODEL, NAMED, STATE, TILTS, TO_UNIT, UNITS, parse_free
from fitting.parameters.nominal import Nominal
from fitting.parameters.parametrization import Parametrization, build_model, parametrization
from fitting.settings import PriorSigma
from jaxsat.errors import InputError
from jaxsat.spacecraft import box_normals

MAGNET = ("magnet.x", "magnet.y", "magnet.z")
RODS = ("rods.y", "rods.z")
INERTIA = ("inertia.xx", "inertia.yy", "inertia.zz", "inertia.xy", "inertia.xz", "inertia.yz")
GAINS = ("gains.+x", "gains.-x", "gains.+y", "gains.-y", "gains.+z", "gains.-z")
ALBEDO = ("albedo.specular", "albedo.diffuse")
POLAR = "magnet.modulus,magnet.azimuth,magnet.elevation"
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
    + [0.0] * 12
)
MEAN_INERTIA = 0.06
SIGMA = np.array([0.05] * 5 + [0.15 * MEAN_INERTIA] * 6 + [0.2 * 0.24] + [0.1] * 6 + [0.5] * 2 + [np.radians(2.0)] * 12)


def some(free: str) -> Parametrization:
    return parametrization(NOMINAL, parse_free(free), PriorSigma())


@eqx.filter_jit
def named_and_slopes(parameters: Parametrization, x):
    """`named`, of which `values` is the beginning, and its derivatives."""
    return parameters.named(x), jax.jacfwd(parameters.named)(x)


def values_of(parameters: Parametrization, x) -> np.ndarray:
    return np.asarray(named_and_slopes(parameters, jnp.asarray(x))[0])[: len(MODEL)]


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
    assert set(UNITS) == set(NAMED) | set(STATE) and len(MODEL) == 32
    assert UNITS["tilts.-x.z"] == UNITS["magnet.azimuth"] == "deg" and TO_UNIT["tilts.-x.z"] == pytest.approx(57.29578)
    assert UNITS["imax"] == "mA" and TO_UNIT["imax"] == 1e3
    assert UNITS["rods.y"] == "A m2" and UNITS["inertia.xy"] == "kg m2" and UNITS["gains.+x"] == "1"


def test_values_without_gauge_are_nominal_plus_shift_times_prior():
    rng = np.random.default_rng(0)
    for free in ("rods,gains,inertia.xx,inertia.yz,albedo", "magnet,rods,imax,albedo,tilts", "state"):
        parameters = some(free)
        assert not parameters.gauged and parameters.names[:6] == STATE
        x = rng.normal(size=len(parameters.free))
        expected = VALUES.copy()
        for name, shift in zip(parameters.free, x, strict=True):
            expected[MODEL.index(name)] += SIGMA[MODEL.index(name)] * shift
        np.testing.assert_allclose(values_of(parameters, x), expected, rtol=1e-14, atol=1e-17)


@pytest.mark.slow
def test_gauges_hold_the_magnet_and_the_mean_gain_and_nothing_else():
    parameters = some(EVERYTHING)
    assert parameters.gauged
    x = np.random.default_rng(1).normal(size=20)
    values = values_of(parameters, x)
    plain = VALUES[:20] + SIGMA[:20] * x
    assert np.linalg.norm(values[:3]) == pytest.approx(np.hypot(0.3, 0.04), rel=1e-14)
    np.testing.assert_allclose(np.cross(values[:3], plain[:3]), 0.0, atol=1e-16)
    assert np.mean(values[12:18]) == pytest.approx(1.0, rel=1e-14)
    np.testing.assert_allclose(values[12:18] / values[12], plain[12:18] / plain[12], rtol=1e-14)
    others = [3, 4, 11, 18, 19]
    np.testing.assert_allclose(values[others], plain[others], rtol=1e-14)
    # A longer magnet along the same line is the same model, and so are gains all larger: derivatives along both vanish.
    jacobian = np.asarray(named_and_slopes(parameters, jnp.asarray(x))[1])[: len(MODEL)]
    np.testing.assert_allclose(jacobian[:, :3] @ plain[:3], 0.0, atol=1e-16)
    np.testing.assert_allclose(jacobian[:, 12:18] @ plain[12:18], 0.0, atol=1e-15)
    assert np.linalg.matrix_rank(jacobian) == 18


def test_a_free_inertia_is_always_that_of_a_body():
    parameters = some("inertia")
    rng = np.random.default_rng(2)
    for x in (*(4.0 * rng.normal(size=(50, 6))), np.zeros(6)):
        xx, yy, zz, xy, xz, yz = values_of(parameters, x)[5:11]
        low, middle, high = np.linalg.eigvalsh([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
        assert low > 0.0 and high < low + middle
    small = 1e-5 * rng.normal(size=6)
    moved = values_of(parameters, small)[5:11] - VALUES[5:11]
    np.testing.assert_allclose(moved, SIGMA[5:11] * small, rtol=1e-3, atol=1e-9 * MEAN_INERTIA)


@pytest.mark.slow
def test_shifts_lead_back_to_values():
    rng = np.random.default_rng(3)
    for free in ("inertia,rods,imax,albedo,tilts", "magnet,rods,gains", POLAR, "inertia.xx,magnet.y"):
        parameters = some(free)
        x = 0.5 * rng.normal(size=len(parameters.free))
        back = parameters.shifts(values_of(parameters, x))
        np.testing.assert_allclose(back, x, rtol=1e-9, atol=1e-11)


def test_a_dipole_by_its_angles_keeps_its_length():
    parameters = some("magnet.azimuth,magnet.elevation")
    values = np.asarray(named_and_slopes(parameters, jnp.array([0.7, -0.4]))[0])
    modulus = np.hypot(0.3, 0.04)
    azimuth, elevation = 0.7 * 0.05 / modulus, np.arctan2(0.04, 0.3) - 0.4 * 0.05 / modulus
    expected = [np.cos(elevation) * np.cos(azimuth), np.cos(elevation) * np.sin(azimuth), np.sin(elevation)]
    np.testing.assert_allclose(values[:3], modulus * np.array(expected), rtol=1e-13)
    np.testing.assert_allclose(values[-3:], [modulus, azimuth, elevation], rtol=1e-13)
    assert not parameters.gauged and some(f"{POLAR},inertia").gauged and not some("magnet.azimuth,inertia").gauged


@pytest.mark.slow
@pytest.mark.parametrize("magnet", [[0.0, 0.0, 0.3], [0.0, 0.0, 0.0], [0.01, 0.0, -0.3]])
def test_no_angles_of_a_dipole_along_z_or_of_none(magnet):
    nominal = dataclasses.replace(NOMINAL, magnet=np.array(magnet))
    with pytest.raises(InputError, match="free the group magnet"):
        parametrization(nominal, parse_free("magnet.azimuth"), PriorSigma())
    plain = parametrization(nominal, parse_free("magnet"), PriorSigma())
    assert np.all(np.isfinite(named_and_slopes(plain, jnp.zeros(3))[1]))


@pytest.mark.slow
def test_derivatives_of_every_map_are_those_of_differences():
    for free in (f"{EVERYTHING},tilts", f"{POLAR},rods,inertia,gains,imax,albedo"):
        parameters = some(free)
        x = 0.4 * np.random.default_rng(5).normal(size=len(parameters.free))
        jacobian = np.asarray(named_and_slopes(parameters, jnp.asarray(x))[1])
        for k, step in enumerate(1e-5 * np.eye(len(x))):
            high, low = (np.asarray(named_and_slopes(parameters, jnp.asarray(x + s * step))[0]) for s in (1.0, -1.0))
            np.testing.assert_allclose(jacobian[:, k], (high - low) / 2e-5, atol=1e-8)


def test_the_gauge_binds_only_where_all_that_it_ties_is_free():
    assert some("magnet,inertia").gauged and not some("magnet.y,inertia").gauged and not some("inertia,rods").gauged
    partial = some("magnet.y,inertia.xx")
    assert values_of(partial, [2.0, 0.5])[0] == 0.3


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
        low, high = VALUES[:20] + SIGMA[:20] * lower[6:], VALUES[:20] + SIGMA[:20] * upper[6:]
    table = {name: (low[k], high[k]) for k, name in enumerate(MODEL[:20])}
    for name in RODS:
        assert table[name] == (pytest.approx(0.0, abs=1e-17), np.inf)
    for name in ALBEDO:
        assert table[name] == (pytest.approx(0.0, abs=1e-16), pytest.approx(1.5))
    for name in GAINS:
        assert table[name] == (pytest.approx(0.0, abs=1e-15), np.inf)
    # A whole inertia stays that of a body without bounds, a part of one does not.
    part, _ = some("inertia.xx,inertia.xy").bounds()
    assert 0.05 + SIGMA[5] * part[6] == pytest.approx(0.05 * MEAN_INERTIA) and part[7] == -np.inf
    for name in (*MAGNET, *INERTIA):
        assert table[name] == (-np.inf, np.inf)
    assert table["imax"] == (pytest.approx(0.05 * 0.24), np.inf)


def test_model_has_each_value_in_its_place():
    spacecraft, panels, albedo = build_model(jnp.asarray(VALUES), jnp.asarray(3e-5))
    expected = [[0.05, 0.001, -0.002], [0.001, 0.06, 0.003], [-0.002, 0.003, 0.07]]
    np.testing.assert_array_equal(spacecraft.inertia, expected)
    np.testing.assert_array_equal(spacecraft.magnet, [0.3, 0.0, 0.04])
    # In the reference field along its axis a rod has the moment of its name.
    field = jnp.array([3e-5, 3e-5, 3e-5])
    assert spacecraft.rods is not None and spacecraft.panels is panels
    np.testing.assert_allclose(spacecraft.rods.dipole(field), [0.0, 0.03, 0.02], rtol=1e-14)
    assert float(panels.max_current) == 0.24 and float(panels.gains[1]) == 1.1
    assert (float(albedo.specular), float(albedo.diffuse)) == (0.1, 0.3)
    np.testing.assert_array_equal(panels.normals, box_normals())
    tilts = dict.fromkeys(TILTS, 0.0) | {"tilts.-y.x": 0.1, "tilts.+z.y": 0.2}
    _, tilted, _ = build_model(jnp.asarray([*VALUES[:20], *tilts.values()]), jnp.asarray(3e-5))
    # A right-handed turn about body x carries -y towards -z, one about y carries z towards x.
    np.testing.assert_allclose(tilted.normals[3], [0.0, -np.cos(0.1), -np.sin(0.1)], atol=1e-15)
    np.testing.assert_allclose(tilted.normals[4], [np.sin(0.2), 0.0, np.cos(0.2)], atol=1e-15)


def test_a_flat_body_moves_entry_by_entry():
    flat = dataclasses.replace(NOMINAL, inertia=np.array([1.0, 2.0, 3.0, 0.0, 0.0, 0.0]))
    parameters = parametrization(flat, parse_free("inertia"), PriorSigma())
    assert not parameters.physical and some("inertia").physical and not some("inertia.xx").physical
    x = np.array([1.0, -0.5, 0.0, 0.2, 0.0, 0.0])
    values = values_of(parameters, x)[5:11]
    np.testing.assert_allclose(values, flat.inertia + 0.15 * 2.0 * x, rtol=1e-14)


def test_azimuths_meet_across_the_half_turn():
    behind = dataclasses.replace(NOMINAL, magnet=np.array([-0.3, 0.001, 0.0]))
    parameters = parametrization(behind, parse_free("magnet.azimuth"), PriorSigma())
    values = behind.vector()
    values[:3] = [-0.3, -0.001, 0.0]
    # 0.38 deg over the half turn, in prior sigmas of 0.05 / 0.3 rad.
    assert parameters.shifts(values)[0] == pytest.approx(2.0 * 0.001 / 0.3 / (0.05 / 0.3), rel=1e-4)


@pytest.mark.slow
def test_a_gauged_modulus_has_no_slope():
    parameters = some(f"{POLAR},inertia,rods")
    slopes = np.asarray(named_and_slopes(parameters, jnp.full(len(parameters.free), 0.3))[1])
    assert not slopes[-3].any() and slopes[-2].any()
