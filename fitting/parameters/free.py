"""Which leaves of a model a fit may change, as data: another choice of them runs the same compiled programs.

Inside, a fit works on `x`: six unknowns of the state, then the shift of each free leaf from its nominal value in units
of its prior sigma, those that move the satellite in front. Both kinds are padded to multiples of `PAD`.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple, TypeAlias

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from fitting.parameters.names import STATE
from fitting.parameters.parametrization import FLAT, Parametrization
from fitting.parameters.transforms import inertia_shift, physical_inertia, second_moment_root, thinnest
from jaxsat.satellites.model import Leaf, Model, Spot, nominal_values

PAD = 4
INERTIA_PLACE = "spacecraft.inertia"


class Gauge(NamedTuple):
    """Leaves whose common size no channel tells while what scales with it is free too."""

    name: str
    """As the satellite file has it: `magnet`, or the gains of a sensor, `cells.gain`."""
    leaves: tuple[int, ...]
    beside: tuple[int, ...]
    """Leaves that must be free with them."""

    def size(self, values: Float[Array, " leaves"]) -> Float[Array, ""]:
        """The modulus of a dipole, the mean of gains."""
        return jnp.sqrt(jnp.sum(values**2)) if self.name == "magnet" else jnp.mean(values)


class FreeLeaves(eqx.Module):
    """The values of all leaves as a function of `x`."""

    nominal: Float[Array | np.ndarray, " leaves"]
    """SI"""
    tangent: Float[Array | np.ndarray, "leaves unknowns"]
    """Change of each leaf for a unit of each unknown after the state; columns of zeros are padding."""
    inertia_root: Float[Array | np.ndarray, "3 3"]
    """`transforms.second_moment_root` of the nominal inertia."""
    inertia_root_inverse: Float[Array | np.ndarray, "3 3"]
    keeps_body: Float[Array | np.ndarray, ""]
    """1 where the inertia stays that of a body whatever the shift, 0 where its entries move by themselves."""
    gauge_on: Float[Array | np.ndarray, " gauges"]
    """1 where the size of its leaves is held at the nominal one, for nothing tells it; 0 where it moves."""
    gauges: tuple[Gauge, ...] = eqx.field(static=True)
    spots: tuple[Spot, ...] = eqx.field(static=True)
    moving: int = eqx.field(static=True)
    """Unknowns after the state that move the satellite, padding included."""

    def values(self, x_model: Float[Array, " unknowns"]) -> Float[Array, " leaves"]:
        """Values of all leaves, SI. Differentiable."""
        shift = jnp.asarray(self.tangent) @ x_model
        found = jnp.asarray(self.nominal) + shift
        inertia = np.array([place == INERTIA_PLACE for place, _ in self.spots])
        if inertia.sum() == 6:
            index = np.flatnonzero(inertia)
            body = physical_inertia(
                jnp.asarray(self.inertia_root), jnp.asarray(self.inertia_root_inverse), shift[index]
            )
            found = found.at[index].set(jnp.where(jnp.asarray(self.keeps_body) > 0.0, body, found[index]))
        for number, gauge in enumerate(self.gauges):
            index = np.array(gauge.leaves)
            held = jnp.asarray(self.gauge_on)[number] > 0.0
            # A size of zero is divided by where nothing is held.
            share = gauge.size(jnp.asarray(self.nominal)[index]) / jnp.where(held, gauge.size(found[index]), 1.0)
            found = found.at[index].set(found[index] * jnp.where(held, share, 1.0))
        return found


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
        names = ["|magnet|" if name == "magnet" else f"the mean of {name}" for name in self.gauged]
        text = f"{' and '.join(names)} held at the nominal value, for the data tell ratios to it alone"
        return text if names else None

    @property
    def gauged_leaves(self) -> frozenset[str]:
        """Names of the leaves of the gauges that hold: along it their priors hold a number without meaning."""
        on = [gauge for gauge in self.tree.gauges if gauge.name in self.gauged]
        return frozenset(self.leaves[k].name for gauge in on for k in gauge.leaves)

    def sigma(self) -> np.ndarray:
        """[unknowns] prior sigma of each unknown after the state, SI; 0 for padding."""
        rows = np.maximum(self.columns, 0)
        return np.where(self.columns >= 0, np.asarray(self.tree.tangent)[rows, np.arange(len(rows))], 0.0)

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
        shift = np.asarray(values, float) - np.asarray(self.tree.nominal)
        if float(np.asarray(self.tree.keeps_body)) > 0.0:
            index = [k for k, leaf in enumerate(self.leaves) if leaf.place == INERTIA_PLACE]
            shift[index] = inertia_shift(np.asarray(self.tree.inertia_root), np.asarray(values, float)[index])
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

    The sizes are those of all leaves with a sigma, or larger where more are free.
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
    index = [k for k, leaf in enumerate(leaves) if leaf.place == INERTIA_PLACE]
    of_body = len(index) == 6 and thinnest(nominal[index]) > FLAT
    root = second_moment_root(nominal[index]) if of_body else np.eye(3)
    whole = of_body and set(index) <= set(columns.tolist())
    gauges = tuple(_gauge(name, leaves) for name in held)
    moved = set(columns.tolist())
    tree = FreeLeaves(
        nominal=nominal,
        tangent=tangent,
        inertia_root=root,
        inertia_root_inverse=np.linalg.inv(root),
        keeps_body=np.asarray(float(whole)),
        gauge_on=np.array([float(moved >= {*gauge.leaves, *gauge.beside}) for gauge in gauges]),
        gauges=gauges,
        spots=spots,
        moving=len(moving),
    )
    return FreeParameters(leaves, columns, tree, free_motion)


def _gauge(name: str, leaves: tuple[Leaf, ...]) -> Gauge:
    """The magnet's modulus, beside all of inertia; or the mean gain of a sensor, beside its largest current."""
    own = tuple(k for k, leaf in enumerate(leaves) if leaf.name.startswith(f"{name}."))
    beside = INERTIA_PLACE if name == "magnet" else f"sensors.{name.removesuffix('.gain')}.max_current"
    return Gauge(name, own, tuple(k for k, leaf in enumerate(leaves) if leaf.place == beside))


AnyParameters: TypeAlias = Parametrization | FreeParameters
"""What solvers take: names, bounds and a `tree` for the compiled programs, of the one kind of model or the other."""
AnyTree: TypeAlias = Parametrization | FreeLeaves
"""What a compiled program takes of it."""
