"""Units against their definitions in SI."""

import math

import pytest

from jaxsat.files.units import parsed_unit


@pytest.mark.parametrize(
    ("text", "factor", "quantity"),
    [
        ("nT", 1e-9, "T"),
        ("uT", 1e-6, "T"),
        ("µT", 1e-6, "T"),
        ("G", 1e-4, "T"),
        ("mG", 1e-7, "T"),
        ("12.5 nT", 12.5e-9, "T"),
        ("7.3e-2 uT", 7.3e-8, "T"),
        ("mA", 1e-3, "A"),
        ("deg", math.pi / 180, "rad"),
        ("deg/s", math.pi / 180, "rad/s"),
        ("deg/h", math.pi / 180 / 3600, "rad/s"),
        ("mrad/s", 1e-3, "rad/s"),
        ("rpm", 2 * math.pi / 60, "rad/s"),
        ("0.5 arcsec", 0.5 * math.pi / 648000, "rad"),
        ("km", 1e3, "m"),
        ("km/s", 1e3, "m/s"),
        ("cm2", 1e-4, "m2"),
        ("mA m2", 1e-3, "A m2"),
        ("g*cm^2", 1e-7, "kg m2"),
        ("uN m", 1e-6, "N m"),
        ("m/s2", 1.0, "m/s2"),
        ("%", 1e-2, "1"),
        ("1", 1.0, "1"),
        ("counts", 1.0, "1"),
        ("mV", 1e-3, "V"),
    ],
)
def test_units(text, factor, quantity):
    found = parsed_unit(text)
    assert found.factor == pytest.approx(factor, rel=1e-14) and found.quantity == quantity and found.text == text


@pytest.mark.parametrize(
    "text", ["", "nX", "T/", "/s", "deg//s", "0 nT", "nan T", "1_0 nT", "uu T", "T2T", "m-1", "µµT"]
)
def test_what_is_no_unit(text):
    with pytest.raises(ValueError, match=r"unknown unit .*; expected one such as nT"):
        parsed_unit(text)
