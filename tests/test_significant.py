"""Numbers as text: digits follow the uncertainty."""

import math

import pytest

from jaxsat.significant import count_text, spans_text, value_and_sigma, value_text


@pytest.mark.parametrize(
    ("value", "sigma", "expected"),
    [
        (0.30495683, 0.0011, ("0.3050", "0.0011")),
        (251.4075, 0.327, ("251.41", "0.33")),
        (1.0, 0.0996, ("1.00", "0.10")),
        (-0.00092, 0.0044, ("-0.0009", "0.0044")),
        (-0.012, 1.0, ("0.0", "1.0")),
        (1234.5, 160.0, ("1230", "160")),
        (5.0e-9, 1.2e-10, ("5.000e-09", "1.2e-10")),
        (0.05283, None, ("0.05283", "")),
        (0.05283, math.nan, ("0.05283", "")),
        (math.nan, 0.1, ("n/a", "")),
    ],
)
def test_value_and_sigma(value, sigma, expected):
    assert value_and_sigma(value, sigma) == expected


@pytest.mark.parametrize(
    ("value", "expected"), [(2.03456, "2.035"), (240.0, "240.0"), (12345.6, "1.235e+04"), (0.0, "0.000")]
)
def test_value_text(value, expected):
    assert value_text(value) == expected


def test_counts_and_spans():
    assert count_text(1, "row") == "1 row"
    assert count_text(2, "axis", "axes") == "2 axes"
    assert spans_text([9, 4, 5, 6, 6]) == "4-6, 9"
    assert spans_text(list(range(0, 40, 2)), limit=2) == "0, 2 and 18 more"
