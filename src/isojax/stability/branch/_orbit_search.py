"""Orbits of one or several drive periods from many starts, each found once."""

import math
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float, Int

from ..._quick_jit import quick_jit
from ...models import Integrator
from ..orbit import period_map, value_and_jacobian
from ._orbit_starts import OrbitStarts
from ._parameter_family import ParameterFamily

_LANES = 352
"""Starts that are improved at once: one compiled batch serves any number."""

_STEPS_TO_CLOSE = 10
"""Steps of Newton's method from each start."""

_LARGEST_STEP = 0.3
"""Of Newton's method, over the size of the motion: a longer one may leave the basin of the orbit nearby."""

_CLOSED_TO = 1e-6
"""Gap of a closed orbit, over its size: at a kink Newton's method may stall below."""

_SAME_TO = 1e-3
"""Distance, over the size, below which two orbits at one value of the parameter are one."""


class FoundOrbits(NamedTuple):
    """Orbits of one count of drive periods, orbit first.

    Attributes:
        shares: of the parameter's range.
        images: the state at t = 0, and those that are orbits under the same drive with it: one drive period
            later and so on; of an odd model half a period later and so on, every second with its sign turned.
        sizes: of each state along the motion.
    """

    shares: Float[np.ndarray, " orbit"]
    images: Float[np.ndarray, "orbit image state"]
    sizes: Float[np.ndarray, "orbit state"]

    def where(self, which: np.ndarray) -> "FoundOrbits":
        """Give some of the orbits."""
        return FoundOrbits(*(values[which] for values in self))


@quick_jit
def _improved(
    family: ParameterFamily,
    integrator: Integrator,
    odd: bool,
    periods: Int[Array, ""],
    steps: Int[Array, ""],
    starts: tuple[Float[Array, " start"], Float[Array, "start state"], Float[Array, " start"]],
) -> tuple[Array, Array, Array]:
    """Give states after steps of Newton's method, their gaps after the periods, and their next images."""

    def lane(share: Array, state: Array, size: Array) -> tuple[Array, Array, Array]:
        setting = family.at(share[None])
        drive = setting.drive
        speed = size * 2.0 * math.pi * drive.frequency / periods
        inner = jnp.maximum(jnp.abs(state[2:]), _SAME_TO * size)
        scale = jnp.concatenate([jnp.stack([size, speed]), inner])

        def turn(here: Array, part: float) -> Array:
            return jnp.stack(period_map(setting.model, integrator, drive, tuple(here), turns=part))

        # How many periods is a number on the device, so that one compiled map serves for all.
        def moved(here: Array) -> Array:
            return jax.lax.fori_loop(0, periods, lambda _, at: turn(at, 1.0), here)

        def improve(_: Array | int, here: Array) -> Array:
            gap, slope = value_and_jacobian(lambda own: moved(own * scale) / scale - own, here / scale)
            step = jnp.linalg.solve(slope, gap)
            return here - scale * step * jnp.minimum(1.0, _LARGEST_STEP / jnp.max(jnp.abs(step)))

        found = jax.lax.fori_loop(0, steps, improve, state)
        gap = jnp.max(jnp.abs(moved(found) - found) / scale)
        # Where friction holds the mass it may rest anywhere: those are no orbits.
        gap = jnp.where(family.is_held(found[1], share[None], speed), jnp.inf, gap)
        return found, gap, turn(found, 0.5 if odd else 1.0)

    return jax.vmap(lane)(*starts)


class OrbitSearch(NamedTuple):
    """How orbits of a family are sought.

    Attributes:
        family: isolators and drives along one parameter.
        integrator: steps a drive period.
        odd: whether the model is odd.
        periods: drive periods after which the orbits repeat.
    """

    family: ParameterFamily
    integrator: Integrator
    odd: bool
    periods: int

    def closed(self, starts: OrbitStarts) -> OrbitStarts:
        """Close motions by Newton's method on the map over the periods.

        Args:
            starts: where the search begins.

        Returns:
            Those that closed, each once at each value of the parameter.
        """
        states, gap, _ = self._improved(starts, _STEPS_TO_CLOSE)
        good = np.flatnonzero((gap < _CLOSED_TO) & np.all(np.isfinite(states), axis=1))
        kept: list[int] = []
        for share in np.unique(starts.shares[good]):
            own = good[starts.shares[good] == share]
            size = np.maximum(np.abs(states[own]).max(axis=0), np.finfo(float).tiny)
            while own.size:
                kept.append(int(own[0]))
                apart = np.max(np.abs(states[own] - states[own[0]]) / size, axis=1)
                own = own[apart > _SAME_TO]
        return OrbitStarts(starts.shares[kept], states[kept], starts.sizes[kept])

    def orbits(self, closed: OrbitStarts) -> FoundOrbits:
        """Give closed motions with their images, without those that repeat earlier.

        Args:
            closed: the motions.

        Returns:
            The orbits.
        """
        each = 2 if self.odd else 1
        images, here = [closed.states], closed
        for _ in range(each * self.periods - 1):
            here = here._replace(states=self._improved(here, 0)[2])
            images.append(here.states)
        along = np.stack(images, axis=1)
        setting = jax.vmap(lambda share: jnp.asarray(self.family.at(share[None]).frequency))
        omega = 2.0 * np.pi * np.asarray(setting(jnp.asarray(closed.shares))) / self.periods
        motion = np.hypot(along[..., 0], along[..., 1] / omega[:, None]).max(axis=1)
        inner = np.abs(along[..., 2:]).max(axis=1)
        sizes = np.concatenate([np.stack([motion, motion * omega], axis=1), inner], axis=1)
        sizes = np.where(sizes > 0.0, sizes, 1.0)
        repeats = np.zeros(closed.shares.size, bool)
        for earlier in range(1, self.periods):
            if self.periods % earlier == 0:
                apart = np.abs(along[:, each * earlier] - along[:, 0]) / sizes
                repeats |= apart.max(axis=1) <= _SAME_TO
        return FoundOrbits(closed.shares, along, sizes).where(~repeats)

    def _improved(self, starts: OrbitStarts, steps: int) -> tuple[np.ndarray, ...]:
        parts = []
        for begin in range(0, max(starts.shares.size, 1), _LANES):
            rows = [values[begin : begin + _LANES] for values in starts]
            count = rows[0].shape[0]
            shares, states, sizes = (jnp.asarray(np.resize(row, (_LANES, *row.shape[1:]))) for row in rows)
            counts = jnp.asarray(self.periods), jnp.asarray(steps)
            out = _improved(self.family, self.integrator, self.odd, *counts, (shares, states, sizes))
            parts.append([np.asarray(values)[:count] for values in out])
        return tuple(np.concatenate(own) for own in zip(*parts, strict=True))
