"""The worked example of CONTRIBUTING.md is a working element."""

import re
from pathlib import Path

import jax.numpy as jnp
import numpy as np
from scipy.integrate import quad

from isojax.elements import Scales

PAGE = (Path(__file__).parents[2] / "CONTRIBUTING.md").read_text(encoding="utf-8")


def test_the_example_has_the_equivalent_stiffness_that_it_states():
    code, line = re.findall(r"```python\n(.*?)```", PAGE, re.DOTALL)
    scope = {"__name__": "isojax.elements._quintic_stiffness", "__package__": "isojax.elements"}
    exec(compile(code, "CONTRIBUTING.md", "exec", dont_inherit=True), scope)
    kind = scope["QuinticStiffness"]
    assert line.strip() == "from ._quintic_stiffness import QuinticStiffness as QuinticStiffness"
    size, stiffness = 3e-3, 2e16
    element = kind(stiffness)

    def integrand(phi):
        zero = jnp.asarray(0.0)
        return float(element.force(jnp.asarray(size * np.sin(phi)), zero, ())) * np.sin(phi) / np.pi

    found = quad(integrand, 0.0, 2.0 * np.pi)[0] / size
    np.testing.assert_allclose(found, 5.0 / 8.0 * stiffness * size**4, rtol=1e-10)
    scales = Scales(800.0, 150.0, size, 0.08, 2.2, 27.0, 1e-3, 0.02, 2.2)
    assert float(kind.guess(scales).coefficient) == 0.0
    np.testing.assert_allclose(kind.typical_strength(scales) * size**5, 150.0)
