"""Strict numerics for every test: 64-bit, no silent broadcasting or promotion; a run shares its compiled programs."""

import atexit
import functools
import gc
import os
import shutil
import signal
import tempfile
from importlib.metadata import version
from pathlib import Path

os.environ.setdefault("MPLBACKEND", "Agg")
# Several processes share the processors: threads of linear algebra that wait for each other take ten times as long.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
if signal.getsignal(signal.SIGINT) == signal.SIG_IGN:
    # In the background of a shell Ctrl-C is ignored, and so it would be by the commands that tests interrupt.
    signal.signal(signal.SIGINT, signal.default_int_handler)
if "JAX_COMPILATION_CACHE_DIR" not in os.environ:
    # Set before the workers and the commands under test start, so that they find here what another one has compiled.
    os.environ["JAX_COMPILATION_CACHE_DIR"] = tempfile.mkdtemp(prefix="jaxsat-tests-")
    atexit.register(shutil.rmtree, os.environ["JAX_COMPILATION_CACHE_DIR"], ignore_errors=True)

if version("jax").startswith("0.10.") and "XLA_FLAGS" not in os.environ:
    # XLA's older code generator for CPUs compiles in two thirds of the processor time, to the same numbers but for
    # rounding. Users have it for a fit's stored programs alone: so has the example of the documentation, and the wheel
    # in .ci/wheel.
    os.environ["XLA_FLAGS"] = "--xla_cpu_use_fusion_emitters=false"

import jax
import pytest

jax.config.update("jax_enable_x64", True)
jax.config.update("jax_numpy_rank_promotion", "raise")
jax.config.update("jax_numpy_dtype_promotion", "strict")
# A small program costs more to keep than to compile, and is seldom wanted by another process.
jax.config.update("jax_persistent_cache_min_compile_time_secs", 0.3)

MAPS = Path("/proc/self/maps")


@pytest.fixture(autouse=True, scope="module")
def room_for_programs():
    """Lets compiled programs go before they are too many: Linux maps 65530 pieces of memory, then XLA crashes."""
    yield
    if MAPS.exists() and MAPS.read_bytes().count(b"\n") > 40_000:
        jax.clear_caches()
        gc.collect()


@pytest.fixture(autouse=True, scope="session")
def every_json_keeps_its_schema():
    """Looks at each JSON document that any test has written: one that its published schema denies is an error."""
    from jaxsat.files import json_files
    from jaxsat.files.schemas import schema, schema_names

    plain_json, known = json_files._json, set(schema_names())

    @functools.cache
    def validator(name):
        # It costs some milliseconds, which processes that write nothing need not pay.
        from jsonschema_rs import Draft202012Validator

        return Draft202012Validator(schema(name))

    def checked(value, indent):
        if not indent and isinstance(value, dict) and value.get("schema") in known:
            validator(value["schema"]).validate(value)
        return plain_json(value, indent)

    json_files._json = checked
    yield
    json_files._json = plain_json
