"""Pictures of profiles, whole and with open ends, are drawn and not blank."""

import io

import numpy as np
import pytest
from matplotlib.image import imread

from jaxsat.plotting import png_bytes
from jaxsat.plotting.profile import draw_profile

VALUES = np.linspace(-3.0, 3.0, 9)
RISE = 0.5 * VALUES**2 + 0.05 * VALUES**3


def picture(**changes) -> bytes:
    arguments = {"best": 0.0, "sigma": 1.0, "interval_68": (-1.0, 1.0), "interval_95": (-2.1, 1.9)}
    settled = np.arange(9) != 2
    return png_bytes(draw_profile(VALUES, RISE, name="imax", unit="mA", **{**arguments, "settled": settled, **changes}))


@pytest.mark.parametrize(
    "changes",
    [
        {"rise_data": RISE + 0.1 * VALUES},
        {"sigma": None, "interval_95": (None, None), "settled": None},
        {"interval_68": (-3.0, None), "interval_95": (-3.0, None)},
    ],
)
def test_picture_is_a_png_with_something_on_it(changes):
    png = picture(**changes)
    assert png[:8] == b"\x89PNG\r\n\x1a\n"
    pixels = imread(io.BytesIO(png))[..., :3]
    height, width = pixels.shape[:2]
    for part in (pixels[: height // 2], pixels[height // 2 :], pixels[:, : width // 2], pixels[:, width // 2 :]):
        assert part.std() > 0.03


def test_what_did_not_settle_and_what_is_open_can_be_seen():
    assert picture() != picture(settled=None)
    assert picture() != picture(interval_95=(None, 1.9))
    assert picture() == picture()
