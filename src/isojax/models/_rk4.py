"""The classical Runge-Kutta step, unrolled: the one integrator of maps, fits and single simulations."""

from collections.abc import Callable
from typing import Any, ClassVar

import diffrax
import jax.tree_util as jtu

_INSIDE_STEP = 1e-9
"""How far inside the step its first and last stage lie, as a share of it: far more than a sample count
rounds off."""


def _add(y: Any, scale: float, k: Any) -> Any:
    return jtu.tree_map(lambda a, b: a + scale * b, y, k)


class RK4(diffrax.AbstractSolver):
    """Classical fourth-order Runge-Kutta with fixed steps.

    Written out stage by stage, because a general stage loop costs five to eight times as much on a CPU. It
    is a diffrax solver, so `diffrax.diffeqsolve` takes it, and `models._scan` calls the same `step`.

    The first and the last stage look a billionth of a step inside, so that a drive that jumps between two
    steps (a zero-order hold) acts with the value that it has within each. Of a smooth drive that moves
    nothing above rounding.

    Source: Kutta 1901, Z. Math. Phys. 46:435.
    """

    term_structure: ClassVar = diffrax.AbstractTerm
    interpolation_cls: ClassVar[Callable[..., Any]] = diffrax.LocalLinearInterpolation

    def order(self, terms: diffrax.AbstractTerm) -> int:
        """Give the order of convergence."""
        return 4

    def init(self, terms: diffrax.AbstractTerm, t0: Any, t1: Any, y0: Any, args: Any) -> None:
        """Start the solver; it keeps no state."""
        return None

    def step(
        self,
        terms: diffrax.AbstractTerm,
        t0: Any,
        t1: Any,
        y0: Any,
        args: Any,
        solver_state: None,
        made_jump: Any,
    ) -> tuple[Any, None, dict[str, Any], None, diffrax.RESULTS]:
        """Advance one step; see `diffrax.AbstractSolver.step`."""
        control = terms.contr(t0, t1)
        length = t1 - t0
        start, middle, end = t0 + _INSIDE_STEP * length, t0 + 0.5 * length, t1 - _INSIDE_STEP * length
        k1 = terms.vf_prod(start, y0, args, control)
        k2 = terms.vf_prod(middle, _add(y0, 0.5, k1), args, control)
        k3 = terms.vf_prod(middle, _add(y0, 0.5, k2), args, control)
        k4 = terms.vf_prod(end, _add(y0, 1.0, k3), args, control)
        y1 = jtu.tree_map(lambda y, a, b, c, d: y + (a + 2.0 * (b + c) + d) / 6.0, y0, k1, k2, k3, k4)
        return y1, None, {"y0": y0, "y1": y1}, None, diffrax.RESULTS.successful

    def func(self, terms: diffrax.AbstractTerm, t0: Any, y0: Any, args: Any) -> Any:
        """Give the vector field; see `diffrax.AbstractSolver.func`."""
        return terms.vf(t0, y0, args)
