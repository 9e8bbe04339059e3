"""The equations of a bifurcation: a motion, split at its kinks, closes and a multiplier is critical."""

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from ..._small_systems import solve
from ..orbit import ShootingMethod, Split, multipliers, split_image, split_jacobian
from ._criticality import BifurcationKind, critical_direction, criticality, cubic_coefficient, pair_cosine
from ._parameter_family import ParameterFamily

_FOLLOWING = 3
"""Steps of Newton's method to the kinks of a motion that is shifted."""

PointValues = tuple[
    Float[Array, " parameter"], Float[Array, " state"], Float[Array, "state state"], Float[Array, " state"]
]
"""Parameters, state, derivative of the map and critical direction of a solution."""


class BifurcationSystem(eqx.Module):
    """The equations of a bifurcation next to a guess, the motion split at its kinks.

    Attributes:
        method: how the orbit is closed.
        kind: which bifurcation.
        split: where the motion is split.
        across: in two parameters, normal of the plane across the curve over scaled state and shares; empty
            in one.
        origin: point of this plane.
        cosine: in two parameters, in place of the plane, that of the critical pair's angle; None for the
            plane.
        degenerate: in two parameters, in place of the plane, whether the cubic coefficient vanishes.
    """

    method: ShootingMethod
    kind: BifurcationKind = eqx.field(static=True)
    split: Split
    across: Float[Array, " unknown"]
    origin: Float[Array, " unknown"]
    cosine: Float[Array, ""] | None = None
    degenerate: bool = eqx.field(static=True, default=False)

    @property
    def states(self) -> int:
        """Count of states."""
        return self.split.scale.shape[0]

    @property
    def whole(self) -> int:
        """Count of states and crossings."""
        return self.states + self.split.crossings.phases.shape[0]

    def at_special_point(self, cosine: float | None) -> "BifurcationSystem":
        """Give the equations of a special point: in place of the plane the angle of the critical pair, or
        that the cubic coefficient of a doubling vanishes.

        Across the curve is enough at a cusp: along the critical direction its parameters do not move.
        """
        nothing = jnp.zeros(0)
        if cosine is not None:
            return BifurcationSystem(
                self.method, self.kind, self.split, nothing, nothing, jnp.asarray(cosine)
            )
        if self.kind == "period_doubling":
            return BifurcationSystem(
                self.method, self.kind, self.split, nothing, nothing, None, degenerate=True
            )
        return self

    def image(self, at: ParameterFamily, unknown: Array) -> Float[Array, " component"]:
        """Give the state after the turns, and how far each kink is missed, of place and shares."""
        setting, place = at.at(unknown[self.whole :]), unknown[: self.whole]
        return jnp.concatenate(split_image(setting.model, self.method, setting.drive, self.split, place))

    def matrix(self, at: ParameterFamily, unknown: Array) -> Float[Array, "state state"]:
        """Give the derivative of the map, in scaled units."""
        setting, place = at.at(unknown[self.whole :]), unknown[: self.whole]
        return split_jacobian(setting.model, self.method, setting.drive, self.split, place)[0]

    def tests(self, matrix: Array) -> Float[Array, " equation"]:
        """Give what vanishes of the derivative of the map."""
        tests = [criticality(self.kind, matrix)]
        if self.cosine is not None:
            tests.append(pair_cosine(matrix) - self.cosine)
        return jnp.stack(tests)

    def plane(self, unknown: Array) -> Float[Array, " equation"]:
        """Give the distance from the plane across the curve, where there is one."""
        if self.cosine is not None or not self.across.size:
            return jnp.zeros(0)
        here = jnp.concatenate([unknown[: self.states], unknown[self.whole :]])
        return jnp.dot(self.across, here - self.origin)[None]

    def residual(self, unknown: Array, at: ParameterFamily) -> Float[Array, " equation"]:
        """Give what vanishes at the bifurcation."""
        moved = self.image(at, unknown)
        gap = moved.at[: self.states].add(-unknown[: self.states])
        matrix = self.matrix(at, unknown)
        cubic = self.cubic(at, unknown, matrix)[None] if self.degenerate else jnp.zeros(0)
        return jnp.concatenate([gap, self.tests(matrix), self.plane(unknown), cubic])

    def cubic(self, at: ParameterFamily, unknown: Array, matrix: Array) -> Float[Array, ""]:
        """Give the cubic coefficient of a doubling."""
        states, whole = self.states, self.whole

        def matrix_beside(shift: Array) -> Array:
            def missed(phases: Array) -> Array:
                return self.image(at, there.at[states:whole].set(phases))[states:]

            there = unknown.at[:states].add(shift)
            # The kinks are where the shifted motion passes them.
            for _ in range(_FOLLOWING if whole > states else 0):
                phases = there[states:whole]
                phases = phases - solve(jax.jacfwd(missed)(phases), missed(phases))
                there = there.at[states:whole].set(phases)
            return self.matrix(at, there)

        return cubic_coefficient(matrix, matrix_beside)

    def values(self, final: Array, at: ParameterFamily) -> PointValues:
        """Give what is wanted of the solution."""
        return self.read(final, self.matrix(at, final))

    def read(self, final: Array, matrix: Array) -> PointValues:
        """Give what is wanted of the solution, from the derivative of the map in scaled units."""
        scale = self.split.scale
        direction = critical_direction(self.kind, matrix, multipliers(matrix))
        return final[self.whole :], final[: self.states] * scale, _unscaled(matrix, scale), direction


def _unscaled(matrix: Array, scale: Array) -> Array:
    return scale[:, None] * matrix / scale[None]
