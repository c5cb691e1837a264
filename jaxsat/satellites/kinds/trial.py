"""A sensor of the user's own is asked for one reading before anything is read with it."""

import inspect
import traceback
from collections.abc import Collection

import jax
import jax.numpy as jnp
import numpy as np

from jaxsat.environment import LightTable
from jaxsat.errors import InputError
from jaxsat.math import quaternion
from jaxsat.sensors.abstract import AbstractSensor
from jaxsat.sensors.solar_panels import Albedo
from jaxsat.sensors.view import View

ATTITUDE = (0.5, -0.1, 0.7, 0.5)
"""Of no symmetry: all components of all directions differ."""


def try_sensor(sensor: AbstractSensor, name: str, columns: int, telemetered: Collection[str]) -> None:
    """Asks a sensor for a reading of `columns` numbers, their differences and the derivatives of both, noise, `direct`.

    `telemetered` are the names of what is in `View.columns`. One that reads light without having it among its `needs`
    has it from then on. Raises `InputError` saying what it does instead of answering, with the line of its module.
    """
    field, made = f"sensors.{name}", type(sensor)
    try:
        found = _asked(sensor, field, columns, telemetered, light="light" in sensor.needs)
    except InputError:
        if "light" in sensor.needs:
            raise
        found = _asked(sensor, field, columns, telemetered, light=True)
        made.needs = sensor.needs | {"light"}
    values, slopes, seen = found
    if (seen is None) != (sensor.sees is None):
        raise InputError(f"{made.__name__} has `sees` or `direct` without the other", field=field)
    for what, numbers in (("a reading", values), ("a derivative", slopes)):
        if not all(np.isfinite(each).all() for each in jax.tree.leaves(numbers)):
            raise InputError(f"{made.__name__} has {what} that is not finite, on an ordinary view", field=field)


def _asked(sensor: AbstractSensor, field: str, columns: int, telemetered: Collection[str], *, light: bool):
    """Reading and differences, their derivatives by a turn, and what `direct` says."""
    made, attitude = type(sensor).__name__, quaternion.normalize(jnp.array(ATTITUDE))

    def differences(turn):
        turned = quaternion.multiply(attitude, quaternion.from_rotation_vector(turn))
        view = _view(turned, light, telemetered)
        reading = sensor(view)
        if jnp.shape(reading) != (columns,):
            expected = f"expected one for each of its columns, shape ({columns},)"
            raise InputError(f"{made} reads numbers of shape {jnp.shape(reading)}; {expected}", field=field)
        return reading, sensor.difference(reading, jnp.zeros(columns)) * sensor.sharpness(view)

    try:
        values, slopes = jax.vmap(lambda turn: (differences(turn), jax.jacfwd(differences)(turn)))(jnp.zeros((1, 3)))
        sensor.noisy(values[0][0], 1.0, jax.random.key(0))
        return values, slopes, sensor.direct(np.asarray(values[0]), 1.0)
    except InputError:
        raise
    except Exception as error:
        # Whatever it raises is what is wrong with it.
        reason = f"{made} fails on a view{_place(error, sensor)}: {_said(error)}"
        raise InputError(reason, field=field) from None


def _view(attitude, lit, telemetered):
    """An instant in a low orbit, with light and without the Earth's where it is wanted."""
    light, albedo = None, None
    if lit:
        sun, down = jnp.array([0.48, 0.64, 0.6]), jnp.array([-1.0, 0.0, 0.0])
        light = LightTable(sun, jnp.array(1.0), down, jnp.array(0.0), down[None], jnp.array([0.0]))
        albedo = Albedo(jnp.array(0.0), jnp.array(0.3))
    return View(
        attitude, jnp.array([0.01, -0.02, 0.03]), jnp.array(60.0), jnp.array([6.9e6, 0.0, 0.0]),
        jnp.array([0.0, 6e3, 4.6e3]), jnp.array([1.3e-5, -2.1e-5, 2.9e-5]), light, albedo,
        {column: jnp.array(1.0) for column in telemetered},
    )  # fmt: skip


def _said(error: Exception) -> str:
    if isinstance(error, jax.errors.JAXTypeError):
        return "it asks for the value of what JAX traces: jnp.where in place of `if`, jax.numpy in place of NumPy"
    return f"{type(error).__name__}: {' '.join(str(error).split())}"


def _place(error: Exception, sensor: AbstractSensor) -> str:
    """The last line of the sensor's own module that led to an error."""
    file = inspect.getfile(type(sensor))
    lines = [frame.lineno for frame in traceback.extract_tb(error.__traceback__) if frame.filename == file]
    return f" ({file.rsplit('/', 1)[-1]}, line {lines[-1]})" if lines else ""
