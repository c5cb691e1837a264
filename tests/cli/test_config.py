"""Configuration: defaults, template, units, and every wrong key named in one line."""

import math
import re
import tomllib
from pathlib import Path

import numpy as np
import pytest

from jaxsat.cli.settings.files import Config, load_config, template
from jaxsat.constants import EARTH_MU
from jaxsat.errors import InputError

KEY = re.compile(r"(?:# )?[A-Za-z0-9_]+ = ")


@pytest.fixture
def file(tmp_path):
    def write(text: str) -> Path:
        path = tmp_path / "x.toml"
        path.write_text(text)
        return path

    return write


def test_template_loads_back_to_the_defaults(file):
    text = template()
    assert load_config(file(text)) == Config() == load_config()
    lines = text.splitlines()
    keys = [k for k, line in enumerate(lines) if KEY.match(line)]
    assert len(keys) > 40
    assert all(lines[k - 1].startswith("# ") for k in keys), "every key has its meaning above it"


def test_examples_of_the_template_are_accepted(file):
    """Uncommenting an example must not be an error (the second of two alternatives stays out)."""
    text = template()
    second = ("# argument_of_latitude_deg", "# greenwich_angle_at_perigee_deg")
    lines = [
        line.removeprefix("# ") if KEY.match(line) and not line.startswith(second) else line
        for line in text.splitlines()
    ]
    config = load_config(file("\n".join(lines)))
    assert config.fit.arc_s == (0.0, 2700.0) and config.spacecraft.magnet_A_m2 == (0.3, 0.0, 0.0)
    assert config.orbit.elements(EARTH_MU) is not None


def test_published_settings(file):
    """Table 1 of Penkov et al. 2009: its two ways to place the satellite and Greenwich agree."""
    shape = "inclination_deg = 95.438873\nraan_deg = 64.81879\nargument_of_perigee_deg = 16.675906\n"
    shape += "eccentricity = 0.072661\nsemi_major_axis_km = 7630.026457\n"
    one = load_config(file(f"[orbit]\n{shape}time_of_perigee_s = 3230.533197\n[earth]\ngreenwich_angle_deg = 191.28"))
    two = load_config(
        file(f"[orbit]\n{shape}argument_of_latitude_deg = -159.2832\n[earth]\ngreenwich_angle_at_perigee_deg = 204.78")
    )
    a, b = one.orbit.elements(EARTH_MU), two.orbit.elements(EARTH_MU)
    assert a is not None and b is not None and a["semi_major_axis"] == 7630026.457
    assert math.remainder(a["mean_anomaly"] - b["mean_anomaly"], 2 * math.pi) == pytest.approx(0.0, abs=3e-5)
    assert one.earth.greenwich_angle(3230.533197) == pytest.approx(math.radians(191.28))
    assert two.earth.greenwich_angle(3230.533197) == pytest.approx(math.radians(191.28), abs=1e-4)
    assert Config().orbit.elements(EARTH_MU) is None and Config().earth.greenwich_angle(0.0) is None


def test_magnet_and_inertia(file):
    polar = load_config(file("[spacecraft]\nmagnet_modulus_A_m2 = 0.4\nmagnet_azimuth_deg = 90\n"))
    np.testing.assert_allclose(polar.spacecraft.magnet(), [0.0, 0.4, 0.0], atol=1e-15)
    up = load_config(file("[spacecraft]\nmagnet_elevation_deg = -90\n"))
    np.testing.assert_allclose(up.spacecraft.magnet(), [0.0, 0.0, -0.3], atol=1e-15)
    vector = load_config(file("[spacecraft]\nmagnet_A_m2 = [0.1, -0.2, 1]\ninertia_kg_m2 = {xy = 0.001}\n"))
    np.testing.assert_array_equal(vector.spacecraft.magnet(), [0.1, -0.2, 1.0])
    tensor = vector.spacecraft.inertia_kg_m2.tensor()
    assert tensor[0, 1] == tensor[1, 0] == 0.001 and tensor[2, 2] == 0.05283


def test_cleaning_settings(file):
    text = '[cleaning]\npanel_order = ["-x", "+x", "+Y", "-Y", "+Z", "-Z"]\ndrop_s = [[0, 10], [20.5, 30]]\n'
    config = load_config(file(text + "[spacecraft]\nimax_mA = 480\n"))
    settings = config.cleaning
    assert settings.panel_order[:2] == ("-X", "+X") and settings.drop_s == ((0.0, 10.0), (20.5, 30.0))
    assert config.numbers.largest_current_sum_mA == pytest.approx(2 * math.sqrt(3) * 480)
    assert Config().numbers.largest_current_sum_mA == pytest.approx(830.0, rel=0.01)


def test_overrides_replace_the_file(file):
    path = file('[fit]\nfree = ["magnet", "rods"]\nseed = 5\n')
    assert load_config(path).fit.free == "magnet,rods"
    config = load_config(path, {"fit.seed": 7, "cleaning.drop_s": [[1.0, 2.0]], "fit.free": "alsI0J"})
    assert (config.fit.seed, config.fit.free, config.cleaning.drop_s) == (7, "alsI0J", ((1.0, 2.0),))
    with pytest.raises(InputError, match=r"^fit\.starts: .*greater than or equal to 1, found 0"):
        load_config(None, {"fit.starts": 0})


BAD = {
    "unknown key": ("[fit]\nstart = 3", r"fit\.start: unknown key; did you mean 'starts'\?"),
    "unknown section": ("[spacecraf]\na = 1", "spacecraf: unknown key; did you mean 'spacecraft'"),
    "unknown nested key": ("[fit.prior_sigma]\ngainz = 1", "fit.prior_sigma.gainz: unknown key; did you mean 'gains'"),
    "string for number": ('[fit]\nnoise_mA = "2"', "fit.noise_mA: .*valid number, found '2'"),
    "bool for number": ("[fit]\nnoise_mA = true", "fit.noise_mA: .*valid number"),
    "unknown choice": ('[fit]\nlikelihood = "cauchy"', "fit.likelihood: .*mixture.*normal"),
    "fraction for count": ("[fit]\nstarts = 1.5", "fit.starts: .*integer, found 1.5"),
    "nan": ("[spacecraft]\nimax_mA = nan", "spacecraft.imax_mA: .*finite"),
    "inf in a list": ("[spacecraft]\nrods_A_m2 = [0.03, inf]", r"spacecraft.rods_A_m2\[1\]: .*finite"),
    "negative": ("[spacecraft]\nimax_mA = -1", "spacecraft.imax_mA: .*greater than 0, found -1"),
    "short list": ("[spacecraft]\nmagnet_A_m2 = [1, 2]", r"spacecraft.magnet_A_m2\[2\]: Field required"),
    "table for number": ("[fit.noise_mA]\nx = 1", "fit.noise_mA: .*valid number"),
    "number for table": ("orbit = 3", "orbit: "),
    "free list": ("[fit]\nfree = [1]", "fit.free: .*string"),
    "arc": ("[fit]\narc_s = [10, 10]", r"fit.arc_s: expected \[t0, t1\] with t0 < t1"),
    "drop": ("[cleaning]\ndrop_s = [[1, 2], [4, 3]]", r"cleaning.drop_s\[1\]: expected \[t0, t1\]"),
    "panels": ('[cleaning]\npanel_order = ["+X", "+X"]', "cleaning.panel_order: expected each of"),
    "incomplete orbit": ("[orbit]\neccentricity = 0.1", "orbit: elements are incomplete"),
    "orbit placed twice": ("[orbit]\ntime_of_perigee_s = 1\nargument_of_latitude_deg = 1", "orbit: .*say the same"),
    "two angles": ("[earth]\ngreenwich_angle_deg = 1\ngreenwich_angle_at_perigee_deg = 2", "earth: .*say the same"),
    "two magnets": ("[spacecraft]\nmagnet_A_m2 = [1, 0, 0]\nmagnet_azimuth_deg = 3", "spacecraft: .*say the same"),
    "sun": ("[sun]\ndirection_eci = [1, 1, 0]", "sun.direction_eci: expected a unit vector"),
    "inertia negative": ("[spacecraft.inertia_kg_m2]\nxy = 0.06", "spacecraft.inertia_kg_m2: .*positive definite"),
    "inertia triangle": ("[spacecraft.inertia_kg_m2]\nxx = 0.2", "spacecraft.inertia_kg_m2: no body has"),
    "syntax": ("[fit]\n\nseed = 1 2", r":3: TOML syntax: .* at column \d+"),
    "syntax at the end": ("[fit", ":1: TOML syntax"),
    "key twice": ("[fit]\nseed = 1\nseed = 2", ":3: TOML syntax"),
    "empty": ("", "file is empty"),
}


@pytest.mark.parametrize(("text", "expected"), BAD.values(), ids=BAD.keys())
def test_bad_configuration_is_one_line(file, text, expected):
    path = file(text)
    with pytest.raises(InputError, match=expected) as caught:
        load_config(path)
    assert str(caught.value).startswith(str(path)) and "\n" not in str(caught.value)
    assert "more wrong" not in str(caught.value)


def test_all_wrong_keys_are_counted_and_named(file):
    text = "[fit]\nseed = -1\nstarts = 0\n[albedo]\nspecular = 2\n[spacecraft]\nimax = 3\n"
    with pytest.raises(InputError, match=r"\(and 3 more wrong: albedo.specular, fit.seed, fit.starts\)") as caught:
        load_config(file(text))
    assert caught.value.field == "spacecraft.imax"


def test_what_is_no_configuration_file(tmp_path):
    with pytest.raises(InputError, match="no such file"):
        load_config(tmp_path / "missing.toml")
    with pytest.raises(InputError, match="is a directory"):
        load_config(tmp_path)
    binary = tmp_path / "binary.toml"
    binary.write_bytes(b"[fit]\n# \xff\xfe\n")
    with pytest.raises(InputError, match=":2: not UTF-8 text"):
        load_config(binary)
    deep = tmp_path / "deep.toml"
    deep.write_text("x = " + "[" * 20000)
    with pytest.raises(InputError, match="TOML syntax"):
        load_config(deep)


def test_every_toml_value_survives_the_template():
    assert tomllib.loads(template())["cleaning"]["panel_order"] == ["+X", "-X", "+Y", "-Y", "+Z", "-Z"]
