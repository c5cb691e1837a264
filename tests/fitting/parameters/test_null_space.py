"""Blind and weak directions of information matrices that are made to have them."""

import dataclasses

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from fitting.parameters.names import NAMED, STATE, parse_free
from fitting.parameters.nominal import Nominal
from fitting.parameters.null_space import gauge_text, unseen_directions
from fitting.parameters.parametrization import INERTIA_SLICE, MAGNET_SLICE, Parametrization, parametrization
from fitting.settings import PriorSigma

NOMINAL = Nominal(
    magnet=np.array([0.3, 0.0, 0.0]),
    rods=np.array([0.03, 0.02]),
    reference_field=3e-5,
    inertia=np.array([0.05, 0.06, 0.07, 0.001, -0.002, 0.003]),
    max_current=0.24,
    gains=np.array([1.0, 1.1, 0.9, 1.0, 1.05, 0.95]),
    albedo=np.array([0.1, 0.3]),
)


class Made:
    """Information of data that see everything well but the given directions [free], on top of unit priors."""

    def __init__(self, free: str):
        self.parameters: Parametrization = parametrization(NOMINAL, parse_free(free), PriorSigma())
        self.values = NOMINAL.vector()
        self.free = np.ones(len(self.parameters.names), bool)

    def along(self, **changes: float) -> np.ndarray:
        """A unit direction from changes of parameters in prior sigmas, `magnet_x` for magnet.x."""
        names = [name.replace("_", ".") for name in changes]
        vector = np.zeros(len(self.parameters.free))
        vector[[self.parameters.free.index(name) for name in names]] = list(changes.values())
        return vector / np.linalg.norm(vector)

    def unseen(self, *pairs):
        """The verdict where the data's information on each (direction, information) is that."""
        n, m = len(self.parameters.free), len(STATE)
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
        return unseen_directions(self.parameters, full, self.free, self.values)


def scale(parameters: Parametrization, names: list[str]) -> np.ndarray:
    vector = np.zeros(len(parameters.free))
    for name in names:
        k, place = parameters.free.index(name), parameters.indices()[parameters.free.index(name)]
        vector[k] = np.asarray(parameters.nominal)[place] / np.asarray(parameters.scale)[place]
    return vector / np.linalg.norm(vector)


def test_data_that_see_everything_leave_nothing():
    made = Made("magnet,rods")
    x = made.along(rods_y=1.0)
    assert made.unseen((x, 1e3)) == () and gauge_text(()) is None


def test_the_common_scale_is_named_where_the_data_miss_it_though_no_gauge_was_declared():
    made = Made("magnet.x,rods,inertia")
    assert not made.parameters.gauged
    direction = scale(made.parameters, list(made.parameters.free))
    (found,) = made.unseen((direction, 0.0))
    assert found.name == "common scale of inertia, magnet and rods" and found.held_by == "the priors" and found.blind
    assert "common scale of inertia, magnet and rods fixed by the priors" == gauge_text((found,))
    ratio = found.components["inertia.zz"] / found.components["inertia.xx"]
    assert ratio == pytest.approx(0.07 / 0.05, rel=1e-6)


def test_declared_gauges_are_found_again_with_what_holds_them():
    made = Made("magnet,inertia,imax,gains")
    magnet, gains = (
        scale(made.parameters, [n for n in made.parameters.free if n.startswith(g)]) for g in ("mag", "gai")
    )
    found = made.unseen((magnet, 0.0), (gains, 0.0))
    assert [d.held_by for d in found] == ["|magnet| = 0.3 A m2", "the mean gain = 1"]
    expected = "common scale of inertia and magnet fixed by |magnet| = 0.3 A m2; common scale of gains and imax"
    assert (gauge_text(found) or "").startswith(expected)


def test_a_nameless_direction_is_spelt_and_a_weak_one_is_no_gauge():
    made = Made("rods,imax,albedo")
    blind = made.along(**{"imax": 1.0, "albedo_diffuse": -1.0})
    weak = made.along(rods_y=1.0)
    found = made.unseen((blind, 0.0), (weak, 0.2))
    assert [d.name for d in found] in (["imax - albedo.diffuse", "rods.y"], ["albedo.diffuse - imax", "rods.y"])
    assert [d.blind for d in found] == [True, False]
    assert found[1].information == pytest.approx(0.2, rel=1e-6)
    assert abs(found[0].components["imax"]) == pytest.approx(48.0 / np.sqrt(2.0), rel=1e-6)  # mA


def test_a_common_turn_of_all_panels_is_named():
    made = Made("tilts")
    turn = made.along(**{name.replace(".", "_"): 1.0 for name in made.parameters.free if name.endswith(".y")})
    (found,) = made.unseen((turn, 1e-5))
    assert found.name == "common turn of the panels about y" and found.information == pytest.approx(1e-5, rel=1e-3)


def test_what_stands_at_its_bound_takes_no_part():
    made = Made("rods,albedo")
    made.free[made.parameters.names.index("albedo.diffuse")] = False
    found = made.unseen((made.along(albedo_diffuse=1.0), 0.0))
    assert found == ()


def test_a_turned_satellite_is_the_turned_one():
    """The change that `common turn` stands for, against a satellite turned by 1e-5 rad the other way round."""
    made = Made("magnet,inertia,tilts")
    angle, axis = 1e-5, np.array([0.0, 1.0, 0.0])
    turn = Rotation.from_rotvec(angle * axis).as_matrix()
    xx, yy, zz, xy, xz, yz = NOMINAL.inertia
    turned = turn @ np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]]) @ turn.T
    change = np.zeros(len(NAMED))
    change[MAGNET_SLICE] = turn @ NOMINAL.magnet - NOMINAL.magnet
    change[INERTIA_SLICE] = turned[[0, 1, 2, 0, 0, 1], [0, 1, 2, 1, 2, 2]] - NOMINAL.inertia
    for k, name in enumerate(NAMED):
        if name.startswith("tilts") and name.endswith(".y"):
            change[k] = angle
    index = made.parameters.indices()
    direction = (change / made.parameters.scale)[index]
    magnet = scale(made.parameters, ["magnet.x", "magnet.y", "magnet.z"])
    found = made.unseen((direction / np.linalg.norm(direction), 0.0), (magnet, 0.0))
    assert {d.name for d in found} == {"common turn of the panels about y", "common scale of inertia and magnet"}


def test_a_direction_of_many_small_parts_still_has_a_name():
    made = Made("magnet,rods,imax,gains,inertia,albedo,tilts")
    (found,) = made.unseen((np.full(len(made.parameters.free), len(made.parameters.free) ** -0.5), 0.0))
    assert len(found.components) == 1 and found.name in found.components


def test_one_free_gain_and_imax_have_no_common_scale():
    made = Made("imax,gains.+x")
    (found,) = made.unseen((made.along(**{"imax": 1.0}), 0.1))
    assert found.name == "imax"


def test_moments_of_rods_are_told_in_the_field_of_the_results():
    made = Made("rods")
    doubled = dataclasses.replace(NOMINAL, reference_field=6e-5)
    made.parameters = parametrization(doubled, parse_free("rods"), PriorSigma())
    (found,) = made.unseen((made.along(rods_y=1.0), 0.1))
    assert found.components == {"rods.y": pytest.approx(0.5 * 0.05)}
