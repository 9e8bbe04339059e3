"""Where the motion goes as the drive is turned up, down, or set anew: the stroboscopic diagram."""

import math
from typing import Any, Literal, get_args

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool, Float, Int

from ..._given_numbers import given_count
from ..._quick_jit import quick_jit
from ..._results import RESULTS
from ..._show import shown
from ..._types import check_float64
from ...models import Integrator, Isolator, Modelled, State, as_isolator
from ..orbit import ascending, integrator_for, recorded_sine
from ._stroboscope import (
    Repetition,
    Watch,
    any_disturbance,
    bounded_or_not,
    repeats_after,
    start_states,
    still_settling,
    watch_settled,
)

SweepDirection = Literal["up", "down", "both", "anew"]

_CHAOS = math.log(100.0)
"""Growth of a disturbance over the samples, as a logarithm, beyond which a motion that repeats nowhere counts
as chaotic: more than what turning and shearing lend to a motion that is only slow to settle."""


@shown
class BifurcationDiagram(eqx.Module):
    """The settled motion, once a drive period, along the drive's amplitude or frequency.

    Where there are several runs, an axis `run` stands in front.

    Attributes:
        model: the isolator.
        parameter: "amplitude" or "frequency", what varies.
        amplitudes: F0 at each point [N, or m/s^2 for base excitation].
        frequencies: f at each point [Hz].
        runs: direction of each run, those up first; all starts of a direction stand together.
        samples: displacement [m], velocity [m/s], internal states at the drive's phase zero.
        period: drive periods after which the motion repeats; 0 where it repeats after none up to the bound.
        lyapunov: largest Lyapunov exponent over the samples [1/s].
        chaotic: whether the motion repeats nowhere and a disturbance grew a hundredfold over the samples.
        settling: whether the motion repeats nowhere because it still settles: more `settle` shows where it
            goes.
        result: whether the motion stayed bounded; where not, its numbers are NaN.
    """

    model: Isolator
    parameter: str = eqx.field(static=True)
    amplitudes: Float[Array, " point"]
    frequencies: Float[Array, " point"]
    runs: tuple[str, ...] = eqx.field(static=True)
    samples: Float[Array, "*run point sample state"]
    period: Int[Array, "*run point"]
    lyapunov: Float[Array, "*run point"]
    chaotic: Bool[Array, "*run point"]
    settling: Bool[Array, "*run point"]
    result: RESULTS

    @property
    def quasi_periodic(self) -> Bool[Array, "*run point"]:
        """Whether the motion repeats nowhere up to the bound, is not chaotic and does not settle any more: it
        runs on a torus, or has a longer period.
        """
        finite = jnp.isfinite(self.samples[..., 0, 0])
        return (self.period == 0) & ~self.chaotic & ~self.settling & finite

    @property
    def rotation_number(self) -> Float[Array, "*run point"]:
        """Turns a drive period of the samples around their mean, of displacement and velocity, up to whole
        turns and their sense: from 0 to 1/2; NaN where the motion is not quasi-periodic.
        """
        plane = self.samples[..., :2] - jnp.mean(self.samples[..., :2], axis=-2, keepdims=True)
        size = jnp.std(plane, axis=-2, keepdims=True)
        plane = plane / jnp.where(size > 0.0, size, 1.0)
        place = jax.lax.complex(plane[..., 0], plane[..., 1])
        # Of the steps from sample to sample: their sum around a closed curve counts its turns.
        ahead = jnp.angle(place[..., 1:] * jnp.conj(place[..., :-1]))
        share = jnp.mean(ahead, axis=-1) / (2.0 * math.pi)
        one_way = jnp.mean(jnp.where(ahead < 0.0, ahead + 2.0 * math.pi, ahead), axis=-1) / (2.0 * math.pi)
        # Steps of half a turn change their sign at random: counted one way round they do not.
        turns = jnp.where(jnp.abs(share) < 0.25, jnp.abs(share), jnp.minimum(one_way, 1.0 - one_way))
        return jnp.where(self.quasi_periodic, turns, jnp.nan)

    @property
    def displacement(self) -> Float[Array, "*run point sample"]:
        """[m]."""
        return self.samples[..., 0]

    @property
    def velocity(self) -> Float[Array, "*run point sample"]:
        """[m/s]."""
        return self.samples[..., 1]

    def _headline(self) -> str:
        period, chaotic = np.asarray(self.period), int(np.sum(np.asarray(self.chaotic)))
        counts = zip(*np.unique(period, return_counts=True), strict=True)
        words = ", ".join(f"{count} of period {value}" for value, count in counts if value)
        runs = ", ".join(dict.fromkeys(self.runs))
        settling, bounded = np.asarray(self.settling), np.isfinite(np.asarray(self.samples)[..., 0, 0])
        torus = bounded & (period == 0) & ~np.asarray(self.chaotic) & ~settling
        more = f", {int(torus.sum())} quasi-periodic" if torus.any() else ""
        more += f", {int(settling.sum())} not settled yet" if settling.any() else ""
        return f"along {self.parameter} ({runs}): {words or 'no periodic motion'}{more}, {chaotic} chaotic"

    def _rows(self) -> list[str]:
        return ["model", "amplitudes", "frequencies", "samples", "period", "lyapunov", "result"]


def bifurcation_diagram(
    model: Isolator | Modelled,
    amplitudes: Any = None,
    frequency: Any = None,
    *,
    amplitude: Any = None,
    frequencies: Any = None,
    direction: SweepDirection | str = "up",
    starts: Any = None,
    settle: int = 200,
    samples: int = 64,
    longest: int = 16,
    tolerance: float = 1e-3,
    integrator: Integrator | None = None,
) -> BifurcationDiagram:
    """Give the settled motion, once a drive period, as the drive's amplitude or frequency varies.

    Turned up or down, the motion at one point starts where that at the point before ended, so that jumps and
    their return show; set anew, it starts at each point from each start. All runs go side by side.

    Args:
        model: the isolator.
        amplitudes: ascending drive amplitudes [N, or m/s^2 for base excitation], with `frequency`.
        frequency: the one frequency that goes with them [Hz].
        amplitude: the one drive amplitude that goes with `frequencies`.
        frequencies: ascending [Hz].
        direction: "up", "down", "both" (down starts where up ended), or "anew".
        starts: state, or list of states, at which a run starts, and starts again after the motion ran away;
            rest if omitted.
        settle: drive periods at each point before the samples.
        samples: drive periods that are kept.
        longest: longest period that is distinguished from none; at most half the samples.
        tolerance: largest distance between a sample and its repetition, as a share of the motion: two
            branches nearer than this count as one.
        integrator: solver and steps.

    Returns:
        The diagram.

    Raises:
        ValueError: if not exactly one of amplitude and frequency is a list, a list is empty, not positive or
            not ascending, `direction` is none of the four, a count is not positive, `longest` exceeds half
            the samples, or a start has the wrong length.
        RuntimeError: if JAX is not in 64-bit mode.

    Source: Thompson & Stewart 2002, Nonlinear Dynamics and Chaos, ch. 4 and 6.

    Example:
        >>> diagram = ij.bifurcation_diagram(ij.paper.y_direction(), np.array([50.0, 100.0]), frequency=3.0)
        >>> diagram.period.ravel().tolist()
        [1, 1]
    """
    model = as_isolator(model)
    check_float64()
    integrator = integrator_for(model, integrator)
    parameter, forces, band = _points(amplitudes, frequency, amplitude, frequencies)
    if direction not in get_args(SweepDirection):
        raise ValueError(
            f"Argument `direction` must be one of {get_args(SweepDirection)}, but is {direction!r}."
        )
    settle = given_count("settle", settle)
    samples = given_count("samples", samples)
    longest = given_count("longest", longest)
    if 2 * longest > samples:
        raise ValueError(f"Argument `longest` must be at most half of {samples} samples, but is {longest}.")
    begin = start_states(model, "starts", starts)
    lanes = tuple(jnp.atleast_1d(value) for value in begin)
    single = begin[0].ndim == 0 and direction != "both"
    points = jnp.asarray(forces), jnp.asarray(band)
    how = Watch(integrator, settle, samples)
    if direction == "anew":
        path, growth = _anew(model, how, points, lanes)
        legs = ("anew",)
    else:
        legs = ("up", "down") if direction == "both" else (direction,)
        path, growth = _swept(model, how, points, legs, lanes)
    runs = tuple(leg for leg in legs for _ in range(lanes[0].size))
    judged = _classify_motions(points[1], path, growth, Repetition(longest, tolerance))
    shown = (values[:, 0] if single else jnp.swapaxes(values, 0, 1) for values in judged)
    kept, period, exponent, chaotic, settling, finite = shown
    seen = kept, period, exponent, chaotic, settling
    return BifurcationDiagram(model, parameter, *points, runs, *seen, bounded_or_not(finite))


def _points(
    amplitudes: Any, frequency: Any, amplitude: Any, frequencies: Any
) -> tuple[str, Float[np.ndarray, " point"], Float[np.ndarray, " point"]]:
    """Give what varies, and amplitude and frequency at each point."""
    asked = (amplitudes is not None, frequency is not None, amplitude is not None, frequencies is not None)
    if asked == (True, True, False, False):
        names, values, held = ("amplitudes", "frequency"), amplitudes, frequency
    elif asked == (False, False, True, True):
        names, values, held = ("frequencies", "amplitude"), frequencies, amplitude
    else:
        raise ValueError(
            "Arguments `amplitudes` and `frequency`, or `amplitude` and `frequencies`, must be given, but "
            f"they are {amplitudes}, {frequency}, {amplitude} and {frequencies}."
        )
    varied, single = ascending(names[0], values), np.asarray(held, dtype=float)
    if single.ndim or not 0.0 < single < math.inf:
        raise ValueError(f"Argument `{names[1]}` must be one positive number, but is {held}.")
    still = np.full(len(varied), single)
    if names[0] == "amplitudes":
        return "amplitude", varied, still
    return "frequency", still, varied


Points = tuple[Float[Array, " point"], Float[Array, " point"]]
"""Amplitude and frequency at each point."""


def _seen(
    model: Isolator, how: Watch, setting: tuple[Array, Array], state: State, tangent: State
) -> tuple[tuple[State, State], tuple[Array, Array]]:
    """Give where motion and disturbance end, and the samples and the disturbance's growth, motion first."""
    drive = recorded_sine(model, *setting)
    seen = watch_settled(model, how, drive, state, tangent)
    path = jnp.moveaxis(jnp.stack(seen.samples, axis=-1), 0, 1)
    return (seen.state, seen.tangent), (path, seen.growth.T)


@quick_jit
def _swept(
    model: Isolator, how: Watch, points: Points, legs: tuple[str, ...], begin: State
) -> tuple[Float[Array, "point run sample state"], Float[Array, "point run sample"]]:
    def point(carry: tuple[State, State], setting: tuple[Array, Array]) -> Any:
        state, tangent = carry
        finite = jnp.all(jnp.isfinite(jnp.stack(state + tangent)), axis=0)
        state = tuple(jnp.where(finite, now, first) for now, first in zip(state, begin, strict=True))
        tangent = tuple(jnp.where(finite, now, 1.0) for now in tangent)
        return _seen(model, how, setting, state, tangent)

    ways = [slice(None, None, -1 if leg == "down" else 1) for leg in legs]
    forces, band = (jnp.concatenate([values[way] for way in ways]) for values in points)
    _, kept = jax.lax.scan(point, (begin, any_disturbance(begin)), (forces, band))
    # From leg after leg to runs side by side, each by rising amplitude or frequency.
    count = points[0].size
    parts = [[v[n * count : (n + 1) * count][way] for n, way in enumerate(ways)] for v in kept]
    return jnp.concatenate(parts[0], axis=1), jnp.concatenate(parts[1], axis=1)


@quick_jit
def _anew(
    model: Isolator, how: Watch, points: Points, begin: State
) -> tuple[Float[Array, "point run sample state"], Float[Array, "point run sample"]]:
    count, runs = points[0].size, begin[0].size
    setting = jnp.repeat(points[0], runs), jnp.repeat(points[1], runs)
    state = tuple(jnp.tile(value, count) for value in begin)
    _, (path, growth) = _seen(model, how, setting, state, any_disturbance(state))
    return path.reshape(count, runs, how.periods, -1), growth.reshape(count, runs, how.periods)


@quick_jit
def _classify_motions(
    frequencies: Float[Array, " point"],
    path: Float[Array, "point run sample state"],
    growth: Float[Array, "point run sample"],
    repetition: Repetition,
) -> tuple[Array, ...]:
    """Give samples, period, Lyapunov exponent, whether chaotic, whether it still settles, and whether finite,
    of each point and run.
    """
    finite = jnp.all(jnp.isfinite(path), axis=(2, 3))
    strobe = jnp.moveaxis(path, 2, 0)
    omega = jnp.broadcast_to(2.0 * math.pi * frequencies[:, None], strobe.shape[:-1])
    period = jnp.where(finite, repeats_after(strobe[..., 0], strobe[..., 1], omega, repetition), 0)
    total = jnp.where(finite, jnp.sum(growth, axis=2), jnp.nan)
    chaotic = (period == 0) & (total > _CHAOS)
    approaches = still_settling(strobe[..., 0], strobe[..., 1], omega)
    return (
        jnp.where(finite[..., None, None], path, jnp.nan),
        period,
        total * frequencies[:, None] / path.shape[2],
        chaotic,
        (period == 0) & ~chaotic & approaches & finite,
        finite,
    )
