"""The scenario `earth-search`: its options, a case's history, and what of it is drawn."""

from types import SimpleNamespace

import jax.numpy as jnp
import numpy as np
import pytest

from jaxsat.cli.sweep.case import write_history
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
    ],
)
def test_wrong_options_are_named(given, field):
    with pytest.raises(InputError, match=field):
        make(given)


def test_a_capture_counts_once_it_has_lasted():
    """Tracking at the nadir from 40 s on: not yet held after 50 s, held after 60."""
    q, up = np.array([[1.0, 0.0, 0.0, 0.0]]), np.array([[0.0, 0.0, -1.0]])

    def status(now, mode=2, up=up):
        memory = SimpleNamespace(mode=jnp.array([mode]))
        numbers = dict(first_signal=1.0, first_capture=40.0, last_capture=40.0, captures=1.0, time=now)
        state = SimpleNamespace(quaternion=jnp.asarray(q), up=jnp.asarray(up), angular_velocity=jnp.zeros((1, 3)))
        state.__dict__.update(memory=memory, **{name: jnp.array([value]) for name, value in numbers.items()})
        found = earth_search.outcome(state, 15.0)
        return earth_search.STATUSES[int(found["status"][0])], float(found["search_time_s"][0])

    assert status(60.0) == ("succeeded", 40.0)
    assert status(50.0)[0] == "only just captured" and np.isnan(status(50.0)[1])
    assert status(60.0, mode=1)[0] == "lost again"
    assert status(60.0, up=-up)[0] == "false capture"


def test_what_is_assumed_is_said():
    assert make({}).assumptions == earth_search.ASSUMPTIONS and len(earth_search.ASSUMPTIONS) > 5


def test_a_case_has_a_history_and_a_picture(tmp_path):
    scenario = make({"spacecraft": "small", "time_s": "60", "brightness": "even"})
    assert scenario.history is not None
    history = scenario.history(1, 5)
    columns = history.columns
    assert history.t_s[1] == 0.5 and columns["mode"].shape == (120,)
    write_history(tmp_path, history, scenario, seed=1, case=5)
    rows = (tmp_path / "history.csv").read_text().splitlines()
    assert len(rows) == 121 and rows[0].startswith("t_s,nadir_x") and "first-y_W_m2_sr" in rows[0]
    assert (tmp_path / "history.png").stat().st_size > 20_000
    nadir = np.stack([columns[f"nadir_{c}"] for c in "xyz"])
    np.testing.assert_allclose(np.linalg.norm(nadir, axis=0), 1.0, atol=1e-9)
    np.testing.assert_allclose(np.cos(np.radians(columns["error_deg"])), nadir[2], atol=1e-9)
