"""Numbers that a caller gave: what they are, or one message that says which one is none."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from isojax._given_numbers import (
    asked_numbers,
    given_chance,
    given_count,
    given_number,
    given_numbers,
    given_scalar,
)


def positive(value):
    return value > 0.0


@pytest.mark.parametrize(
    ("ask", "words"),
    [
        (lambda: given_count("draws", np.nan, 100), "`draws` must be a whole number, but is nan"),
        (lambda: given_count("draws", 250.5, 100), "`draws` must be a whole number, but is 250.5"),
        (lambda: given_count("draws", "many"), "`draws` must be a whole number, but is 'many'"),
        (lambda: given_count("draws", True), "`draws` must be a whole number, but is True"),
        (lambda: given_count("draws", [200]), r"`draws` must be a whole number, but is \[200\]"),
        (lambda: given_count("draws", 99, 100), "`draws` must be at least 100, but is 99"),
        (lambda: given_count("draws", 0), "`draws` must be a positive count, but is 0"),
        (lambda: given_chance("confidence", None), "`confidence` must lie between 0 and 1, but is None"),
        (lambda: given_chance("chance", 0.4, 0.5), "`chance` must lie between 0.5 and 1, but is 0.4"),
        (lambda: given_number("reach", "far"), "`reach` must be a finite number, but is 'far'"),
        (lambda: given_numbers("levels", [], "be", positive), r"`levels` must be, but is \[\]"),
        (lambda: given_numbers("levels", [[1], [2, 3]], "be", positive), r"but is \[\[1\], \[2, 3\]\]"),
        (lambda: given_scalar("pressure", {}), r"`pressure` must be one real number, but is \{\}"),
        (lambda: asked_numbers("quantity", "k1"), "`quantity` must be a function of an isolator, .* 'k1'"),
        (lambda: asked_numbers("quantity", lambda: {"k": 1}), "number or an array, .* of type dict"),
        (lambda: asked_numbers("quantity", lambda: 1j), "must give real numbers, but gave complex"),
        (
            lambda: jax.jit(lambda x: asked_numbers("quantity", float, x))(1.0),
            "differentiable by `jax.jacfwd`",
        ),
    ],
)
def test_one_message_names_the_argument_what_was_found_and_what_was_expected(ask, words, unchecked):
    with pytest.raises(ValueError, match=words):
        ask()


def test_what_is_such_a_number_is_taken():
    assert given_count("draws", 1e4) == given_count("draws", np.int64(10_000)) == 10_000
    assert given_numbers("levels", 60.0, "be positive", positive).tolist() == 60.0
    assert np.isnan(given_scalar("amplitude", np.nan))
    assert jax.jit(lambda value: given_scalar("amplitude", value))(3).dtype == jnp.float64
    assert float(asked_numbers("quantity", lambda: True)) == 1.0
