"""From the directory of a sweep to its indices; one line for each kind of directory that has none."""

import json
import shutil
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from fitting.sensitivity.sweeps import holds_sweep, read_sweep, write_sweep_indices
from fitting.sensitivity.sweeps.report import HEAD
from jaxsat.cli.main import run
from jaxsat.errors import InputError
from jaxsat.sweep import Source

FOLDER = Path(__file__).parents[3] / "sweep"


@pytest.fixture(scope="module")
def swept(tmp_path_factory):
    """800 cases of the scenario without physics: a miss is its push along x, success its luck."""
    out = tmp_path_factory.mktemp("sweep") / "out"
    with pytest.MonkeyPatch.context() as patch:
        patch.syspath_prepend(FOLDER)
        patch.setattr("jaxsat.numerics.set_up_jax", lambda: None)
        arguments = ["fake_scenario:make", "--cases", "800", "--seed", "3", "--set", "chunk=100", "--out", str(out)]
        assert run(["sweep", *arguments, "--no-plots", "--quiet"]) == 0
        assert Source.of("fake_scenario:make", {}).scenario().inputs
    return out


@pytest.fixture
def copy(swept, tmp_path):
    return Path(shutil.copytree(swept, tmp_path / "copy"))


def test_indices_of_a_sweep_are_those_of_its_scenario(swept, tmp_path, capsys):
    told = []
    document, rows, said = write_sweep_indices(swept, tmp_path / "out", progress=told.append)
    assert capsys.readouterr() == ("", "")
    assert sorted(path.name for path in (tmp_path / "out").iterdir()) == ["indices.json", "indices.png"]
    assert (tmp_path / "out" / "indices.png").read_bytes()[:4] == b"\x89PNG"
    found = json.loads((tmp_path / "out" / "indices.json").read_text())
    assert found == document and found["schema"] == "jaxsat.indices/1" and found["seed"] == 3
    assert told == list(found["metrics"]) == ["success", "miss_deg", "settling_time_s"]
    assert found["inputs"]["push"] == {
        "unit": "m/s",
        "meaning": "at the start",
        "columns": ["in_push_x_m_s", "in_push_y_m_s"],
    }
    status = pq.read_table(swept / "cases.parquet")["status"].to_pylist()
    failed = 800 - status.count("succeeded")
    assert found["cases"] == 800 and found["failed"] == failed > 100

    miss = found["metrics"]["miss_deg"]["indices"]
    assert miss["push"]["first"]["value"] > 0.99 and miss["push"]["total"]["value"] > 0.99
    assert miss["luck"]["first"]["low"] < 0.0 < miss["luck"]["first"]["high"]
    # The miss [deg] is twice the push along x [m/s].
    slopes = miss["push"]["columns"]
    assert slopes["in_push_x_m_s"]["slope"] == pytest.approx(2.0) and slopes["in_push_y_m_s"]["slope"] < 1e-9
    # Success is a band of luck, and nothing else.
    luck = found["metrics"]["success"]["indices"]["luck"]
    assert luck["first"]["value"] > 0.97 and luck["total"]["value"] > 0.97
    assert found["metrics"]["success"]["mean"] == pytest.approx(1.0 - failed / 800)
    time = found["metrics"]["settling_time_s"]
    assert time["without"] == failed and time["cases"] == 800 - failed
    assert time["indices"]["push"]["first"]["value"] > 0.9
    assert f"settling_time_s: of the {1.0 - failed / 800:.1%} of the cases that have it" in said

    assert all(len(row) == len(HEAD) for row in rows)
    assert [row[1] for row in rows if row[0] == "miss_deg"] == ["push"]
    assert [row[1] for row in rows if row[0] == "success"] == ["luck"]


def test_inputs_may_count_as_one(swept, tmp_path):
    document, _, _ = write_sweep_indices(swept, tmp_path, together=[["luck", "push"]], plots=False)
    assert list(document["inputs"]) == ["luck+push"]
    assert document["inputs"]["luck+push"]["unit"] == "1, m/s"
    one = document["metrics"]["miss_deg"]["indices"]["luck+push"]
    assert one["first"]["value"] > 0.99 and one["total"]["value"] > 0.99 and one["bound"] is None
    document, _, _ = write_sweep_indices(swept, tmp_path, apart=["push"], plots=False)
    found = document["metrics"]["miss_deg"]["indices"]
    assert list(found) == ["luck", "push_x_m_s", "push_y_m_s"]
    assert found["push_x_m_s"]["first"]["value"] > 0.99 and found["push_y_m_s"]["total"]["high"] < 0.01
    with pytest.raises(InputError, match="push: no such input of this sweep, or named twice"):
        write_sweep_indices(swept, tmp_path, together=[["luck", "push"]], apart=["push"])
    with pytest.raises(InputError, match="lucks: no such input of this sweep.*; inputs are luck, push"):
        write_sweep_indices(swept, tmp_path, together=[["lucks", "push"]])


def test_dependent_inputs_and_a_metric_that_is_constant_are_said(copy, tmp_path):
    table = pq.read_table(copy / "cases.parquet")
    luck = table["in_luck"].to_numpy()
    names = table.column_names
    changed = {"in_push_y_m_s": table["in_push_y_m_s"].to_numpy() + luck, "miss_deg": np.full(len(luck), 2.5)}
    for name, values in changed.items():
        table = table.set_column(names.index(name), table.schema.field(name), [values])
    pq.write_table(table, copy / "cases.parquet")
    document, rows, said = write_sweep_indices(copy, tmp_path / "out")
    assert document["dependent"][0]["inputs"] == ["luck", "push"]
    assert any(line.startswith("luck and push depend on each other (rank correlation 0.8") for line in said)
    miss = document["metrics"]["miss_deg"]
    assert miss["indices"] == {} and miss["mean"] == 2.5 and "miss_deg" not in [row[0] for row in rows]
    assert "miss_deg: constant: 2.5 in all cases" in said
    assert not any("nan" in line for line in said)


def test_columns_by_other_hands_are_inputs_of_their_own(copy):
    table = pq.read_table(copy / "cases.parquet")
    bare = pa.schema([field.remove_metadata() for field in table.schema])
    pq.write_table(pa.Table.from_arrays(table.columns, schema=bare), copy / "cases.parquet")
    assert list(read_sweep(copy).inputs) == ["luck", "push_x_m_s", "push_y_m_s"]


def without(column):
    def change(copy):
        table = pq.read_table(copy / "cases.parquet")
        pq.write_table(
            table.drop([name for name in table.column_names if name.startswith(column)]), copy / "cases.parquet"
        )

    return change


def with_nan(copy):
    table = pq.read_table(copy / "cases.parquet")
    values = table["in_luck"].to_numpy().copy()
    values[41] = np.nan
    place = table.column_names.index("in_luck")
    pq.write_table(table.set_column(place, table.schema.field("in_luck"), [values]), copy / "cases.parquet")


@pytest.mark.parametrize(
    ("change", "expected"),
    [
        (lambda copy: (copy / "sweep.json").unlink(), r"copy: holds no sweep \(`jaxsat sweep SCENARIO"),
        (
            lambda copy: (copy / "cases.parquet").unlink(),
            "cases.parquet: is not there, so the sweep is not finished; `jax",
        ),
        (
            lambda copy: (copy / "summary.json").unlink(),
            "summary.json: is not there, so the sweep is not finished; `jax",
        ),
        (lambda copy: (copy / "summary.json").write_text('{"a": 1}'), "summary.json: is no summary of a sweep"),
        (lambda copy: (copy / "cases.parquet").write_text("half"), "cases.parquet: cannot be read"),
        (without("in_"), r"cases.parquet: has no columns in_..., what each case was drawn from; `jaxsat sweep fake"),
        (without("status"), "cases.parquet: is no table of cases"),
        (with_nan, "cases.parquet:42: in_luck: is not finite"),
    ],
)
def test_a_bad_directory_is_one_line(change, expected, copy, tmp_path):
    change(copy)
    with pytest.raises(InputError, match=expected) as caught:
        write_sweep_indices(copy, tmp_path / "out")
    assert "\n" not in str(caught.value) and not (tmp_path / "out").exists()


def test_too_few_cases_and_no_directory(copy, tmp_path):
    pq.write_table(pq.read_table(copy / "cases.parquet").slice(0, 50), copy / "cases.parquet")
    with pytest.raises(InputError, match="holds 50 cases; 200 are needed: `jaxsat sweep fake"):
        write_sweep_indices(copy, tmp_path / "out")
    with pytest.raises(InputError, match="nowhere: holds no sweep"):
        write_sweep_indices(tmp_path / "nowhere", tmp_path / "out")
    assert holds_sweep(copy) and not holds_sweep(tmp_path)


def test_the_command_shows_them(swept, tmp_path, capsys):
    out = tmp_path / "out"
    assert run(["sensitivity", str(swept), "--apart", "push", "--no-plots", "--out", str(out)]) == 0
    text = capsys.readouterr().out
    assert "what drives each metric, of 800 cases" in text and "push_x" in text
    assert max(map(len, text.splitlines())) <= 80
    assert json.loads((out / "indices.json").read_text())["inputs"]["push_x_m_s"]["columns"] == ["in_push_x_m_s"]
    for option in (["--free", "magnet"], ["--parts", "4"], ["--scenarios", "10"]):
        assert run(["sensitivity", str(swept), *option]) == 2
        assert "a sweep takes --together, --apart" in capsys.readouterr().err
