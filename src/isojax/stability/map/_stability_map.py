"""What a map of stability holds, and how it shows itself."""

import dataclasses
from collections.abc import Mapping

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool, Complex, Float, Int

from ..._results import RESULTS, cell_results
from ..._show import number, shown
from ...models import Integrator, Isolator
from ..orbit import Sine
from ._chance import chance_words
from ._map_method import Lane, MapMethod
from ._states_at_zero import states_at_zero

_OF_EACH_ORBIT = ("spectral_radius", "multipliers", "start", "direction", "phases", "split", "response")
"""Fields with an axis `orbit` where coexisting orbits are sought."""

_ROWS, _COLUMNS = 12, 60
"""Size of the map in characters."""


@shown
class StabilityMap(eqx.Module):
    """Periodic orbits and their multipliers over drive amplitude and frequency.

    With `coexisting` every array of a cell has an axis `orbit` in front, by rising displacement; places that
    a cell does not fill are NaN.

    Attributes:
        model: the isolator.
        amplitudes: drive amplitudes [N, or m/s^2 for base excitation].
        frequencies: [Hz].
        spectral_radius: largest modulus of the multipliers; stable below one.
        multipliers: Floquet multipliers over one drive period.
        start: state of each orbit at the phase at which it is largest.
        direction: drive over its amplitude, sine and cosine part, with the phase counted from there.
        phases: where each orbit passes kinks, counted from there.
        sides: signs of the kinks on the pieces between, alike for all orbits that are split.
        split: whether an orbit was split there; else it was integrated with four times the steps.
        response: half the peak-to-peak displacement [m].
        count: orbits found in each cell.
        result: how the search ended in each cell, in words: `smap.result[i, j]`, of all orbits
            `smap.result[k, i, j]`; beside NaN, why.
        error: of a multiplier at most, from a sample of cells against steps three times finer; of `response`
            and the states it says nothing.
        unconfirmed: orbits of this sample that finer steps did not find. They are left out, as not accurate;
            of others like them, in cells outside the sample, `error` says nothing.
        symmetric: whether the half-period map of an odd model was used, so that only symmetric orbits show.
        integrator: steps a period that were taken.
        probability_stable: chance that the cell holds no unstable orbit, coexisting ones included, where a
            fit was given; NaN where the maps that it rests on do not reach.
        probability_coexisting: chance that the cell holds several orbits, where a fit was given.
        standard_errors: of `response` and `spectral_radius` of each orbit, where a fit was given; NaN where
            orbits may appear or vanish.
        chance_error: mean error over the map of a chance of one half, where chances are least exact; by a map
            of one draw of all coefficients, where a fit was given. Where it is large, map drawn models and
            count.
        other_rests: where else the mass rests without a drive, within a hundred times the largest motion [m].
            The orbits are those about the rest next to zero, others only where no such orbit was found.
    """

    model: Isolator
    amplitudes: Float[Array, " amplitude"]
    frequencies: Float[Array, " frequency"]
    spectral_radius: Float[Array, "*orbit amplitude frequency"]
    multipliers: Complex[Array, "*orbit amplitude frequency multiplier"]
    start: Float[Array, "*orbit amplitude frequency state"]
    direction: Float[Array, "*orbit amplitude frequency 2"]
    phases: Float[Array, "*orbit amplitude frequency crossing"]
    sides: Float[Array, "piece kink"]
    split: Bool[Array, "*orbit amplitude frequency"]
    response: Float[Array, "*orbit amplitude frequency"]
    count: Int[Array, "amplitude frequency"]
    result: RESULTS = eqx.field(converter=cell_results)
    error: float
    unconfirmed: int
    symmetric: bool = eqx.field(static=True)
    integrator: Integrator
    probability_stable: Float[Array, "amplitude frequency"] | None = None
    probability_coexisting: Float[Array, "amplitude frequency"] | None = None
    standard_errors: Mapping[str, Float[Array, "*orbit amplitude frequency"]] | None = None
    chance_error: float | None = None
    other_rests: Float[np.ndarray, " rest"] = eqx.field(default_factory=lambda: np.zeros(0))

    @property
    def stable(self) -> Array:
        """Whether each orbit is stable; False where there is none."""
        return self.spectral_radius < 1.0

    @property
    def incomplete(self) -> Bool[np.ndarray, "amplitude frequency"]:
        """Whether a cell of a map of all orbits lacks one: folds come in pairs, so their count is odd."""
        count = np.asarray(self.count)
        return self._all_sought & (count > 0) & (count % 2 == 0)

    @property
    def y0(self) -> Float[Array, "*orbit amplitude frequency state"]:
        """State of each orbit at t = 0 of the recorded drive, by integration from `start`."""
        return self.states_at_zero(np.arange(self.spectral_radius.size)).reshape(self.start.shape)

    def smallest(self) -> "StabilityMap":
        """Give a map of all orbits as that of the smallest motion in each cell."""
        first = {name: getattr(self, name)[0] for name in _OF_EACH_ORBIT}
        found = jnp.isfinite(first["spectral_radius"]).astype(int)
        return dataclasses.replace(
            self, count=found, result=jax.tree.map(lambda own: own[0], self.result), **first
        )

    def states_at_zero(self, cells: Int[np.ndarray, " cell"]) -> Float[Array, "cell state"]:
        """Give the states of some orbits at t = 0 of the recorded drive.

        Args:
            cells: places in the flattened map.

        Returns:
            The states, in the order of the places.
        """
        shape = self.spectral_radius.shape
        force = jnp.broadcast_to(self.amplitudes[:, None], shape).ravel()[cells]
        frequency = jnp.broadcast_to(self.frequencies, shape).ravel()[cells]
        state = tuple(self.start.reshape(self.spectral_radius.size, -1)[cells].T)
        sine, cosine = self.direction.reshape(self.spectral_radius.size, 2)[cells].T * force[None]
        lane = Lane(state, Sine(sine, cosine, frequency), (), self.response.ravel()[cells])
        steps = jnp.asarray(self.integrator.steps_a_period(self.model))
        method = MapMethod(self.integrator, self.symmetric, None, steps)
        return jnp.stack(states_at_zero(self.model, method, lane), axis=-1)

    def _headline(self) -> str:
        count, radius = np.asarray(self.count), np.asarray(self.spectral_radius)
        found = radius[np.isfinite(radius)]
        cells = {"with an unstable orbit": self._unstable}
        if self._all_sought:
            cells["with coexisting orbits"] = count > 1
            if self.incomplete.any():
                cells["with an even count of them, where one is missing"] = self.incomplete
        if self.held.any():
            cells["in which dry friction holds the mass"] = self.held
        cells["without any"] = (count == 0) & ~self.held
        counted = ", ".join(f"{int(np.sum(which))} {words}" for words, which in cells.items())
        largest = number(found.max()) if found.size else "unknown"
        grid = " × ".join(map(str, count.shape))
        return f"{grid} cells of amplitude and frequency, {counted}; largest |mu| {largest}"

    @property
    def held(self) -> Bool[np.ndarray, "amplitude frequency"]:
        """Whether dry friction holds the mass over the whole period: the cell is still, and has no orbit."""
        codes, sticks = (np.asarray(jax.tree.leaves(one)[0]) for one in (self.result, RESULTS.sticks))
        return np.any((codes == sticks).reshape(-1, *codes.shape[-2:]), axis=0)

    @property
    def _all_sought(self) -> bool:
        return np.ndim(self.spectral_radius) > np.ndim(self.count)

    @property
    def _unstable(self) -> np.ndarray:
        radius = np.asarray(self.spectral_radius)
        return np.any((radius >= 1.0).reshape(-1, *radius.shape[-2:]), axis=0)

    def _rows(self) -> list[str]:
        return ["model", "amplitudes", "frequencies", "response", "symmetric", "error", "result"]

    def _lines(self) -> list[str]:
        count, unstable = np.asarray(self.count), self._unstable
        marks = np.where(count == 0, "?", np.where(count > 1, "2", "."))
        marks = np.where((count > 1) & (count < 10), count.astype(str), marks)
        marks = np.where((count == 1) & unstable, "x", marks)
        marks = np.where(self.held, "h", marks)
        forces, band = np.asarray(self.amplitudes), np.asarray(self.frequencies)
        rows = np.unique(np.linspace(0, forces.size - 1, min(_ROWS, forces.size)).round().astype(int))
        columns = np.unique(np.linspace(0, band.size - 1, min(_COLUMNS, band.size)).round().astype(int))
        drawn = [f"  {forces[row]:>10.4g} |{''.join(marks[row, columns])}" for row in rows[::-1]]
        chances = chance_words(self)
        legend = (
            "  . one stable orbit, x one unstable orbit, 2 to 9 coexisting orbits, ? none found"
            if self._all_sought
            else "  the orbit of smallest motion in each cell: . stable, x unstable, ? none found"
        )
        legend += ", h held by friction" if self.held.any() else ""
        return [
            *drawn,
            f"  {'F0':>10} +{'-' * columns.size}",
            f"  {'f [Hz]':>10}  {band[0]:.4g} to {band[-1]:.4g}",
            legend,
            *([f"  with all orbits of a cell, {chances}"] if chances else []),
            *([f"  {unconfirmed_words(self)}"] if self.unconfirmed else []),
            *([f"  {incomplete_words(self)}"] if self.incomplete.any() else []),
            *([f"  {elsewhere_words(self)}"] if self.other_rests.size else []),
        ]


def unconfirmed_words(smap: StabilityMap) -> str:
    """Say how many orbits of the sample for the error finer steps did not find."""
    return (
        f"finer steps did not find {smap.unconfirmed} of the sampled orbits, which are left out; "
        "the error says nothing of others like them"
    )


def incomplete_words(smap: StabilityMap) -> str:
    """Say how many cells lack an orbit for sure."""
    return (
        f"{np.sum(smap.incomplete)} cells hold an even number of orbits: folds come in pairs, so one is "
        "missing or counted twice"
    )


def elsewhere_words(smap: StabilityMap) -> str:
    """Say where else the mass rests."""
    places = ", ".join(f"{1e3 * place:.3g}" for place in smap.other_rests)
    return f"without a drive the mass also rests at {places} mm; motions about these places are not sought"
