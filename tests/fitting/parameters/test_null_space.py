"""Blind and weak directions of information matrices that are made to have them."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from fitting.parameters.chosen import chosen_leaves
from fitting.parameters.free import free_parameters
from fitting.parameters.names import STATE
from fitting.parameters.null_space import gauge_text, unseen_directions
from jaxsat.satellites import Satellite, read_satellite

MAGNET, INERTIA = np.array([0.3, 0.0, 0.0]), np.array([0.05, 0.06, 0.07, 0.001, -0.002, 0.003])
GAINS = np.array([1.0, 1.1, 0.9, 1.0, 1.05, 0.95])
TEXT = """
[body]
inertia_kg_m2 = {value = [[0.05, 0.001, -0.002], [0.001, 0.06, 0.003], [-0.002, 0.003, 0.07]], sigma = 0.009}
[magnet]
dipole_A_m2 = {value = [0.3, 0.0, 0.0], sigma = 0.05}
[[rods]]
axis = "+y"
moment = {value = 0.03, sigma = 0.05}
[[rods]]
axis = "+z"
moment = {value = 0.02, sigma = 0.05}
%s
[albedo]
specular = {value = 0.1, sigma = 0.5}
diffuse = {value = 0.3, sigma = 0.5}
[orbit]
tle = "none.tle"
[time]
column = "utc"
[sensors.cells]
kind = "panels"
normals = ["+x", "-x", "+y", "-y", "+z", "-z"]
imax = {value = 240.0, sigma = 48.0}
gain = {value = [1.0, 1.1, 0.9, 1.0, 1.05, 0.95], sigma = 0.1}
tilts_deg = {value = [[0, 0], [0, 0], [0, 0], [0, 0], [0, 0], [0, 0]], sigma = 2.0}
[channels.cells]
columns = ["a", "b", "c", "d", "e", "f"]
unit = "mA"
sigma = 2.0
"""
GAUGE = '[gauge]\nhold = ["magnet", "cells.gain"]'
COIL = "[[coils]]\naxis = [1, 0, 0]\narea_turns_m2 = {value = 2.0, sigma = 0.1, free = false}\ncolumn = 'i'"
RESIDUAL = """
[residual]
torque = {value = [1e-7, 0.0, 0.0], sigma = 1e-7}
[eddy]
coefficient = {value = 500.0, sigma = 100.0}
"""


class Made:
    """Information of data that see everything well but the given directions [free], on top of unit priors."""

    def __init__(self, satellite: Satellite, *free: str):
        names = chosen_leaves(satellite.leaves, free)
        self.model = satellite.model
        self.parameters = free_parameters(satellite.model, satellite.leaves, names, held=satellite.held)
        self.values = np.asarray(self.parameters.tree.nominal)
        self.free = self.parameters.everything.copy()

    @property
    def names(self) -> list[str]:
        """Of the free unknowns after the state."""
        return [name for name, free in zip(self.parameters.names, self.free, strict=True) if free][len(STATE) :]

    def direction(self, changes: dict[str, float]) -> np.ndarray:
        """A unit direction from changes of parameters in prior sigmas."""
        vector = np.zeros(len(self.names))
        vector[[self.names.index(name) for name in changes]] = list(changes.values())
        return vector / np.linalg.norm(vector)

    def scale(self, *heads: str) -> np.ndarray:
        """The direction that scales all free numbers whose names begin so."""
        leaves = {
            leaf.name: (value, leaf.loose) for leaf, value in zip(self.parameters.leaves, self.values, strict=True)
        }
        own = [name for name in self.names if name.startswith(heads)]
        return self.direction({name: leaves[name][0] / leaves[name][1] for name in own})

    def unseen(self, *pairs, pressed: str = ""):
        """The verdict where the data's information on each (direction, information) is that, with one at its bound."""
        n, m = len(self.names), len(STATE)
        rng = np.random.default_rng(1)
        data = rng.normal(size=(3 * n, n))
        data = 1e3 * data.T @ data
        vectors = np.array([vector for vector, _ in pairs])
        q, _ = np.linalg.qr(vectors.T)
        across = np.eye(n) - q @ q.T
        data = across @ data @ across + sum(value * np.outer(v, v) for v, value in pairs)
        # The state is coupled with everything; seen from the data alone it takes nothing away.
        state = np.diag(rng.uniform(1e4, 1e8, m))
        coupling = rng.normal(size=(n, m))
        full = np.block(
            [[state, state @ coupling.T], [coupling @ state, data + coupling @ state @ coupling.T + np.eye(n)]]
        )
        # What is not free has its prior alone, as the padding of the unknowns.
        padded = np.eye(len(self.free))
        place = np.concatenate([np.arange(m), m + np.flatnonzero(self.free[m:])])
        padded[np.ix_(place, place)] = full
        zero = jnp.zeros(len(self.parameters.columns))
        jacobian = np.asarray(jax.jacfwd(self.parameters.tree.values)(zero))
        free = self.free & np.array([name != pressed for name in self.parameters.names])
        return unseen_directions(self.parameters, padded, free, self.values, jacobian, self.model)


@pytest.fixture(scope="module")
def satellites(tmp_path_factory):
    def built(extra: str) -> Satellite:
        path = tmp_path_factory.mktemp("null") / "made.sat.toml"
        path.write_text(TEXT % extra)
        found = read_satellite(path)
        assert isinstance(found, Satellite)
        return found

    parts = {"": "", "gauge": GAUGE, "coil": COIL, "residual": RESIDUAL}
    return {name: built(extra) for name, extra in parts.items()}


@pytest.fixture
def made(satellites):
    return lambda *free, kind="": Made(satellites[kind], *free)


def test_data_that_see_everything_leave_nothing(made):
    case = made("magnet", "rods")
    assert case.unseen((case.direction({"rods.0.moment": 1.0}), 1e3)) == () and gauge_text(()) is None


def test_the_common_scale_is_named_where_the_data_miss_it_though_no_gauge_was_declared(made):
    case = made("magnet.x", "rods", "inertia")
    assert not case.parameters.gauged
    (found,) = case.unseen((case.scale("magnet", "rods", "inertia"), 0.0))
    assert found.name == "common scale of inertia, magnet and rods" and found.held_by == "the priors" and found.blind
    assert "common scale of inertia, magnet and rods fixed by the priors" == gauge_text((found,))
    ratio = found.components["inertia.zz"] / found.components["inertia.xx"]
    assert ratio == pytest.approx(0.07 / 0.05, rel=1e-6)


def test_all_that_scales_is_named(made):
    case = made("magnet", "rods", "inertia", "residual", "eddy", kind="residual")
    (found,) = case.unseen((case.scale("magnet", "rods", "inertia", "residual", "eddy"), 1e-4))
    assert found.name == "common scale of inertia, magnet, rods, residual and eddy"


@pytest.mark.parametrize(("kind", "free"), [("coil", ("rods", "magnet", "inertia")), ("", ("magnet", "inertia"))])
def test_a_torque_of_known_size_tells_the_scale(made, kind, free):
    """Of a coil with its current, or of rods that are not free: a direction along it is spelt by its components."""
    case = made(*free, kind=kind)
    (found,) = case.unseen((case.scale(*free), 0.5))
    assert not found.name.startswith("common scale") and "inertia.zz" in found.name


def test_declared_gauges_are_found_again_with_what_holds_them(made):
    case = made("magnet", "inertia", "cells.imax", "cells.gain", kind="gauge")
    assert case.parameters.gauged == ("magnet", "cells.gain")
    found = case.unseen((case.scale("magnet"), 0.0), (case.scale("cells.gain"), 0.0))
    assert [d.held_by for d in found] == ["|magnet| = 0.3 A m²", "the mean gain = 1"]
    expected = "common scale of inertia and magnet fixed by |magnet| = 0.3 A m²; common scale of gains and imax"
    assert (gauge_text(found) or "").startswith(expected)


def test_the_modulus_stands_for_the_dipole(made):
    free = ("magnet.modulus", "magnet.azimuth", "magnet.elevation", "inertia", "rods")
    (held,) = made(*free, kind="gauge").unseen((made(*free).scale("magnet.modulus"), 0.0))
    assert gauge_text([held]) == "common scale of inertia, magnet and rods fixed by |magnet| = 0.3 A m²"
    (found,) = made(*free).unseen((made(*free).scale("magnet.modulus", "inertia", "rods"), 0.0))
    assert found.name == "common scale of inertia, magnet and rods" and found.held_by == "the priors"


def test_gains_and_the_largest_current_share_a_scale(made):
    case = made("cells.imax", "cells.gain")
    change = {"cells.imax": 240.0 / 48.0}
    change |= {name: -value / 0.1 for name, value in zip(case.names[1:], GAINS, strict=True)}
    (found,) = case.unseen((case.direction(change), 1e-5))
    assert found.name == "common scale of gains and imax" and found.held_by == "the priors" and found.blind


def test_a_nameless_direction_is_spelt_and_a_weak_one_is_no_gauge(made):
    case = made("rods", "cells.imax", "albedo")
    blind = case.direction({"cells.imax": 1.0, "albedo.diffuse": -1.0})
    weak = case.direction({"rods.0.moment": 1.0})
    found = case.unseen((blind, 0.0), (weak, 0.2))
    spelt = (["cells.imax - albedo.diffuse", "rods.0.moment"], ["albedo.diffuse - cells.imax", "rods.0.moment"])
    assert [d.name for d in found] in spelt
    assert [d.blind for d in found] == [True, False]
    assert found[1].information == pytest.approx(0.2, rel=1e-6)
    assert abs(found[0].components["cells.imax"]) == pytest.approx(48.0 / np.sqrt(2.0), rel=1e-6)  # mA


def test_a_common_turn_of_all_panels_is_named(made):
    case = made("cells.tilts")
    turn = case.direction({name: 1.0 for name in case.names if name.endswith(".y")})
    (found,) = case.unseen((turn, 1e-5))
    assert found.name == "common turn of the panels about y" and found.information == pytest.approx(1e-5, rel=1e-3)


def test_what_stands_at_its_bound_takes_no_part(made):
    case = made("rods", "albedo")
    found = case.unseen((case.direction({"albedo.diffuse": 1.0}), 0.0), pressed="albedo.diffuse")
    assert found == ()


def test_a_turned_satellite_is_the_turned_one(made):
    """The change that `common turn` stands for, against a satellite turned by 1e-5 rad the other way round."""
    case = made("magnet", "inertia", "rods", "cells.tilts")
    angle, axis = 1e-5, np.array([0.0, 1.0, 0.0])
    turn = Rotation.from_rotvec(angle * axis).as_matrix()
    xx, yy, zz, xy, xz, yz = INERTIA
    turned = turn @ np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]]) @ turn.T
    magnet = (turn @ MAGNET - MAGNET) / 0.05
    inertia = (turned[[0, 1, 2, 0, 0, 1], [0, 1, 2, 1, 2, 2]] - INERTIA) / 0.009
    change = {f"magnet.{axis}": m for axis, m in zip("xyz", magnet, strict=True)}
    change |= {f"inertia.{ij}": m for ij, m in zip(("xx", "yy", "zz", "xy", "xz", "yz"), inertia, strict=True)}
    change |= {name: angle / np.radians(2.0) for name in case.names if "tilts" in name and name.endswith(".y")}
    found = case.unseen((case.direction(change), 0.0))
    assert [d.name for d in found] == ["common turn of the panels about y"]


def test_a_direction_of_many_small_parts_still_has_a_name(made):
    case = made("magnet", "rods", "cells", "inertia", "albedo", kind="gauge")
    (found,) = case.unseen((np.full(len(case.names), len(case.names) ** -0.5), 0.0))
    assert len(found.components) == 1 and found.name in found.components


def test_one_free_gain_and_imax_have_no_common_scale(made):
    case = made("cells.imax", "cells.gain.+x")
    (found,) = case.unseen((case.direction({"cells.imax": 1.0}), 0.1))
    assert found.name == "cells.imax"


ANGLES = ("magnet.azimuth", "magnet.elevation")


def test_the_common_scale_is_that_of_a_modulus_too(made):
    case = made("magnet.modulus", *ANGLES, "rods", "inertia", kind="gauge")
    (found,) = case.unseen((case.direction({"magnet.modulus": 1.0}), 0.0))
    assert found.name == "common scale of inertia, magnet and rods" and found.held_by == "|magnet| = 0.3 A m²"
    free = made("magnet.modulus", "rods", "inertia")
    (found,) = free.unseen((free.scale("magnet.modulus", "rods", "inertia"), 0.0))
    assert found.name == "common scale of inertia, magnet and rods" and found.held_by == "the priors"


@pytest.mark.parametrize(("axis", "angle", "size"), [("y", "magnet.elevation", -1.0), ("z", "magnet.azimuth", 1.0)])
def test_a_common_turn_turns_the_angles_of_the_dipole(made, axis, angle, size):
    """The dipole lies along x: a right-handed turn about y lowers it, one about z carries it towards y."""
    case = made(*ANGLES, "cells.tilts")
    turn = {name: 1.0 / np.radians(2.0) for name in case.names if name.endswith(f".{axis}")}
    (found,) = case.unseen((case.direction({**turn, angle: size / (0.05 / 0.3)}), 1e-2))
    assert found.name == f"common turn of the panels about {axis}"
    assert found.information == pytest.approx(1e-2, rel=1e-3)
