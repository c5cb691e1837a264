"""Which leaves of a model a fit may change, as data: another choice of them runs the same compiled programs.

Inside, a fit works on `x`: six unknowns of the state, then the shift of each free leaf from its nominal value in units
of its prior sigma, those that move the satellite in front. Both kinds are padded to multiples of `PAD`.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import equinox as eqx
import jax.numpy as jnp
import numpy as np

from fitting.parameters.names import STATE
from fitting.parameters.transforms import inertia_shift, polar_from_dipole, second_moment_root, thinnest
from fitting.parameters.tree import FreeLeaves, Gauge
from jaxsat.errors import InputError
from jaxsat.satellites.model import INERTIA_PLACE, MAGNET_PLACE, POLAR_PLACE, Leaf, Model, Spot, nominal_values

PAD = 4
FLAT = 0.05
"""Least principal second moment of mass over the mean one of a nominal body below which a prior sigma of its inertia
spans thicknesses many times its own, and entries of the inertia move by themselves."""
MAX_ELEVATION = np.radians(80.0)
"""Highest elevation of a nominal dipole that angles may describe."""
MODULUS: Spot = (POLAR_PLACE, (0,))


@dataclass(frozen=True)
class FreeParameters:
    """`FreeLeaves` with the names and limits that the host needs."""

    leaves: tuple[Leaf, ...]
    columns: np.ndarray
    """[unknowns] number of the leaf that each unknown after the state moves, -1 for padding."""
    tree: FreeLeaves
    free_motion: bool
    """Whether the motion's start is unknown."""

    @property
    def names(self) -> tuple[str, ...]:
        """Of all unknowns, empty for padding."""
        return STATE + tuple(self.leaves[k].name if k >= 0 else "" for k in self.columns)

    @property
    def everything(self) -> np.ndarray:
        """[unknowns] bool: what may move at the end."""
        return np.concatenate([np.full(len(STATE), self.free_motion), self.columns >= 0])

    def active(self, wanted: Sequence[str]) -> np.ndarray:
        """[unknowns] bool: the state, and the free leaves of these names."""
        return self.everything & np.isin(self.names, [*STATE, *wanted])

    @property
    def gauged(self) -> tuple[str, ...]:
        """Names of the gauges that hold."""
        on = np.asarray(self.tree.gauge_on) > 0.0
        return tuple(gauge.name for gauge, held in zip(self.tree.gauges, on, strict=True) if held)

    @property
    def gauge_text(self) -> str | None:
        """What is held by definition, in words."""
        names = [f"|{each}|" if gauge.name == "magnet" else f"the mean of {each}" for gauge, each in self._held()]
        text = f"{' and '.join(names)} held at the nominal value, for the data tell ratios to it alone"
        return text if names else None

    @property
    def gauged_leaves(self) -> frozenset[str]:
        """Names of the leaves of the gauges that hold: along it their priors hold a number without meaning."""
        found = {self.leaves[k].name for gauge, _ in self._held() for k in gauge.leaves}
        if "magnet" in self.gauged:
            found |= {leaf.name for leaf in self.leaves if leaf.spot == MODULUS}
        return frozenset(found)

    def _held(self) -> list[tuple[Gauge, str]]:
        """The gauges that hold, and what their leaves are called."""
        own = [gauge for gauge in self.tree.gauges if gauge.name in self.gauged]
        return [(gauge, self.leaves[gauge.leaves[0]].part or gauge.name) for gauge in own]

    @property
    def restated(self) -> frozenset[str]:
        """Names of the components of a dipole that moves by its modulus and angles."""
        by_angles = float(np.asarray(self.tree.by_angles)) > 0.0
        return frozenset(leaf.name for leaf in self.leaves if by_angles and leaf.place == MAGNET_PLACE)

    def sigma(self) -> np.ndarray:
        """[unknowns] prior sigma of each unknown after the state, SI; 0 for padding."""
        rows = np.maximum(self.columns, 0)
        return np.where(self.columns >= 0, np.asarray(self.tree.tangent)[rows, np.arange(len(rows))], 0.0)

    def with_nominal(self, values: Mapping[int, float]) -> "FreeParameters":
        """The same about other nominal values [SI] of some leaves, by their numbers."""
        nominal = np.array(self.tree.nominal)
        nominal[list(values)] = list(values.values())
        return replace(self, tree=eqx.tree_at(lambda tree: tree.nominal, self.tree, nominal))

    def bounds(self) -> tuple[np.ndarray, np.ndarray]:
        """Lowest and highest `x`; the state is unbounded."""
        lower, upper = (np.full(len(self.columns), sign * np.inf) for sign in (-1.0, 1.0))
        sigma, body = self.sigma(), float(np.asarray(self.tree.keeps_body)) > 0.0
        for number, leaf_number in enumerate(self.columns):
            if leaf_number < 0:
                continue
            leaf, nominal = self.leaves[leaf_number], float(np.asarray(self.tree.nominal)[leaf_number])
            if not (body and leaf.place == INERTIA_PLACE):
                lower[number] = (leaf.lower - nominal) / sigma[number]
                upper[number] = (leaf.upper - nominal) / sigma[number]
        state = np.full(len(STATE), np.inf)
        return np.concatenate([-state, lower]), np.concatenate([state, upper])

    def shifts(self, values: np.ndarray) -> np.ndarray:
        """[unknowns] the `x` after the state that gives the leaves these values [leaves, SI], on the host.

        Where gauges hold, their ratios.
        """
        values = np.array(values, float)
        polar = [k for k, leaf in enumerate(self.leaves) if leaf.place == POLAR_PLACE]
        magnet = [k for k, leaf in enumerate(self.leaves) if leaf.place == MAGNET_PLACE]
        if len(polar) == 3:
            values[polar] = np.asarray(polar_from_dipole(jnp.asarray(values[magnet])))
        shift = values - np.asarray(self.tree.nominal)
        if len(polar) == 3:
            # The shorter way round.
            shift[polar[1]] = np.angle(np.exp(1j * shift[polar[1]]))
        if float(np.asarray(self.tree.keeps_body)) > 0.0:
            index = [k for k, leaf in enumerate(self.leaves) if leaf.place == INERTIA_PLACE]
            shift[index] = inertia_shift(np.asarray(self.tree.inertia_root), values[index])
        found, known = np.zeros(len(self.columns)), self.columns >= 0
        found[known] = shift[self.columns[known]] / self.sigma()[known]
        return found


def free_parameters(
    model: Model,
    leaves: tuple[Leaf, ...],
    free: Sequence[str],
    *,
    free_motion: bool = True,
    held: Sequence[str] = (),
) -> FreeParameters:
    """`free` names leaves, `held` gauges that hold where nothing tells them (`GaugeSettings` of a satellite file).

    The sizes are those of all leaves with a sigma, or larger where more are free. Raises `InputError` where the dipole
    is free both ways, or by angles that it has not.
    """
    wanted = set(free)

    def chosen(moves: bool) -> list[int]:
        own = [k for k, leaf in enumerate(leaves) if leaf.moves == moves]
        numbers = [k for k in own if leaves[k].name in wanted]
        usual = sum(leaves[k].sigma is not None for k in own)
        size = max(len(numbers), usual)
        # The state's six unknowns are carried with those that move the satellite.
        ahead = len(STATE) if moves else 0
        padded = -(-(size + ahead) // PAD) * PAD - ahead
        return numbers + [-1] * (padded - len(numbers))

    moving, seeing = chosen(True), chosen(False)
    columns = np.array(moving + seeing, dtype=int)
    spots = tuple(leaf.spot for leaf in leaves)
    nominal = nominal_values(model, spots)
    tangent = np.zeros((len(leaves), len(columns)))
    for number, k in enumerate(columns):
        if k >= 0:
            tangent[k, number] = leaves[k].loose if leaves[k].sigma is None else leaves[k].sigma
    by_angles = _by_angles(leaves, wanted, nominal)
    index = [k for k, leaf in enumerate(leaves) if leaf.place == INERTIA_PLACE]
    of_body = len(index) == 6 and thinnest(nominal[index]) > FLAT
    root = second_moment_root(nominal[index]) if of_body else np.eye(3)
    whole = of_body and set(index) <= set(columns.tolist())
    gauges = tuple(_gauge(name, leaves) for name in held)
    moved = set(columns.tolist())
    if any(leaves[k].spot == MODULUS for k in moved if k >= 0):
        # The modulus stands for all of the vector: both have the size that nothing tells.
        moved |= {k for k, leaf in enumerate(leaves) if leaf.place == MAGNET_PLACE}
    tree = FreeLeaves(
        nominal=nominal,
        tangent=tangent,
        inertia_root=root,
        inertia_root_inverse=np.linalg.inv(root),
        keeps_body=np.asarray(float(whole)),
        by_angles=np.asarray(float(by_angles)),
        gauge_on=np.array([float(moved >= {*gauge.leaves, *gauge.beside}) for gauge in gauges]),
        gauges=gauges,
        spots=spots,
        moving=len(moving),
    )
    return FreeParameters(leaves, columns, tree, free_motion)


def _by_angles(leaves: tuple[Leaf, ...], wanted: set[str], nominal: np.ndarray) -> bool:
    """Whether the dipole is to move by its modulus and angles; raises `InputError` where it cannot."""
    polar = [k for k, leaf in enumerate(leaves) if leaf.restates]
    angles = [leaves[k].name for k in polar]
    if not wanted & set(angles):
        return False
    if wanted & {leaf.name for leaf in leaves if leaf.place == MAGNET_PLACE}:
        reason = f"the dipole is free both as a vector and by {', '.join(angles)}: ask for one of them"
        raise InputError(reason, field="free")
    if not (nominal[polar[0]] > 0.0 and abs(nominal[polar[2]]) < MAX_ELEVATION):
        reason = (
            f"the dipole's angles are free: its nominal modulus must be above 0 and its elevation within "
            f"{np.degrees(MAX_ELEVATION):.0f} deg, or free {leaves[polar[0]].part}, the vector"
        )
        raise InputError(reason, field="free")
    return True


def _gauge(name: str, leaves: tuple[Leaf, ...]) -> Gauge:
    """The magnet's modulus, beside all of inertia; or the mean gain of a sensor, beside its largest current."""
    sensor = name.removesuffix(".gain")
    own, beside = MAGNET_PLACE, INERTIA_PLACE
    if name != "magnet":
        own, beside = f"sensors.{sensor}.gain", f"sensors.{sensor}.max_current"
    where = [tuple(k for k, leaf in enumerate(leaves) if leaf.place == place) for place in (own, beside)]
    return Gauge(name, *where)
