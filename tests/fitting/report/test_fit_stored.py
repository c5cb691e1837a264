"""A fit of any satellite read back from its files: the same result, the same page; `view` and `export` take it."""

import dataclasses
import json
import re
import shutil

import jax
import numpy as np
import pytest
from made_up_fit import make_fit_result

from fitting.report.stored_run import Run, read_run
from jaxsat.cli.main import run
from jaxsat.errors import InputError

pytestmark = pytest.mark.slow


def test_the_result_comes_back(fit_run):
    stored, made = read_run(fit_run), make_fit_result()
    assert isinstance(stored, Run)
    for field in dataclasses.fields(made):
        before, after = getattr(made, field.name), getattr(stored.result, field.name)
        if isinstance(before, np.ndarray):
            np.testing.assert_allclose(after, before, rtol=1e-9, atol=1e-12, err_msg=field.name)
        elif field.name == "between":
            jax.tree.map(np.testing.assert_array_equal, vars(after), vars(before))
        elif field.name not in ("channels", "timing_s", "parameters"):
            assert after == before, field.name
    for name, channel in made.channels.items():
        again = stored.result.channels[name]
        for field in dataclasses.fields(channel):
            before, after = getattr(channel, field.name), getattr(again, field.name)
            if isinstance(before, np.ndarray):
                if channel.kind == "StarTracker" and field.name in ("measured", "modelled"):
                    before, after = np.abs(before), np.abs(after)
                np.testing.assert_allclose(after, before, rtol=1e-9, atol=1e-9, err_msg=f"{name}.{field.name}")
            else:
                assert after == before, f"{name}.{field.name}"
    assert [p.note for p in stored.result.parameters] == [p.note for p in made.parameters]


def test_view_builds_the_same_page(fit_run, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert run(["view", str(fit_run), "--no-open", "--out", "again"]) == 0
    again = (tmp_path / "again/report.html").read_text()
    targets = [target for target in re.findall('href="([^"#]*)"', again) if not target.startswith("data:")]
    assert len(targets) > 6 and all((tmp_path / "again" / target).resolve().is_file() for target in targets)
    way = targets[0].removesuffix("attitude.csv")
    assert again.replace(f'href="{way}', 'href="') == (fit_run / "report.html").read_text()


def test_export_names_the_sensors(fit_run, tmp_path):
    out = tmp_path / "out"
    formats = [word for name in ("aem", "oem", "csv") for word in ("--format", name)]
    assert run(["export", str(fit_run), *formats, "--out", str(out)]) == 0
    assert "COMMENT Attitude fitted to readings of mag, gyro, star, a/b cells." in (out / "attitude.aem").read_text()
    assert re.search(r"OBJECT_NAME\s+= TESTSAT", (out / "orbit.oem").read_text())
    assert len((out / "session.csv").read_text().splitlines()) == 241


def test_an_attitude_without_orbit_is_exported_and_its_orbit_refused(fit_run, tmp_path):
    damaged = shutil.copytree(fit_run, tmp_path / "run")
    document = json.loads((damaged / "fit.json").read_text())
    del document["orbit"]
    document["attitude"]["field_angle_deg"] = None
    (damaged / "fit.json").write_text(json.dumps(document))
    assert run(["export", str(damaged), "--format", "aem", "--out", str(tmp_path / "out")]) == 0
    assert run(["export", str(damaged), "--format", "oem", "--out", str(tmp_path / "out")]) == 1


@pytest.mark.parametrize("name", ["channel-mag.csv", "provenance.json"])
def test_files_that_are_missing_or_damaged_are_refused(fit_run, tmp_path, name):
    damaged = shutil.copytree(fit_run, tmp_path / "run")
    (damaged / name).write_text("t_s\n1\n" if name.endswith("csv") else '{"schema": "jaxsat.provenance/1"}')
    with pytest.raises(InputError):
        read_run(damaged)
