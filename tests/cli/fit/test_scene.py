"""The scene of the bundled session against published numbers and the Almanac of its day."""

import json

import numpy as np
import pytest
from made_up_munin import make_munin_result, munin_surroundings

from fitting.report.scene import dark_spans


@pytest.fixture(scope="module")
def scene():
    return munin_surroundings().scene(make_munin_result())


def test_orbit_and_shadow_are_those_of_the_paper(scene):
    # Penkov et al. 2009, Table 1 at t = 0; entry and exit of the cylinder of 6371.2 km under the Sun of t = 0, whose
    # motion makes 0.9 s; the grid of the edges makes 1.1 s.
    np.testing.assert_allclose(scene["track"]["position_km"][0], [-3504.82, -6809.61, -2881.71], atol=0.1)
    np.testing.assert_allclose(scene["orbit"]["period_s"], 6632.848, atol=0.5)
    np.testing.assert_allclose(scene["shadow_s"], [[2747.4, 4009.6]], atol=2.0)
    dark = np.array(scene["orbit"]["lit"]) == 0
    times = np.linspace(0.0, scene["orbit"]["period_s"], len(dark))
    np.testing.assert_allclose([times[dark][0], times[dark][-1]], [2746.0, 4008.6], atol=20.0)


def test_sun_and_field_are_those_of_the_day(scene):
    x, y, z = scene["sun_eci"][0]
    np.testing.assert_allclose(np.degrees(np.arctan2(y, x)) % 360.0, 300.265358, atol=5e-3)
    np.testing.assert_allclose(np.degrees(np.arcsin(z)), -20.528203, atol=5e-3)
    # In mid-ocean, 2000 km from either pole of the field, it has between a quarter and the whole of its polar strength.
    strength = np.linalg.norm(scene["track"]["field_uT"], axis=1)
    assert 10.0 < strength.min() < strength.max() < 50.0


def test_field_lines_go_through_the_satellite_along_the_field(scene):
    lines = np.array(scene["field_lines_km"], float).reshape(97, -1, 3)
    track = np.array(scene["track"]["position_km"])
    times, at = np.linspace(0.0, 4480.0, 97), np.linspace(0.0, 4480.0, len(track))
    here = np.stack([np.interp(times, at, column) for column in track.T], axis=1)
    middle = lines.shape[1] // 2
    np.testing.assert_allclose(lines[:, middle], here, atol=2.0)
    b = np.stack([np.interp(times, at, column) for column in np.array(scene["track"]["field_uT"]).T], axis=1)
    along = lines[:, middle + 1] - lines[:, middle - 1]
    cosine = np.sum(along * b, axis=1) / np.linalg.norm(along, axis=1) / np.linalg.norm(b, axis=1)
    assert cosine.min() > 0.999


def test_scene_is_small_and_plain(scene):
    assert len(json.dumps(scene, allow_nan=False)) < 400_000
    assert scene["attitude"]["t_s"][0] == 0.0 and scene["attitude"]["t_s"][-1] == 4480.0


@pytest.mark.parametrize(
    ("lit", "spans"),
    [
        ([1, 1, 1, 1], []),
        ([0, 0, 1, 1], [(0.0, 2.0)]),
        ([1, 0, 1, 0], [(1.0, 2.0), (3.0, 3.0)]),
        ([0, 0, 0, 0], [(0.0, 3.0)]),
    ],
)
def test_dark_spans(lit, spans):
    assert dark_spans(np.arange(4.0), np.array(lit, bool)) == spans
