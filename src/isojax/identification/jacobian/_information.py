"""The information that segments hold: products of residuals and of derivatives of their simulation."""

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from typing import NamedTuple

import numpy as np
from jaxtyping import Array, Float

from ..._kept import recall
from ..._types import on_device
from ...models import Isolator
from ._batch import Prepared, workers
from ._fixed_steps import fixed_information, fixed_path, fixed_readings
from ._solved_steps import solved_information, solved_path, solved_readings
from ._unknowns import Lanes, Unknowns


class Stepping(NamedTuple):
    """How segments are simulated: functions of the same arguments, whatever the integrator.

    Attributes:
        information: A^T W A of each lane; A holds the columns and, last, the residual.
        readings: what the sensor chain records.
        path: states at the start of each step of the tables, and the ringing of jumps where laws are split.
    """

    information: Callable[..., Array]
    readings: Callable[..., Array]
    path: Callable[..., tuple]


def find_stepping(prepared: Prepared) -> Stepping:
    """Give the way in which segments are simulated: by RK4 under a scan, or by diffrax as asked.

    All that depends on it is chosen here: residuals, exact derivatives, and the motion along which the
    columns of absent effects are worked out. Those columns themselves are a linear solve, the same for both.

    Args:
        prepared: the segments, with their integrator.

    Returns:
        The functions.
    """
    if prepared.sampling.integrator.is_locked:
        return Stepping(fixed_information, fixed_readings, fixed_path)
    return Stepping(solved_information, solved_readings, solved_path)


def information(unknowns: Unknowns, prepared: Prepared) -> Float[np.ndarray, "lanes column column"]:
    """Give the information matrix of each segment.

    Columns, in this order: the directions; the stiffness scale of the record in units of
    `STIFFNESS_SCALE_UNIT`, if the model has a linear spring; the initial states in their scales; the residual
    (measured - simulated). All in the SI unit of the output, not yet weighted by the noise.

    Args:
        unknowns: where the simulation stands and its directions.
        prepared: the segments.

    Returns:
        A^T A of each lane, lanes first; not finite where a simulation diverged.
    """
    stepping = find_stepping(prepared)
    moving = unknowns.moving
    changed = on_device(unknowns.directions[list(moving)])

    def one(part: int) -> np.ndarray:
        (scale,), states = (
            prepared.own(one, part) for one in (unknowns.stiffness_scale[None], unknowns.states)
        )
        own, scales = Lanes(unknowns.model, scale, states), prepared.own(unknowns.state_scales, part)
        batch = prepared.batches[part].following(unknowns.model)
        result = stepping.information(own, moving, changed, scales, batch, prepared.sampling)
        return np.moveaxis(np.asarray(result), -1, 0)

    # JAX releases the interpreter while it computes, so that plain threads use every core on one device.
    with ThreadPoolExecutor(workers()) as pool:
        return prepared.in_lanes(pool.map(one, range(len(prepared.batches))))


def readings(
    model: Isolator,
    stiffness_scale: Float[np.ndarray, " lanes"],
    states: Float[np.ndarray, "state lanes"],
    prepared: Prepared,
) -> Float[np.ndarray, "time lanes"]:
    """Simulate each segment from a given state.

    Args:
        model: the isolator.
        stiffness_scale: factor on the linear stiffness, a lane each.
        states: state at each lane's first sample.
        prepared: the segments.

    Returns:
        What the sensor chain records [SI unit of the output]; meaningless where the lane is padded.
    """
    stepping = find_stepping(prepared)

    def one(part: int) -> np.ndarray:
        (scale,), own = prepared.own(stiffness_scale[None], part), prepared.own(states, part)
        batch = prepared.batches[part].following(model)
        return np.asarray(stepping.readings(Lanes(model, scale, own), batch, prepared.sampling)).T

    def compute() -> tuple[np.ndarray]:
        with ThreadPoolExecutor(workers()) as pool:
            return (prepared.in_lanes(pool.map(one, range(len(prepared.batches)))).T,)

    (simulated,) = recall(
        "readings", compute, model, stiffness_scale, states, prepared.sampling.integrator.band_limited
    )
    return simulated
