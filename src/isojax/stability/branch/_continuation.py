"""Branches of periodic orbits along one parameter, past their folds."""

import dataclasses
import math
from collections.abc import Sequence
from typing import get_args

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool, Float

from ..._implicit import frozen
from ..._parameters import list_parameters
from ..._quick_jit import quick_jit
from ..._types import Lanes, Scalar, as_float64, check_float64
from ...models import (
    EndsEstimated,
    Estimated,
    Integrator,
    Isolator,
    Modelled,
    as_isolator,
    coefficient_errors,
)
from ..orbit import (
    ShootingMethod,
    integrator_for,
    integrator_that_follows,
    is_odd,
    need_fundamental,
    refuse_traced,
    response_start,
)
from ._arc_length import HELD, NEVER_STARTED, REACHED_BOUND, STALLED, STIFF, Departure, Followed, Stride
from ._branch import Branch, BranchEvent
from ._branch_bands import with_bands, with_probability
from ._criticality import BifurcationKind
from ._other_branches import BranchSearch, find_other_branches
from ._parameter_family import ParameterFamily, family_of
from ._possible_points import find_possible_points
from ._tracing import assemble, trace

_SIZED_AT = 33
"""Parameters at which the size of the motion is estimated beforehand."""

_LOOSE_HALVINGS = 24
"""Of the range between two of them in which a mass breaks loose."""


def tracing_steps(model: Isolator, integrator: Integrator | None) -> Integrator:
    """Give the steps with which curves are followed.

    Args:
        model: the isolator.
        integrator: of the caller; None where none was given.

    Returns:
        That, or 256 steps a period: what is located along a curve starts the search for the exact point.
    """
    return integrator_for(frozen(model), integrator, 256)


def continue_branch(
    model: Isolator | Modelled,
    *,
    parameter: str,
    start: Scalar | float,
    stop: Scalar | float,
    amplitude: Lanes | float | None = None,
    frequency: Lanes | float | None = None,
    start_state: Sequence[Scalar | float] | Float[Array, " state"] | None = None,
    periods: int = 1,
    symmetric: bool | None = None,
    other_periods: Sequence[int] | None = None,
    step: float = 0.02,
    most: int = 1000,
    integrator: Integrator | None = None,
    events: Sequence[BranchEvent] = (),
    fit: Estimated | EndsEstimated | None = None,
) -> Branch:
    """Follow a branch of periodic orbits along the drive's amplitude, its frequency or any coefficient.

    Orbits that the branch does not reach within the range are sought too, and followed as branches of their
    own: see `others` of the result, and `searched` for where they were sought.

    Pseudo-arc-length continuation of the period map's fixed point; of symmetric orbits of odd models, of the
    half-period map's. Bifurcations are located on the way and then found anew with the motion split at its
    kinks. `jax.jacfwd` and `jax.grad` over the model work: the special points move as they do when found
    anew, the points of the branch across it.

    Args:
        model: the isolator.
        parameter: "amplitude", "frequency", or a coefficient by its name in reports, such as
            `cubic_stiffness.coefficient` or `mass`.
        start: value of the parameter where the branch starts.
        stop: value where it ends; it also ends where it comes back to `start`.
        amplitude: F0 [N, or m/s^2 for base excitation], where it is not the parameter.
        frequency: f [Hz], where it is not the parameter. An array here or there gives a batch of branches,
            followed together.
        start_state: state at t = 0 near an orbit at `start`; the one-harmonic balance with the smallest
            motion if omitted.
        periods: drive periods after which the orbits repeat.
        symmetric: whether to follow symmetric orbits with the half-period map; if omitted, so for an odd
            model without a `start_state`.
        other_periods: drive periods of the orbits that are sought beside the branch, () for none; if omitted
            1, 2 and 3, or none where `start_state` says which branch is meant.
        step: largest step, over the size of the motion and the range of the parameter.
        most: points to give up after.
        integrator: solver and steps; 256 a period if omitted.
        events: numbers of the orbits whose zeros are to be located too; they are among the special points,
            by their names. Passing the same events again uses what was compiled for them.
        fit: with whose errors branches and special points are given bands, and these their probability;
            bifurcations that `model`, which is its model, lacks are then sought within them: see
            `possible_points` of the result. None for neither.

    Returns:
        The branch. Where it ends early `result` says so, and the points found so far stand. Where dry
        friction holds the mass there are no orbits: the branch begins where it breaks loose, or ends where it
        is held, and `result` says that it sticks.

    Raises:
        ValueError: if `parameter` is none of the model's, the drive is incomplete or said twice, the range is
            empty or not finite, a frequency is not positive, `start_state` has the wrong length, `symmetric`
            is asked of a model that is not odd, or `step`, `most`, `periods` or one of `other_periods` is not
            positive, two events have one name or that of a bifurcation, or `fit` failed, leaves a
            coefficient undetermined or is of another model.
        RuntimeError: if JAX is not in 64-bit mode.

    Source: Keller 1977, Applications of Bifurcation Theory, p. 359; Nayfeh & Balachandran 1995, sec. 6.1.

    Example:
        >>> model = ij.paper.y_direction()
        >>> branch = ij.continue_branch(model, parameter="amplitude", frequency=4.3, start=1.0, stop=400.0)
        >>> [point.kind for point in branch.special_points]
        ['fold', 'fold']
    """
    model = as_isolator(model)
    check_float64()
    refuse_traced(model, amplitude, frequency, start, stop)
    errors = None if fit is None else coefficient_errors(fit, model)
    integrator = tracing_steps(model, integrator)
    family, batched = swept_family(model, parameter, start, stop, amplitude, frequency)
    states = 2 + model.internal_states
    if start_state is not None and len(start_state) != states:
        raise ValueError(f"Argument `start_state` must hold {states} states, but holds {len(start_state)}.")
    for name, value in (("periods", periods), ("step", step), ("most", most)):
        if not value > 0:
            raise ValueError(f"Argument `{name}` must be positive, but is {value}.")
    own = [event.name for event in events]
    if len({*own, *get_args(BifurcationKind)}) < len(own) + len(get_args(BifurcationKind)):
        raise ValueError(f"Argument `events` must have names of their own, but they are {own}.")
    if other_periods is None:
        other_periods = (1, 2, 3) if start_state is None else ()
    if any(count < 1 for count in other_periods):
        raise ValueError(
            f"Argument `other_periods` must hold positive counts, but is {tuple(other_periods)}."
        )
    wanted = periods == 1 and (bool(symmetric) or (symmetric is None and start_state is None))
    half = wanted and is_odd(frozen(model))
    if symmetric and not half:
        raise ValueError(
            "Argument `symmetric` must be False for a model that is not odd and for orbits of several "
            "periods, but is True."
        )
    begin = None if start_state is None else jnp.stack([as_float64(value) for value in start_state])
    method, stride = ShootingMethod(integrator, periods, half), Stride(step, most)
    scale, followed = follow_branches(frozen(family), method, frozen(begin), stride)
    if half and not is_odd(frozen(model), _largest(scale, followed)):
        # A law on one side only, between the displacements at which oddness is tried.
        if symmetric:
            raise ValueError("Argument `symmetric` must be False for a model that is not odd, but is True.")
        half, method = False, ShootingMethod(integrator, periods, False)
        scale, followed = follow_branches(frozen(family), method, frozen(begin), stride)
    if _stalled(followed).any():
        finer, stiff = _finer(frozen(family), integrator, scale)
        if finer.steps_per_period > integrator.steps_per_period:
            method = ShootingMethod(finer, periods, half)
            scale, followed = follow_branches(frozen(family), method, frozen(begin), stride)
        if stiff:
            followed = followed._replace(ending=jnp.where(_stalled(followed), STIFF, followed.ending))
    branch = assemble(family, method, scale, followed, batched, step, tuple(events))
    if other_periods:
        search = BranchSearch(tuple(other_periods), stride, tuple(events))
        found, searched = find_other_branches(family, method, scale, followed, search)
        branch = dataclasses.replace(branch, others=found, searched=searched)
    if errors is None:
        return branch

    def again(isolator: Isolator) -> Branch:
        other = dataclasses.replace(frozen(family), model=isolator)
        return assemble(other, method, *follow_branches(other, method, begin, stride), batched, step)

    possible, undecided = find_possible_points(frozen(branch), errors, again)
    branch = with_bands(branch, errors)
    possible = tuple(with_probability(point, errors) for point in possible)
    return dataclasses.replace(branch, possible_points=possible, undecided=undecided)


def _largest(scale: Float[Array, "branch state"], followed: Followed) -> float:
    """Give about the largest displacement along branches [m]."""
    motion = np.linalg.norm(np.asarray(followed.unknowns)[..., :2], axis=-1).max(axis=1, initial=0.0)
    return float(np.max(np.where(np.isfinite(motion), motion, 0.0) * np.asarray(scale)[:, 0]))


def _stalled(followed: Followed) -> Bool[Array, " branch"]:
    """Say which branches end where no step was short enough, or did not start."""
    return (followed.ending == STALLED) | (followed.ending == NEVER_STARTED)


def _finer(
    family: ParameterFamily, integrator: Integrator, scale: Float[Array, "branch state"]
) -> tuple[Integrator, bool]:
    """Give the integrator with steps that follow the states all over a range, and whether these are stiff."""
    stiff = False
    for share in (0.0, 1.0):
        there = family.at(jnp.asarray([share]))
        frequencies = np.broadcast_to(np.asarray(there.frequency), scale.shape[:1])
        integrator, more = integrator_that_follows(
            there.model, integrator, np.asarray(scale[:, 0]), frequencies
        )
        stiff = stiff or more
    return integrator, stiff


def follow_branches(
    family: ParameterFamily,
    method: ShootingMethod,
    begin: Float[Array, " state"] | None,
    stride: Stride,
) -> tuple[Float[Array, "branch state"], Followed]:
    """Follow branches from the start of their range.

    Args:
        family: isolators and drives, drive with a leading axis.
        method: how the orbits are closed.
        begin: state to start from; the one-harmonic balance if None.
        stride: steps along the branches.

    Returns:
        The size of each state, and the curves.
    """
    first, scale = _starts(family, begin)
    fixed = np.zeros(first.shape)
    fixed[:, -1] = 1.0
    fixed = jnp.asarray(fixed)
    followed = trace(family, method, scale, Departure(first, fixed, fixed), stride)
    # What begins where the mass breaks loose lacks a part of the range, also where it reaches the end.
    lacking = (first[:, -1] > 0.0) & (followed.ending == REACHED_BOUND)
    return scale, followed._replace(ending=jnp.where(lacking, HELD, followed.ending))


def swept_family(
    model: Isolator,
    parameter: str,
    start: Scalar | float,
    stop: Scalar | float,
    amplitude: Lanes | float | None,
    frequency: Lanes | float | None,
) -> tuple[ParameterFamily, bool]:
    """Check what is varied and what is held; give the family, drive with an axis, and whether asked so."""
    if parameter not in ("amplitude", "frequency"):
        names = [entry.name for entry in list_parameters(model)]
        if parameter not in names:
            raise ValueError(
                f"Argument `parameter` must be amplitude, frequency or one of {', '.join(names)}, but is "
                f"{parameter!r}."
            )
        varied = (frozen(model).replace(**{parameter: frozen(as_float64(end))}) for end in (start, stop))
        if len({tuple(float(one.order) for one in there.harmonics) for there in varied}) > 1:
            raise ValueError(f"Argument `parameter` must be continuous, but {parameter} is a count.")
    held = {"amplitude": amplitude, "frequency": frequency}
    for name, value in held.items():
        if (value is None) != (name == parameter):
            wanted = "omitted where it is the parameter" if name == parameter else "given"
            raise ValueError(f"Argument `{name}` must be {wanted}, but is {value}.")
    if parameter != "amplitude":
        need_fundamental(frozen(model), frozen(as_float64(held["amplitude"])))
    start, stop = as_float64(start), as_float64(stop)
    ends = [float(frozen(end)) for end in (start, stop)]
    if not all(map(math.isfinite, ends)) or ends[0] == ends[1]:
        raise ValueError(
            f"Argument `stop` must be finite and differ from `start`, but they are {ends[1]} and {ends[0]}."
        )
    drive = {name: as_float64(0.0 if value is None else value) for name, value in held.items()}
    swept = np.asarray(ends) if parameter == "frequency" else np.asarray(frozen(drive["frequency"]))
    if not np.all((swept > 0.0) & np.isfinite(swept)):
        name = "start" if parameter == "frequency" else "frequency"
        raise ValueError(f"Argument `{name}` must be a positive frequency, but is {swept} Hz.")
    shape = np.broadcast_shapes(*(value.shape for value in drive.values()))
    if len(shape) > 1:
        raise ValueError(f"Argument `{parameter}`'s partner must be a number or a list, but has {shape}.")
    lanes = {name: jnp.broadcast_to(value, shape or (1,)) for name, value in drive.items()}
    drives = lanes["amplitude"], lanes["frequency"]
    return family_of(model, drives, (start[None], stop[None]), (parameter,)), bool(shape)


@quick_jit
def _starts(
    family: ParameterFamily, begin: Float[Array, " state"] | None
) -> tuple[Float[Array, "branch unknown"], Float[Array, "branch state"]]:
    """Give the first point of each branch, and the size of its states over the range."""

    def lane(amplitude: Array, frequency: Array) -> tuple[Array, Array]:
        here = family.driven(amplitude, frequency)

        def answer(share: Array) -> tuple[Array, Array]:
            setting = here.at(share[None])
            state = response_start(*setting)
            omega = setting.drive.angular_frequency
            motion = jnp.hypot(state[0], state[1] / omega)
            return state, jnp.concatenate([jnp.stack([motion, motion * omega]), jnp.abs(state[2:])])

        # The first of them is where the mass breaks loose, if friction holds it at the start of the range.
        loose = jnp.zeros(()) if begin is not None else _breaks_loose(here)
        shares = jnp.linspace(0.0, 1.0, _SIZED_AT).at[0].set(loose)
        state, sizes = jax.vmap(answer)(shares)
        size = jnp.max(jnp.where(jnp.isfinite(sizes), sizes, 0.0), axis=0)
        scale = jnp.where(size > 0.0, size, 1.0)
        first = state[0] if begin is None else begin
        return jnp.concatenate([first / scale, loose[None]]), scale

    return jax.vmap(lane)(family.amplitude, family.frequency)


def _breaks_loose(family: ParameterFamily) -> Float[Array, ""]:
    """Give the share from which on dry friction no longer holds the mass.

    0 where it does nowhere, or throughout.
    """
    if not family.model.slides:
        return jnp.zeros(())

    def holds(share: Array) -> Array:
        return family.is_held(jnp.zeros(()), share[None], jnp.ones(()))

    shares = jnp.linspace(0.0, 1.0, _SIZED_AT)
    held = jax.vmap(holds)(shares)
    place = jnp.argmin(held)

    def halve(_: Array | int, ends: tuple[Array, Array]) -> tuple[Array, Array]:
        low, high = ends
        middle = 0.5 * (low + high)
        there = holds(middle)
        return jnp.where(there, middle, low), jnp.where(there, high, middle)

    _, high = jax.lax.fori_loop(0, _LOOSE_HALVINGS, halve, (shares[place - 1], shares[place]))
    return jnp.where(held[0] & (place > 0), high, 0.0)
