"""The page of a turn: its angle in the place of time, everything about the satellite still."""

import json
import re

import numpy as np
from scipy.spatial.transform import Rotation

from jaxsat.cli.turn.space import ELLIPSE, Surroundings, Turned, turn_page

ROUND = np.linspace(0.0, 2.0 * np.pi, ELLIPSE)
AROUND = Surroundings(
    t_s=448.0,
    radius_m=6371200.0,
    ellipse=1.2 * np.column_stack([np.cos(ROUND), np.sin(ROUND), 0.0 * ROUND]),
    velocity_m_s=np.array([0.0, 7.0e3, 0.0]),
    sun=np.array([-1.0, 0.0, 0.0]),
    field_T=np.array([0.0, 0.0, -3.0e-5]),
    greenwich=1.0,
)


def test_angle_is_the_time_of_the_page():
    angles = np.arange(361.0)
    q = Rotation.from_euler("z", angles[:, None], degrees=True).as_quat(scalar_first=True)
    modelled = 100.0 * np.maximum(np.cos(np.radians(angles))[:, None] * np.ones(6), 0.0)
    turned = Turned(angles, q, modelled, modelled, np.full(6, 50.0), 2.0)
    text = turn_page(
        turned,
        AROUND,
        about="field",
        chosen_deg=60.0,
        epoch_utc="2001-01-18T04:54:15.000",
        title="Turned about the field",
        subtitle="a session",
        message="Residual RMS 0 mA.",
        pictures={"space.png": b"", "turn.png": b""},
    )
    block = re.search(r'<script type="application/json" id="data">(.*?)</script>', text, re.DOTALL)
    assert block is not None
    data = json.loads(block[1])
    assert data["turn"] == {"about": "field", "t_s": 448.0, "angle_deg": 60.0}
    scene = data["scene"]
    # Behind the Earth as the Sun sees it: in shadow at every angle.
    assert scene["shadow_s"] == [[0.0, 360.0]] and scene["earth"]["rotation_rate_rad_s"] == 0.0
    assert len({tuple(row) for row in scene["track"]["position_km"]}) == 1
    np.testing.assert_allclose(scene["track"]["position_km"][0], [1.2 * 6371.2, 0.0, 0.0], atol=0.06)
    w, x, y, z = scene["attitude"]["quaternion_inertial_from_body"][90]
    np.testing.assert_allclose([w, x, y, z], [np.sqrt(0.5), 0.0, 0.0, np.sqrt(0.5)], atol=1e-5)
    # Body x stays across the field, which points down.
    assert set(data["samples"]["field_angle_deg"]) == {90.0}
    (currents,) = data["channels"]
    assert currents["residuals"][0]["residual"][60] == 0.0 and currents["residuals"][0]["residual"][90] == 25.0
