"""Functions replayed element by element do what `jax.vmap` of them does: values, slopes, dtypes; zeros are left out."""

import functools

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from jax import lax

from jaxsat.environment import reflection_angle, solve_kepler
from jaxsat.environment.shadow import lens_area
from jaxsat.math import cross, inverse_3x3, quaternion, unit
from jaxsat.math.scalars import elements, over_cases, regrouped

EPS = np.finfo(float).eps
# Most of the time goes into compiling, and none of it has to be fast.
quick = functools.partial(jax.jit, compiler_options={"xla_backend_optimization_level": 0})


def like(*shapes, dtype=float):
    return tuple(jax.ShapeDtypeStruct(shape, dtype) for shape in shapes)


def replay(function, shapes, cases, arguments):
    """Values over the cases in the first axes, by elements with the cases in the last ones."""
    one_case = like(*shapes, dtype=arguments[0].dtype)
    replayed = over_cases(function, *one_case)
    last = [jnp.moveaxis(x, range(len(cases)), range(-len(cases), 0)) for x in arguments]
    found = replayed(*(elements(x, element_rank=len(shape)) for x, shape in zip(last, shapes, strict=True)))

    def together(x, expected):
        assert x.shape == expected.shape
        stacked = [jnp.broadcast_to(jnp.asarray(each, expected.dtype), cases) for each in x.reshape(-1)]
        return jnp.stack(stacked, axis=-1).reshape(*cases, *x.shape) if stacked else jnp.zeros((*cases, *x.shape))

    return jax.tree.map(together, found, jax.eval_shape(function, *one_case))


def over_all(function, cases):
    return functools.reduce(lambda f, _: jax.vmap(f), cases, function)


def drawn(shapes, cases, seed=0):
    rng = np.random.default_rng(seed)
    return [jnp.asarray(rng.uniform(0.2, 0.9, size=(*cases, *shape))) for shape in shapes]


def products(a, b, m, n, s):
    return {
        "inner": a @ b + jnp.vdot(a, b),
        "matrix": (m @ a, a @ m, m @ n, m.T @ n @ m),
        "einsum": (jnp.einsum("ij,ik->jk", m, n), jnp.einsum("ij,ij->i", m, n), jnp.einsum("ij,k->kji", m, a)),
        "outer": jnp.outer(a, b),
        "cross": (cross(a, b), jnp.cross(a, b)),
        "inverse": inverse_3x3(m + 3.0 * jnp.eye(3, dtype=m.dtype)),
        "direction cosines": quaternion.to_dcm(m.reshape(9)[:4]),
        "lengths": (unit(a), jnp.linalg.norm(m)),
        "rows": jax.vmap(jnp.dot)(m, n) + jax.vmap(lambda row: s * row @ b)(m),
    }


def elementwise(a, b, m, n, s):
    integer = jnp.asarray(10.0 * a, int)
    return {
        "where": (jnp.where(a > b, a, 0.0), jnp.where(s > 0.5, a, b), jnp.clip(a, 0.4, s)),
        "powers": (a**2, a**-3, a**2.5, a**b, jnp.sqrt(a), lax.rsqrt(a), jnp.square(m)),
        "angles": (jnp.sin(s), jnp.tan(s), jnp.arccos(s), jnp.arcsin(s), jnp.arctan(s), jnp.arctan2(a, -b)),
        "exponentials": (jnp.exp(s), jnp.log(s), jnp.expm1(s), jnp.log1p(s), jnp.tanh(s), jnp.cosh(s), jnp.sinh(s)),
        "roundings": (jnp.round(9.0 * a), jnp.floor(9.0 * a), jnp.ceil(9.0 * b), jnp.sign(a - b), jnp.mod(a, 0.3)),
        "integers": (3 * integer % 4, -integer, jnp.abs(integer - 5), integer.astype(float) * a, 0 * integer),
        "truth": ((a > b) & (a < 0.8) | ~(b >= s), (a > b) ^ (b == b), jnp.isfinite(a)),
        "mixed": (a[:, None] * b[None, :], s * m - a[None, :], m / s, lax.stop_gradient(a) * b, 0.0 - a, 1.0 * n + 0.0),
    }


def rearranged(a, b, m, n, s):
    return {
        "joined": (jnp.concatenate([a, b[:1], s[None]]), jnp.stack([a, b], axis=1), jnp.stack([m, n], axis=0)),
        "cut": (m[1:, ::2], m[0], m[:, 1], a[1], a[-1], a[:0], m.reshape(9)[::-2].reshape(5, 1).T),
        "turned": (m.T, jnp.flip(m, 0), jnp.roll(a, 1), jnp.moveaxis(jnp.stack([m, n]), 0, 1), m[:, None].squeeze(1)),
        "spread": (jnp.broadcast_to(a[:, None], (3, 2)), jnp.broadcast_to(s, (2, 2)), jnp.tile(a, 2)),
        "summed": (m.sum(), m.sum(0), m.sum(1), m.mean(), jnp.trace(m), a[:0].sum(), a[:0] @ b[:0]),
        "constant": (jnp.ones(3), jnp.zeros(()), jnp.arange(3) * jnp.asarray([2, 0, 1]), jnp.asarray(np.eye(3)) @ a),
    }


def whole(a, b, m, n, s):
    """What has no rule of its own goes through arrays: loops, branches, sorting, gathering, functions with a rule."""
    return {
        "branch": lax.cond(s > 0.5, jnp.sin, lambda x: x**2, a),
        "loop": lax.scan(lambda c, x: (c * x + 1.0, c), s, a),
        "while": lax.while_loop(lambda c: c < 3.0, lambda c: c + s, b[0]),
        "extremes": (m.max(), m.min(0), jnp.prod(m), m.argmax(1), jnp.cumsum(m, 0), jnp.sort(a)),
        "gathered": (a[np.array([2, 0, 1, 1])], a[jnp.asarray(2.5 * s, int)], b.at[1].set(4.0), jnp.pad(a, 1)),
        "table": jnp.interp(s, jnp.linspace(0.0, 1.0, 5), jnp.linspace(0.0, 1.0, 5) ** 2),
        "functions": (jax.scipy.special.erf(a), jnp.arcsinh(b), jnp.cbrt(m)),
        "rules": (solve_kepler(10.0 * s, b[0]), reflection_angle(4.0 + s, a[0]), lens_area(a[0], b[0], a[1])),
    }


VECTORS = ((3,), (3,), (3, 3), (3, 3), ())


@pytest.mark.slow
@pytest.mark.parametrize(
    ("function", "cases"),
    [(products, (5,)), (elementwise, (2, 3)), (rearranged, (5,)), (whole, ()), (whole, (2, 3))],
)
def test_values_are_those_of_vmap(function, cases):
    arguments = drawn(VECTORS, cases)
    found = quick(lambda *x: replay(function, VECTORS, cases, x))(*arguments)
    expected = quick(over_all(function, cases))(*arguments)
    for name in expected:
        for one, other in zip(jax.tree.leaves(found[name]), jax.tree.leaves(expected[name]), strict=True):
            assert one.shape == other.shape and one.dtype == other.dtype, name
            one, other = np.asarray(one, float), np.asarray(other, float)
            # Sums of up to nine terms of order one, in another order; nothing here is steep.
            np.testing.assert_allclose(one, other, rtol=32 * EPS, atol=16 * EPS, err_msg=name)


def smooth(a, b, m, n, s):
    """A number with slopes through products, rearrangements, a choice and operations without a rule of their own."""
    turned = m.T @ unit(a) + cross(a, n[:, 1])
    chosen = jnp.where(a > 0.5, a**2, jnp.exp(-a) / b)
    looped, _ = lax.scan(lambda c, row: (c * row, None), b[:2], m[:, 1:])
    spread = jnp.concatenate([n.max(0), jnp.sum(jnp.flip(n), axis=1)[:1]])
    return s * (turned @ chosen + jnp.sum(looped) * jnp.sum(jnp.sin(spread)))


@pytest.mark.slow
@pytest.mark.parametrize("mode", [jax.jacfwd, jax.jacrev], ids=["forward", "reverse"])
def test_slopes_are_those_of_vmap(mode):
    cases = (2,)
    arguments = drawn(VECTORS, cases, seed=5)
    found = quick(mode(lambda *x: replay(smooth, VECTORS, cases, x), argnums=range(5)))(*arguments)
    expected = quick(mode(over_all(smooth, cases), argnums=range(5)))(*arguments)
    for one, other in zip(found, expected, strict=True):
        assert np.all(np.isfinite(other)) and np.abs(other).max() > 0.1
        np.testing.assert_allclose(one, other, atol=1e2 * EPS * np.abs(other).max())


@jax.custom_jvp
def forward_rule(x, y):
    return x * y


forward_rule.defjvp(lambda primals, tangents: (forward_rule(*primals), 7.0 * tangents[0] + 5.0 * tangents[1]))


@jax.custom_vjp
def reverse_rule(x):
    return 2.0 * x


reverse_rule.defvjp(lambda x: (reverse_rule(x), None), lambda _, g: (11.0 * g,))


def test_rules_of_custom_derivatives_survive():
    """Slopes that no differentiation of x y or 2 x gives, in reverse mode; and Kepler's equation, M' = r E'."""
    cases = (2, 3)
    x, y = drawn([(), ()], cases, seed=2)

    def slopes(function, *arguments):
        shapes = [()] * len(arguments)
        total = lambda *z: jnp.sum(replay(function, shapes, cases, z))  # noqa: E731
        return quick(jax.grad(total, argnums=range(len(arguments))))(*arguments)

    np.testing.assert_array_equal(slopes(forward_rule, x, y)[0], 7.0)
    np.testing.assert_array_equal(slopes(forward_rule, x, y)[1], 5.0)
    np.testing.assert_array_equal(slopes(reverse_rule, x)[0], 11.0)

    anomaly = np.asarray(quick(lambda *z: replay(solve_kepler, [(), ()], cases, z))(x, y))
    np.testing.assert_allclose(anomaly - y * np.sin(anomaly), x, atol=4 * EPS)
    r = 1 - np.asarray(y) * np.cos(anomaly)
    by_mean_anomaly, by_eccentricity = slopes(solve_kepler, x, y)
    np.testing.assert_allclose(by_mean_anomaly, 1 / r, rtol=64 * EPS)
    np.testing.assert_allclose(by_eccentricity, np.sin(anomaly) / r, rtol=64 * EPS)


def test_single_precision_stays_single():
    cases = (2,)
    arguments = [x.astype(jnp.float32) for x in drawn(VECTORS, cases)]

    def several(a, b, m, n, s):
        constant = jnp.asarray([[2.0, 0, 0], [0, 1.0, 0], [0, 0.5, 0]], a.dtype)
        return m @ a, constant @ b, cross(a, n[0]), a**2.5 / s, jnp.max(m, axis=1), jnp.sum(a[:0]), 2.0 * m, m.mean()

    found = quick(lambda *x: replay(several, VECTORS, cases, x))(*arguments)
    expected = quick(over_all(several, cases))(*arguments)
    for one, other in zip(jax.tree.leaves(found), jax.tree.leaves(expected), strict=True):
        assert one.dtype == jnp.float32
        np.testing.assert_allclose(one, other, rtol=64 * float(np.finfo(np.float32).eps), atol=1e-6)
    replayed = over_cases(lambda a, s: s * a + 1.0, *like((3,), (), dtype=jnp.float32))
    alone = replayed(elements(arguments[0].T, element_rank=1), elements(arguments[4], element_rank=0))
    assert {each.dtype for each in alone} == {jnp.dtype(jnp.float32)}


def count(function, *arguments):
    """Operations written down for a function of arrays."""
    return len(jax.make_jaxpr(function)(*arguments).jaxpr.eqns)


def test_zeros_and_ones_are_not_written_down():
    """A diagonal matrix of numbers times a vector: three products; a unit matrix: nothing at all."""
    x = jnp.ones((3, 4))
    times = over_cases(lambda m, v: m @ v, *like((3, 3), (3,)))

    def with_matrix(matrix):
        return lambda x: tuple(times(np.array(matrix, dtype=object), elements(x, element_rank=1)))

    def traced(m, x):
        return tuple(times(elements(m), elements(x, element_rank=1)))

    taken_apart = count(lambda x: tuple(elements(x, element_rank=1)), x)
    full = count(with_matrix([[2.0, 3.0, 4.0]] * 3), x)
    assert count(traced, jnp.ones((3, 3)), x) > full >= taken_apart + 9 + 6
    diagonal = count(with_matrix([[2.0, 0.0, 0.0], [0, 3.0, 0], [0, 0, 4.0]]), x)
    assert diagonal <= full - 12
    assert count(with_matrix(np.eye(3).tolist()), x) == taken_apart
    # So also where the zeros are written in the function itself.
    unit_matrix = over_cases(lambda v: jnp.asarray([[1.0, 0, 0], [0, 1.0, 0], [0, 0, 1.0]]) @ v, *like((3,)))
    known = over_cases(lambda v: np.eye(3) @ v + 0.0 * v, *like((3,)))
    assert count(lambda x: tuple(known(elements(x, element_rank=1))), x) == taken_apart
    np.testing.assert_array_equal(jnp.stack(list(unit_matrix(elements(x, element_rank=1)))), x)


def test_nothing_times_a_zero_that_is_written_down_is_nothing():
    """Not even NaN, unlike in floating arithmetic; zeros that come as data are multiplied."""
    nan = jnp.asarray([np.nan, 2.0])
    (found,) = over_cases(lambda v: 0.0 * v, *like((1,)))(elements(nan[None], element_rank=1))
    assert np.all(np.asarray(found) == 0.0)
    product = over_cases(lambda x, y: x * y, *like((), ()))
    (found,) = product(elements(nan, element_rank=0), elements(jnp.zeros(2), element_rank=0)).reshape(-1)
    np.testing.assert_array_equal(found, [np.nan, 0.0])
    # It goes nowhere else.
    total = over_cases(lambda x, y: (x + y, x), *like((), ()))
    sums = total(elements(nan, element_rank=0), elements(jnp.ones(2), element_rank=0))
    np.testing.assert_array_equal(sums[0][()], [np.nan, 3.0])


def test_common_numbers_and_scalars_beside_cases():
    """Elements of one array may be numbers, scalars common to all cases and arrays over them."""
    times = over_cases(lambda m, v, s: s * m @ v + jnp.sort(v), *like((2, 2), (2,), ()))
    x, common = jnp.asarray([0.3, 0.7, 0.1]), jnp.asarray(0.5)
    matrix = np.empty((2, 2), dtype=object)
    matrix[0, 0], matrix[0, 1], matrix[1, 0], matrix[1, 1] = x, 0.0, common, 2.0
    vector, scale = np.empty(2, dtype=object), np.empty((), dtype=object)
    vector[0], vector[1], scale[()] = common, x, 3.0
    found = times(matrix, vector, scale)
    low, high = np.minimum(0.5, x), np.maximum(0.5, x)
    np.testing.assert_allclose(found[0], 3 * x * 0.5 + low, rtol=4 * EPS)
    np.testing.assert_allclose(found[1], 3 * (0.25 + 2 * x) + high, rtol=4 * EPS)


def test_elements_and_back():
    array = jnp.arange(24.0).reshape(3, 2, 4)
    assert elements(array).shape == (3, 2, 4) and elements(array)[2, 1, 3] == 23.0
    for rank, shape in enumerate([(), (3,), (3, 2)]):
        apart = elements(array, element_rank=rank)
        assert apart.shape == shape and apart.dtype == object
        for index in np.ndindex(shape):
            np.testing.assert_array_equal(apart[index], array[index])
    # A single element that is an array stays one object.
    assert elements(jnp.ones((1, 4)), element_rank=1).shape == (1,)

    flat = tuple(range(8))
    tree = regrouped(flat, {"a": np.zeros((2, 3)), "b": (np.zeros(()), np.zeros(1), np.zeros((0, 2)))})
    assert tree["a"].tolist() == [[0, 1, 2], [3, 4, 5]]
    assert tree["b"][0].shape == () and tree["b"][0][()] == 6 and tree["b"][1].tolist() == [7]
    assert tree["b"][2].shape == (0, 2)


def test_what_stands_behind_a_barrier_is_held_by_what_the_caller_chooses():
    held = []

    def hold(arrays):
        held.append(len(arrays))
        return [2.0 * x for x in arrays]

    def function(a, s):
        a, s, one = lax.optimization_barrier((3.0 * a, s, jnp.ones(())))
        return a + s + one

    a, s = drawn([(3,), ()], (5,))
    replayed = over_cases(function, *like((3,), ()))
    arguments = (elements(a.T, element_rank=1), elements(s, element_rank=0))
    plain = np.stack(list(replayed(*arguments)), axis=-1)
    np.testing.assert_allclose(plain, 3.0 * a + s[:, None] + 1.0, rtol=1e-15)
    doubled = np.stack(list(replayed(*arguments, hold=hold)), axis=-1)
    # Three elements, one scalar; the number one may be held or not.
    assert held in ([4], [5])
    np.testing.assert_allclose(doubled - plain, 3.0 * a + s[:, None] + float(held == [5]), rtol=1e-12)


def test_a_large_constant_is_read_by_index_for_all_cases_at_once():
    table = jnp.asarray(np.random.default_rng(0).normal(size=2000))

    def one(x):
        return 2.0 * table.at[jnp.floor(x).astype(jnp.int32)].get(mode="promise_in_bounds") + x

    x = np.random.default_rng(1).uniform(0.0, 2000.0, (3, 5))
    replayed = over_cases(one, jax.ShapeDtypeStruct((3,), float))
    found = jnp.stack(list(replayed(elements(jnp.asarray(x), element_rank=1))))
    np.testing.assert_allclose(found, 2.0 * np.asarray(table)[x.astype(int)] + x, rtol=1e-14)
