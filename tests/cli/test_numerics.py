"""Where compiled programs are kept, and what is said where they cannot be."""

import subprocess
import sys

from jaxsat.numerics import _cache_directory, _why_not_writable


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


def test_programs_of_a_program_of_one_s_own_are_kept(tmp_path):
    (tmp_path / "file").write_text("")
    script = (
        "import sys, jax, jaxsat; print(jaxsat.keep_programs(sys.argv[1]));"
        "jax.jit(lambda x: x + 1)(jax.numpy.zeros(1))\n"
        "try: jaxsat.keep_programs(sys.argv[2])\n"
        "except ValueError as error: print(error)"
    )
    kept, below = tmp_path / "programs", tmp_path / "file" / "below"
    command = [sys.executable, "-c", script, str(kept), str(below)]
    done = subprocess.run(command, capture_output=True, text=True, env={"PATH": "", "JAX_PLATFORMS": "cpu"}, check=True)
    where, refused = done.stdout.splitlines()
    assert where == str(kept) and any(kept.iterdir())
    assert refused.startswith(f"{below}: no programs can be kept here")


def test_without_a_place_for_the_cache_jax_still_runs_and_says_so(tmp_path):
    (tmp_path / "file").write_text("")
    script = (
        "from jaxsat.numerics import set_up_jax; print(set_up_jax()); import jax;"
        "print(jax.jit(lambda x: x + 1)(jax.numpy.zeros(1)).dtype)\n"
        "try: set_up_jax('float32')\n"
        "except ValueError as error: print(error)\n"
        "try: set_up_jax('float64', 'gpu')\n"
        "except ValueError as error: print(error)"
    )
    environment = {"PATH": "", "JAX_PLATFORMS": "cpu", "JAX_COMPILATION_CACHE_DIR": str(tmp_path / "file" / "below")}
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, env=environment, check=True)
    notice, dtype, *refused = done.stdout.splitlines()
    assert notice.startswith("no compile cache") and "below" in notice
    assert dtype == "float64"
    assert refused[0] == "float32: this process works in float64 already; begin another one"
    assert refused[1].startswith("device gpu: JAX finds none, and would take cpu; JAX has to be installed for it")
