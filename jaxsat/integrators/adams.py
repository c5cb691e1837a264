"""Adams-Bashforth-Moulton multistep integration: two evaluations a step at high order, for smooth motions.

Explicit methods of high order spend a dozen evaluations and half as many sums on a step; a multistep method reuses
what earlier steps computed. Its price: equal steps, a start by another method, and a motion without kinks.
"""

import functools
import math
from fractions import Fraction

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jax import lax
from jaxtyping import Array, Float, Int, PyTree

from jaxsat.integrators.runge_kutta import staged_step
from jaxsat.math.runge_kutta import DORMAND_PRINCE_8, Derivative
from jaxsat.math.weighted_sum import weighted_sum

ORDER = 12
"""Of predictor and corrector. At 1e-6 it allows steps a third longer than order ten; at thirteen, or with a corrector
one order higher, stability forbids the steps that accuracy allows."""

MORE = 1.005
"""Share of the correction that is made. It is a multiple of the twelfth difference of the slopes, so any share keeps
order 12; this one lets a swinging motion take steps an eighth longer before it diverges (0.072 over its rate instead of
0.064, by the roots of the method's characteristic polynomial). A larger one magnifies rounding."""
_NODES_A_STEP = len(DORMAND_PRINCE_8.inner_nodes) + 1
REACH = 0.3
"""As `Tableau.reach`."""
STABLE = 0.08
"""Step times the fastest rate of a motion beyond which order 12 usually diverges."""
START_NODES = (ORDER - 1) * _NODES_A_STEP
"""Nodes of an `AdamsGrid` before the end of the last starting step."""
_INTERPOLATION = 10
"""States through which a requested time between two steps is interpolated."""


class AdamsGrid(eqx.Module):
    """Equal steps over a span of time, and how to read the requested times from them."""

    step: Float[Array | np.ndarray, ""]
    """Length of every step [s], negative where time runs backward."""
    node_times: Float[Array | np.ndarray, " nodes"]
    """Nodes of the starting Runge-Kutta steps, then the end of each further step [s]."""
    sample_first: Int[Array | np.ndarray, " samples"]
    """First state (0 is the initial one) that each requested time is interpolated from."""
    sample_weights: Float[Array | np.ndarray, "samples k"]
    """Weights of that state and the next ones."""

    @staticmethod
    def through(times: np.ndarray, *, start: float, max_step: float) -> "AdamsGrid":
        """Grid from `start` through monotonic `times` [s] with equal steps of at most `max_step`.

        Where all requested times are multiples of one step the states are read as they are, else interpolated through
        the ten nearest ones. Raises ValueError where the times are not monotonic or leave `start` on both sides,
        where `max_step` is not positive, or where the span is zero.
        """
        times = np.asarray(times, dtype=float)
        gaps = np.diff(np.concatenate([[start], times]))
        if not (np.all(gaps >= 0) or np.all(gaps <= 0)):
            raise ValueError("AdamsGrid.through: times must run in one direction away from `start`")
        span = times[-1] - start
        if not max_step > 0 or span == 0:
            raise ValueError(f"AdamsGrid.through: max_step and span must not be zero, got {max_step} and {span}")
        steps = max(_count(gaps, span, max_step), 2 * ORDER)
        step = span / steps
        beginnings = start + step * np.arange(ORDER - 1)
        c = np.array((0.0, *DORMAND_PRINCE_8.inner_nodes))
        nodes = np.concatenate(
            [(beginnings[:, None] + step * c).reshape(-1), start + step * np.arange(ORDER - 1, steps + 1)]
        )
        place = (times - start) / step
        first = np.clip(np.round(place).astype(int) - _INTERPOLATION // 2, 0, steps + 1 - _INTERPOLATION)
        return AdamsGrid(np.asarray(step), nodes, first, _lagrange(place - first))

    @property
    def steps(self) -> int:
        """Number of steps."""
        return len(self.node_times) - START_NODES + ORDER - 2

    @property
    def at_end(self) -> bool:
        """Whether the end of the last step alone is read; False where they are not numbers of NumPy."""
        if not (isinstance(self.sample_first, np.ndarray) and isinstance(self.sample_weights, np.ndarray)):
            return False
        places = np.arange(_INTERPOLATION) + self.sample_first[:, None]
        return len(places) == 1 and bool(np.all(self.sample_weights == (places == self.steps)))

    def padded(self, steps: int) -> "AdamsGrid":
        """The same grid with its last node repeated up to so many steps, for programs with a traced count."""
        nodes = np.pad(self.node_times, (0, max(0, steps - self.steps)), mode="edge")
        return AdamsGrid(self.step, nodes, self.sample_first, self.sample_weights)


def _count(gaps: np.ndarray, span: float, max_step: float) -> int:
    """Steps over the span; where the samples are equally spaced, a multiple that makes them steps' ends."""
    spacing = gaps[gaps != 0.0]
    samples = round(span / spacing[0])
    if np.allclose(spacing, spacing[0], rtol=1e-12) and math.isclose(samples * spacing[0], span, rel_tol=1e-12):
        return samples * math.ceil(abs(spacing[0]) / max_step * (1 - 1e-12))
    return math.ceil(abs(span) / max_step * (1 - 1e-12))


def _lagrange(place: Float[np.ndarray, " samples"]) -> Float[np.ndarray, "samples k"]:
    """Weights of the states 0, 1, .. k - 1 in the polynomial through them, at each place; exact at the states."""
    nodes = np.arange(_INTERPOLATION)
    nearest = np.round(place)
    place = np.where(np.abs(place - nearest) < 1e-9, nearest, place)
    weights = np.ones((len(place), _INTERPOLATION))
    for j in nodes:
        for k in nodes[nodes != j]:
            weights[:, j] *= (place - k) / (j - k)
    return weights


@functools.cache
def adams_weights(order: int) -> tuple[Float[np.ndarray, " order"], Float[np.ndarray, " order"]]:
    """Weights of the predictor on slopes 0, -1, .. and of the corrector on slopes 1, 0, -1, ..

    They integrate over one step the polynomial through the slopes: Adams-Bashforth and Adams-Moulton (Hairer, Norsett &
    Wanner 1993, III.1).
    """

    def weights(nodes: list[int]) -> np.ndarray:
        # In rationals: the weights alternate in sign and grow, and floats lose half their digits on the way.
        found = []
        for node in nodes:
            basis = [Fraction(1)]
            for other in nodes:
                if other != node:
                    shifted, scaled = [Fraction(0), *basis], [*(c * other for c in basis), Fraction(0)]
                    basis = [(x - y) / (node - other) for x, y in zip(shifted, scaled, strict=True)]
            found.append(float(sum(c / (power + 1) for power, c in enumerate(basis))))
        return np.array(found)

    return weights([-j for j in range(order)]), weights([1 - j for j in range(order)])


def integrate_adams(
    f: Derivative,
    initial: PyTree,
    table: PyTree,
    step: Float[Array, ""],
    *,
    count: Int[Array | np.ndarray, ""] | None = None,
    keep_all: bool = True,
) -> PyTree:
    """States at every step, the initial one first, or the last one alone.

    Predict, evaluate, correct by `MORE` of what Adams-Moulton asks, evaluate: order 12 (Hairer, Norsett & Wanner
    1993, III.1), the first eleven steps by Dormand-Prince 8. `table` has leaves over the nodes of an `AdamsGrid`.
    With a traced `count` only that many steps are taken, and one program serves every length: forward-mode
    derivatives only; later states are zero.
    """
    dtype = jnp.result_type(*jax.tree.leaves(initial))
    step = jnp.asarray(step, dtype)
    starting = jax.tree.map(lambda a: a[:START_NODES].reshape(ORDER - 1, _NODES_A_STEP, *a.shape[1:]), table)
    ends = jax.tree.map(lambda a: jnp.concatenate([a[_NODES_A_STEP:START_NODES:_NODES_A_STEP], a[START_NODES:]]), table)
    early, slopes = _start(f, initial, starting, jax.tree.map(lambda a: a[: ORDER - 1], ends), step)
    ahead = jax.tree.map(lambda a: a[ORDER - 1 :], ends)
    capacity = jax.tree.leaves(ahead)[0].shape[0]
    predictor, correction, own = _turning_weights(step, dtype)

    def sums(newest, state, slopes):
        predicted = jax.tree.map(lambda y, k: y + weighted_sum(predictor[newest], k), state, slopes)
        return predicted, jax.tree.map(lambda k: weighted_sum(correction[newest], k), slopes)

    def advance(carry, inputs):
        (predicted, more), corrected, slopes = carry
        number, point = inputs
        turn, place = number % ORDER, number % 2
        state = jax.tree.map(lambda y, c, new: y + (own * new + c), predicted, more, f(predicted, point))
        # Written to memory and read again at a place that the compiler does not know: else it would work the
        # correction out once more for every array of the second slope.
        corrected = _written(corrected, state, place)
        state = jax.tree.map(lambda a: lax.dynamic_index_in_dim(a, place, keepdims=False), corrected)
        slopes = _written(slopes, f(state, point), turn)
        return (sums(turn, state, slopes), corrected, slopes), (state if keep_all else None)

    first = jax.tree.map(lambda a: a[-1], early)
    blank = jax.tree.map(lambda a: jnp.stack([a, a]), first)
    carry = (sums(ORDER - 1, first, slopes), blank, slopes)
    if count is None:
        (_, corrected, _), states = lax.scan(advance, carry, (jnp.arange(capacity), ahead))
        last_place = (capacity - 1) % 2
    else:
        taken = count - (ORDER - 1)
        blank_states = jax.tree.map(lambda a: jnp.zeros((capacity, *a.shape), a.dtype), initial)
        corrected, states = _counted(advance, carry, ahead, taken, blank_states if keep_all else None)
        last_place = (taken - 1) % 2
    if not keep_all:
        return jax.tree.map(lambda a: a[last_place], corrected)
    return jax.tree.map(lambda a, b, c: jnp.concatenate([a[None], b, c]), initial, early, states)


def _written(kept: PyTree, new: PyTree, place: Int[Array, ""]) -> PyTree:
    return jax.tree.map(lambda a, b: lax.dynamic_update_index_in_dim(a, b, place, 0), kept, new)


def _counted(advance, carry, ahead, count, kept):
    def body(number, carry):
        moving, kept = carry
        point = jax.tree.map(lambda a: lax.dynamic_index_in_dim(a, number, keepdims=False), ahead)
        moving, state = advance(moving, (number, point))
        return moving, None if kept is None else _written(kept, state, number)

    (_, corrected, _), kept = lax.fori_loop(0, count, body, (carry, kept))
    return corrected, kept


def _turning_weights(step: Float[Array, ""], dtype) -> tuple[Array, Array, Array]:
    """Step times the weights of the kept slopes in predictor and correction, [newest slot, slot], and of the new slope.

    A slope stays in the slot (its step's number) mod 12 and the weights go round instead. The correction is the
    corrector minus the predictor, but for its weight of the slope at the predicted state.
    """
    predictor, corrector = adams_weights(ORDER)
    slots = np.arange(ORDER)
    age = (slots[:, None] - slots) % ORDER
    correction = MORE * (np.append(corrector[1:], 0.0) - predictor)
    return (
        jnp.asarray(predictor[age], dtype) * step,
        jnp.asarray(correction[age], dtype) * step,
        step * float(MORE * corrector[0]),
    )


def _start(f, initial, starting, early_ends, step):
    """The states after each of the starting steps, and the slopes at the beginning and after each.

    The slope at a step's end is one stage more, the next step's first one once again: compiled within the stages' loop
    it costs nothing, apart from it a quarter of the whole program.
    """
    tableau = DORMAND_PRINCE_8

    def one_step(state, inputs):
        points, end = inputs
        nodes = tuple(jax.tree.map(lambda a, k=k: a[k], points) for k in range(_NODES_A_STEP))
        state, slopes = staged_step(tableau, f, state, step, (*nodes, end), closed=True)
        return state, (state, *(jax.tree.map(lambda a, k=k: a[k], slopes) for k in (0, -1)))

    _, (states, beginnings, ends) = lax.scan(one_step, initial, (starting, early_ends))
    return states, jax.tree.map(lambda a, b: jnp.concatenate([a, b[-1:]]), beginnings, ends)
