"""The map from a fit's unknowns to a satellite's numbers: its gauges, its bounds, the body's inertia, the dipole."""

from pathlib import Path

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest

from fitting.parameters.chosen import chosen_leaves
from fitting.parameters.free import FreeParameters, free_parameters
from fitting.parameters.names import STATE
from fitting.parameters.tree import FreeLeaves
from jaxsat.errors import InputError
from jaxsat.satellites import Satellite, read_satellite

POLAR = "magnet.modulus,magnet.azimuth,magnet.elevation"
EVERYTHING = "magnet,rods,imax,gains,inertia,albedo"
MODULUS = np.hypot(0.3, 0.04)
MEAN_INERTIA = 0.06
TEXT = """
[body]
inertia_kg_m2 = {{value = {inertia}, sigma = {of_inertia}}}
[magnet]
dipole_A_m2 = {{value = {magnet}, sigma = 0.05}}
[[rods]]
axis = "+y"
moment = {{value = 0.03, sigma = 0.05, bounds = [0.0, 10.0]}}
[[rods]]
axis = "+z"
moment = {{value = 0.02, sigma = 0.05, bounds = [0.0, 10.0]}}
[albedo]
specular = {{value = 0.1, sigma = 0.5}}
diffuse = {{value = 0.3, sigma = 0.5}}
[gauge]
hold = {hold}
[orbit]
tle = "none.tle"
[time]
column = "utc"
[sensors.cells]
kind = "panels"
normals = ["+x", "-x", "+y", "-y", "+z", "-z"]
imax = {{value = 240.0, sigma = 48.0, bounds = [12.0, 1.0e5]}}
gain = {{value = [1.0, 1.1, 0.9, 1.0, 1.05, 0.95], sigma = 0.1}}
tilts_deg = {{value = 0.0, sigma = 2.0}}
[channels.cells]
columns = ["a", "b", "c", "d", "e", "f"]
unit = "mA"
sigma = 2.0
[names]
"cells.imax" = "imax"
"cells.gain" = "gains"
"cells.tilts" = "tilts"
"rods.0.moment" = "rods.y"
"rods.1.moment" = "rods.z"
"""
BODY = [[0.05, 0.001, -0.002], [0.001, 0.06, 0.003], [-0.002, 0.003, 0.07]]
INERTIA = ("inertia.xx", "inertia.yy", "inertia.zz", "inertia.xy", "inertia.xz", "inertia.yz")
MAGNET = ("magnet.x", "magnet.y", "magnet.z")
GAINS = ("gains.+x", "gains.-x", "gains.+y", "gains.-y", "gains.+z", "gains.-z")
NOMINAL = {"magnet.x": 0.3, "magnet.y": 0.0, "magnet.z": 0.04, "rods.y": 0.03, "rods.z": 0.02, "imax": 0.24}
NOMINAL |= dict(zip(INERTIA, (0.05, 0.06, 0.07, 0.001, -0.002, 0.003), strict=True))
NOMINAL |= dict(zip(GAINS, (1.0, 1.1, 0.9, 1.0, 1.05, 0.95), strict=True))
NOMINAL |= {"albedo.specular": 0.1, "albedo.diffuse": 0.3}
SIGMA = {"imax": 0.048, "albedo.specular": 0.5, "albedo.diffuse": 0.5}
SIGMA |= dict.fromkeys(GAINS, 0.1) | dict.fromkeys((*MAGNET, "rods.y", "rods.z"), 0.05)
SIGMA |= dict.fromkeys(INERTIA, 0.15 * MEAN_INERTIA)


def written(folder: Path, *, magnet="[0.3, 0.0, 0.04]", inertia=BODY, of_inertia=0.009, held=True) -> Satellite:
    path = folder / "one.sat.toml"
    hold = '["magnet", "cells.gain"]' if held else "[]"
    path.write_text(TEXT.format(magnet=magnet, inertia=inertia, of_inertia=of_inertia, hold=hold))
    found = read_satellite(path)
    assert isinstance(found, Satellite)
    return found


@pytest.fixture(scope="module")
def satellite(tmp_path_factory) -> Satellite:
    return written(tmp_path_factory.mktemp("parameters"))


def some(satellite: Satellite, free: str) -> FreeParameters:
    names = chosen_leaves(satellite.leaves, free.split(","))
    return free_parameters(satellite.model, satellite.leaves, names, held=satellite.held)


@eqx.filter_jit
def values_and_slopes(tree: FreeLeaves, x):
    return tree.values(x), jax.jacfwd(tree.values)(x)


def unknowns(parameters: FreeParameters, **shifts: float) -> np.ndarray:
    """Unknowns after the state, of which some are given by their names with _ for the dot."""
    names = [name.replace(".", "_") for name in parameters.names[len(STATE) :]]
    x = np.zeros(len(names))
    for name, shift in shifts.items():
        x[names.index(name)] = shift
    return x


def random_unknowns(parameters: FreeParameters, seed: int, size: float = 1.0) -> np.ndarray:
    return size * np.random.default_rng(seed).normal(size=len(parameters.columns)) * (parameters.columns >= 0)


def values(parameters: FreeParameters, x) -> dict[str, float]:
    found = np.asarray(values_and_slopes(parameters.tree, jnp.asarray(x))[0])
    return dict(zip((leaf.name for leaf in parameters.leaves), found.tolist(), strict=True))


def of(found: dict[str, float], names) -> np.ndarray:
    return np.array([found[name] for name in names])


def rows(parameters: FreeParameters, names) -> list[int]:
    every = [leaf.name for leaf in parameters.leaves]
    return [every.index(name) for name in names]


@pytest.mark.parametrize("free", ["rods,gains,inertia.xx,inertia.yz,albedo", "magnet,rods,imax,albedo,tilts", "state"])
def test_values_without_gauge_are_nominal_plus_shift_times_prior(satellite, free):
    parameters = some(satellite, free)
    assert not parameters.gauged and parameters.names[:6] == STATE
    x = random_unknowns(parameters, 0)
    found = values(parameters, x)
    shifts = dict(zip(parameters.names[6:], x.tolist(), strict=True))
    expected = {name: value + SIGMA[name] * shifts.get(name, 0.0) for name, value in NOMINAL.items()}
    np.testing.assert_allclose(of(found, expected), list(expected.values()), rtol=1e-14, atol=1e-17)
    tilts = {name: shift * np.radians(2.0) for name, shift in shifts.items() if name.startswith("tilts.")}
    assert of(found, tilts) == pytest.approx(np.array(list(tilts.values())), rel=1e-14)


def test_held_sizes_have_no_slope_and_touch_nothing_else(satellite):
    parameters = some(satellite, EVERYTHING)
    x = random_unknowns(parameters, 1)
    found, shifts = values(parameters, x), dict(zip(parameters.names[6:], x.tolist(), strict=True))
    plain = {name: value + SIGMA[name] * shifts[name] for name, value in NOMINAL.items()}
    others = ("rods.y", "rods.z", "imax", "albedo.specular", "albedo.diffuse")
    np.testing.assert_allclose(of(found, others), of(plain, others), rtol=1e-14)
    # A longer magnet along the same line is the same model, and so are gains all larger: derivatives along both vanish.
    slopes = np.asarray(values_and_slopes(parameters.tree, jnp.asarray(x))[1])
    for names in (MAGNET, GAINS):
        columns = [parameters.names.index(name) - 6 for name in names]
        along = slopes[:, columns] @ (of(plain, names) / of(SIGMA, names))
        np.testing.assert_allclose(along, 0.0, atol=1e-14)
    assert np.linalg.matrix_rank(slopes[rows(parameters, NOMINAL)]) == 18


def test_a_free_inertia_is_always_that_of_a_body(satellite):
    parameters = some(satellite, "inertia")
    for seed in range(40):
        xx, yy, zz, xy, xz, yz = of(values(parameters, random_unknowns(parameters, seed, 4.0)), INERTIA)
        low, middle, high = np.linalg.eigvalsh([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
        assert low > 0.0 and high < low + middle
    small = random_unknowns(parameters, 2, 1e-5)
    shift = np.array([small[parameters.names.index(name) - 6] for name in INERTIA])
    moved = of(values(parameters, small), INERTIA) - of(NOMINAL, INERTIA)
    np.testing.assert_allclose(moved, of(SIGMA, INERTIA) * shift, rtol=1e-3, atol=1e-9 * MEAN_INERTIA)


@pytest.mark.parametrize(
    "free", ["inertia,rods,imax,albedo,tilts", "magnet,rods,gains", POLAR, f"{POLAR},rods", "inertia.xx,magnet.y"]
)
def test_shifts_lead_back_to_values(satellite, free):
    parameters = some(satellite, free)
    x = random_unknowns(parameters, 3, 0.5)
    found = np.asarray(values_and_slopes(parameters.tree, jnp.asarray(x))[0])
    np.testing.assert_allclose(parameters.shifts(found), x, rtol=1e-9, atol=1e-11)


def test_a_dipole_by_its_angles_keeps_its_length(satellite):
    parameters = some(satellite, "magnet.azimuth,magnet.elevation")
    found = values(parameters, unknowns(parameters, magnet_azimuth=0.7, magnet_elevation=-0.4))
    azimuth, elevation = 0.7 * 0.05 / MODULUS, np.arctan2(0.04, 0.3) - 0.4 * 0.05 / MODULUS
    expected = [np.cos(elevation) * np.cos(azimuth), np.cos(elevation) * np.sin(azimuth), np.sin(elevation)]
    np.testing.assert_allclose(of(found, MAGNET), MODULUS * np.array(expected), rtol=1e-13)
    np.testing.assert_allclose(of(found, POLAR.split(",")), [MODULUS, azimuth, elevation], rtol=1e-13)
    assert parameters.restated == set(MAGNET) and not some(satellite, "magnet").restated


def test_modulus_and_angles_are_told_of_a_vector_too(satellite):
    parameters = some(satellite, "magnet")
    x = random_unknowns(parameters, 4)
    found = values(parameters, x)
    vector = of(found, MAGNET)
    modulus = np.linalg.norm(vector)
    expected = [modulus, np.arctan2(vector[1], vector[0]), np.arcsin(vector[2] / modulus)]
    np.testing.assert_allclose(of(found, POLAR.split(",")), expected, rtol=1e-13)


def test_a_dipole_is_free_in_one_way(satellite):
    with pytest.raises(InputError, match=r"both as a vector and by magnet\.modulus"):
        some(satellite, "magnet.y,magnet.azimuth")
    assert set(chosen_leaves(satellite.leaves, ["magnet"])) == set(MAGNET)


@pytest.mark.parametrize("magnet", ["[0.0, 0.0, 0.3]", "[0.0, 0.0, 0.0]", "[0.01, 0.0, -0.3]"])
def test_no_angles_of_a_dipole_along_z_or_of_none(tmp_path, magnet):
    other = written(tmp_path, magnet=magnet, held=False)
    with pytest.raises(InputError, match="within 80 deg, or free magnet, the vector"):
        some(other, "magnet.azimuth")
    parameters = some(other, "magnet")
    found, slopes = values_and_slopes(parameters.tree, jnp.zeros(len(parameters.columns)))
    assert np.all(np.isfinite(found)) and np.all(np.isfinite(slopes))


@pytest.mark.parametrize("free", [f"{EVERYTHING},tilts", f"{POLAR},rods,inertia,gains,imax,albedo", POLAR])
def test_derivatives_are_those_of_differences(satellite, free):
    parameters = some(satellite, free)
    x = random_unknowns(parameters, 5, 0.4)
    slopes = np.asarray(values_and_slopes(parameters.tree, jnp.asarray(x))[1])
    for k, step in enumerate(1e-5 * np.eye(len(x))):
        high, low = (np.asarray(values_and_slopes(parameters.tree, jnp.asarray(x + s * step))[0]) for s in (1.0, -1.0))
        np.testing.assert_allclose(slopes[:, k], (high - low) / 2e-5, atol=1e-8)


@pytest.mark.parametrize(
    ("free", "gauged"),
    [
        ("magnet,inertia", True),
        (f"{POLAR},inertia", True),
        ("magnet.modulus,inertia", True),
        ("magnet.azimuth,inertia", False),
        ("magnet.y,inertia", False),
        ("inertia,rods", False),
        (POLAR, False),
    ],
)
def test_the_modulus_is_held_only_where_all_that_scales_with_it_is_free(satellite, free, gauged):
    parameters = some(satellite, free)
    assert parameters.gauged == (("magnet",) if gauged else ())
    if gauged:
        text = parameters.gauge_text
        assert text is not None and text.startswith("|magnet| held")


def test_a_held_modulus_has_no_slope(satellite):
    parameters = some(satellite, f"{POLAR},inertia,rods")
    x = 0.3 * (parameters.columns >= 0)
    found, slopes = values_and_slopes(parameters.tree, jnp.asarray(x))
    modulus, azimuth = rows(parameters, ("magnet.modulus", "magnet.azimuth"))
    assert float(found[modulus]) == pytest.approx(MODULUS, rel=1e-14)
    assert not np.any(slopes[modulus]) and np.any(slopes[azimuth])
    assert parameters.gauged_leaves == {*MAGNET, "magnet.modulus"}


def test_names_of_gauges_are_those_of_the_user(satellite):
    text = some(satellite, EVERYTHING).gauge_text
    assert text is not None and "|magnet| and the mean of gains held" in text


def test_another_choice_is_the_same_program(satellite):
    first, second = (jax.tree.structure(some(satellite, free).tree) for free in ("magnet", f"{POLAR},rods"))
    assert first == second


def test_bounds_are_those_of_physical_values(satellite):
    parameters = some(satellite, EVERYTHING)
    lower, upper = parameters.bounds()
    assert np.all(np.isinf(lower[:6])) and np.all(np.isinf(upper[:6]))
    low, high = {}, {}
    for number, name in enumerate(parameters.names):
        if name in NOMINAL:
            low[name], high[name] = (NOMINAL[name] + SIGMA[name] * side[number] for side in (lower, upper))
    np.testing.assert_allclose(of(low, ("rods.y", "rods.z", "albedo.specular", *GAINS)), 0.0, atol=1e-15)
    np.testing.assert_allclose(of(high, ("rods.y", "albedo.diffuse", "imax")), [10.0, 1.5, 100.0], rtol=1e-14)
    assert low["imax"] == pytest.approx(0.012)
    assert all(np.isinf(side[name]) for side in (low, high) for name in (*MAGNET, *INERTIA))
    assert all(high[name] == np.inf for name in GAINS)
    # A whole inertia stays that of a body without bounds, a part of one does not.
    parameters = some(satellite, "inertia.xx,inertia.xy,magnet.modulus")
    lower = dict(zip(parameters.names, parameters.bounds()[0], strict=True))
    assert NOMINAL["inertia.xx"] + SIGMA["inertia.xx"] * lower["inertia.xx"] == pytest.approx(0.0, abs=1e-16)
    assert lower["inertia.xy"] == -np.inf and MODULUS + 0.05 * lower["magnet.modulus"] == pytest.approx(0.0, abs=1e-16)


def test_a_flat_body_moves_entry_by_entry(tmp_path):
    parameters = some(written(tmp_path, inertia="[1.0, 2.0, 3.0]", of_inertia=0.3), "inertia")
    shifts = [1.0, -0.5, 0.0, 0.2, 0.0, 0.0]
    given = dict(zip((name.replace(".", "_") for name in INERTIA), shifts, strict=True))
    found = of(values(parameters, unknowns(parameters, **given)), INERTIA)
    np.testing.assert_allclose(found, np.array([1.0, 2.0, 3.0, 0.0, 0.0, 0.0]) + 0.3 * np.array(shifts), rtol=1e-14)


def test_azimuths_meet_across_the_half_turn(tmp_path):
    parameters = some(written(tmp_path, magnet="[-0.3, 0.001, 0.0]"), "magnet.azimuth")
    beyond = np.array(parameters.tree.nominal)
    beyond[rows(parameters, MAGNET)] = [-0.3, -0.001, 0.0]
    # 0.38 deg over the half turn, in prior sigmas of 0.05 / 0.3 rad.
    shift = parameters.shifts(beyond)[parameters.names.index("magnet.azimuth") - 6]
    assert shift == pytest.approx(2.0 * 0.001 / 0.3 / (0.05 / 0.3), rel=1e-4)
