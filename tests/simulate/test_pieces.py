"""An arc in pieces is the arc: no time is lost or doubled, and the motion goes on as in one."""

import jax.numpy as jnp
import numpy as np
import pytest

from jaxsat.dynamics import AttitudeState
from jaxsat.environment import OrbitTable
from jaxsat.integrators import AdamsGrid
from jaxsat.simulate import pieces, simulate, simulate_many
from jaxsat.simulate.pieces import most_steps, pieces_of
from jaxsat.spacecraft import Spacecraft
from jaxsat.torques import PermanentMagnet

# Samples at the start, twice at one time, dense, and behind gaps longer than a piece.
UNEVEN = np.array([0.0, 0.0, 7.0, 7.0, *np.arange(10.0, 500.0, 10.0), 2000.0, 9000.0, 9000.5])


@pytest.mark.parametrize("sign", [1.0, -1.0])
@pytest.mark.parametrize("times", [UNEVEN, UNEVEN[-1:], np.arange(1.0, 9001.0, 30.0)], ids=["uneven", "end", "even"])
def test_pieces_follow_each_other(times, sign):
    found = pieces_of(sign * times, start=0.0, max_step=3.0, most=100)
    assert len(found) > 25
    assert np.concatenate([np.arange(len(times))[piece.samples] for piece in found]).tolist() == list(range(len(times)))
    begin = 0.0
    for piece in found:
        nodes, grid = piece.grid.node_times[: len(piece.grid.node_times) + piece.count - piece.grid.steps], piece.grid
        assert nodes[0] == begin
        begin = nodes[-1]
        assert abs(grid.step) <= 3.0 * (1 + 1e-9)
        # What is read: a polynomial in time through the steps is time itself.
        ends = nodes[0] + grid.step * np.arange(int(piece.count) + 1)
        read = np.sum(ends[grid.sample_first[:, None] + np.arange(10)] * grid.sample_weights, axis=1)
        np.testing.assert_allclose(read[0], begin, atol=1e-9)
        np.testing.assert_allclose(read[piece.read], sign * times[piece.samples], atol=1e-9)
    assert begin == sign * times[-1]
    assert len({(piece.grid.steps, len(piece.grid.sample_first)) for piece in found}) == 1


def test_steps_that_memory_allows():
    assert most_steps(0) == 65536
    assert most_steps(2000) == 2048
    assert pieces_of(UNEVEN, start=0.0, max_step=3.0, most=4096)[0].samples == slice(0, len(UNEVEN))


@pytest.mark.slow
def test_a_motion_in_pieces_is_the_motion(monkeypatch):
    """A magnet in a field that turns, to the tolerance of the steps, which begin anew thirty times."""

    def around(times):
        field = 3e-5 * jnp.stack([jnp.cos(2e-3 * times), jnp.sin(2e-3 * times), 0.3 + 0.0 * times], axis=-1)
        return OrbitTable(jnp.full((*times.shape, 3), 4e6), field)

    craft = Spacecraft(jnp.diag(jnp.array([0.04, 0.05, 0.06])), jnp.array([0.2, 0.1, 0.3]))
    q, w = np.array([0.8, 0.0, 0.6, 0.0]), np.array([0.01, -0.02, 0.015])
    given = ((PermanentMagnet(),), np.linspace(60.0, 6000.0, 40))

    def both():
        one = simulate(craft, AttitudeState(q, w), around, given[1], torques=given[0], tolerance=1e-9)
        many = AttitudeState(np.tile(q, (3, 1)), np.tile(w, (3, 1)))
        options = {"torques": given[0], "max_step": 2.0}
        return one, *(simulate_many(craft, many, around, t, **options) for t in (given[1], given[1][-1:]))

    whole = both()
    monkeypatch.setattr(pieces, "LEAST", 100)
    monkeypatch.setattr(pieces, "MOST", 100)
    for found, expected in zip(both(), whole, strict=True):
        np.testing.assert_allclose(found.quaternion, expected.quaternion, rtol=0, atol=3e-8)
        np.testing.assert_allclose(found.angular_velocity, expected.angular_velocity, rtol=0, atol=1e-9)
    grid = whole[0].grid
    assert isinstance(grid, AdamsGrid) and grid.steps > 3000
