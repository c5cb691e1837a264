"""Explicit Runge-Kutta methods: tableaux, and one step over given values at the stage nodes."""

from collections.abc import Callable
from dataclasses import dataclass

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float, PyTree

Derivative = Callable[[PyTree, PyTree], PyTree]
"""f(state, point) -> time derivative; `point` is whatever is known beforehand at that instant."""


@dataclass(frozen=True, eq=False)
class Tableau:
    """Coefficients of an explicit method (Butcher's notation), zeros left out."""

    order: int
    rows: tuple[dict[int, float], ...]
    """a_ij of stage i by j."""
    weights: dict[int, float]
    """b_j by j."""
    nodes: tuple[float, ...]
    """c_i, as fractions of the step."""
    reach: float
    """Step times the fastest rate of a motion, over tolerance^(1/order), that usually holds the tolerance; measured."""

    @property
    def stages(self) -> int:
        """Evaluations of the derivative in one step."""
        return len(self.rows)

    @property
    def matrix(self) -> Float[np.ndarray, "rows stages"]:
        """The rows and, last, the weights, as one matrix with its zeros."""
        found = np.zeros((self.stages + 1, self.stages))
        for i, row in enumerate((*self.rows, self.weights)):
            found[i, list(row)] = list(row.values())
        return found

    @property
    def inner_nodes(self) -> tuple[float, ...]:
        """The distinct nodes between start and end of a step, in order."""
        return tuple(sorted({c for c in self.nodes if 0.0 < c < 1.0}))

    @property
    def node_of_stage(self) -> tuple[int, ...]:
        """Position of each stage's node among start, inner nodes and end."""
        places = (0.0, *self.inner_nodes, 1.0)
        return tuple(places.index(c) for c in self.nodes)


RK4 = Tableau(
    4, ({}, {0: 0.5}, {1: 0.5}, {2: 1.0}), {0: 1 / 6, 1: 1 / 3, 2: 1 / 3, 3: 1 / 6}, (0.0, 0.5, 0.5, 1.0), 0.3
)
"""The classical method (Kutta 1901)."""

DORMAND_PRINCE_8 = Tableau(
    8,
    (
        {},
        {0: 0.05260015195876773},
        {0: 0.0197250569845379, 1: 0.0591751709536137},
        {0: 0.02958758547680685, 2: 0.08876275643042054},
        {0: 0.2413651341592667, 2: -0.8845494793282861, 3: 0.924834003261792},
        {0: 0.037037037037037035, 3: 0.17082860872947386, 4: 0.12546768756682242},
        {0: 0.037109375, 3: 0.17025221101954405, 4: 0.06021653898045596, 5: -0.017578125},
        {
            0: 0.03709200011850479,
            3: 0.17038392571223998,
            4: 0.10726203044637328,
            5: -0.015319437748624402,
            6: 0.008273789163814023,
        },
        {
            0: 0.6241109587160757,
            3: -3.3608926294469414,
            4: -0.868219346841726,
            5: 27.59209969944671,
            6: 20.154067550477894,
            7: -43.48988418106996,
        },
        {
            0: 0.47766253643826434,
            3: -2.4881146199716677,
            4: -0.590290826836843,
            5: 21.230051448181193,
            6: 15.279233632882423,
            7: -33.28821096898486,
            8: -0.020331201708508627,
        },
        {
            0: -0.9371424300859873,
            3: 5.186372428844064,
            4: 1.0914373489967295,
            5: -8.149787010746927,
            6: -18.52006565999696,
            7: 22.739487099350505,
            8: 2.4936055526796523,
            9: -3.0467644718982196,
        },
        {
            0: 2.273310147516538,
            3: -10.53449546673725,
            4: -2.0008720582248625,
            5: -17.9589318631188,
            6: 27.94888452941996,
            7: -2.8589982771350235,
            8: -8.87285693353063,
            9: 12.360567175794303,
            10: 0.6433927460157636,
        },
    ),
    {
        0: 0.054293734116568765,
        5: 4.450312892752409,
        6: 1.8915178993145003,
        7: -5.801203960010585,
        8: 0.3111643669578199,
        9: -0.1521609496625161,
        10: 0.20136540080403034,
        11: 0.04471061572777259,
    },
    (
        0.0,
        0.05260015195876773,
        0.0789002279381516,
        0.1183503419072274,
        0.2816496580927726,
        0.3333333333333333,
        0.25,
        0.3076923076923077,
        0.6512820512820513,
        0.6,
        0.8571428571428571,
        1.0,
    ),
    2.0,
)
"""Twelve stages of order eight (Prince & Dormand 1981; coefficients of DOP853, Hairer, Norsett & Wanner 1993, II.5)."""


def runge_kutta_step(
    tableau: Tableau, f: Derivative, state: PyTree, h: float | Float[Array, ""], points: tuple[PyTree, ...]
) -> PyTree:
    """Return the state one step `h` later; `points` are the known values at the tableau's nodes, one for each stage."""
    slopes: list[PyTree] = []
    for row, point in zip(tableau.rows, points, strict=True):
        slopes.append(f(_moved(state, h, row, slopes), point))
    return _moved(state, h, tableau.weights, slopes)


def _moved(state: PyTree, h: float | Float[Array, ""], weights: dict[int, float], slopes: list[PyTree]) -> PyTree:
    """state + h sum of weights[j] slopes[j]."""
    if not weights:
        return state
    chosen = [slopes[j] for j in weights]

    def add(y, *k):
        return y + h * sum(w * s for w, s in zip(weights.values(), k, strict=True))

    return jax.tree.map(add, state, *chosen)


def integrate_in_time(
    tableau: Tableau, f: Derivative, initial: PyTree, times: Float[Array, " n"], *, start: float | Float[Array, ""]
) -> PyTree:
    """Return the states at `times`, one step of the method from each to the next, the first from `start`.

    `f(state, t)` takes the time itself; the result has `times` as the leading axis of each leaf.
    """
    ends = jnp.asarray(times)
    begins = jnp.concatenate([jnp.reshape(jnp.asarray(start, ends.dtype), (1,)), ends[:-1]])

    def advance(state, interval):
        begin, end = interval
        h = end - begin
        state = runge_kutta_step(tableau, f, state, h, tuple(begin + c * h for c in tableau.nodes))
        return state, state

    return jax.lax.scan(advance, initial, (begins, ends))[1]
