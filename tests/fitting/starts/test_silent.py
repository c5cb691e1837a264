"""Panels that never show light: begun as dead too, and the others left as bright as they are."""

import dataclasses

import numpy as np
import pytest

from fitting.measurements.assembly import Samples
from fitting.parameters.chosen import chosen_leaves
from fitting.parameters.free import free_parameters
from fitting.starts.silent import silent_panels
from jaxsat.bundled import BUNDLED
from jaxsat.panel_names import PANEL_NAMES
from jaxsat.satellites import read_satellite
from jaxsat.telemetry import read_telemetry

DARK = 3
NORMALS = np.repeat(np.eye(3), 2, axis=0) * np.tile([1.0, -1.0], 3)[:, None]


@pytest.fixture(scope="module")
def satellite():
    return read_satellite()


def free_of(satellite, free):
    names = chosen_leaves(satellite.leaves, free, satellite.aliases)
    return free_parameters(satellite.model, satellite.leaves, names, held=satellite.held)


def with_currents(satellite, currents):
    session = read_telemetry(BUNDLED, satellite)
    whole = Samples.of(session.channels, session.epoch, session.columns)
    few = whole.part(slice(len(currents)))
    return dataclasses.replace(few, values={**few.values, "cells": currents})


def currents_of(suns, dark):
    return 0.24 * np.maximum(suns @ NORMALS.T, 0.0) * (~dark)


def test_dark_panels_of_free_gain_are_silent_and_left_out(satellite):
    suns = np.random.default_rng(3).normal(size=(40, 3))
    suns /= np.linalg.norm(suns, axis=1, keepdims=True)
    dark, none = np.arange(6) == DARK, np.zeros(6, bool)
    samples = with_currents(satellite, currents_of(suns, dark))
    silent = silent_panels(samples, satellite.model, free_of(satellite, ["gains"]))
    np.testing.assert_array_equal(silent.panels["cells"], [DARK])
    left = silent.left_out(samples).values["cells"]
    np.testing.assert_array_equal(np.isnan(left), np.broadcast_to(dark, left.shape))

    def panels_of(currents, free):
        return silent_panels(with_currents(satellite, currents), satellite.model, free_of(satellite, free)).panels

    assert not panels_of(currents_of(suns, dark), ["magnet"])
    assert not panels_of(currents_of(suns, none), ["gains"])
    assert not panels_of(np.zeros((40, 6)), ["gains"])
    # The Sun on the dead panel is seen by what is left of it on the others, and not where a live one would show it.
    directions = [satellite.model.sensors["cells"].direct(rows, 2e-3)[0] for rows in (samples.values["cells"], left)]
    apart = [np.degrees(np.arccos(np.clip(np.sum(each * suns, axis=1), -1.0, 1.0))) for each in directions]
    seen = (suns @ NORMALS[DARK] > 0.5) & np.isfinite(apart[1])
    assert np.nanmin(apart[0][seen]) > 20.0 and np.nanmax(apart[1][seen]) < 5.0 and seen.sum() > 3


@pytest.mark.parametrize("free", [["gains"], ["gains", "imax"]])
def test_a_dead_panel_leaves_the_others_as_bright_as_they_are(satellite, free):
    suns = np.vstack([np.eye(3), -np.eye(3)])
    own = free_of(satellite, free)
    silent = silent_panels(with_currents(satellite, currents_of(suns, np.arange(6) == DARK)), satellite.model, own)
    x = silent.unknowns(own)
    shift = dict(zip(own.names[6:], own.sigma() * x[6:], strict=True))
    gains = np.array([1.0 + shift[f"gains.{panel}"] for panel in PANEL_NAMES])
    if "imax" in free:
        # Their mean is held.
        gains /= gains.mean()
    full = (0.24 + shift.get("imax", 0.0)) * gains
    np.testing.assert_allclose(full, 0.24 * (np.arange(6) != DARK), rtol=1e-12, atol=1e-15)
    np.testing.assert_array_equal(x[:6], 0.0)
