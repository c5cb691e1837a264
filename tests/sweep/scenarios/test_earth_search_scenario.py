"""The scenario `earth-search`: its options, how a case ends, and what is assumed."""

from types import SimpleNamespace

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from jaxsat.errors import InputError
from jaxsat.sweep.scenarios import earth_search
from jaxsat.sweep.scenarios.earth_search import make


@pytest.mark.parametrize(
    ("given", "field"),
    [
        ({"spacecraft": "medium"}, "spacecraft"),
        ({"altitude_km": "90"}, "altitude_km"),
        ({"altitude_spread_km": "700"}, "altitude_spread_km"),
        ({"strateg": "fast"}, "strateg"),
        ({"inside": "maybe"}, "inside"),
        ({"period_s": "nan"}, "period_s"),
        ({"earth": "flat"}, "earth"),
    ],
)
def test_wrong_options_are_named(given, field):
    with pytest.raises(InputError, match=field):
        make(given)


@pytest.mark.slow
def test_a_capture_counts_once_it_has_lasted():
    """Tracking at the nadir from 40 s on: not yet held after 50 s, held after 60."""
    q, up = np.array([[1.0, 0.0, 0.0, 0.0]]), np.array([[0.0, 0.0, -1.0]])

    @jax.jit
    def outcome(time, mode, up):
        numbers = dict(first_signal=1.0, first_capture=40.0, last_capture=40.0, captures=1.0)
        state = SimpleNamespace(quaternion=jnp.asarray(q), up=up, angular_velocity=jnp.zeros((1, 3)), time=time)
        state.__dict__.update({name: jnp.array([value]) for name, value in numbers.items()})
        state.memory = SimpleNamespace(mode=mode)
        return earth_search.outcome(state, 15.0)

    def status(now, mode=2, up=up):
        found = outcome(np.array([now]), np.array([mode]), up)
        return earth_search.STATUSES[int(found["status"][0])], float(found["search_time_s"][0])

    assert status(60.0) == ("succeeded", 40.0)
    assert status(50.0)[0] == "only just captured" and np.isnan(status(50.0)[1])
    assert status(60.0, mode=1)[0] == "lost again"
    assert status(60.0, up=-up)[0] == "false capture"


def test_what_is_assumed_is_said():
    assert make({}).assumptions == earth_search.ASSUMPTIONS and len(earth_search.ASSUMPTIONS) > 5
