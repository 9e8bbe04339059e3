"""Orbits of one or several drive periods from many starts, each found once."""

import math
from collections.abc import Callable, Sequence
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float, Int

from ..._quick_jit import quick_jit
from ..._small_systems import solve
from ...models import Integrator
from ..orbit import fastest_rate, integrator_with, period_map, value_and_jacobian
from ._orbit_starts import OrbitStarts
from ._parameter_family import ParameterFamily

_FEW, _LANES = 32, 352
"""Starts that are improved at once, where they are few and where they are many: a compiled batch serves any
number."""

_STEPS_TO_CLOSE = 10
"""Steps of Newton's method from each start."""

_LARGEST_STEP = 0.3
"""Of Newton's method, over the size of the motion: a longer one may leave the basin of the orbit nearby."""

_CLOSED_TO = 1e-6
"""Gap of a closed orbit, over its size: at a kink Newton's method may stall below."""

_SAME_TO = 1e-3
"""Distance, over the size, below which two orbits at one value of the parameter are one."""

_HELD = -1.0
"""Instead of the gap where friction holds the mass."""

_MAYBE_UNSTABLE = 2.0
"""Product of step and rate from which steps may be unstable: those of Runge and Kutta are from 2.7."""

_MOST_STEPS = 1 << 12
"""Steps a drive period with which an orbit is sought: where a start asks for more, it does not settle."""


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
            step = solve(slope, gap)
            return here - scale * step * jnp.minimum(1.0, _LARGEST_STEP / jnp.max(jnp.abs(step)))

        found = jax.lax.fori_loop(0, steps, improve, state)
        gap = jnp.max(jnp.abs(moved(found) - found) / scale)
        # Where friction holds the mass it may rest anywhere: those are no orbits.
        gap = jnp.where(family.is_held(found[1], share[None], speed), _HELD, gap)
        return found, gap, turn(found, 0.5 if odd else 1.0)

    return jax.vmap(lane)(*starts)


@quick_jit
def _pace(
    family: ParameterFamily, shares: Float[Array, " start"], sizes: Float[Array, " start"]
) -> tuple[Float[Array, " start"], Float[Array, "start state"]]:
    """Give the rate of the fastest state along a motion, per drive period, and the size of each state."""

    def one(share: Array, size: Array) -> tuple[Array, Array]:
        setting = family.at(share[None])
        frequency = jnp.asarray(setting.frequency)
        rate, scale = fastest_rate(setting.model, size, frequency)
        return rate / frequency, scale

    return jax.vmap(one)(shares, sizes)


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

    def settled(self, starts: OrbitStarts) -> tuple[Sequence[tuple["OrbitSearch", OrbitStarts]], int]:
        """Close motions, those that do not close once more with steps that follow their fastest states.

        Args:
            starts: where the search begins.

        Returns:
            Each search with what it closed, and how many starts did not settle.
        """
        found, open_ended = self._closed(starts)
        done = [(self, found)]
        if not open_ended.shares.size:
            return done, 0
        model, rates = self.family.model, self._pace(open_ended)[0]
        unstable = rates > _MAYBE_UNSTABLE * self.integrator.steps_a_period(model)
        follows = [integrator_with(model, self.integrator, rate, _MOST_STEPS) for rate in rates[:, None]]
        again = unstable & np.array([not stiff for _, stiff in follows], bool)
        if not again.any():
            return done, again.size
        finer = self._replace(integrator=integrator_with(model, self.integrator, rates[again])[0])
        found, still = finer._closed(open_ended.where(again))
        return [*done, (finer, found)], int((~again).sum()) + still.shares.size

    def _closed(self, starts: OrbitStarts) -> tuple[OrbitStarts, OrbitStarts]:
        """Give the motions that close, each once at each value of the parameter, and the starts of others."""
        states, gap, _ = self._improved(starts, _STEPS_TO_CLOSE)
        settled = (gap < _CLOSED_TO) & np.all(np.isfinite(states), axis=1)
        closed = OrbitStarts(starts.shares, states, starts.sizes).where(settled & (gap >= 0.0))
        return distinct(self.family, closed), starts.where(~settled)

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
        omega = 2.0 * np.pi * _frequencies(self.family, closed.shares) / self.periods
        motion = np.hypot(along[..., 0], along[..., 1] / omega[:, None]).max(axis=1)
        inner = np.abs(along[..., 2:]).max(axis=1)
        if inner.size:
            # All images of an internal state may lie near its zeros.
            inner = np.maximum(inner, self._pace(closed)[1][:, 2:])
        sizes = np.concatenate([np.stack([motion, motion * omega], axis=1), inner], axis=1)
        sizes = np.where(sizes > 0.0, sizes, 1.0)
        repeats = np.zeros(closed.shares.size, bool)
        for earlier in range(1, self.periods):
            if self.periods % earlier == 0:
                apart = np.abs(along[:, each * earlier] - along[:, 0]) / sizes
                repeats |= apart.max(axis=1) <= _SAME_TO
        return FoundOrbits(closed.shares, along, sizes).where(~repeats)

    def _improved(self, starts: OrbitStarts, steps: int) -> tuple[np.ndarray, ...]:
        counts = jnp.asarray(self.periods), jnp.asarray(steps)

        def improved(*rows: Array) -> tuple[Array, ...]:
            return _improved(self.family, self.integrator, self.odd, *counts, rows)

        return _in_batches(improved, starts)

    def _pace(self, starts: OrbitStarts) -> tuple[np.ndarray, ...]:
        return _in_batches(lambda shares, _, sizes: _pace(self.family, shares, sizes), starts)


def _in_batches(
    function: Callable[[Array, Array, Array], tuple[Array, ...]], starts: OrbitStarts
) -> tuple[np.ndarray, ...]:
    """Give values of some starts, computed by batches of one size."""
    parts = []
    lanes = _FEW if starts.shares.size <= _FEW else _LANES
    for begin in range(0, max(starts.shares.size, 1), lanes):
        rows = [values[begin : begin + lanes] for values in starts]
        count = rows[0].shape[0]
        out = function(*(jnp.asarray(np.resize(row, (lanes, *row.shape[1:]))) for row in rows))
        parts.append([np.asarray(values)[:count] for values in out])
    return tuple(np.concatenate(own) for own in zip(*parts, strict=True))


def distinct(family: ParameterFamily, closed: OrbitStarts) -> OrbitStarts:
    """Give each of some closed motions once at each value of the parameter, with its own size.

    Args:
        family: isolators and drives along one parameter.
        closed: the motions.

    Returns:
        The motions.
    """
    omega = 2.0 * np.pi * _frequencies(family, closed.shares)
    own = np.hypot(closed.states[:, 0], closed.states[:, 1] / omega)
    own = np.maximum(own, _SAME_TO * closed.sizes)
    kept: list[int] = []
    for share in np.unique(closed.shares):
        left = np.flatnonzero(closed.shares == share)
        largest = np.max(np.abs(closed.states[left, 2:]), axis=0, initial=np.finfo(float).tiny)
        inner = largest / own[left].max()
        while left.size:
            first, kept = left[0], [*kept, int(left[0])]
            # Over the larger of the two, so that a small motion is not taken for one beside a large one.
            size = np.maximum(own[left], own[first])[:, None]
            scale = np.concatenate([size, size * omega[first], size * inner], axis=1)
            apart = np.max(np.abs(closed.states[left] - closed.states[first]) / scale, axis=1)
            left = left[apart > _SAME_TO]
    return closed._replace(sizes=own).where(np.array(kept, int))


def _frequencies(family: ParameterFamily, shares: Float[np.ndarray, " start"]) -> Float[np.ndarray, " start"]:
    start, stop = (float(end[0]) for end in (family.start, family.stop))
    is_frequency = bool(np.asarray(family.of_drive)[0, 1])
    return start + shares * (stop - start) if is_frequency else np.full(shares.shape, float(family.frequency))
