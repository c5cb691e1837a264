"""A fit without a search: a made-up result with the shapes and the life of real ones."""

from dataclasses import replace

import pytest
from made_up_munin import make_munin_result, write_munin

from fitting.identify import Identified


@pytest.fixture
def fake_fit(monkeypatch):
    """Puts a stand-in in the place of the search; returns a dict whose entries change the result it gives."""
    return put_fake_fit(monkeypatch)


@pytest.fixture(scope="session")
def fitted_run(tmp_path_factory):
    """The directory of a made-up fit of the bundled session, pictures and all; not to be changed."""
    out = tmp_path_factory.mktemp("fitted") / "run"
    write_munin(out, plots=True)
    return out


def put_fake_fit(monkeypatch) -> dict:
    """Does the work of `fake_fit`."""
    changes: dict = {}

    def identify(samples, model, around, parameters, settings, *, progress, **_):
        progress("arc 1", 1, 2)
        if "error" in changes:
            raise changes["error"]
        return Identified((), samples, parameters, len(samples.t), 1.0, {"prepare": 0.0, "compile": 0.0, "solve": 0.0})

    monkeypatch.setattr("fitting.run.identify", identify)
    monkeypatch.setattr(
        "fitting.run.summarize",
        lambda found, *_: replace(make_munin_result(), timing_s=found.timing_s, **changes),
    )

    # The cache of compiled programs belongs to the user, the settings of JAX to the test session.
    monkeypatch.setattr("jaxsat.numerics.set_up_jax", lambda: None)
    return changes
