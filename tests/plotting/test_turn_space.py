"""A turn in space: each cube shows the faces whose normals look at the eye, by vectors worked out by hand."""

import numpy as np
from matplotlib.colors import to_hex
from matplotlib.patches import Polygon
from scipy.spatial.transform import Rotation

from jaxsat.panel_names import PANEL_COLOURS
from jaxsat.plotting import draw_turn_in_space

ROUND = np.linspace(0.0, 2.0 * np.pi, 61)
ELLIPSE = 1.2 * np.column_stack([np.cos(ROUND), np.sin(ROUND), 0.0 * ROUND])
ANGLES = (30.0, 10.0, 100.0)


def test_faces_that_look_at_the_eye_are_seen():
    turned = Rotation.from_euler("z", np.array(ANGLES)[:, None], degrees=True).as_matrix()
    figure = draw_turn_in_space(
        turned,
        ANGLES,
        position=ELLIPSE[0],
        velocity=np.array([0.0, 7.0, 0.0]),
        ellipse=ELLIPSE,
        lit=np.ones(61, bool),
        sun=np.array([0.0, 1.0, 0.0]),
        field=np.array([0.0, 0.0, -30.0]),
        greenwich=0.3,
        title="Turned",
    )
    (axes,) = figure.axes
    cubes = [to_hex(patch.get_facecolor()) for patch in axes.patches if isinstance(patch, Polygon)]
    # The eye is above the orbit, here that of the equator, and on the satellite's side.
    eye = np.array([0.55, 0.0, 1.35])
    expected = [
        colour
        for body in turned
        for k, colour in enumerate(PANEL_COLOURS.values())
        if (1.0 - 2.0 * (k % 2)) * (eye @ body[:, k // 2]) > 1e-9
    ]
    assert cubes == [colour.lower() for colour in expected]
    texts = [text.get_text() for text in axes.texts]
    assert {"turned by 30 deg", "10 deg", "100 deg", "Sun", "B", "nadir"} <= set(texts)
