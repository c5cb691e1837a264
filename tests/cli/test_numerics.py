"""Where compiled programs are kept, and what is said where they cannot be."""

import os
import subprocess
import sys
from importlib.metadata import version

import pytest

from jaxsat.numerics import _cache_directory, _why_not_writable, choose_code_generator


def test_cache_directory_follows_the_environment(monkeypatch, tmp_path):
    monkeypatch.delenv("JAX_COMPILATION_CACHE_DIR", raising=False)
    monkeypatch.delenv("XDG_CACHE_HOME", raising=False)
    monkeypatch.setenv("HOME", str(tmp_path))
    assert _cache_directory() == tmp_path / ".cache" / "jaxsat" / "xla"
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "xdg"))
    assert _cache_directory() == tmp_path / "xdg" / "jaxsat" / "xla"
    monkeypatch.setenv("JAX_COMPILATION_CACHE_DIR", str(tmp_path / "own"))
    assert _cache_directory() == tmp_path / "own"


def test_writable_directory_is_made_and_left_empty(tmp_path):
    assert _why_not_writable(tmp_path / "a" / "b") is None
    assert list((tmp_path / "a" / "b").iterdir()) == []


def test_without_a_place_for_the_cache_jax_still_runs_and_says_so(tmp_path):
    (tmp_path / "file").write_text("")
    script = (
        "from jaxsat.numerics import set_up_jax; print(set_up_jax()); import jax;"
        "print(jax.jit(lambda x: x + 1)(jax.numpy.zeros(1)).dtype)"
    )
    environment = {"PATH": "", "JAX_COMPILATION_CACHE_DIR": str(tmp_path / "file" / "below")}
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, env=environment, check=True)
    notice, dtype = done.stdout.splitlines()
    assert notice.startswith("no compile cache") and "below" in notice
    assert dtype == "float64"


@pytest.mark.parametrize(
    ("flags", "expected"),
    [
        (None, "--xla_cpu_use_fusion_emitters=false"),
        ("--xla_dump_to=x", "--xla_dump_to=x --xla_cpu_use_fusion_emitters=false"),
        ("--xla_cpu_use_fusion_emitters=true", "--xla_cpu_use_fusion_emitters=true"),
    ],
)
def test_code_generator_is_chosen_where_nobody_has(flags, expected, monkeypatch):
    monkeypatch.delenv("XLA_FLAGS", raising=False)
    if flags is not None:
        monkeypatch.setenv("XLA_FLAGS", flags)
    monkeypatch.setattr("jaxsat.numerics.TRIED", tuple(version("jax").split(".")[:2]))
    choose_code_generator()
    assert os.environ["XLA_FLAGS"] == expected


def test_another_version_of_jax_is_left_alone(monkeypatch):
    """XLA ends a process that gives it a flag which it does not know."""
    monkeypatch.setenv("XLA_FLAGS", "--xla_dump_to=x")
    monkeypatch.setattr("jaxsat.numerics.TRIED", ("0", "0"))
    choose_code_generator()
    assert os.environ["XLA_FLAGS"] == "--xla_dump_to=x"
