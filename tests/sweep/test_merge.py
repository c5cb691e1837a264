"""The merged table, and its sums against NumPy."""

import math

import fake_scenario
import numpy as np
import pyarrow.parquet as pq
import pytest
from scipy.stats import binomtest

import jaxsat.sweep.merge
from jaxsat.sweep import Metric, merge_cases, run_cases, summarise
from jaxsat.sweep.plan import PLAN
from jaxsat.sweep.summary import document, interval_of, summarise_metric


def test_table_holds_every_case_once_with_units(sweep, monkeypatch):
    # Row groups that fall between chunks.
    monkeypatch.setattr(jaxsat.sweep.merge, "ROW_GROUP", 12)
    one = sweep()
    one.run()
    status = merge_cases(one.scenario, one.plan, one.directory)
    found = pq.ParquetFile(one.directory / "cases.parquet")
    assert found.metadata.num_row_groups == 4
    table = found.read()
    found.close()
    inputs = ["in_luck", "in_push_x_m_s", "in_push_y_m_s"]
    assert table.column_names == ["case", "status", "miss_deg", "settling_time_s", *inputs]
    said = {b"unit": b"m/s", b"meaning": b"at the start", b"input": b"push"}
    assert [table.schema.field(name).metadata for name in inputs[1:]] == [said, said]
    assert table.schema.field("settling_time_s").metadata == {b"unit": b"s", b"meaning": b"how soon; none if failed"}
    expected = run_cases(one.scenario, 3, np.arange(37))
    np.testing.assert_array_equal(table["case"].to_numpy(), np.arange(37))
    np.testing.assert_array_equal(status, expected["status"])
    assert table["status"].to_pylist() == [fake_scenario.STATUSES[code] for code in status]
    for name in ("miss_deg", "settling_time_s"):
        np.testing.assert_array_equal(table[name].to_numpy(), expected[name])
    # Each beside what came of it.
    found = np.stack([table[name].to_numpy() for name in inputs], axis=1)
    np.testing.assert_array_equal(found, fake_scenario.drawn(3, np.arange(37)) * [1.0, 0.5, 0.5])


def test_summary_is_that_of_numpy(sweep):
    one = sweep(cases=500)
    one.run()
    status = merge_cases(one.scenario, one.plan, one.directory)
    content = document(one.scenario, one.plan, status, summarise(one.scenario, one.directory, status), cases_per_s=1.0)
    expected = run_cases(one.scenario, 3, np.arange(500))
    assert content["schema"] == "jaxsat.sweep/1" and content["cases"] == 500 and content["seed"] == 3
    assert content["failed"] == np.flatnonzero(expected["status"]).tolist()
    assert content["succeeded"] + len(content["failed"]) == 500 == sum(content["statuses"].values())
    assert content["statuses"]["lost"] == np.count_nonzero(expected["status"] == 2) > 0
    assert content["options"] == {"scale": 1, "pause_s": 0, "chunk": 8}
    times = expected["settling_time_s"]
    known = times[~np.isnan(times)]
    assert content["metrics"]["settling_time_s"] == {
        "unit": "s",
        "p05": np.percentile(known, 5),
        "p50": np.median(known),
        "p95": np.percentile(known, 95),
        "max": known.max(),
        "of": known.size,
        "missing": len(content["failed"]),
    }
    # Of SciPy's own test of a binomial share.
    exact = binomtest(content["succeeded"], 500).proportion_ci(method="exact")
    found = content["success"]
    assert (found["share"], found["of"]) == (content["succeeded"] / 500, 500)
    assert (found["low"], found["high"]) == pytest.approx((exact.low, exact.high), rel=1e-12)
    assert (one.directory / PLAN).exists()


def test_a_metric_that_no_case_has():
    none = summarise_metric("a", Metric("s", ""), np.full(5, np.nan), np.zeros(5, bool))
    assert none.missing == 5 and math.isnan(none.percentiles["p50"]) and none.edges.size == 0


def test_bins_hold_every_case_that_is_not_beyond():
    rng = np.random.default_rng(1)
    success = rng.random(2000) < 0.8
    for values in (rng.normal(size=2000), np.exp(3.0 * rng.normal(size=2000)), np.ones(2000), np.zeros(2000)):
        values[7], values[8] = 1e6, np.inf
        found = summarise_metric("a", Metric("1", ""), values, success)
        assert found.missing == 1 and found.beyond >= 1 and found.beyond < 100
        assert found.succeeded.sum() + found.failed.sum() + found.beyond == 1999
        assert np.all(np.diff(found.edges) > 0)
    assert summarise_metric("a", Metric("1", ""), np.exp(3.0 * rng.normal(size=2000)), success).logarithmic
    assert not found.logarithmic


@pytest.mark.parametrize(("cases", "succeeded"), [(10, 0), (10, 10), (1, 1), (10**6, 10**6 - 1)])
def test_shares_at_their_ends_have_an_interval(cases, succeeded):
    exact = binomtest(succeeded, cases).proportion_ci(method="exact")
    assert interval_of(succeeded, cases) == pytest.approx((exact.low, exact.high), rel=1e-9)


def test_bins_of_whole_numbers_hold_as_many_of_them():
    rng = np.random.default_rng(1)
    for mean in (3.0, 20.0, 2000.0):
        values = rng.poisson(mean, 2000).astype(float)
        edges = summarise_metric("pulses", Metric("1", ""), values, np.ones(2000, bool)).edges
        width = edges[1] - edges[0]
        assert np.all(np.diff(edges) == width) and width == round(width) and np.all(edges % 1.0 == 0.5)
        assert len(edges) <= 61 and (mean > 20.0 or width == 1.0)


def test_cases_that_never_got_there_count_beyond_any_time():
    values = np.array([10.0, 20.0, 30.0, 40.0, np.nan, np.nan])
    found = summarise_metric("a", Metric("s", "", endless=True, limit=25.0), values, np.isfinite(values))
    assert found.percentiles["p50"] == 25.0 and found.missing == 2
    # Sorted, of six: the first, the third, and one that never got there.
    assert found.all_cases == {"p05": 10.0, "p50": 30.0, "p95": np.inf}
    assert found.over == {"limit": 25.0, "share": 4.0 / 6.0}
    known = summarise_metric("a", Metric("deg", "", limit=25.0), values, np.isfinite(values))
    assert known.all_cases is None and known.over == {"limit": 25.0, "share": 2.0 / 6.0}
