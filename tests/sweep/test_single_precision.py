"""Sweeps in single precision: the same draws rounded, differences told as they are, and what is lost told loudly."""

import json
import subprocess
import sys
from html import unescape

import jax
import numpy as np
import pyarrow.parquet as pq
import pytest
from scipy.stats import norm

from jaxsat.sweep import Metric, case_keys
from jaxsat.sweep.precision.agreement import agreement

CASES, EPS = np.arange(2000), 2.0**-23


@jax.jit
def draws(keys):
    def one(key):
        first, second, third = jax.random.split(key, 3)
        return (
            jax.random.uniform(first, (3,)),
            jax.random.normal(second, (3,)),
            jax.random.uniform(third) < 0.3,
            jax.random.randint(third, (), 0, 4),
        )

    return jax.vmap(one)(keys)


def test_draws_are_those_of_double_precision_rounded():
    uniform, normal, chance, whole = (np.asarray(x) for x in draws(case_keys(7, CASES)))
    with jax.enable_x64(False):
        found = [np.asarray(x) for x in draws(case_keys(7, CASES))]
    assert [x.dtype for x in found] == ["float32", "float32", "bool", "int32"] and uniform.dtype == "float64"
    assert np.all((found[0] <= uniform) & (uniform - found[0] < EPS))
    # By their probability, for far out a normal number moves more: the last bit drawn, and the last digit kept.
    np.testing.assert_allclose(norm.cdf(found[1].astype(float)), norm.cdf(normal), rtol=0, atol=2 * EPS)
    np.testing.assert_array_equal(found[2], chance)
    np.testing.assert_array_equal(found[3], whole)


METRICS = {"miss_deg": Metric("deg", "by how much"), "time_s": Metric("s", "until when")}


def found(miss, time, bad):
    return {"status": np.asarray(bad, int), "miss_deg": miss, "time_s": time}


def test_differences_are_told_of_what_both_have():
    miss, none = np.arange(101.0), np.full(101, np.nan)
    time = np.where(np.arange(101) < 11, np.arange(101), np.nan)
    off = np.where(np.arange(101) == 100, 7.0, 0.9)
    told = agreement(METRICS, found(miss, time, miss < 0), found(miss + off, none, miss < 2))
    one, other = told["metrics"]["miss_deg"], told["metrics"]["time_s"]
    assert (one["median"], one["of"], one["in_one_alone"]) == (pytest.approx(0.9), 101, 0)
    # Of 0 ... 100 the spread from the 5th to the 95th percentile is 90.
    assert one["largest"] == pytest.approx(7.0) and one["median_over_spread"] == pytest.approx(0.01)
    assert one["percentiles_over_spread"] == pytest.approx(0.01)
    assert (other["of"], other["in_one_alone"]) == (0, 11)
    assert told["ends_otherwise"] == 2 and told["succeeded"] == {"float64": 101, "float32": 99}
    assert not told["holds"] and told["message"].startswith("SINGLE PRECISION IS NOT GOOD ENOUGH HERE")
    assert "2 end otherwise; time_s is off by 0 %" in told["message"] and "11 cases having it in one" in told["message"]
    assert "miss_deg" not in told["message"] and told["message"].endswith("(limits: 1 % of the cases; 2 %, 10 %).")
    well = agreement(METRICS, found(miss, time, miss < 0), found(miss + off, time, miss < 1))
    assert (
        well["holds"]
        and "1 ends otherwise; the median difference of a metric is at most 1 % of its spread" in well["message"]
    )


LOSSY = '''"""Numbers of which single precision keeps all, and nothing."""

import jax
import numpy as np

from jaxsat.sweep import Factory, Input, Metric, Scenario, case_keys

draw = jax.jit(jax.vmap(jax.random.normal))


def build(options):
    def run(seed, cases):
        x = draw(case_keys(seed, cases))
        return {"status": np.zeros(len(cases), int), "double": x + x, "lost": (x + 1e9) - 1e9}

    metrics = {"double": Metric("1", "of x"), "lost": Metric("1", "x, beside a large number")}
    inputs = (Input("x", "1", "normal", lambda drawn: drawn),)
    return Scenario("lossy", ("good",), metrics, 64, run, inputs=inputs, draw=lambda s, c: draw(case_keys(s, c)))


make = Factory(build)
'''


def test_what_single_precision_loses_is_told_loudly(tmp_path):
    """Beside 1e9 nothing is left of x in 24 bits, and its double has all of its digits."""
    (tmp_path / "lossy.py").write_text(LOSSY)
    script = "import jaxsat.cli.main as m\nif __name__ == '__main__': m.main()"
    words = ["sweep", "lossy.py", "--cases", "50", "--seed", "4", "--precision", "float32", "--no-plots", "--out", "o"]
    done = subprocess.run([sys.executable, "-c", script, *words], cwd=tmp_path, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    said = " ".join(done.stdout.split())
    assert "lossy: 50 cases, seed 4, in float32, 50 succeeded" in said
    assert "SINGLE PRECISION IS NOT GOOD ENOUGH HERE: of 50 cases" in said
    summary = json.loads((tmp_path / "o" / "summary.json").read_text())
    compared = summary["compared_with_float64"]
    assert summary["precision"] == "float32" and compared["cases"] == 50 and not compared["holds"]
    x = np.asarray(jax.vmap(jax.random.normal)(case_keys(4, np.arange(50))))
    table = pq.read_table(tmp_path / "o" / "cases.parquet").to_pydict()
    np.testing.assert_allclose(table["in_x"], x, rtol=1e-4)
    assert np.all(np.array(table["lost"]) == 0.0)
    # 1e9 itself leaves 1e-7 of a double's digits.
    assert compared["metrics"]["lost"]["largest"] == pytest.approx(np.abs(x).max(), abs=2e-7)
    assert compared["metrics"]["lost"]["median"] == pytest.approx(np.median(np.abs(x)), abs=2e-7)
    assert compared["metrics"]["double"]["largest"] < 1e-3
    page = unescape((tmp_path / "o" / "sweep.html").read_text())
    assert "50 of 50 cases succeeded, in a precision that is not good enough." in page
    assert compared["message"] in page
