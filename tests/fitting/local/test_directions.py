"""Directions sample by sample: rates by finite turns, and what is carried between two readings is less sure."""

import numpy as np
from scipy.spatial.transform import Rotation

from fitting.local.directions import _carried_sigma, sample_rates
from fitting.starts.sights import carried


def test_rates_of_a_steady_spin_with_gaps():
    t = np.array([0.0, 2.0, 4.0, 6.0, 30.0, 32.0, 34.0, 50.0])
    rate = np.radians([3.0, -8.0, 5.0])
    attitude = (Rotation.random(rng=np.random.default_rng(1)) * Rotation.from_rotvec(t[:, None] * rate)).as_quat(
        scalar_first=True
    )
    attitude[2] = np.nan
    found = sample_rates(t, attitude)
    # Nothing near 50 s; at 2 s the neighbour after it is at 6 s, two usual intervals on.
    assert np.isnan(found[[2, 7]]).all()
    np.testing.assert_allclose(found[[0, 1, 3, 4, 5, 6]], np.tile(rate, (6, 1)), atol=1e-12)
    assert np.isnan(sample_rates(t[:1], attitude[:1])).all()


def test_the_sigma_of_what_is_carried_covers_its_error():
    t = np.arange(0.0, 60.0, 1.0)
    spin = Rotation.from_rotvec(t[:, None] * np.radians([0.0, 0.0, 6.0]))
    for tilt in np.radians([20.0, 45.0, 70.0, 90.0]):
        true = spin.apply([np.sin(tilt), 0.0, np.cos(tilt)])
        read, sigma = true.copy(), np.full(len(t), 1e-3)
        read[t % 5 != 0], sigma[t % 5 != 0] = np.nan, np.nan
        whole, spread = carried(t, read, unit=True), _carried_sigma(read, sigma)
        inside = t <= 55.0
        error = np.linalg.norm(whole - true, axis=1)[inside]
        assert np.all(error < 3.0 * spread[inside]) and np.all(spread[t % 5 == 0] == 1e-3)
        # And is not far above it: the arc of this one is all of the error.
        assert np.radians(30.0) ** 2 / 8.0 + 1e-3 > spread[inside].max()
