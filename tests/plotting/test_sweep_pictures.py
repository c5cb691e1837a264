"""Pictures of a sweep and of a case, drawn and not blank, with metrics of all kinds."""

import io

import numpy as np
import pytest
from matplotlib.image import imread

from jaxsat.plotting import png_bytes
from jaxsat.plotting.distributions import draw_distributions
from jaxsat.plotting.history import draw_history
from jaxsat.sweep import Metric
from jaxsat.sweep.summary import summarise_metric

RNG = np.random.default_rng(2)
SUCCESS = RNG.random(3000) < 0.9
COLUMNS = {
    "normal_deg": RNG.normal(size=3000),
    "wide_s": np.exp(3.0 * RNG.normal(size=3000)),
    "constant": np.full(3000, 2.0),
    "absent": np.full(3000, np.nan),
    "strays_m": np.where(np.arange(3000) == 5, 1e9, RNG.normal(size=3000)),
}


def pixels(png: bytes) -> np.ndarray:
    assert png[:8] == b"\x89PNG\r\n\x1a\n"
    return imread(io.BytesIO(png))[..., :3]


@pytest.mark.slow
@pytest.mark.parametrize("count", [0, 1, 5])
def test_distributions(count):
    metrics = [
        summarise_metric(name, Metric("1", ""), values, SUCCESS) for name, values in list(COLUMNS.items())[:count]
    ]
    picture = draw_distributions(metrics, title="a", subtitle="3000 cases")
    drawn = pixels(png_bytes(picture))
    assert (drawn.std() > 0.05) == (count > 0)


def test_failures_can_be_seen():
    def drawn(success):
        return png_bytes(draw_distributions([summarise_metric("a", Metric("1", ""), COLUMNS["normal_deg"], success)]))

    assert drawn(SUCCESS) != drawn(np.ones(3000, bool))


def test_history():
    t = np.linspace(0.0, 100.0, 50)
    panels = {"angle, deg": {"": np.sin(t)}, "rate, deg/s": {c: np.cos(t + k) for k, c in enumerate("xyz")}}
    drawn = pixels(png_bytes(draw_history(t, panels, title="a", subtitle="b")))
    half = drawn.shape[0] // 2
    assert drawn[:half].std() > 0.03 and drawn[half:].std() > 0.03
