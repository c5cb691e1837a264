"""Munin's satellite file says what the numbers and priors of its fit have been."""

import re

import numpy as np
import pytest

from fitting.sensed_run import chosen_leaves
from fitting.settings import PriorSigma
from jaxsat.bundled import MUNIN_SATELLITE
from jaxsat.errors import InputError
from jaxsat.satellites import Satellite, read_satellite
from jaxsat.satellites.model import nominal_values
from jaxsat.satellites.numbers import MUNIN

MAGNET = {"magnet.x", "magnet.y", "magnet.z"}
RODS = {"rods.y", "rods.z"}
INERTIA = {f"inertia.{entry}" for entry in ("xx", "yy", "zz", "xy", "xz", "yz")}
FACES = ("+x", "-x", "+y", "-y", "+z", "-z")
GAINS = {f"gains.{face}" for face in FACES}
ALBEDO = {"albedo.specular", "albedo.diffuse"}
TILTS = {f"tilts.{face}.{axis}" for face in FACES for axis in "xyz" if axis != face[1]}
POLAR = {"magnet.modulus", "magnet.azimuth", "magnet.elevation"}


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
    assert [values["rods.y"], values["rods.z"]] == craft["rods_A_m2"]
    assert values["imax"] == pytest.approx(craft["imax_mA"])
    assert {f"inertia.{key}": values[f"inertia.{key}"] for key in craft["inertia_kg_m2"]} == {
        f"inertia.{key}": value for key, value in craft["inertia_kg_m2"].items()
    }
    assert values["albedo.specular"] == MUNIN["albedo"]["specular"]
    np.testing.assert_array_equal(np.asarray(munin.model.spacecraft.rods.axes), np.eye(3)[1:])
    assert float(munin.model.spacecraft.rods.reference_field) == craft["reference_field_T"]


def test_priors_are_those_of_the_settings(munin):
    prior, widths = PriorSigma(), {leaf.name: leaf.loose * leaf.to_unit for leaf in munin.leaves}
    assert widths["magnet.y"] == prior.magnet_A_m2
    assert widths["rods.z"] == prior.rods_A_m2
    assert widths["imax"] == pytest.approx(prior.imax_relative * 240.0)
    assert widths["inertia.xy"] == widths["inertia.xx"] == pytest.approx(prior.inertia_relative * 0.05283)
    assert widths["albedo.diffuse"] == prior.albedo
    assert widths["gains.-z"] == prior.gains
    assert widths["tilts.+x.y"] == pytest.approx(prior.tilts_deg)


def test_names_and_units_are_those_that_results_have_always_had(munin):
    units = {leaf.name: leaf.unit for leaf in munin.leaves}
    moving = MAGNET | RODS | INERTIA | POLAR
    assert {leaf.name for leaf in munin.leaves if leaf.moves} == moving
    assert set(units) == moving | GAINS | ALBEDO | TILTS | {"imax", "cells.delay", "mag.delay"} | {
        name for name in units if name.startswith("mag.")
    }
    assert {units[name] for name in MAGNET | RODS} == {"A m2"} and {units[name] for name in INERTIA} == {"kg m2"}
    assert {units[name] for name in GAINS | ALBEDO} == {"1"} and {units[name] for name in TILTS} == {"deg"}
    assert units["imax"] == "mA" and units["magnet.modulus"] == "A m2" and units["magnet.azimuth"] == "deg"
    parts = {leaf.part for leaf in munin.leaves if leaf.name in moving | GAINS | TILTS | {"imax"}}
    assert parts == {"magnet", "rods.y", "rods.z", "inertia", "gains", "tilts", "imax"}


@pytest.mark.parametrize(
    ("asked", "expected"),
    [
        ("als", set()),
        ("alsI0,alsIO,als10", MAGNET),
        ("ALSI0", MAGNET),
        ("alsI23", RODS),
        ("alsimax", {"imax"}),
        ("alsJ", INERTIA),
        ("alsI0J", MAGNET | INERTIA),
        ("als10j", MAGNET | INERTIA),
        ("state,rods,imax,gains,albedo,tilts", RODS | {"imax"} | GAINS | ALBEDO | TILTS),
        ("rods.z, gains.+x ,tilts.-z.y", {"rods.z", "gains.+x", "tilts.-z.y"}),
        ("magnet.modulus,magnet.azimuth", {"magnet.modulus", "magnet.azimuth"}),
    ],
)
def test_groups_and_classic_names(munin, asked, expected):
    assert set(chosen_leaves(munin.leaves, asked.split(","), munin.aliases)) == expected


@pytest.mark.parametrize("bad", ["magnt", "als1", "Magnet", "gains.x", "", "als I0", "cells.gain"])
def test_what_is_no_name_is_told(munin, bad):
    with pytest.raises(InputError, match=re.escape(f"unknown free parameter {bad!r}")):
        chosen_leaves(munin.leaves, ["imax", bad, "nonsense"], munin.aliases)


def test_by_default_the_same_is_free(munin):
    assert set(chosen_leaves(munin.leaves, None)) == MAGNET | RODS | {"imax"} | INERTIA | ALBEDO
