"""Satellite files of any sensors: what they give, and every wrong key at once."""

import math
import re

import jax
import numpy as np
import pytest
from satellite_text import BODY, MAG

from jaxsat.errors import InputError
from jaxsat.satellites import Satellite, read_numbers, read_satellite
from jaxsat.satellites.actuators import torquers_of, wheels_of
from jaxsat.satellites.model import array_at, nominal_values, with_values


def read(path) -> Satellite:
    found = read_satellite(path)
    assert isinstance(found, Satellite)
    return found


def leaf(satellite: Satellite, name: str):
    (found,) = [each for each in satellite.leaves if each.name == name]
    return found


def value(satellite: Satellite, name: str) -> float:
    """Nominal value of a leaf, SI."""
    return dict(
        zip(
            (each.name for each in satellite.leaves),
            nominal_values(satellite.model, [each.spot for each in satellite.leaves]),
            strict=True,
        )
    )[name]


def test_a_box_has_its_inertia_from_mass_and_size(file):
    found = read(file(BODY + MAG))
    a, b = 1.2 / 12 * (0.01 + 0.04), 1.2 / 12 * (0.01 + 0.01)
    assert np.allclose(found.model.spacecraft.inertia, np.diag([a, a, b]), rtol=1e-14)
    assert leaf(found, "inertia.xx").sigma is None and leaf(found, "inertia.xy").entries == (1, 3)
    assert found.name == "sat" and found.conventions == {}


def test_numbers_of_a_magnetometer_come_in_tesla_and_are_quoted_in_its_unit(file):
    found = read(file(BODY + MAG))
    bias = leaf(found, "mag.bias.y")
    assert value(found, "mag.bias.y") == pytest.approx(2e-6, rel=1e-14)
    assert bias.unit == "uT" and bias.to_unit == pytest.approx(1e6) and bias.sigma == pytest.approx(0.5e-6)
    assert leaf(found, "mag.scale.x").sigma is None and leaf(found, "mag.scale.x").lower == 0.0
    assert leaf(found, "mag.delay").place == "delays.mag"
    assert found.channels["mag"].columns == ("bx", "by", "bz")


def test_free_and_bounds_and_a_sigma_each(file):
    text = BODY + MAG.replace("sigma = 0.5}", "sigma = [0.1, 0.2, 0.3], free = false, bounds = [-5, 5]}")
    found = read(file(text + "[magnet]\ndipole_A_m2 = {value = [0, 0, 0.1], free = true}\n"))
    bias = leaf(found, "mag.bias.z")
    assert bias.sigma is None and bias.loose == pytest.approx(0.3e-6)
    assert (bias.lower, bias.upper) == pytest.approx((-5e-6, 5e-6))
    assert leaf(found, "magnet.z").sigma == leaf(found, "magnet.z").loose == 1.0


PARTS = """
[magnet]
dipole_A_m2 = {value = [0.1, 0, 0], sigma = 0.1}
[[rods]]
axis = "+y"
moment = {value = 0.02, sigma = 0.05}
[[rods]]
axis = [0, 0, 2]
Hc = 8.0
Br = {value = 0.02, sigma = 0.004}
Bs = 0.06
volume = 7.5e-8
[[rods]]
axis = "+x"
moment = 0.03
[[coils]]
axis = "+x"
area_turns_m2 = 2.0
column = "coil_mA"
unit = "mA"
[[wheels]]
axis = "+z"
inertia = 1e-6
column = "wheel"
unit = "rpm"
[residual]
torque = {value = [0, 0, 1e-8], sigma = 1e-7}
[eddy]
coefficient = 200
[surface]
specular = {value = 0.1, sigma = 0.1}
[albedo]
diffuse = {value = 0.3, sigma = 0.2}
"""


def test_parts_and_the_places_of_their_numbers(file):
    found = read(file(BODY + PARTS + MAG))
    craft = found.model.spacecraft
    assert craft.rods is not None and craft.hysteresis_rods is not None and craft.facets is not None
    assert np.allclose(craft.rods.moments, [0.02, 0.03]) and np.allclose(craft.hysteresis_rods.axes, [[0, 0, 1]])
    expected = {"rods.0.moment": 0.02, "rods.1.Br": 0.02, "rods.2.moment": 0.03, "residual.z": 1e-8, "eddy": 200.0}
    expected |= {"coils.0.area_turns": 2.0, "wheels.0.inertia": 1e-6, "surface.specular": 0.1, "albedo.diffuse": 0.3}
    assert {name: value(found, name) for name in expected} == pytest.approx(expected, rel=1e-12)
    assert found.columns == {"coil_mA": "mA", "wheel": "rpm"}
    assert leaf(found, "albedo.diffuse").upper == 1.5


def test_every_leaf_is_where_it_says(file):
    found = read(file(BODY + PARTS + MAG + SUN + STAR))
    spots = [each.spot for each in found.leaves if not each.restates]
    nominal = nominal_values(found.model, spots)
    changed = nominal * 1.25 + np.arange(1.0, nominal.size + 1.0)
    again = nominal_values(with_values(found.model, spots, jax.numpy.asarray(changed)), spots)
    assert np.array_equal(again, changed)
    names = [each.name for each in found.leaves]
    assert len(set(names)) == len(names)


SUN = """
[sensors.sun]
kind = "photodiodes"
normals = ["+x", "-y", [1, 0, 1], "+x"]
gain = {value = 1.2, sigma = 0.1}
response = "power"
limit_deg = {value = 72, sigma = 6}
exponent = 2.5
[channels.sun]
columns = ["s1", "s2", "", "s4"]
unit = "1"
quantum = 0.01
[sensors.cells]
kind = "panels"
normals = ["+x", "-z"]
imax = {value = 500, sigma = 30}
tilts_deg = {value = 0, sigma = 2}
[channels.cells]
columns = ["i1", "i2"]
unit = "mA"
sigma = 3
"""
STAR = """
[sensors.star]
kind = "star_tracker"
sense = "body_from_inertial"
[channels.star]
columns = ["q0", "q1", "q2", "q3"]
unit = "1"
sigma = 1e-4
"""


def test_faces_that_are_no_axes_have_numbers(file):
    found = read(file(BODY + SUN + STAR))
    names = [each.name for each in found.leaves if each.name.startswith(("sun.", "cells."))]
    assert names[:4] == ["sun.gain.+x", "sun.gain.-y", "sun.gain.2", "sun.gain.3"]
    assert {"sun.limit", "sun.exponent", "cells.imax", "cells.gain.-z", "cells.tilts.+x.y"} <= set(names)
    limit, most, tilt = (leaf(found, name) for name in ("sun.limit", "cells.imax", "cells.tilts.-z.x"))
    assert value(found, "sun.limit") == pytest.approx(math.radians(72)) and limit.to_unit == pytest.approx(57.29578)
    assert value(found, "cells.imax") == pytest.approx(0.5) and most.unit == "mA" and most.sigma == pytest.approx(0.03)
    assert tilt.sigma == pytest.approx(math.radians(2))
    star = found.model.sensors["star"]
    assert star.body_from_inertial  # type: ignore[attr-defined]


@pytest.mark.parametrize(("axes", "convention"), [('"unknown"', "unknown"), ('"mirrored"', "mirrored")])
def test_axes_that_nobody_knows(file, axes, convention):
    found = read(file(BODY + MAG.replace('unit = "uT"\n', f'unit = "uT"\naxes = {axes}\n')))
    assert found.conventions == {"mag": convention}
    assert np.array_equal(found.model.sensors["mag"].axes, np.eye(3))  # type: ignore[attr-defined]


def test_axes_by_name_and_a_stray_field(file):
    stray = 'unit = "uT"\naxes = ["+y", "-z", "+x"]\nstray = {by = ["i1", "i2"], column_unit = "mA", sigma = 0.01}\n'
    found = read(file(BODY + MAG.replace('unit = "uT"\n', stray)))
    mag = found.model.sensors["mag"]
    assert np.array_equal(mag.axes, [[0, 1, 0], [0, 0, -1], [1, 0, 0]])  # type: ignore[attr-defined]
    assert found.columns == {"i1": "mA", "i2": "mA"}
    assert leaf(found, "mag.stray.i2.z").sigma == pytest.approx(0.01 * 1e-6 / 1e-3)


KINDS = {
    "magnetometer": ('axes = ["+y"]\nshear = {value = [0, 0, 0], sigma = 0.1}', 1, "uT"),
    "gyro": ("turn = {value = [0, 0, 0.1], sigma = 0.1}", 3, "rpm"),
    "sun_vector": ('axes = ["-x", "-y", "+z"]', 3, "1"),
    "sun_angles": ('axes = ["-x", "-y", "+z"]', 2, "deg"),
    "pyramid": ("imax = {value = 2, sigma = 0.1}\nhood_angle_deg = {value = 70, sigma = 1}", 4, "1"),
    "limb": ("earth_radius_km = {value = 6400, sigma = 10}", 2, "deg"),
    "horizon_vector": ("", 3, "1"),
    "star_tracker": ("turn = [0, 0.1, 0]", 4, "1"),
    "panels": ('normals = ["+x"]\nimax = 500\nunit = "A"', 1, "uA"),
    "photodiodes": (
        'normals = ["+x"]\nunit = "V"\nresponse = "table"\n'
        "table = [{angle_deg = 0, response = 1}, {angle_deg = 80, response = 0}]",
        1,
        "mV",
    ),
}


@pytest.mark.parametrize("kind", KINDS)
def test_every_kind_of_sensor(file, kind):
    keys, count, unit = KINDS[kind]
    columns = ", ".join(f'"c{k}"' for k in range(count))
    channel = f'[channels.one]\ncolumns = [{columns}]\nunit = "{unit}"\nsigma = 0.1\n'
    found = read(file(BODY + f'[sensors.one]\nkind = "{kind}"\n{keys}\n{channel}'))
    spots = [each.spot for each in found.leaves if not each.restates]
    nominal = nominal_values(found.model, spots)
    changed = nominal + 0.5
    assert np.array_equal(nominal_values(with_values(found.model, spots, jax.numpy.asarray(changed)), spots), changed)
    assert all(
        each.lower <= value <= each.upper
        for each, value in zip((e for e in found.leaves if not e.restates), nominal, strict=True)
    )
    assert all(each.loose > 0.0 for each in found.leaves)


@pytest.mark.parametrize("kind", ["sun_angles", "pyramid", "limb"])
def test_angles_want_three_axes(file, kind):
    channel = '[channels.one]\ncolumns = ["a", "b"]\nunit = "deg"\nsigma = 0.1\n'
    with pytest.raises(InputError, match="sensors.one: axes: expected three directions, found 2"):
        read_satellite(file(BODY + f'[sensors.one]\nkind = "{kind}"\naxes = ["+x", "+y"]\n{channel}'))


def test_aliases(file):
    found = read(file(BODY + MAG + '[aliases]\nals = ["magnet", "mag.bias.x"]\n'))
    assert found.aliases == {"als": ("magnet", "mag.bias.x")}


RODS = '[[rods]]\naxis = "+x"\nmoment = 0.02\n[[rods]]\naxis = "+y"\nmoment = 0.03\n'
NAMES = """
[names]
"mag.bias" = "offsets"
"mag.bias.z" = "offset.last"
"rods.0.moment" = "rods.x"
magnet = "dipole"
"""


def test_names_of_the_users_own(file):
    before, after = (read(file(BODY + RODS + MAG + names)) for names in ("", NAMES))
    new = {a.name: b.name for a, b in zip(before.leaves, after.leaves, strict=True) if a.name != b.name}
    assert new == {
        "mag.bias.x": "offsets.x",
        "mag.bias.y": "offsets.y",
        "mag.bias.z": "offset.last",
        "rods.0.moment": "rods.x",
        **{f"magnet.{which}": f"dipole.{which}" for which in ("x", "y", "z", "modulus", "azimuth", "elevation")},
    }
    assert [a.spot for a in before.leaves] == [b.spot for b in after.leaves]
    assert {each.part for each in before.leaves if "rods" in each.name} == {"rods.0", "rods.1"}
    assert leaf(before, "mag.bias.x").part == "mag.bias" and leaf(before, "magnet.azimuth").part == "magnet"
    assert leaf(after, "rods.x").part == "rods.x" and leaf(after, "rods.1.moment").part == "rods.1"
    assert leaf(after, "dipole.x").part == leaf(after, "dipole.modulus").part == "dipole"


def test_wrong_names_are_told_at_once(file):
    wrong = '[names]\n"mag.biass" = "a"\n"mag.scale.x" = "one"\n"mag.scale.y" = "one"\n"rods.7" = "b"\n'
    with pytest.raises(InputError) as caught:
        read_satellite(file(BODY + MAG + wrong))
    line = str(caught.value)
    assert "names.mag.biass: " in line and "did you mean 'mag.bias'?" in line and "names.rods.7: " in line
    assert "mag.scale.x and mag.scale.y would both be 'one'" in line


def test_the_dipole_by_its_modulus_and_angles(file):
    found = read(file(BODY + "[magnet]\ndipole_A_m2 = {value = [-0.3, 0.3, 0.1], sigma = [0.1, 0.2, 0.3]}\n" + MAG))
    modulus = math.sqrt(0.19)
    expected = {"modulus": modulus, "azimuth": 0.75 * math.pi, "elevation": math.asin(0.1 / modulus)}
    for name, size in expected.items():
        each = leaf(found, f"magnet.{name}")
        assert value(found, f"magnet.{name}") == pytest.approx(size, rel=1e-14)
        assert each.moves and each.restates and each.sigma is None
        assert each.loose == pytest.approx(0.2 if name == "modulus" else 0.2 / modulus)
    assert leaf(found, "magnet.azimuth").to_unit == pytest.approx(57.29577951)
    none = read(file(BODY + MAG))
    assert [value(none, f"magnet.{name}") for name in expected] == [0.0] * 3


OWN = '''
import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Float
from jaxsat.sensors.abstract import AbstractSensor


class Heat(AbstractSensor):
    """Temperature of a plate."""

    warm: Float[Array, ""] = eqx.field(converter=lambda x: jnp.asarray(x, float))
    along: Float[Array, "3"] = eqx.field(converter=lambda x: jnp.asarray(x, float), default=(0.0, 0.0, 1.0))
    curve: Float[Array, "2"] = eqx.field(converter=lambda x: jnp.asarray(x, float), default=(0.0, 1.0))
    label: str = eqx.field(static=True, default="plate")

    def __call__(self, view):
        return jnp.stack([self.warm * jnp.sum(self.along * view.sun)])


class Unfinished(AbstractSensor):
    pass


class NoSensor:
    pass
'''
OWN_KEYS = """
[sensors.heat]
kind = "my_heat:Heat"
warm = {value = 3.0, sigma = 0.5}
label = "roof"
[channels.heat]
columns = ["t1"]
unit = "1"
sigma = 0.1
"""


def test_a_sensor_of_the_users_own_from_beside_the_file(file):
    file(OWN, "my_heat.py")
    found = read(file(BODY + OWN_KEYS))
    names = [each.name for each in found.leaves if each.name.startswith("heat.")]
    assert names == ["heat.warm", "heat.along.x", "heat.along.y", "heat.along.z", "heat.curve.0", "heat.curve.1"] + [
        "heat.delay"
    ]
    assert value(found, "heat.warm") == 3.0 and leaf(found, "heat.warm").sigma == 0.5
    assert value(found, "heat.along.z") == 1.0 and leaf(found, "heat.along.z").sigma is None
    assert found.model.sensors["heat"].label == "roof"  # type: ignore[attr-defined]


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ("my_heat:Heat", "my_heat:Head", "'my_heat' has no class 'Head'"),
        ("my_heat:Heat", "my_heat:NoSensor", "not as an AbstractSensor"),
        ("my_heat:Heat", "my_heat:Unfinished", "has no __call__"),
        ("my_heat:Heat", "nowhere_at_all:Heat", "cannot be imported"),
        ("warm", "worm", "unknown key; did you mean 'warm'?"),
        ("warm = {value = 3.0, sigma = 0.5}", "", "sensors.heat.warm: Field required"),
    ],
)
def test_what_is_wrong_with_a_sensor_of_the_users_own(file, old, new, said):
    file(OWN, "my_heat.py")
    with pytest.raises(InputError, match="sensors.heat") as caught:
        read_satellite(file(BODY + OWN_KEYS.replace(old, new)))
    assert said in str(caught.value) and "\n" not in str(caught.value)


WRONG = [
    ("mass_kg = 1.2", "mass = 1.2", "body.mass", "did you mean 'mass_kg'"),
    ("mass_kg = 1.2", "", "body", "give inertia_kg_m2, or mass_kg and size_m"),
    ("mass_kg = 1.2", "mass_kg = -1.2", "body.mass_kg", "greater than 0"),
    ("size_m", "inertia_kg_m2 = [1e-3, 1e-3, 9e-3]\nsize_m", "body", "exceeds the sum"),
    ("size_m", "inertia_kg_m2 = [1e-3, 1e-3]\nsize_m", "body.inertia_kg_m2", "three principal moments or 3 x 3"),
    ("size_m", "inertia_kg_m2 = [[1, 2, 0], [0, 1, 0], [0, 0, 1]]\nsize_m", "body", "not symmetric"),
    ('kind = "magnetometer"', 'kind = "magnetometr"', "sensors.mag.kind", "did you mean 'magnetometer'"),
    ('kind = "magnetometer"', "", "sensors.mag.kind", "expected kind"),
    ("bias = {value = [1.0, 2.0, 3.0]", "bias = {value = [1.0, 2.0]", "sensors.mag.bias", "three numbers"),
    ("bias = {value = [1.0, 2.0, 3.0]", "bais = {value = [1.0, 2.0, 3.0]", "sensors.mag.bais", "did you mean 'bias'"),
    ("sigma = 0.5", "sigma = 0", "sensors.mag.bias.sigma", "above zero"),
    ("sigma = 0.5", "bounds = [5, 6]", "sensors.mag.bias", "outside its bounds"),
    ("sigma = 0.5", "sigma = nan", "sensors.mag.bias.sigma", "finite"),
    ('unit = "uT"', 'unit = "uX"', "sensors.mag.unit", "unknown unit 'uX'"),
    ('unit = "uT"', 'unit = "deg"', "sensors.mag.unit", "expected a unit of T"),
    ('unit = "nT"', 'unit = "counts"', "channels.mag.unit", "what one count is"),
    ('unit = "nT"', 'unit = "mA"', "channels.mag.unit", "expected a unit of T"),
    ('["bx", "by", "bz"]', '["bx", "by"]', "channels.mag.columns", "expected 3 for a magnetometer, found 2"),
    ("sigma = 100.0", "", "channels.mag", "give sigma, or quantum"),
    ("[channels.mag]", "[channels.mga]", "sensors.mag", "has no [channels.mag]"),
    ("[channels.mag]", "[channels.mga]", "channels.mga", "did you mean 'mag'"),
    ('unit = "uT"', 'unit = "uT"\naxes = ["+x", "+x", "+y"]', "sensors.mag.axes", "right angles"),
    ('unit = "uT"', 'unit = "uT"\naxes = ["+x", "+q", "+y"]', "sensors.mag.axes", "+x, -x"),
    ('unit = "uT"', 'unit = "uT"\naxes = "unknwn"', "sensors.mag.axes", '"unknown" or "mirrored"'),
    ('unit = "uT"', 'unit = "uT"\nscale = 0', "sensors.mag.scale", "above 0"),
    ('column = "utc"', 'column = "utc"\nform = "seconds"', "time", "epoch is needed"),
    ('column = "utc"', 'column = "utc"\nform = "isso"', "time.form", "'iso', 'unix' or 'seconds'"),
    ('column = "utc"', 'column = "utc"\nzone = "CET"', "time.zone", "pattern"),
    ("[time]", '[rows]\nkeep = ["mode = 0"]\n[time]', "rows.keep[0]", "is no condition"),
    ("[time]", "[rows]\nkeep = [\"open('x')\"]\n[time]", "rows.keep[0]", "is no comparison"),
    ("[orbit.elements]", '[orbit]\ntle = "a"\n[orbit.elements]', "orbit", "found tle and elements"),
    ("a_km = 6900", "a_km = 690", "orbit.elements.a_km", "greater than 6000"),
    (
        'epoch = "2021-05-01T00:00:00Z"',
        'epoch = "2021-05-32T00:00:00Z"',
        "orbit.elements.epoch",
        "day must be in 1..31",
    ),
    ("[time]", '[[rods]]\naxis = "+x"\nHc = 3\n[time]', "rods[0]", "Br, Bs, volume missing"),
    ("[time]", '[[rods]]\naxis = "+x"\nHc=3\nBr=0.5\nBs=0.4\nvolume=1e-8\n[time]', "rods[0]", "Br < Bs"),
    ("[time]", '[[rods]]\naxes = "+x"\nmoment = 1\n[time]', "rods[0].axes", "did you mean 'axis'"),
    ("[time]", '[motion]\nkind = "given"\n[time]', "motion", "needs columns"),
    ("[time]", '[aliases]\nals = ["state"]\nALS = ["magnet"]\n[time]', "aliases.ALS", "but for the case"),
    ("[time]", '[names]\n"mag.bias" = "a b"\n[time]', "names.mag.bias", "without spaces"),
    ("[time]", '[names]\n"mag.bias" = "rate"\n[time]', "names.mag.bias", "names of the motion"),
    ("[time]", '[names]\n"mag.bais" = "a"\n[time]', "names.mag.bais", "did you mean 'mag.bias'"),
    ("[time]", "[tmie]\n[time]", "tmie", "did you mean 'time'"),
]


@pytest.mark.parametrize(("old", "new", "field", "said"), WRONG)
def test_a_wrong_key_is_one_line_with_its_path(file, old, new, field, said):
    text = BODY + MAG
    assert old in text
    path = file(text.replace(old, new))
    with pytest.raises(InputError) as caught:
        read_satellite(path)
    line = str(caught.value)
    assert line.startswith(f"{path}: ") and f"{field}: " in line and said in line and "\n" not in line


def test_all_wrong_keys_are_told_at_once(file):
    text = (BODY + MAG).replace("mass_kg", "mass").replace("sigma = 0.5", "sigma = -1").replace('"nT"', '"nX"')
    with pytest.raises(InputError) as caught:
        read_satellite(file(text + '[sensors.sun]\nkind = "photodiode"\n'))
    line = str(caught.value)
    for field in ("body.mass: ", "sensors.mag.bias.sigma: ", "channels.mag.unit: ", "sensors.sun.kind: "):
        assert field in line, field


def test_files_of_munins_numbers_give_a_satellite_too(file):
    path = file("[spacecraft]\nimax_mA = 230.0\n")
    assert read_numbers(path).spacecraft.imax_mA == 230.0
    found = read_satellite(path)
    assert found.name == "Munin"
    assert float(array_at(found.model, "sensors.cells.max_current")) == pytest.approx(0.23)


def test_diodes_that_send_elevations_have_gains_and_tilts_by_their_faces(file):
    text = """
[sensors.sun]
kind = "sun_elevation"
normals = ["+x", "-z"]
gain = {value = [0.9, 1.1], sigma = 0.1}
tilts_deg = {value = 0.0, sigma = 3.0}
[channels.sun]
columns = ["a", "b"]
unit = "deg"
sigma = 3.0
"""
    found = read(file(BODY + text))
    names = [each.name for each in found.leaves if each.name.startswith("sun.")]
    assert names == [
        *("sun.gain.+x", "sun.gain.-z"),
        *("sun.tilts.+x.y", "sun.tilts.+x.z", "sun.tilts.-z.x", "sun.tilts.-z.y", "sun.delay"),
    ]
    rimmed = read(file(BODY + text.replace("tilts_deg =", "rim = {value = 0.0, sigma = 0.2}\ntilts_deg =")))
    assert leaf(rimmed, "sun.rim.-z.sin4").entries == (15,) and leaf(rimmed, "sun.rim.+x.cos1").sigma == 0.2
    assert value(found, "sun.gain.-z") == 1.1 and leaf(found, "sun.tilts.+x.y").sigma == pytest.approx(math.radians(3))
    with pytest.raises(InputError, match=r"channels.sun.unit: expected a unit of rad"):
        read(file(BODY + text.replace('unit = "deg"', 'unit = "A"')))


@pytest.mark.parametrize(
    ("text", "told"),
    [
        ('[[coils]]\naxis = "+x"\n', "give column and area_turns_m2 where telemetry tells its current"),
        ('[[coils]]\naxis = "+x"\ncolumn = "i"\nmax_dipole_A_m2 = 0.2\n', "column and area_turns_m2 go together"),
        ('[[coils]]\naxis = "+x"\nmax_dipole_A_m2 = 0.2\nresidual = 1.5\n', "coils[0].residual"),
        ('[[wheels]]\naxis = "+x"\ninertia = 1e-6\n', "give column where telemetry tells its rate"),
        ('[[wheels]]\naxis = "+x"\ninertia = 1e-6\nmax_torque_N_m = 1e-4\n', "max_torque_N_m and max_speed_rpm go"),
        ('[[wheels]]\naxis = "+x"\ninertia = 0.0\nmax_torque_N_m = 1e-4\nmax_speed_rpm = 8e3\n', "inertia: expected"),
    ],
)
def test_coils_and_wheels_say_what_they_are_for(file, text, told):
    with pytest.raises(InputError, match=re.escape(told)):
        read_satellite(file(BODY + MAG + text))


def test_coils_and_wheels_for_control_laws_are_none_of_the_fits(file):
    coil = "[[coils]]\naxis = [0, 0, 2.0]\nmax_dipole_A_m2 = 0.3\nresidual = 0.1\n"
    wheel = '[[wheels]]\naxis = "{}"\ninertia = 2e-6\nmax_torque_N_m = 1e-4\nmax_speed_rpm = 6000.0\n'
    telemetered = '[[coils]]\naxis = "+x"\narea_turns_m2 = 2.0\ncolumn = "i"\n'
    satellite = read_satellite(file(BODY + MAG + coil + telemetered + "".join(map(wheel.format, ("+x", "+y", "+z")))))
    assert len(satellite.model.spacecraft.parts) == 1 and list(satellite.columns) == ["i"]
    names = [leaf.name for leaf in satellite.leaves]
    assert "coils.1.area_turns" in names and not any(name.startswith("wheels") for name in names)
    torquers, wheels = torquers_of(satellite), wheels_of(satellite)
    np.testing.assert_allclose(torquers.axes, [[0, 0, 1.0]])
    assert float(torquers.max_dipole[0]) == 0.3 and float(torquers.residual[0]) == 0.1
    np.testing.assert_allclose(wheels.max_speed, 200.0 * np.pi)
    with pytest.raises(InputError, match=r"has no three \[\[wheels\]\]"):
        wheels_of(read_satellite(file(BODY + MAG + wheel.format("+x"))))
