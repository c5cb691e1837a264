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


def test_bins_hold_whole_numbers_and_never_go_down_into_rounding():
    counted = summarise_metric("firings", Metric("1", ""), RNG.poisson(6.0, 3000).astype(float), SUCCESS)
    # Zero but for the last bits in nine cases of ten.
    zero = np.where(RNG.random(3000) < 0.9, 1e-14 * RNG.random(3000), 10.0 * RNG.random(3000))
    rounding = summarise_metric("worst_estimate_deg", Metric("deg", "largest error"), zero, SUCCESS)
    few = summarise_metric("few", Metric("1", ""), RNG.normal(size=40), np.ones(40, bool))
    axes = draw_distributions([counted, rounding, few]).axes
    assert counted.whole and not rounding.whole and not rounding.logarithmic and len(few.edges) == 14
    assert all(tick == round(tick) for tick in axes[0].get_xticks())
    assert axes[1].get_xscale() == "linear" and axes[1].get_xlabel() == "Worst estimate, deg"
    assert axes[1].get_title("left").startswith("5, 50, 95 %: 0.000, 0.000, ")
    assert "largest error" in [text.get_text() for text in axes[1].texts]


def test_history():
    t = np.linspace(0.0, 100.0, 50)
    panels = {"angle, deg": {"": np.sin(t)}, "rate, deg/s": {c: np.cos(t + k) for k, c in enumerate("xyz")}}
    drawn = pixels(png_bytes(draw_history(t, panels, title="a", subtitle="b")))
    half = drawn.shape[0] // 2
    assert drawn[:half].std() > 0.03 and drawn[half:].std() > 0.03
