"""Munin's satellite file says what the numbers and priors of its fit have been."""

import numpy as np
import pytest

from fitting.parameters.names import PROGRAMS, parse_free
from fitting.sensed_run import chosen_leaves
from fitting.settings import PriorSigma
from jaxsat.bundled import MUNIN_SATELLITE
from jaxsat.satellites import Satellite, read_satellite
from jaxsat.satellites.model import nominal_values
from jaxsat.satellites.numbers import MUNIN

RENAMED = {"rods.y": "rods.0.moment", "rods.z": "rods.1.moment", "imax": "cells.imax"}


def new_name(name: str) -> str:
    for old, new in (("gains.", "cells.gain."), ("tilts.", "cells.tilts.")):
        if name.startswith(old):
            return new + name.removeprefix(old)
    return RENAMED.get(name, name)


@pytest.fixture(scope="module")
def munin() -> Satellite:
    found = read_satellite(MUNIN_SATELLITE)
    assert isinstance(found, Satellite)
    return found


def test_nominal_values_are_those_of_munin(munin):
    values = dict(
        zip(
            (leaf.name for leaf in munin.leaves),
            nominal_values(munin.model, [leaf.spot for leaf in munin.leaves]) * [leaf.to_unit for leaf in munin.leaves],
            strict=True,
        )
    )
    craft = MUNIN["spacecraft"]
    assert values["magnet.x"] == craft["magnet_modulus_A_m2"] and values["magnet.y"] == values["magnet.z"] == 0.0
    assert [values["rods.0.moment"], values["rods.1.moment"]] == craft["rods_A_m2"]
    assert values["cells.imax"] == pytest.approx(craft["imax_mA"])
    assert {f"inertia.{key}": values[f"inertia.{key}"] for key in craft["inertia_kg_m2"]} == {
        f"inertia.{key}": value for key, value in craft["inertia_kg_m2"].items()
    }
    assert values["albedo.specular"] == MUNIN["albedo"]["specular"]
    np.testing.assert_array_equal(np.asarray(munin.model.spacecraft.rods.axes), np.eye(3)[1:])
    assert float(munin.model.spacecraft.rods.reference_field) == craft["reference_field_T"]


def test_priors_are_those_of_the_settings(munin):
    prior, widths = PriorSigma(), {leaf.name: leaf.loose * leaf.to_unit for leaf in munin.leaves}
    assert widths["magnet.y"] == prior.magnet_A_m2
    assert widths["rods.1.moment"] == prior.rods_A_m2
    assert widths["cells.imax"] == pytest.approx(prior.imax_relative * 240.0)
    assert widths["inertia.xy"] == widths["inertia.xx"] == pytest.approx(prior.inertia_relative * 0.05283)
    assert widths["albedo.diffuse"] == prior.albedo
    assert widths["cells.gain.-z"] == prior.gains
    assert widths["cells.tilts.+x.y"] == pytest.approx(prior.tilts_deg)


@pytest.mark.parametrize(
    "asked",
    [*PROGRAMS, "alsIO", "als10J", "state,magnet,rods,imax,gains,inertia,albedo,tilts", "rods.z,gains.+x,tilts.-z.y"],
)
def test_groups_and_classic_names_free_the_same_numbers(munin, asked):
    assert set(chosen_leaves(munin.leaves, asked.split(","), munin.aliases)) == {new_name(n) for n in parse_free(asked)}


def test_by_default_the_same_is_free(munin):
    default = parse_free("state,magnet,rods,imax,inertia,albedo")
    assert set(chosen_leaves(munin.leaves, None)) == {new_name(name) for name in default}
