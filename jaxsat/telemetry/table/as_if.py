"""A session taken as if something about it were otherwise: columns exchanged, stamps moved, another unit ...

Each change is a text of `jaxsat.files.as_if`, as `jaxsat fit --as` takes it and as the table of what would explain the
data has it.
"""

from collections.abc import Callable, Sequence
from dataclasses import replace

import equinox as eqx
import jax.numpy as jnp
import numpy as np

from jaxsat.errors import InputError
from jaxsat.files.as_if import DIRECTION, AsIf
from jaxsat.satellites.satellite import Satellite
from jaxsat.sensors import Panels, Photodiodes
from jaxsat.telemetry.table.axes import from_earth_fixed
from jaxsat.telemetry.table.session import Channel, TableSession
from jaxsat.time import Epoch

POSITIONS = "positions"


def taken_as(texts: Sequence[str], satellite: Satellite, session: TableSession) -> tuple[Satellite, TableSession]:
    """The satellite and the session with the changes made one after the other.

    Raises ValueError for a text that is no change, and `InputError` for one that names what the session has not.
    """
    for change in [AsIf.of(text) for text in texts]:
        try:
            satellite, session = _CHANGES[change.word](satellite, session, *change.arguments)
        except InputError as error:
            raise InputError(error.reason, file=session.paths[0], field=change.text) from None
    return satellite, session


def swaps_text(labels: Sequence[str], order: Sequence[int]) -> list[str]:
    """The changes by which columns are read in another order, a cycle each."""
    found, left = [], {k for k, other in enumerate(order) if k != other}
    while left:
        cycle = [min(left)]
        while order[cycle[-1]] != cycle[0]:
            cycle.append(order[cycle[-1]])
        left -= set(cycle)
        found.append(f"swapped:{','.join(labels[k] for k in cycle)}")
    return found


def _channel(session: TableSession, name: str) -> Channel:
    if name not in session.channels:
        raise InputError(f"no channel {name!r}; there are {', '.join(session.channels)}")
    return session.channels[name]


def _with(session: TableSession, channel: Channel) -> TableSession:
    return replace(session, channels={**session.channels, channel.name: channel})


def _holding(session: TableSession, columns: Sequence[str]) -> Channel:
    """The channel that has all of these columns."""
    for channel in session.channels.values():
        if set(columns) <= set(channel.columns):
            return channel
    known = "; ".join(f"{name}: {', '.join(each.columns)}" for name, each in session.channels.items())
    raise InputError(f"no channel has {' and '.join(columns)} ({known})")


def _swapped(satellite, session, names):
    cycle = names.split(",")
    channel = _holding(session, cycle)
    order = list(range(len(channel.columns)))
    for name, other in zip(cycle, [*cycle[1:], cycle[0]], strict=True):
        order[channel.columns.index(name)] = channel.columns.index(other)
    return satellite, _with(session, replace(channel, values=channel.values[:, order]))


def _axes(satellite, session, name, directions):
    channel, sensor = _channel(session, name), satellite.model.sensors[name]
    old = getattr(sensor, "axes", None)
    named = DIRECTION.findall(directions)
    if old is None or len(named) != len(old):
        expected = "a sensor of axes" if old is None else f"{len(old)} directions, one for each column"
        raise InputError(f"expected {expected}, got {name} and {directions}")
    rows = np.array([[(each[1] == letter) * (1.0 if each[0] == "+" else -1.0) for letter in "xyz"] for each in named])
    model = eqx.tree_at(lambda m: m.sensors[channel.name].axes, satellite.model, jnp.asarray(rows))
    # Axes that are told are not looked for.
    conventions = {other: each for other, each in satellite.conventions.items() if other != name}
    return replace(satellite, model=model, conventions=conventions), session


def _without(satellite, session, name):
    channel = _holding(session, [name])
    values = np.array(channel.values)
    values[:, channel.columns.index(name)] = np.nan
    return satellite, _with(session, _measured(channel, values))


def _measured(channel: Channel, values: np.ndarray) -> Channel:
    """The channel of other values, rows of which all are missing left out."""
    seen = np.isfinite(values).any(axis=1)
    return replace(channel, t_s=channel.t_s[seen], values=values[seen])


def _offset(satellite, session, name, number):
    channel, sensor = _channel(session, name), satellite.model.sensors[name]
    size = float(number) / channel.to_unit
    lit = isinstance(sensor, Panels | Photodiodes)
    values = without_offset(channel.values, size) if lit else channel.values - size
    return satellite, _with(session, _measured(channel, values))


def without_offset(light: np.ndarray, size: float) -> np.ndarray:
    """Readings of light less a constant: none below zero, and none where one that was too small was cut off there."""
    return np.maximum(light - size, 0.0) if size > 0.0 else np.where(light == 0.0, np.nan, light - size)


def _on_values(change: Callable[[Channel, float], np.ndarray]):
    def changed(satellite, session, name, number):
        channel = _channel(session, name)
        return satellite, _with(session, replace(channel, values=change(channel, float(number))))

    return changed


def _drifting(channel: Channel, share: float) -> np.ndarray:
    return channel.values / drift(channel, channel.t_s, share)[:, None]


def drift(channel: Channel, t_s: np.ndarray, share: float) -> np.ndarray:
    """Scale at times of one that goes from 1 to 1 + `share` while the channel measures."""
    return 1.0 + share * (t_s - channel.t_s[0]) / max(float(np.ptp(channel.t_s)), 1.0)


def _noise(satellite, session, name, sigma):
    channel = _channel(session, name)
    return satellite, _with(session, replace(channel, sigma=float(sigma) / channel.to_unit))


def _late(satellite, session, name, seconds):
    if name != POSITIONS:
        channel = _channel(session, name)
        return satellite, _with(session, replace(channel, t_s=channel.t_s - float(seconds)))
    t, position = _positions(session)
    return satellite, replace(session, positions=(t - float(seconds), position))


def _positions(session: TableSession) -> tuple[np.ndarray, np.ndarray]:
    if session.positions is None:
        raise InputError("the table has no positions")
    return session.positions


def _jump(satellite, session, time, seconds):
    return satellite, session.restamped(lambda t: np.where(t > float(time), t - float(seconds), t))


def _pace(satellite, session, share):
    return satellite, session.restamped(lambda t: t / (1.0 + float(share)))


def _dated(satellite, session, instant):
    try:
        return satellite, replace(session, epoch=Epoch.from_iso(instant))
    except ValueError as error:
        raise InputError(str(error)) from None


def _frame(satellite, session, _):
    t, position = _positions(session)
    still = np.zeros_like(position)
    velocity = still if session.velocities is None else session.velocities
    position, velocity = from_earth_fixed(session.epoch, t, position, velocity)
    return satellite, replace(
        session, positions=(t, position), velocities=None if session.velocities is None else velocity
    )


_CHANGES: dict[str, Callable[..., tuple[Satellite, TableSession]]] = {
    "swapped": _swapped,
    "axes": _axes,
    "without": _without,
    "scaled": _on_values(lambda channel, factor: channel.values * factor),
    "offset": _offset,
    "drifting": _on_values(_drifting),
    "noise": _noise,
    "late": _late,
    "jump": _jump,
    "pace": _pace,
    "dated": _dated,
    "frame": _frame,
}
