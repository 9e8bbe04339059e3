"""Derivatives of a root against those of its closed form, in both modes and at every order."""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest

from isojax._implicit import with_derivatives

AT = 1.3


def closed(p):
    """Give the cube root of 2 p, and a value that follows from it, squared so that orders mix."""
    root = jnp.cbrt(2.0 * p)
    return (jnp.sin(root) * p) ** 2


def residual(root, live, held):
    p, other = live
    return root**3 - other * p, jnp.sin(root[0]) * p


@eqx.filter_jit
def found(p):
    known = jax.lax.stop_gradient(p)
    root = jnp.cbrt(2.0 * known)[None]
    value = with_derivatives(jnp.sin(root[0]) * known, residual, root, (p, jnp.asarray(2.0)), None)
    return value**2


FORWARD, REVERSE = jax.jacfwd, jax.grad


@pytest.mark.parametrize(
    "modes",
    [(FORWARD,), (REVERSE,), (FORWARD, REVERSE), (REVERSE, FORWARD), (REVERSE, REVERSE), (FORWARD,) * 3],
    ids=lambda modes: "-".join(mode.__name__ for mode in modes),
)
def test_derivatives_of_a_root_are_those_of_its_closed_form(modes):
    ours, theirs = found, closed
    for mode in modes:
        ours, theirs = mode(ours), mode(theirs)
    np.testing.assert_allclose(ours(jnp.asarray(AT)), theirs(jnp.asarray(AT)), rtol=1e-12)


def test_a_batch_of_derivatives_is_that_of_each():
    at = jnp.asarray([0.7, 1.3])
    np.testing.assert_allclose(jax.vmap(jax.grad(found))(at), jax.vmap(jax.grad(closed))(at), rtol=1e-12)


def test_values_without_a_search_are_differentiated_as_they_stand():
    def curve(p):
        def values(root, live, held):
            return root, {"sum": live[0] + held * live[1], "product": live[0] * live[1]}

        known = values(jnp.zeros(0), jax.lax.stop_gradient(p), 3.0)[1]
        return with_derivatives(known, values, jnp.zeros(0), p, 3.0)

    at = (jnp.asarray(2.0), jnp.asarray(5.0))
    slopes = jax.grad(lambda p: curve(p)["sum"] * curve(p)["product"])(at)
    # (a + 3 b) a b at a = 2, b = 5: by a 2 a b + 3 b^2, by b a^2 + 6 a b.
    np.testing.assert_allclose(slopes, (95.0, 64.0), rtol=1e-14)
