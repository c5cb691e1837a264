"""Check of a gyroscope against how a direction turns in the body: its unit, its axes and its signs."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from jaxsat.math.on_host import angles_between
from jaxsat.satellites.satellite import Satellite
from jaxsat.sensors.mounting import signed_permutations
from jaxsat.telemetry.checks.axes import reading_text
from jaxsat.telemetry.checks.finding import Finding, finding
from jaxsat.telemetry.checks.sights import Sight
from jaxsat.telemetry.table.session import TableSession

_FEW = 20
_LARGEST_TURN = math.radians(40.0)
"""Between two readings of a direction, beyond which their difference is no rate."""
_SLOW_RAD_S = 5.0 * 2.2e-3
"""Rate of the body up to which the field's own turn along the orbit, twice the orbit's, is too much of it."""
_AGREES = 0.7, 1.4
_EXPLAINED, _CLEAR = 0.3, 0.5
"""Share of the squares that may be left over; and over that of the axes as they are, to tell others."""
_UNITS = {math.degrees(1.0): "as rad/s", math.radians(1.0): "as deg/s", 1e3: "times 1000", 1e-3: "times 0.001"}


@dataclass(frozen=True)
class _Turning:
    """How a direction turns in the body against what a gyroscope says, under the 48 ways of reading that."""

    sight: Sight
    scales: Float[np.ndarray, "ways"]
    """How many times as fast."""
    left: Float[np.ndarray, "ways"]
    """Share of the squares of its turns that is left over."""

    @property
    def agrees(self) -> bool:
        """Whether axes and signs are right, the scale apart."""
        return bool(self.left[0] < _EXPLAINED)


def check_gyroscope(satellite: Satellite, session: TableSession, name: str, sights: Sequence[Sight]) -> list[Finding]:
    """Whether directions turn in the body as the gyroscope `name` says: d' = -w x d."""
    if name in satellite.conventions:
        return []
    told = [_turning(satellite, session, name, sight) for sight in sights]
    turnings = [each for each in told if each is not None]
    right = [each for each in turnings if each.agrees]
    return [found for each in turnings for found in _told(satellite, session, name, each, right)][:1]


def _told(
    satellite: Satellite, session: TableSession, name: str, turning: _Turning, right: list[_Turning]
) -> list[Finding]:
    scale, left, sight = float(turning.scales[0]), turning.left, turning.sight
    numbers = {"scale": scale, "share_left": float(left[0])}
    best = int(np.argmin(left))
    if not turning.agrees and left[best] < min(_EXPLAINED, _CLEAR * left[0]):
        matrix = signed_permutations(mirrored=True)[best]
        if right:
            # A direction of the other sign turns likewise: angles to other directions tell them apart.
            sensor = satellite.model.sensors[sight.name]
            options = [reading_text(sensor, session, sight.name, sign * matrix.T) for sign in (1.0, -1.0)]
            text = f"its directions do not turn as {name} and {right[0].sight.name} say: axes or signs"
        else:
            options = [reading_text(satellite.model.sensors[name], session, name, matrix)]
            text = f"directions of {sight.name} do not turn as the rates of {name} say: axes or signs of one of them"
        shown = " or ".join(option for option in options if option)
        about = sight.name if right else name
        return [finding(about, text + (f"; {shown} fits" if shown else ""), odd=True, numbers=numbers)]
    if turning.agrees and not _AGREES[0] < scale < _AGREES[1]:
        hints = [
            f"; {word} it fits: --as scaled:{name}:{factor:.8g}"
            for factor, word in _UNITS.items()
            if _AGREES[0] < scale / factor < _AGREES[1]
        ]
        text = f"directions of {sight.name} turn {scale:.3g} times as fast as its rates say{''.join(hints[:1])}"
        return [finding(name, text, odd=True, numbers=numbers)]
    return []


def _turning(satellite: Satellite, session: TableSession, name: str, sight: Sight) -> _Turning | None:
    """None where too little is seen, or the field's own way along the orbit is too much of it."""
    channel, t, seen = session.channels[name], sight.t, sight.seen
    whole = np.isfinite(channel.values).all(axis=1)
    if t.size < _FEW or whole.sum() < _FEW:
        return None
    step, middle = np.diff(t), 0.5 * (t[1:] + t[:-1])
    near = (step < 1.5 * np.median(step)) & (angles_between(seen[:-1], seen[1:]) < _LARGEST_TURN)
    near &= (middle >= channel.t_s[whole][0]) & (middle <= channel.t_s[whole][-1])
    if near.sum() < _FEW:
        return None
    rate = np.stack([np.interp(middle[near], channel.t_s[whole], column) for column in channel.values[whole].T], axis=1)
    read = satellite.model.sensors[name].direct(rate, channel.sigma)
    if read is None:
        return None
    rate, direction = np.asarray(read[0]), 0.5 * (seen[1:] + seen[:-1])[near]
    turns = ((seen[1:] - seen[:-1]) / step[:, None])[near]
    squares = float((turns**2).sum())
    if sight.of == "field" and math.sqrt(squares / near.sum()) < _SLOW_RAD_S:
        return None
    scales, left = [], []
    for matrix in signed_permutations(mirrored=True):
        expected = -np.cross(rate @ matrix.T, direction)
        # A negative scale is that of other signs, which stand in the list themselves.
        scale = max(float((turns * expected).sum() / max(float((expected**2).sum()), 1e-300)), 0.0)
        scales.append(scale)
        left.append(float(((turns - scale * expected) ** 2).sum()) / squares)
    return _Turning(sight, np.array(scales), np.array(left))
