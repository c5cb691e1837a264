"""Numbers that are not free: gains, tilts, albedo, biases ... freed a part at a time.

Where there is room among the unknowns of the fit's programs they run as they are. Else the part is settled beside them,
on the host, with the Jacobian of a few of its numbers at a time, and then held at what was found.
"""

from collections.abc import Iterator, Sequence
from dataclasses import replace

import equinox as eqx
import jax
import numpy as np
from scipy.spatial.transform import Rotation

from fitting.doctor.bench import Bench
from fitting.doctor.score import robust, softened, terms
from fitting.doctor.searches import PROMISE, anew
from fitting.doctor.trial import WORTH, Trial
from fitting.parameters.free import FreeParameters, free_parameters
from fitting.parameters.names import STATE
from fitting.parameters.tree import FreeLeaves
from fitting.starts.multi_start import Starts
from jaxsat.satellites.model import Leaf, Model

STARTS = 32
MOST = 3
"""Parts that are freed together."""
ROUNDS = 12
"""Steps on the host."""
FINISHED = 0.5
"""Saving of half a chi2 below which they end."""
MEANINGS = {
    "gains": "the panels do not give the same current in the same light",
    "gain": "the faces do not give the same reading in the same light",
    "tilts": "the panels do not stand square",
    "albedo": "the Earth's light is not in the model",
    "imax": "the largest current is not that of the file",
    "bias": "the sensor adds a constant",
    "scale": "the sensor's scale is not one",
    "turn": "the sensor is turned",
    "magnet": "the magnet is not that of the file",
    "inertia": "the inertia is not that of the file",
    "rods": "the rods are not those of the file",
}


def parts_to_free(bench: Bench) -> dict[str, list[int]]:
    """Numbers of the leaves of each part that is not free, and that a sensor which is fitted or the motion shows."""
    free = set(bench.parameters.columns.tolist())
    fitted = tuple(f"sensors.{name}." for name, channel in bench.samples.channels.items() if not channel.witness)
    found: dict[str, list[int]] = {}
    for number, leaf in enumerate(bench.parameters.leaves):
        shown = leaf.place.startswith(("spacecraft.", "albedo.", *fitted))
        if number in free or leaf.restates or not shown:
            continue
        whole = leaf.place.startswith(("spacecraft.", "albedo."))
        found.setdefault(leaf.part.split(".")[0] if whole else leaf.part, []).append(number)
    return found


def freed_parts(bench: Bench) -> Iterator[Trial]:
    """Each part that is not free, freed; with the best of them others that the fit's programs have room for."""
    parts = parts_to_free(bench)
    found = {(part,): _freed(bench, numbers) for part, numbers in parts.items() if _promises(bench, numbers)}
    known: dict[tuple[str, ...], float] = {chosen: chi2 for chosen, chi2 in found.items() if chi2 is not None}
    for _ in range(MOST - 1):
        if not known:
            break
        best = min(known, key=lambda chosen: known[chosen])
        if known[best] < bench.enough or len(best) == MOST:
            break
        for part in parts:
            if part not in best:
                chi2 = chi2_in_room(bench, [k for each in (*best, part) for k in parts[each]])
                known |= {} if chi2 is None else {(*best, part): chi2}
    for chosen, chi2 in known.items():
        meanings = [MEANINGS.get(part.split(".")[-1], "a value is not that of the satellite file") for part in chosen]
        yield Trial(
            f"{chosen[0]} not free" if len(chosen) == 1 else "parts not free",
            f"{' and '.join(chosen)} {'is' if len(chosen) == 1 else 'are'} not free",
            f"{'; '.join(meanings)}: free what is named",
            chi2,
            sum(len(parts[part]) for part in chosen),
            f"--free {','.join([*_asked(bench), *chosen])}",
        )


def _promises(bench: Bench, numbers: list[int]) -> bool:
    """Whether a look at the minimum says that these numbers buy more than their price; yes where it cannot say."""
    parameters = bench.parameters
    if any(parameters.leaves[k].moves for k in numbers) or len(parameters.columns) == parameters.tree.moving:
        return True
    sigma = np.array([parameters.leaves[k].loose for k in numbers])
    start = bench.starts.x[0], bench.starts.reference[0]
    columns = _jacobian(bench, parameters, *start, numbers, sigma)
    return bench.score.fall(columns, with_prior=True)[1] > max(WORTH + 2.0 * len(numbers), PROMISE * bench.unexplained)


def _asked(bench: Bench) -> list[str]:
    """What was free, by its parts."""
    return list(
        dict.fromkeys(bench.parameters.leaves[k].part.split(".")[0] for k in bench.parameters.columns if k >= 0)
    )


def _freed(bench: Bench, numbers: list[int]) -> float | None:
    """Chi2 with these leaves free; None where they move the satellite and there is no room for them."""
    chi2, old = chi2_in_room(bench, numbers), bench.parameters
    if chi2 is not None:
        return chi2
    if any(old.leaves[k].moves for k in numbers) or len(old.columns) == old.tree.moving:
        return None
    return min(_beside(bench, numbers, k) for k in range(min(2, len(bench.starts.x))))


def chi2_in_room(bench: Bench, numbers: list[int]) -> float | None:
    """The same by the fit's own programs; None where they have not so many unknowns."""
    old = bench.parameters
    wider, starts = widened(bench, bench.problem.model, old.leaves, numbers)
    if len(wider.columns) != len(old.columns) or wider.tree.moving != old.tree.moving:
        return None
    chi2 = bench.chi2_near(bench.problem, starts, parameters=wider)
    return chi2 if chi2 < bench.enough else min([chi2, *anew(bench, bench.samples, STARTS, parameters=wider)])


def widened(
    bench: Bench, model: Model, leaves: tuple[Leaf, ...], numbers: Sequence[int] = ()
) -> tuple[FreeParameters, Starts]:
    """What was free, and leaves of these numbers, of `leaves` that begin with the fit's; and its minima with them."""
    old = bench.parameters
    names = [leaves[k].name for k in [*old.columns, *numbers] if k >= 0]
    held = [gauge.name for gauge in old.tree.gauges]
    wider = free_parameters(model, leaves, names, free_motion=old.free_motion, held=held)
    x = np.zeros((len(bench.starts.x), len(wider.everything)))
    x[:, : len(STATE)] = bench.starts.x[:, : len(STATE)]
    for k, column in enumerate(old.columns):
        if column >= 0:
            x[:, len(STATE) + int(np.flatnonzero(wider.columns == column)[0])] = bench.starts.x[:, len(STATE) + k]
    return wider, Starts(x, bench.starts.reference, np.zeros(len(x)))


def _beside(bench: Bench, numbers: list[int], start: int) -> float:
    """Chi2 with numbers of sensors settled on the host."""
    found, x, reference = _settled(bench, numbers, start)
    parameters = bench.parameters.with_nominal(dict(zip(numbers, found, strict=True)))
    chi2 = bench.chi2_near(bench.problem, Starts(x[None], reference[None], np.zeros(1)), parameters=parameters)
    sigma = np.array([bench.parameters.leaves[k].loose for k in numbers])
    nominal = np.asarray(bench.parameters.tree.nominal)[numbers]
    return chi2 + float((((found - nominal) / sigma) ** 2).sum())


def _settled(bench: Bench, numbers: list[int], start: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Values of the leaves, and x and reference beside them, by Levenberg's and Marquardt's steps on the host."""
    parameters, problem = bench.parameters, bench.problem
    base = parameters.everything
    sigma = np.array([parameters.leaves[k].loose for k in numbers])
    nominal = np.asarray(parameters.tree.nominal)[numbers]
    weight = bench.weight(problem)
    bounds = np.array([(parameters.leaves[k].lower, parameters.leaves[k].upper) for k in numbers]).T
    lower, upper = parameters.bounds()
    x, reference, values = bench.starts.x[start].copy(), bench.starts.reference[start].copy(), nominal.copy()
    cost, damping, best = np.inf, 1e-2, (values, x, reference)
    system = None
    for _ in range(ROUNDS):
        moved = parameters.with_nominal(dict(zip(numbers, values, strict=True)))
        residual, own = bench.look(problem, moved, x, reference)
        prior = np.concatenate([np.where(np.arange(len(x)) < len(STATE), 0.0, x)[base], (values - nominal) / sigma])
        square, slope, curvature = terms(residual, np.asarray(problem.floor))
        trial = 0.5 * float((weight * robust(square)).sum() + prior @ prior)
        saved = cost - trial
        if saved > 0.0:
            cost, best, damping = trial, (values, x, reference), damping * 0.2
            J = np.concatenate([own[..., base], _jacobian(bench, moved, x, reference, numbers, sigma)], axis=-1)
            w = softened(weight, square)
            flat = J.reshape(-1, J.shape[-1])
            gradient = flat.T @ (w * slope).reshape(-1) + prior
            matrix = flat.T @ (flat * (w * curvature).reshape(-1, 1))
            matrix += np.diag(np.concatenate([np.arange(len(x))[base] >= len(STATE), np.ones(len(numbers))]))
            system = gradient, matrix
            if saved < FINISHED:
                break
        else:
            damping *= 8.0
        assert system is not None
        gradient, matrix = system
        step = -np.linalg.solve(matrix + damping * np.diag(np.diagonal(matrix)), gradient)
        values, x, reference = best
        values = np.clip(values + sigma * step[base.sum() :], *bounds)
        x = x.copy()
        x[base] += step[: base.sum()]
        x = np.clip(x, lower, upper)
        turned = Rotation.from_quat(reference, scalar_first=True) * Rotation.from_rotvec(x[:3])
        reference, x[:3] = turned.as_quat(scalar_first=True), 0.0
    return best


_values = jax.jit(FreeLeaves.values)


def _jacobian(bench: Bench, parameters: FreeParameters, x, reference, numbers: list[int], sigma) -> np.ndarray:
    """[samples channels numbers] for a prior sigma of each, as many at a time as the program has sensors' unknowns."""
    moving, count = parameters.tree.moving, len(parameters.columns)
    tree, room = parameters.tree, count - moving
    values = np.asarray(_values(tree, x[len(STATE) :]))
    seeing = [k for k in parameters.columns[moving:] if k >= 0]
    nominal = np.array(tree.nominal)
    nominal[seeing] = values[seeing]
    still = x.copy()
    still[len(STATE) + moving :] = 0.0
    found = []
    for begin in range(0, len(numbers), room):
        part = numbers[begin : begin + room]
        tangent = np.array(tree.tangent)
        tangent[:, moving:] = 0.0
        tangent[part, moving + np.arange(len(part))] = sigma[begin : begin + len(part)]
        other = eqx.tree_at(lambda t: (t.nominal, t.tangent), tree, (nominal, tangent))
        _, jacobian = bench.look(bench.problem, replace(parameters, tree=other), still, reference)
        found.append(jacobian[..., len(STATE) + moving :][..., : len(part)])
    return np.concatenate(found, axis=-1)
