"""What cases of any satellite are drawn from beside the numbers of its file."""

import numpy as np

from jaxsat.sweep.inputs import Input, upright

ATTITUDE = Input(
    "attitude",
    "1",
    "quaternion at the start, scalar first, from body to inertial axes, true equator and equinox of date",
    lambda drawn: upright(drawn.motion.quaternion),
    tuple("wxyz"),
)
RATE = Input(
    "rate", "deg/s", "at the start, body axes", lambda drawn: np.degrees(drawn.motion.angular_velocity), tuple("xyz")
)


def start_inputs(max_rate: float) -> tuple[Input, ...]:
    """Attitude, and the rate where there is any."""
    return (ATTITUDE, RATE) if max_rate > 0.0 else (ATTITUDE,)
