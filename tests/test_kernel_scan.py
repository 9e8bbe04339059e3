"""A loop in one kernel computes what `jax.lax.scan` does."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from isojax._kernel_scan import kernel_scan


def body(carry, row):
    place, speed = carry
    force = jnp.where(jnp.any(speed > 0.1), -jnp.sign(speed), row) - jnp.sin(place)
    moved = jax.lax.fori_loop(0, 3, lambda _, at: at + 0.01 * speed, place)
    return (moved, speed + 0.03 * force), place * speed


@pytest.fixture
def tables():
    return jnp.asarray(np.random.default_rng(3).standard_normal((400, 5)))


def test_the_loop_is_one_kernel_and_gives_the_same(tables):
    begun = jnp.linspace(0.0, 1.0, 5), jnp.zeros(5)
    alone = jax.jit(lambda carry, tables: kernel_scan(body, carry, tables)).lower(begun, tables).compile()
    if jax.default_backend() == "cpu":
        text = alone.as_text()
        marked = [line for line in text.splitlines() if " call(" in line and 'small_call="true"' in line]
        assert len(marked) == 1
        entry = text[text.index("ENTRY") :]
        assert "while(" not in entry
    expected = jax.jit(lambda carry, tables: jax.lax.scan(body, carry, tables))(begun, tables)
    jax.tree.map(
        lambda one, other: np.testing.assert_allclose(one, other, rtol=1e-12, atol=1e-14),
        alone(begun, tables),
        expected,
    )


def test_derivatives_pass_through_it(tables):
    def end(scan):
        return lambda start: scan(body, (start, jnp.zeros(5)), tables)[0][0].sum()

    start = jnp.linspace(0.0, 1.0, 5)
    unit = jnp.ones(5)
    _, own = jax.jit(lambda at: jax.jvp(end(kernel_scan), (at,), (unit,)))(start)
    _, usual = jax.jit(lambda at: jax.jvp(end(jax.lax.scan), (at,), (unit,)))(start)
    np.testing.assert_allclose(own, usual, rtol=1e-10)


def test_what_the_loop_takes_but_does_not_read_ends_no_process(tables):
    # XLA aborts where simplifying leaves an operand of the kernel unread, or where it is known.
    def run(tables):
        idle, known = tables[5] * 0.0, jnp.zeros(5)

        def unread(carry, row):
            return body(carry, jnp.where(idle > 1.0, row, row) + known)

        return kernel_scan(unread, (tables[0], known), tables)[1]

    expected = jax.jit(lambda tables: jax.lax.scan(body, (tables[0], jnp.zeros(5)), tables)[1])(tables)
    np.testing.assert_allclose(jax.jit(run)(tables), expected, rtol=1e-12, atol=1e-14)
