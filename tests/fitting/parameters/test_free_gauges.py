"""Sizes that no channel tells are held: modulus of the magnet, mean of the gains, as a matter of data."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from fitting.parameters.chosen import chosen_leaves
from fitting.parameters.free import FreeParameters, free_parameters
from fitting.parameters.invisible import relative_to
from jaxsat.satellites import Satellite, read_satellite

NORMALS = "[[1, 0, 0], [-0.5, 0.8660254037844386, 0], [-0.5, -0.8660254037844386, 0]]"
TEXT = f"""
[body]
inertia_kg_m2 = {{value = [0.02, 0.03, 0.04], sigma = 0.004}}
[magnet]
dipole_A_m2 = {{value = [0.3, -0.1, 0.2], sigma = 0.05}}
[[rods]]
axis = "+y"
moment = {{value = 0.03, sigma = 0.05}}
[gauge]
hold = ["magnet", "cells.gain"]
[orbit]
tle = "none.tle"
[time]
column = "utc"
[sensors.cells]
kind = "panels"
normals = {NORMALS}
imax = {{value = 300.0, sigma = 60.0}}
gain = {{value = [1.0, 1.2, 0.9], sigma = 0.1}}
[channels.cells]
columns = ["a", "b", "c"]
unit = "mA"
sigma = 2.0
"""


@pytest.fixture(scope="module")
def satellite(tmp_path_factory) -> Satellite:
    path = tmp_path_factory.mktemp("gauge") / "three.sat.toml"
    path.write_text(TEXT)
    found = read_satellite(path)
    assert isinstance(found, Satellite)
    return found


def some(satellite: Satellite, *free: str) -> FreeParameters:
    names = chosen_leaves(satellite.leaves, free or None)
    return free_parameters(satellite.model, satellite.leaves, names, held=satellite.held)


def values(parameters: FreeParameters, x) -> dict[str, float]:
    found = np.asarray(parameters.tree.values(jnp.asarray(x)))
    return dict(zip((leaf.name for leaf in parameters.leaves), found.tolist(), strict=True))


def shifted(parameters: FreeParameters, seed: int) -> np.ndarray:
    return np.random.default_rng(seed).normal(size=len(parameters.columns))


def test_sizes_stay_and_directions_move(satellite):
    parameters = some(satellite)
    assert parameters.gauged == ("magnet", "cells.gain")
    x = shifted(parameters, 1)
    found = values(parameters, x)
    magnet = np.array([found[f"magnet.{axis}"] for axis in "xyz"])
    assert np.linalg.norm(magnet) == pytest.approx(np.sqrt(0.3**2 + 0.1**2 + 0.2**2), rel=1e-14)
    unheld = np.array([0.3, -0.1, 0.2])
    for number, axis in enumerate("xyz"):
        unheld[number] += 0.05 * x[parameters.names.index(f"magnet.{axis}") - 6]
    np.testing.assert_allclose(np.cross(magnet, unheld), 0.0, atol=1e-16)
    gains = [found[f"cells.gain.{name}"] for name in ("+x", "1", "2")]
    assert np.mean(gains) == pytest.approx((1.0 + 1.2 + 0.9) / 3.0, rel=1e-14)
    assert gains[0] / gains[1] != pytest.approx(1.0 / 1.2)


@pytest.mark.parametrize("free", [("magnet", "cells.gain"), ("inertia.xx", "magnet", "cells.gain"), ("inertia",)])
def test_nothing_is_held_where_nothing_else_scales_with_it(satellite, free):
    parameters = some(satellite, *free)
    assert parameters.gauged == ()
    assert parameters.gauged_leaves == frozenset()
    x = shifted(parameters, 2)
    moved = 0.05 * x[parameters.names.index("magnet.x") - 6] if "magnet" in free else 0.0
    assert values(parameters, x)["magnet.x"] == pytest.approx(0.3 + moved, rel=1e-14)


def test_slopes_against_differences(satellite):
    parameters = some(satellite)
    x, h = shifted(parameters, 3), 1e-6
    slopes = np.asarray(jax.jacfwd(parameters.tree.values)(jnp.asarray(x)))
    for number in range(len(x)):
        step = np.zeros_like(x)
        step[number] = h
        ends = [np.asarray(parameters.tree.values(jnp.asarray(x + sign * step))) for sign in (1.0, -1.0)]
        np.testing.assert_allclose(slopes[:, number], (ends[0] - ends[1]) / (2.0 * h), rtol=1e-6, atol=1e-9)


def test_another_choice_is_the_same_program(satellite):
    trees = [some(satellite, *free).tree for free in ((), ("magnet", "cells"))]
    first, second = (jax.tree.structure(tree) for tree in trees)
    assert first == second


def test_what_a_gauge_scales_is_called_relative(satellite):
    everything = some(satellite)
    nominal = np.asarray(everything.tree.nominal)
    by_magnet = {n for n in everything.names if n.startswith(("magnet.", "rods.", "inertia."))}
    by_gain = {"cells.imax"} | {n for n in everything.names if ".gain" in n}
    assert relative_to(everything, nominal) == {
        **dict.fromkeys(by_magnet, "given |magnet|"),
        **dict.fromkeys(by_gain, "given mean gain"),
    }
    assert relative_to(some(satellite, "magnet", "rods"), nominal) == {}
