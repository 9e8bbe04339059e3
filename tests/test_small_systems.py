"""Small linear systems, many at once: the solutions, their derivatives, and that nothing waits for ever."""

import subprocess
import sys

import jax
import jax.numpy as jnp
import numpy as np
import optimistix as optx
import pytest

from isojax._small_systems import determinant, newton, solve

SYSTEMS = {size: np.random.default_rng(size).normal(size=(64, size, size)) for size in (1, 2, 3, 5, 14)}


@pytest.mark.parametrize("size", SYSTEMS)
def test_solutions_and_determinants_are_those_of_numpy(size):
    matrices = SYSTEMS[size]
    right = np.random.default_rng(0).normal(size=(64, size, 2))
    found = np.asarray(jax.vmap(solve)(matrices, right))
    gap = np.linalg.norm(matrices @ found - right, axis=1)
    scale = np.linalg.norm(matrices, axis=(1, 2))[:, None] * np.linalg.norm(found, axis=1)
    assert np.max(gap / scale) < 1e-15 * size
    one = np.asarray(jax.vmap(solve)(matrices, right[..., 0]))
    np.testing.assert_allclose(one, found[..., 0], rtol=1e-12)
    np.testing.assert_allclose(jax.vmap(determinant)(matrices), np.linalg.det(matrices), rtol=1e-9)


def test_complex_systems_are_solved_with_their_derivatives():
    rng = np.random.default_rng(1)
    matrix = jnp.asarray(rng.normal(size=(3, 3)) + 1j * rng.normal(size=(3, 3)))
    right = jnp.array([1.0, 2.0j, 3.0])
    inverse = np.linalg.inv(matrix)
    np.testing.assert_allclose(solve(matrix, right), inverse @ right, rtol=1e-12)
    np.testing.assert_allclose(
        jax.jacfwd(solve, argnums=1, holomorphic=True)(matrix, right), inverse, atol=1e-12
    )
    np.testing.assert_allclose(determinant(matrix), np.linalg.det(matrix), rtol=1e-12)


def test_rows_are_exchanged():
    # Without pivoting the first is 0/0 and the second loses all digits.
    np.testing.assert_allclose(solve(jnp.array([[0.0, 2.0], [3.0, 0.0]]), jnp.array([4.0, 9.0])), [3.0, 2.0])
    np.testing.assert_allclose(
        solve(jnp.array([[1e-20, 1.0], [1.0, 1.0]]), jnp.array([1.0, 2.0])), [1.0, 1.0]
    )
    assert determinant(jnp.array([[0.0, 2.0], [3.0, 0.0]])) == -6.0
    assert solve(jnp.zeros((0, 0)), jnp.zeros((0, 2))).shape == (0, 2)
    assert not np.isfinite(solve(jnp.ones((2, 2)), jnp.array([1.0, 2.0]))).all()


@pytest.mark.parametrize("mode", [jax.jacfwd, jax.jacrev])
def test_a_solution_is_differentiated_by_its_matrix_and_its_right_side(mode):
    matrix, right = jnp.asarray(SYSTEMS[5][0]), jnp.arange(5.0) + 1.0
    inverse = np.linalg.inv(matrix)
    solution = inverse @ right
    np.testing.assert_allclose(mode(solve, argnums=1)(matrix, right), inverse, atol=1e-12)
    # d(A^-1 b)_i / dA_jk = -(A^-1)_ij (A^-1 b)_k
    by_matrix = -np.einsum("ij,k->ijk", inverse, solution)
    np.testing.assert_allclose(mode(solve)(matrix, right), by_matrix, atol=1e-11)


def test_newton_finds_the_root_that_is_known():
    def gap(unknown, args):
        return jnp.array([unknown[0] ** 2 + unknown[1] ** 2 - args, unknown[0] - unknown[1]])

    found = optx.root_find(gap, newton(1e-12), jnp.array([2.0, 1.0]), jnp.asarray(8.0)).value
    np.testing.assert_allclose(found, [2.0, 2.0], rtol=1e-12)


def test_as_many_batches_as_there_are_threads_are_solved_at_once():
    script = """
import jax
jax.config.update("jax_enable_x64", True)
import numpy as np
from isojax._small_systems import solve
matrices = np.random.default_rng(0).normal(size=(8192, 3, 3))
batch = jax.vmap(lambda one: solve(one, one[:, 0]))
several = jax.jit(lambda all_of: sum(batch(all_of * (1.0 + share)) for share in range(6)))
for _ in range(30):
    several(matrices).block_until_ready()
"""
    # With jnp.linalg.solve this never ends on a machine of two cores and JAX 0.10.
    subprocess.run([sys.executable, "-c", script], check=True, timeout=120)
