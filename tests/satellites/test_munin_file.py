"""Munin's satellite file says what the numbers and priors of its fit have been."""

import re

import numpy as np
import pytest

from fitting.parameters.chosen import chosen_leaves
from jaxsat.bundled import MUNIN_SATELLITE
from jaxsat.errors import InputError
from jaxsat.satellites import Satellite, read_numbers, read_satellite
from jaxsat.satellites.described import PriorSigma, described
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


def test_other_numbers_stand_in_the_same_places():
    numbers = read_numbers(
        changed={
            "spacecraft.magnet_modulus_A_m2": 0.4,
            "spacecraft.magnet_azimuth_deg": 90.0,
            "spacecraft.rods_A_m2": [0.01, 0.02],
            "spacecraft.reference_field_T": 6.0e-5,
            "spacecraft.imax_mA": 250.0,
            "spacecraft.gains": [1.0, 1.1, 1.2, 1.3, 1.4, 1.5],
            "spacecraft.inertia_kg_m2": {"xx": 0.05, "yy": 0.06, "zz": 0.07, "xy": 1e-3, "xz": 2e-3, "yz": 3e-3},
            "albedo.specular": 0.3,
            "albedo.diffuse": 0.1,
            "spacecraft.panel_tilts_deg": [[0.0, 0.0], [0.0, 2.0], [0.0, 0.0], [-1.0, 0.0], [0.0, 0.0], [0.0, 0.0]],
        },
    )
    found = described(numbers)
    spots = [leaf.spot for leaf in found.leaves]
    values = dict(zip((leaf.name for leaf in found.leaves), nominal_values(found.model, spots), strict=True))
    expected = {"magnet.x": 0.0, "magnet.y": 0.4, "magnet.z": 0.0, "imax": 0.25, "albedo.specular": 0.3}
    expected |= {"albedo.diffuse": 0.1, "gains.+x": 1.0, "gains.-y": 1.3, "gains.-z": 1.5, "inertia.yz": 3e-3}
    # Moments in the field in which results quote them: half of those at twice the field.
    expected |= {"rods.y": 0.005, "rods.z": 0.01, "inertia.yy": 0.06, "inertia.xy": 1e-3, "inertia.xz": 2e-3}
    expected |= {"tilts.-x.z": np.radians(2.0), "tilts.-y.x": np.radians(-1.0), "tilts.+x.y": 0.0}
    for name, value in expected.items():
        assert values[name] == pytest.approx(value, abs=1e-15), name
