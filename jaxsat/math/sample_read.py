"""States between the steps of a motion, read in a way whose transpose XLA can compile into one function."""

import jax
import jax.numpy as jnp
import numpy as np
from jax import lax
from jax.extend.core import Primitive
from jax.interpreters import ad, batching, mlir
from jaxtyping import Array, Float, Int


def read_samples(
    states: Float[Array, "states *parts"],
    first: Int[Array | np.ndarray, " samples"],
    weights: Float[Array | np.ndarray, "samples k"],
) -> Float[Array, "samples *parts"]:
    """For each sample the weighted sum of `k` neighbouring states from number `first` on.

    Differentiable by the states in both modes; `weights` count as constants. JAX's own transpose of a gather is a
    scatter, which a program in one function (`jaxsat.math.one_function`) cannot hold: here it is a loop of sums.
    """
    return _read.bind(states, jnp.asarray(first), lax.stop_gradient(jnp.asarray(weights, states.dtype)))


_read = Primitive("read_samples")


@_read.def_impl
@jax.jit
def _gathered(states, first, weights):
    picked = states[first[:, None] + np.arange(weights.shape[1])[None, :]]
    return jnp.einsum("sk,sk...->s...", weights, picked, precision="highest")


@_read.def_abstract_eval
def _shape(states, first, weights):
    return states.update(shape=(*first.shape, *states.shape[1:]))


def _tangent(primals, tangents):
    states, first, weights = primals
    found, moved = _read.bind(*primals), tangents[0]
    return found, jnp.zeros_like(found) if isinstance(moved, ad.Zero) else _read.bind(moved, first, weights)


def _transpose(cotangent, states, first, weights):
    if isinstance(cotangent, ad.Zero):
        return None, None, None
    width = weights.shape[1]
    own = weights.reshape(*weights.shape, *[1] * (cotangent.ndim - 1))

    def add(sample, total):
        block = lax.dynamic_slice_in_dim(total, first[sample], width) + own[sample] * cotangent[sample][None]
        return lax.dynamic_update_slice_in_dim(total, block, first[sample], 0)

    return lax.fori_loop(0, first.shape[0], add, jnp.zeros(states.aval.shape, cotangent.dtype)), None, None


def _batch(arguments, axes):
    states, first, weights = arguments
    if axes[1] is None and axes[2] is None:
        return _read.bind(jnp.moveaxis(states, axes[0], -1), first, weights), -1 % states.ndim
    return jax.vmap(_gathered, in_axes=axes)(*arguments), 0


ad.primitive_jvps[_read] = _tangent
ad.primitive_transposes[_read] = _transpose
batching.primitive_batchers[_read] = _batch
mlir.register_lowering(_read, mlir.lower_fun(_gathered, multiple_results=False))
