"""Traced programs on disk: written once, used again by another process, replaced when damaged."""

import subprocess
import sys
from pathlib import Path

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from fitting.stored import Stored

SCRIPT = """
import sys
import jax
jax.config.update("jax_enable_x64", True)
jax.config.update("jax_compilation_cache_dir", sys.argv[1])
jax.config.update("jax_persistent_cache_min_compile_time_secs", 0.0)
import equinox as eqx
import numpy as np
from fitting.stored import Stored

class Wave(eqx.Module):
    sum: jax.Array
    sine: jax.Array
    cosine: jax.Array | None
    power: int = eqx.field(static=True)

def wave(x, power):
    print("traced", x.shape)
    return Wave((x**power).sum(), jax.numpy.sin(x), None, power)

stored = Stored(wave)
for size in map(int, sys.argv[2:]):
    stored.compile(np.zeros(size), 3)
    for start in (0.1, 0.2):
        result = stored(np.linspace(start, 1.0, size), 3)
        assert isinstance(result, Wave) and result.cosine is None and result.power == 3
        print(size, float(result.sum).hex(), np.asarray(result.sine).tobytes().hex())
"""


def process(directory: Path, *sizes: int) -> tuple[int, list[str]]:
    """How often a new process traced, and what it printed of the results."""
    done = subprocess.run(
        [sys.executable, "-c", SCRIPT, str(directory), *map(str, sizes)], capture_output=True, text=True, check=True
    )
    lines = done.stdout.splitlines()
    return sum(line.startswith("traced") for line in lines), [line for line in lines if not line.startswith("traced")]


def programs(directory: Path) -> dict[str, bytes]:
    return {path.name: path.read_bytes() for path in sorted(directory.glob("wave-*.stablehlo"))}


@pytest.mark.slow
def test_program_outlives_its_process(tmp_path):
    traced, results = process(tmp_path, 5)
    first = programs(tmp_path)
    assert traced == 1 and len(first) == 1
    x = np.linspace(0.1, 1.0, 5)
    assert float.fromhex(results[0].split()[1]) == pytest.approx(np.sum(x**3), rel=1e-15)
    np.testing.assert_allclose(np.frombuffer(bytes.fromhex(results[0].split()[2])), np.sin(x), rtol=1e-15)

    # Another process reads it; other shapes are another program.
    traced, again = process(tmp_path, 5, 7)
    assert traced == 1 and again[:2] == results
    both = programs(tmp_path)
    assert len(both) == 2 and both.items() >= first.items()

    # One wrong bit or a missing half cost the tracing, and the file is replaced.
    whole, half = both
    flipped = bytearray(both[whole])
    flipped[len(flipped) // 2] ^= 1
    (tmp_path / whole).write_bytes(flipped)
    (tmp_path / half).write_bytes(both[half][: len(both[half]) // 2])
    traced, repaired = process(tmp_path, 5, 7)
    assert traced == 2 and repaired == again
    traced, last = process(tmp_path, 5, 7)
    assert traced == 0 and last == again
    assert not [path for path in tmp_path.iterdir() if path.name.startswith("tmp")], "nothing half-written stays"


@pytest.mark.slow
def test_a_directory_that_is_gone_costs_the_file_and_no_more(tmp_path):
    traced, results = process(tmp_path / "missing", 5)
    assert traced == 1 and len(results) == 2 and not programs(tmp_path / "missing")


@pytest.fixture
def no_directory():
    before = jax.config.jax_compilation_cache_dir  # pyright: ignore[reportAttributeAccessIssue]
    jax.config.update("jax_compilation_cache_dir", None)
    yield
    jax.config.update("jax_compilation_cache_dir", before)


def test_without_a_directory_it_is_a_compiled_function(no_directory):
    traced = []

    def scale(x, factor):
        traced.append(x.shape)
        return x * factor

    stored = Stored(scale)
    assert stored.compile(jnp.zeros(3), 2.0) is None and not traced
    np.testing.assert_array_equal(stored(np.arange(3.0), 2.0), [0.0, 2.0, 4.0])
    np.testing.assert_array_equal(stored(np.arange(1.0, 4.0), 2.0), [2.0, 4.0, 6.0])
    assert len(traced) == 1
    # A number that is no array is part of the program.
    np.testing.assert_array_equal(stored(np.arange(3.0), 3.0), [0.0, 3.0, 6.0])
    assert len(traced) == 2
