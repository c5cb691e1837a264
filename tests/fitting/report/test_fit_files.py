"""The directory of a fit of any satellite: tables that hold what was fitted, a page of them, nothing half-written."""

import csv
import json
import re
from html.parser import HTMLParser

import numpy as np
import pytest
from made_up_fit import make_fit_result, make_session, write_made_up

from fitting.report.fit.files import write_fit
from fitting.report.fit.owned import file_stems, owned_files
from fitting.report.fit.shown import readings_of
from jaxsat.files.staging import staged_directory


def table(path):
    with path.open() as stream:
        names, *rows = csv.reader(stream)
    return names, [dict(zip(names, row, strict=True)) for row in rows]


class Texts(HTMLParser):
    def __init__(self):
        super().__init__()
        self.texts = []

    def handle_data(self, data):
        self.texts.append(data)


@pytest.mark.slow
def test_every_file_is_there_and_documented(fit_run):
    names = {path.name for path in fit_run.iterdir()}
    tables = {"attitude.csv", "channel-mag.csv", "channel-gyro.csv", "channel-star.csv", "channel-a_b_cells.csv"}
    assert names == tables | {"fit.json", "provenance.json", "scene.json", "curves.json", "report.html"}
    provenance = json.loads((fit_run / "provenance.json").read_text())
    assert {name: list(columns) for name, columns in provenance["columns"].items()} == {
        name: table(fit_run / name)[0] for name in tables
    }
    assert provenance["seed"] == 3 and provenance["warnings"] == ["stamps are whole seconds"]
    assert names <= set(owned_files(fit_run, make_fit_result().channels))


@pytest.mark.slow
def test_tables_hold_the_readings(fit_run):
    mag = make_fit_result().channels["mag"]
    names, rows = table(fit_run / "channel-mag.csv")
    assert names[2:5] == ["measured_bx_nT", "measured_by_nT", "measured_bz_nT"]
    assert len(rows) == 120 and rows[5]["measured_bx_nT"] == rows[5]["residual_bx_sigma"] == ""
    np.testing.assert_allclose([float(row["modelled_by_nT"]) for row in rows], mag.modelled[:, 1], rtol=1e-9)
    assert [row["fitted"] for row in rows] == ["1"] * 80 + ["0"] * 40
    assert [k for k, row in enumerate(rows) if row["used"] == "0"] == [3, 8]
    assert rows[1]["utc"] == "2024-03-01T12:00:05.000"
    assert [row["weight_bx"] for row in rows[9:13]] == ["1", "0.1", "0.1", "1"] and rows[3]["weight_by"] == "0"
    names, rows = table(fit_run / "channel-a_b_cells.csv")
    direct, modelled = (np.array([float(row[f"{part}_i2_mA"]) for row in rows]) for part in ("direct", "modelled"))
    np.testing.assert_allclose(direct, 0.8 * modelled, rtol=1e-9)
    _, rows = table(fit_run / "attitude.csv")
    assert {row["t_s"] for row in rows if row["limited"] == "1"} == {"30", "32", "35", "36", "40"}


@pytest.mark.slow
def test_orbit_and_scene_are_those_of_the_surroundings(fit_run):
    fit = json.loads((fit_run / "fit.json").read_text())
    scene = json.loads((fit_run / "scene.json").read_text())
    position = np.array(fit["orbit"]["position_eci_m"])
    assert fit["orbit"]["object_name"] == "TESTSAT" and fit["orbit"]["object_id"] == "2024-001A"
    assert position.shape == (240, 3)
    np.testing.assert_allclose(np.linalg.norm(position, axis=1), 6.9e6, atol=7.0e3)
    # Kepler's third law of 6900 km.
    assert scene["orbit"]["period_s"] == pytest.approx(2 * np.pi * np.sqrt(6.9e6**3 / 3.986004418e14), rel=1e-6)
    np.testing.assert_allclose(scene["track"]["position_km"][0], position[0] / 1e3, atol=0.02)
    np.testing.assert_allclose(scene["orbit"]["position_km"][0], position[0] / 1e3, atol=0.1)
    axis = fit["orbit"]["elements"]["semi_major_axis"]
    assert axis["unit"] == "m" and abs(axis["value"] - 6.9e6) < 4.0 * axis["sigma"] < 1000.0


@pytest.mark.slow
def test_page_says_the_verdict_and_has_a_place_for_each_channel(fit_run):
    html = (fit_run / "report.html").read_text()
    parser = Texts()
    parser.feed(html)
    text = " ".join(parser.texts)
    words = ("Predicts.", "Channel a/b cells", "mag.bias.x", "54321", "unreadable time", "+x, -z, +y")
    tables = ("Residual diagnostics", "Ljung-Box p", "What the data hardly see", "common scale of magnet and inertia")
    rest = ("250 rows gave samples at 240 times.", "semi major axis", "body.size_m", "left out as limited", "holdout")
    for part in (*words, *tables, *rest):
        assert part in text, part
    for number in range(4):
        assert f'data-live="channel-{number}"' in html
    # The answer comes first: verdict, numbers, doubts, parameters; who asks for the settings opens them.
    heads = re.findall(r"<h2>([^<]*)</h2>", html)
    assert html.index("Predicts.") < html.index("<h2>") and heads[:2] == ["Key numbers", "What to doubt"]
    assert heads.index("Parameters") < heads.index("Channels") < heads.index("Motion")
    for folded in ("Parameters that were held", "Provenance", "Settings", "Satellite file"):
        assert f'<details class="folded"><summary><h2>{folded}</h2>' in html
    for name in ("attitude.csv", "channel-a_b_cells.csv", "fit.json"):
        assert f'<a href="{name}">' in html
    data = json.loads(html.split('id="data">')[1].split("</script>")[0])
    assert data["size"] == [0.2941, 0.2941, 1.0] and len(data["held_s"]) == 1
    assert data["held_s"][0] == [pytest.approx(398.0), 596.0]
    assert [c["paired"] for c in data["channels"]] == [True, True, False, True]
    assert ['data-live="field-angle"' in html, "direct" in data["channels"][0]["readings"][0]] == [True, False]
    cells = data["channels"][3]
    assert cells["scale"][1] == 500.0 and cells["residuals"][0]["light"] == [10, 11]
    # Lines go through more points than there are samples; of direct light there are no others.
    lit = cells["readings"][2]
    np.testing.assert_allclose(lit["direct_line"], 0.8 * np.array(lit["line"]), atol=1e-2)
    assert len(lit["line"]) == len(data["curve"]["t_s"]) == 479 and "direct" not in lit and len(lit["modelled"]) == 60
    assert (
        data["channels"][0]["use"][:5] == [1, 1, 1, 3, 1] and data["channels"][0]["readings"][0]["measured"][5] is None
    )


def test_a_fit_without_orbit_has_no_scene(tmp_path):
    result = make_fit_result(illumination=None, field_angle_deg=None, field_angle_sigma_deg=None)
    settings = {"telemetry": "p", "label": "p", "session": make_session(), "settings": {}, "draw": None}
    write_fit(tmp_path, result, epoch=make_session().epoch, **settings)
    assert not (tmp_path / "scene.json").exists()
    assert "orbit" not in json.loads((tmp_path / "fit.json").read_text())
    assert table(tmp_path / "attitude.csv")[1][0]["lit"] == ""


def test_nothing_half_written_stays_and_old_channels_go(tmp_path, monkeypatch):
    out = tmp_path / "run"
    out.mkdir()
    for name in ("channel-old.csv", "currents.csv", "mine.txt"):
        (out / name).write_text("old")

    def fails(*_, **__):
        raise RuntimeError("no page")

    with monkeypatch.context() as patched:
        patched.setattr("fitting.report.fit.files.fit_page", fails)
        with pytest.raises(RuntimeError, match="no page"):
            write_made_up(out, plots=False)
    assert {path.name for path in out.iterdir()} == {"channel-old.csv", "currents.csv", "mine.txt"}
    with staged_directory(out, owned_files(out, ["mag"])) as stage:
        (stage / "fit.json").write_text("{}")
    assert {path.name for path in out.iterdir()} == {"fit.json", "mine.txt"}
    assert {path.name for path in tmp_path.iterdir()} == {"run"}


def test_channels_of_any_name_have_a_file_of_their_own():
    stems = file_stems(["mag", "a/b", "a b", "../x"])
    assert list(stems.values()) == ["channel-mag", "channel-a_b", "channel-a_b_", "channel-___x"]


def test_quaternions_are_shown_without_jumps_of_sign():
    shown = readings_of(make_fit_result().channels["star"])
    steps = np.einsum("ni,ni->n", shown.modelled[1:], shown.modelled[:-1])
    assert steps.min() > 0.0 and not shown.paired and shown.differences == ("turn x", "turn y", "turn z")
    good = np.isfinite(shown.measured).all(axis=1) & shown.used
    np.testing.assert_allclose(shown.measured[good], shown.modelled[good], atol=0.05)


@pytest.mark.slow
def test_pictures_are_there_with_plots(tmp_path):
    write_made_up(tmp_path / "run", plots=True)
    names = {path.name for path in (tmp_path / "run").glob("*.png")}
    channels = {f"channel-{name}.png" for name in ("mag", "gyro", "star", "a_b_cells")}
    assert names == channels | {"attitude.png", "field_angle.png", "orbit.png", "parameters.png", "worth.png"}
    # Those of parameters and worth are tables in the page.
    assert (tmp_path / "run" / "report.html").read_text().count("data:image/png") == 7
