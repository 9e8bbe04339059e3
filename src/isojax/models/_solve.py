"""Integration by diffrax, from the first of the times that are wanted to the last."""

from collections.abc import Callable

import diffrax
import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from .._types import Lanes
from ._instant import Instant
from ._integrator import Integrator
from ._isolator import Isolator, Quantity
from ._laws import State

_LEAST_STEP = 1e-9
"""Adaptive step, over a fixed one, below which a simulation gives up: it has diverged."""

_NODES = 4
"""Stages of a sample through which its cubic goes."""


def solve_ode(
    field: Callable[[Lanes, State], State],
    integrator: Integrator,
    state: State,
    wanted: Float[Array, " time"],
    steps: Float[Array, " end"],
    jumps: Float[Array, " jump"] | None = None,
) -> tuple[State, diffrax.RESULTS]:
    """Integrate by diffrax, so that forward derivatives go through.

    Args:
        field: rates of the state, from the time and the state.
        integrator: solver, and its tolerances if the steps are adaptive.
        state: at the first of `steps`.
        wanted: times whose states are given, ascending.
        steps: ends of the fixed steps, the first time among them.
        jumps: times at which the field jumps, if any; see `Integrator.controller`.

    Returns:
        States at the times wanted; how the integration ended.
    """
    length = steps[1] - steps[0]
    solution = diffrax.diffeqsolve(
        diffrax.ODETerm(lambda t, y, args: field(t, y)),  # pyright: ignore[reportArgumentType]
        integrator.solver,
        t0=steps[0],
        t1=steps[-1],
        dt0=None if integrator.rtol is None else length,
        y0=state,
        saveat=diffrax.SaveAt(ts=wanted),
        stepsize_controller=integrator.controller(steps, _LEAST_STEP * length, jumps),
        adjoint=diffrax.ForwardMode(),
        max_steps=integrator.max_steps,
        throw=False,
    )
    assert solution.ys is not None
    return solution.ys, solution.result


def solve_record(
    model: Isolator,
    integrator: Integrator,
    quantity: Quantity,
    sample_time: Lanes | float,
    state: State,
    record: Instant,
    observed: int,
    jumps: bool,
) -> State:
    """Integrate one record by diffrax, its steps free of the samples where they are adaptive.

    A law that jumps or bends is the rounded one, as in `simulate`; `scan_records` splits it instead.

    Args:
        model: the isolator.
        integrator: solver, steps and tolerances.
        quantity: what the sensor measures.
        sample_time: time between samples [s].
        state: at the first sample.
        record: what acts: arrays over time and stage; the stages, at least four, run equidistantly from a
            sample to the next, and a cubic goes through the nearest four.
        observed: how many times in a sample the state is wanted.
        jumps: whether what acts jumps at the samples.

    Returns:
        States, `observed` a sample; NaN where the integration failed.
    """
    count, stages = record.drive.shape

    # Time is counted in samples: a whole number is then exact, however long the record.
    def field(t: Lanes, y: State) -> State:
        sample = jnp.clip(jnp.floor(t).astype(int), 0, count - 1)
        place = (t - sample) * (stages - 1)
        first = jnp.clip(jnp.floor(place).astype(int) - 1, 0, stages - _NODES)
        shares = _lagrange(place - first)

        def between(table: Array) -> Array:
            return jax.lax.dynamic_slice(table, (sample, first), (1, _NODES))[0] @ shares

        at = model.with_delay_slope(jax.tree_util.tree_map(between, record))
        return tuple(sample_time * rate for rate in model.rates(y, at, quantity))

    steps = integrator.steps_per_sample(model)
    ends = jnp.arange(count * steps + 1, dtype=float) / steps
    if jumps:
        # A fixed step, too, ends before a jump; the next one, of no length to speak of, leads across it.
        inner = ends[1:-1, None]
        around = jnp.concatenate([jnp.nextafter(inner, 0.0), jnp.nextafter(inner, jnp.inf)], axis=1)
        ends = jnp.concatenate([ends[:1], around.ravel(), ends[-1:]])
    wanted = jnp.arange(count * observed, dtype=float) / observed
    samples = jnp.arange(1, count, dtype=float)
    path, ended = solve_ode(field, integrator, state, wanted, ends, samples if jumps else None)
    return tuple(jnp.where(ended == diffrax.RESULTS.successful, values, jnp.nan) for values in path)


def check_integrator(integrator: object) -> None:
    """Refuse what cannot simulate records: its solver is traced, derivatives included, and nothing is run.

    Args:
        integrator: what a caller gave as argument `integrator`.

    Raises:
        ValueError: if it is no `Integrator`, or its solver does not solve ordinary differential equations
            with the steps asked for.
    """
    if not isinstance(integrator, Integrator):
        raise ValueError(
            "Argument `integrator` must be an Integrator, such as "
            f"isojax.Integrator(diffrax.Dopri8(), rtol=1e-8), but is {integrator!r}."
        )
    if integrator.is_locked:
        return
    times = jnp.arange(3.0)

    def motion(start: Array) -> State:
        return solve_ode(lambda t, y: (-y[0],), integrator, (start,), times, times, times[1:2])[0]

    try:
        jax.eval_shape(lambda start: jax.jvp(motion, (start,), (start,)), times[0])
    # Whatever diffrax has against a solver, it says so while it is traced, each in an exception of its own.
    except Exception as trouble:
        raise ValueError(
            "Argument `integrator` must hold a solver of ordinary differential equations that diffrax can "
            f"step as asked, but holds {type(integrator.solver).__name__}: {str(trouble).splitlines()[0]}"
        ) from trouble


def _lagrange(place: Array) -> Float[Array, "4"]:
    """Give the weights of values at 0, 1, 2 and 3 in the cubic through them."""
    a, b, c, d = place, place - 1.0, place - 2.0, place - 3.0
    return jnp.stack([-b * c * d / 6.0, a * c * d / 2.0, -a * b * d / 2.0, a * b * c / 6.0])
