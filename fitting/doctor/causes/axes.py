"""Columns in another order or of other signs: all 48, by a search on growing arcs and by what witnesses see."""

from collections.abc import Iterator, Sequence

import numpy as np
from scipy.spatial.transform import Rotation

from fitting.doctor.bench import Bench
from fitting.doctor.searches import first, searched
from fitting.doctor.sensors import sunlit
from fitting.doctor.trial import Trial
from fitting.measurements.groups import columns_of
from fitting.parameters.names import STATE
from fitting.solvers.refine import Refined
from fitting.starts.multi_start import Starts
from jaxsat.satellites.model import INERTIA_PLACE, MAGNET_PLACE, array_at
from jaxsat.sensors import Magnetometer, Panels, Photodiodes
from jaxsat.sensors.mounting import signed_permutations
from jaxsat.telemetry.table.as_if import swaps_text

STARTS = 64
"""Of each class of orders."""
KEPT = 2
"""Turns of a motion that are fitted again, those that witnesses like best."""


def other_orders(bench: Bench) -> Iterator[Trial]:
    """Faces whose columns are exchanged: whatever of the 48 orders explains the light, turned as witnesses want."""
    for name in sunlit(bench):
        sensor = bench.problem.model.sensors[name]
        assert isinstance(sensor, Panels | Photodiodes)
        normals = np.asarray(sensor.normals, float)
        orders = {tuple(perm): matrix for matrix, perm in _orders(normals)}
        if len(orders) < 2:
            continue
        own = tuple(range(len(normals)))
        base = [(own, bench.found.minima[0].refined, 0)] if bench.fits_light else _searched(bench, name, orders)
        tried = {own}
        for perm, refined, number in base:
            for order in [perm, *_turned(bench, name, orders, perm, refined, number)]:
                if order in tried:
                    continue
                tried.add(order)
                yield _trial(bench, name, order, perm, orders, refined, number)


def _orders(normals: np.ndarray) -> Iterator[tuple[np.ndarray, list[int]]]:
    """Signed permutations of the axes that carry the normals into each other, and the columns that are read then."""
    for matrix in signed_permutations(mirrored=True):
        turned = normals @ matrix.T
        perm = np.argmax(turned @ normals.T, axis=1)
        if np.allclose(normals[perm], turned, atol=1e-6) and len(set(perm.tolist())) == len(normals):
            yield matrix, perm.tolist()


def _searched(
    bench: Bench, name: str, orders: dict[tuple[int, ...], np.ndarray]
) -> list[tuple[tuple[int, ...], Refined, int]]:
    """The order that a search finds the light explained by best, with its minima.

    Orders of one class, which a turn about the magnet carries into each other, have the same torque: one is searched.
    """
    rows, one_of, found = bench.samples.values[name], {}, {}
    for order, matrix in orders.items():
        one_of.setdefault(_class(bench, matrix), order)
    # Each by itself, with room for as many starts as a search of the usual order has.
    for order in one_of.values():
        starts = searched(bench, bench.with_values(name, rows[:, list(order)]), STARTS)
        if starts is not None:
            found[order] = starts
    if not found:
        return []
    best = min(found, key=lambda order: found[order].cost[0])
    fine = bench.rebuilt(bench.with_values(name, rows[:, list(best)]), same_sky=True)
    refined = bench.refitted(fine, first(found[best]))
    return [(best, refined, bench.best_of(fine, refined)[1])] if len(refined.score) else []


def _class(bench: Bench, matrix: np.ndarray) -> tuple[int, ...]:
    """Hand of an order, and the face that the magnet's main axis points to under it."""
    dipole = np.asarray(array_at(bench.problem.model, MAGNET_PLACE), float)
    main = np.eye(3)[np.argmax(np.abs(dipole))] * dipole.any()
    return (int(np.sign(np.linalg.det(matrix))), *(matrix @ main).astype(int).tolist())


def _turned(bench, name, orders, perm, refined, number) -> list[tuple[int, ...]]:
    """The same motion under body axes that are turned with the columns: orders by what witnesses of the field see.

    Where there is no witness, those of the same class, which have another inertia.
    """
    matrix = orders[perm]
    hand = np.linalg.det(matrix)
    q = Rotation.from_quat(np.asarray(refined.points.prediction.quaternion)[number], scalar_first=True)
    field = q.inv().apply(np.array(bench.problem.sky.b_field_eci))
    misfits = {}
    for order, other in orders.items():
        if np.linalg.det(other) * hand > 0.0:
            misfits[order] = _misfit(bench, field @ _turn(matrix, other).T)
    if np.isinf(list(misfits.values())).all():
        own = _class(bench, matrix)
        # Without a magnet all are of the same class, and what else is fitted has told them apart.
        return [order for order, other in orders.items() if _class(bench, other) == own] if any(own[1:]) else []
    return sorted(misfits, key=lambda order: misfits[order])[:KEPT]


def _turn(matrix: np.ndarray, other: np.ndarray) -> np.ndarray:
    """New body axes by the old: a column that read face M n reads M' n, so what was along M n is along M'^-1 M n."""
    return other.T @ matrix


def _misfit(bench: Bench, field: np.ndarray) -> float:
    """How far witnesses of the field are off for a field in body axes [samples 3]."""
    total = np.inf
    for group, columns in zip(bench.problem.groups, columns_of(bench.problem.groups), strict=True):
        sensor, channel = bench.problem.model.sensors[group.name], bench.samples.channels[group.name]
        if not channel.witness or not isinstance(sensor, Magnetometer) or sensor.unit_vector:
            continue
        known = np.asarray(bench.problem.known)[:, columns]
        measured = np.asarray(bench.problem.measured[group.name])
        modelled = field @ np.asarray(sensor.axes).T
        off = np.minimum(((measured - modelled) / channel.sigma) ** 2, 1e4)
        total = (0.0 if np.isinf(total) else total) + float(off[known].sum())
    return total


def _trial(bench, name, order, perm, orders, refined, number) -> Trial:
    rows, labels = bench.samples.values[name], bench.samples.channels[name].columns
    turn = Rotation.from_matrix(_turn(orders[perm], orders[order]))
    points = refined.points
    reference = Rotation.from_quat(np.asarray(points.reference)[number], scalar_first=True) * turn.inv()
    x = np.array(points.x)[number : number + 1]
    x[0, 3:6] = turn.apply(x[0, 3:6])
    if order != perm:
        x[0, len(STATE) :] = _leaves_turned(bench, x[0], turn)
    starts = Starts(x, reference.as_quat(scalar_first=True)[None], np.zeros(1))
    fine = bench.rebuilt(bench.with_values(name, rows[:, list(order)]), same_sky=True)
    chi2 = bench.chi2_near(fine, starts)
    return Trial(
        "axes",
        f"columns of {name} in another order: {exchanged(labels, order)}",
        "columns or signs of faces are exchanged in the table, or the axes of the satellite file are not those of the "
        "telemetry",
        chi2,
        1,
        " ".join(f"--as {text}" for text in swaps_text(labels, order)),
    )


def _leaves_turned(bench: Bench, x: np.ndarray, turn: Rotation) -> np.ndarray:
    """The unknowns after the state, of a satellite whose magnet and inertia are turned with its axes."""
    parameters, matrix = bench.parameters, turn.as_matrix()
    values = bench.values_at(x)
    magnet = [k for k, leaf in enumerate(parameters.leaves) if leaf.place == MAGNET_PLACE]
    inertia = [k for k, leaf in enumerate(parameters.leaves) if leaf.place == INERTIA_PLACE]
    if len(magnet) == 3:
        values[magnet] = matrix @ values[magnet]
    if len(inertia) == 6:
        xx, yy, zz, xy, xz, yz = values[inertia]
        J = matrix @ np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]]) @ matrix.T
        values[inertia] = J[[0, 1, 2, 0, 0, 1], [0, 1, 2, 1, 2, 2]]
    lower, upper = (bound[len(STATE) :] for bound in parameters.bounds())
    return np.clip(parameters.shifts(values), lower, upper)


def exchanged(labels: Sequence[str], order: Sequence[int]) -> str:
    """In words: pairs that are exchanged, else which column stands for which."""
    pairs, rest = [], []
    for k, other in enumerate(order):
        if other != k and order[other] == k:
            pairs += [f"{labels[k]} and {labels[other]}"] if k < other else []
        elif other != k:
            rest.append(f"{labels[other]} for {labels[k]}")
    return ", ".join([*([f"{', '.join(pairs)} exchanged"] if pairs else []), *rest])
