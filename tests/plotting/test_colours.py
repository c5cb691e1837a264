"""Colours stay apart for people who see no red or no green, and are the same in pictures and pages."""

import os
import re
import subprocess
import sys
from importlib.resources import files
from itertools import combinations

import numpy as np
import pytest

from fitting.local.solutions import STATUSES
from jaxsat.panel_names import PANEL_COLOURS, PAPER_COLOURS
from jaxsat.plotting.local_attitudes import STATUS_COLOURS, STATUS_MARKS
from jaxsat.plotting.space import drawing
from jaxsat.plotting.style import AXIS_COLOURS, FAILED, LINES, SUCCEEDED
from jaxsat.sweep.scenarios._earth_search_page import COLOURS

# Machado, Oliveira and Fernandes 2009, table 1, severity 1: linear RGB.
SEEN = {
    "all": np.eye(3),
    "no red": [[0.152286, 1.052583, -0.204868], [0.114503, 0.786281, 0.099216], [-0.003882, -0.048116, 1.051998]],
    "no green": [[0.367322, 0.860646, -0.227968], [0.280085, 0.672501, 0.047413], [-0.011820, 0.042940, 0.968881]],
}
XYZ = [[0.4124564, 0.3575761, 0.1804375], [0.2126729, 0.7151522, 0.0721750], [0.0193339, 0.1191920, 0.9503041]]
SCENE = {
    "sun": drawing.SUN,
    "field": drawing.FIELD,
    "nadir": drawing.NADIR,
    "x-axis": drawing.X_AXIS,
    "orbit": drawing.ORBIT,
    "equator": drawing.EQUATOR,
    "greenwich": drawing.GREENWICH,
    "shadow-arc": drawing.SHADOW_ARC,
}


def lab(colour: str, seen) -> np.ndarray:
    """CIE L*a*b* (D65) of an sRGB colour as it is seen."""
    c = np.array([int(colour[k : k + 2], 16) for k in (1, 3, 5)]) / 255.0
    linear = np.where(c <= 0.04045, c / 12.92, ((c + 0.055) / 1.055) ** 2.4)
    xyz = np.array(XYZ) @ np.clip(np.array(seen) @ linear, 0.0, 1.0) / [0.95047, 1.0, 1.08883]
    f = np.where(xyz > 0.008856, np.cbrt(xyz), 7.787 * xyz + 16.0 / 116.0)
    return np.array([116.0 * f[1] - 16.0, 500.0 * (f[0] - f[1]), 200.0 * (f[1] - f[2])])


def nearest(colours, seen) -> float:
    return min(float(np.linalg.norm(lab(a, seen) - lab(b, seen))) for a, b in combinations(colours, 2))


@pytest.mark.parametrize("who", SEEN)
def test_colours_are_told_apart(who):
    # 2.3 is what trained eyes just see side by side (Mahy et al. 1994); ten times that for thin lines apart.
    arrows = [SCENE[name] for name in ("sun", "field", "nadir", "x-axis")]
    for colours in (PANEL_COLOURS.values(), AXIS_COLOURS.values(), (SUCCEEDED, FAILED), LINES[:4], arrows):
        assert nearest(list(colours), SEEN[who]) > 20.0


def test_those_of_the_paper_are_not():
    assert nearest(list(PAPER_COLOURS.values()), SEEN["no green"]) < 12.0
    assert list(PAPER_COLOURS) == list(PANEL_COLOURS)


def test_every_status_of_a_sample_is_drawn():
    assert set(STATUS_COLOURS) == set(STATUS_MARKS) == set(STATUSES)
    assert len(set(STATUS_MARKS.values())) == len(STATUSES)


def test_page_and_pictures_have_one_scheme():
    css = files("jaxsat.report").joinpath("page/page.css").read_text("utf-8")
    told = dict(re.findall(r"--([a-z0-9-]+): light-dark\((#[0-9a-f]{6}),", css.split(":root[data-colours")[0]))
    for name, colour in SCENE.items():
        assert told[name] == colour, name
    assert [told[f"{axis}-axis"] for axis in "xyz"] == list(AXIS_COLOURS.values())
    assert f"--ended-0: light-dark({SUCCEEDED}," in css and f"--ended-1: light-dark({FAILED}," in css
    assert COLOURS == LINES[:4]
    paper = css.split(':root[data-colours="paper"] {')[1].split("}")[0]
    assert re.findall(r"light-dark\((#[0-9a-f]{6}),", paper) == [PAPER_COLOURS[f"+{axis}"] for axis in "xyz"]


def test_the_papers_are_asked_for_by_the_environment():
    """By every command alike, so before anything is drawn; another word is refused."""
    program = "from jaxsat.plotting.style import AXIS_COLOURS; print(*AXIS_COLOURS.values())"
    for scheme, status in (("paper", 0), ("", 0), ("bright", 1)):
        environment = {**os.environ, "JAXSAT_COLOURS": scheme}
        done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, env=environment)
        assert done.returncode == status
        if status:
            assert "JAXSAT_COLOURS: 'bright' is neither 'safe' nor 'paper'" in done.stderr
        else:
            colours = PAPER_COLOURS if scheme else PANEL_COLOURS
            assert done.stdout.split() == [colours[f"+{axis}"] for axis in "xyz"]
