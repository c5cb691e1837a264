"""A sensor of one's own that is wrong is refused when its file is read, by its line."""

import pytest
from satellite_text import BODY

from jaxsat.errors import InputError
from jaxsat.satellites import read_satellite

MODULE = """
import jax.numpy as jnp
import numpy as np
from jaxsat.sensors import AbstractSensor, View

class Size(AbstractSensor):
    def __call__(self, view: View):
        return {}
"""
KEYS = """
[sensors.size]
kind = "{}:Size"
[channels.size]
columns = ["b"]
unit = "nT"
sigma = 100.0
"""
REFUSED = {
    "branch": ("view.field[:1] if view.field[0] > 0 else view.field[1:2]", r"line 8\): it asks for the value of what"),
    "numpy": ("np.array([float(view.field[0])])", r"line 8\): it asks for the value of what JAX traces"),
    "typo": ("view.feild[:1]", r"line 8\): AttributeError: 'View' object has no attribute 'feild'"),
    "scalar": ("view.field[0]", r"reads numbers of shape \(\); expected .* shape \(1,\)"),
    "column": ("view.columns['temp'][None]", r"line 8\): KeyError: 'temp'"),
    "not_finite": ("jnp.log(-jnp.abs(view.field[:1]))", "a reading that is not finite"),
    "kink": ("jnp.sqrt(jnp.maximum(0.0, -jnp.abs(view.field[:1])))", "a derivative that is not finite"),
}


@pytest.mark.parametrize("name", REFUSED)
def test_what_does_not_read_a_view_is_refused_in_one_line(file, tmp_path, name):
    reading, reason = REFUSED[name]
    (tmp_path / f"{name}_sensor.py").write_text(MODULE.format(reading))
    with pytest.raises(InputError, match=rf"(?s)sat\.toml: sensors\.size: Size .*{reason}") as refused:
        read_satellite(file(BODY + KEYS.format(f"{name}_sensor")))
    assert "\n" not in str(refused.value)


def test_light_that_is_read_is_among_the_needs(file, tmp_path):
    (tmp_path / "lit_sensor.py").write_text(MODULE.format("view.sun[:1]"))
    assert read_satellite(file(BODY + KEYS.format("lit_sensor"))).model.sensors["size"].needs == {"light"}


def test_a_direction_that_is_seen_comes_with_its_reading(file, tmp_path):
    told = MODULE.replace("def __call__", 'sees = "field"\n    def __call__').format("view.field[:1]")
    (tmp_path / "sees_sensor.py").write_text(told)
    with pytest.raises(InputError, match="`sees` or `direct` without the other"):
        read_satellite(file(BODY + KEYS.format("sees_sensor")))
