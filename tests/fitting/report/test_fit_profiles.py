"""Profiles, and what the data hardly see, in every output of a fit, and read back from it."""

import dataclasses
import json

import numpy as np
import pytest
from made_up_fit import make_fit_result, write_made_up

from fitting.parameters.null_space import Direction
from fitting.profile.profile import Profile
from fitting.report.fit.profiles import profile_pictures
from fitting.report.fit.result_rows import fit_facts, unseen_rows
from fitting.report.stored_run import Run, read_run

VALUES = np.linspace(247.0, 255.0, 9)
RISE = 0.5 * ((VALUES - 251.0) / 1.3) ** 2
IMAX = Profile(
    name="a/b cells.imax",
    unit="mA",
    best=251.0,
    sigma=1.3,
    values=VALUES,
    rise=RISE,
    rise_data=RISE - 0.01 * (VALUES - 251.0),
    settled=np.ones(9, bool),
    interval_68=(249.7, 252.3),
    interval_95=(248.45, None),
)
SCALE = Direction("common scale of inertia and magnet", 0.0, "|magnet| = 0.3 A m²", {"magnet.x": 0.05})
WEAK = Direction("magnet.y - mag.bias.x", 0.25, "the priors", {"magnet.y": 0.01, "mag.bias.x": -200.0})


def test_names_of_files_hold_what_a_folder_may():
    found = profile_pictures(["mag.bias.x", "a/b.x", "a b.x"])
    assert found == {
        "mag.bias.x": "profile-mag.bias.x.png",
        "a/b.x": "profile-a_b.x.png",
        "a b.x": "profile-a_b.x_.png",
    }


def test_what_the_data_hardly_see_in_words():
    result = make_fit_result(unseen=(SCALE, WEAK), gauge="as told")
    assert unseen_rows(result) == [
        (SCALE.name, "none", "|magnet| = 0.3 A m²", "magnet.x +0.05 A m²"),
        (WEAK.name, "0.25", "the priors", "magnet.y +0.01 A m², mag.bias.x -200 nT"),
    ]
    facts = dict(fit_facts(result))
    assert facts["by definition"] == "common scale of inertia and magnet fixed by |magnet| = 0.3 A m²"
    assert facts["held by the priors"] == "1 combination of parameters: magnet.y - mag.bias.x"
    assert "held by the priors" not in dict(fit_facts(make_fit_result()))


@pytest.mark.slow
def test_profiles_are_in_every_output_and_come_back(tmp_path):
    out, result = tmp_path / "out", make_fit_result(unseen=(SCALE, WEAK))
    write_made_up(out, result, plots=True, profiles=(IMAX,))
    assert (out / "profile-a_b_cells.imax.png").read_bytes().startswith(b"\x89PNG")
    document = json.loads((out / "fit.json").read_text())
    assert list(document["profiles"]) == ["a/b cells.imax"]
    entry = document["profiles"]["a/b cells.imax"]
    assert entry["values"] == VALUES.tolist() and entry["interval_68"] == [249.7, 252.3]
    assert entry["interval_95"] == [248.45, None] and entry["settled"] == [True] * 9
    assert [each["blind"] for each in document["unseen"]] == [True, False]
    assert document["unseen"][1]["components"] == {"magnet.y": 0.01, "mag.bias.x": -200.0}
    page = (out / "report.html").read_text()
    assert "<h2>Profiles</h2>" in page and "<h2>Profile of a/b cells.imax</h2>" in page and "249.7 ... 252.3" in page
    assert "248.4 ... open" in page or "248.5 ... open" in page
    assert "<h2>What the data hardly see</h2>" in page and SCALE.name in page

    stored = read_run(out)
    assert isinstance(stored, Run) and stored.result.unseen == (SCALE, WEAK) and stored.page == page
    (again,) = stored.profiles
    for field in dataclasses.fields(Profile):
        np.testing.assert_array_equal(getattr(again, field.name), getattr(IMAX, field.name))

    write_made_up(out, plots=False)
    assert not (out / "profile-a_b_cells.imax.png").exists()
    assert json.loads((out / "fit.json").read_text())["profiles"] == {}
    assert "<h2>Profile" not in (out / "report.html").read_text()
