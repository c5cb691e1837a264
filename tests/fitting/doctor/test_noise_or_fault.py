"""Whether residuals are larger noise or a fault: the sizes of residuals of a fault have a memory."""

import numpy as np

from fitting.doctor.causes.scales import SIZES_P, WHITE_P, sizes_p


def test_sizes_of_noise_have_no_memory_and_those_of_a_fault_have():
    noise = 2.5 * np.random.default_rng(3).standard_normal((130, 6))
    slot = np.arange(130)
    assert sizes_p(noise, slot) > WHITE_P
    # A motion that drifts away from that of the data: signs change as before.
    assert sizes_p(noise * np.linspace(0.2, 2.0, 130)[:, None], slot) < SIZES_P
    assert sizes_p(noise[:0], slot[:0]) == 1.0
