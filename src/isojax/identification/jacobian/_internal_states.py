"""Internal states along measured motions: their values at the start of each segment."""

from concurrent.futures import ThreadPoolExecutor

import numpy as np
from jaxtyping import Array, Float

from ..._types import on_device
from ...models import Isolator
from ...records import Record
from ._batch import Prepared, coordinate_motion, workers
from ._effect_inputs import internal_state_path
from ._families import ElementFamily, find_families, in_turn


def _stages(values: Float[np.ndarray, "time lanes"], steps: int) -> Float[Array, "node 3 lanes"]:
    """Give values at start, middle and end of each integration step, straight between samples."""
    share = (np.arange(steps)[:, None] + np.array([0.0, 0.5, 1.0])) / steps
    now, ahead = values[:-1, None, None], values[1:, None, None]
    return on_device((now + share[..., None] * (ahead - now)).reshape(-1, 3, values.shape[1]))


def internal_starts(
    model: Isolator, records: tuple[Record, ...], prepared: Prepared, carried: int | None = None
) -> tuple[Float[np.ndarray, "internal lanes"], Float[np.ndarray, "internal lanes"]]:
    """Run the internal states of a model along the measured motion.

    Each lane starts from rest, as long before its segment as the longest segment lasts, or at the start of
    its record; internal states of sensors follow the measured output. Between samples the motion is straight.

    Args:
        model: the isolator; its internal states are integrated, its force balance is not.
        records: the records of the segments.
        prepared: the segments.
        carried: count of elements that move the state, whose sizes are wanted; all if omitted.

    Returns:
        Internal states at each lane's first sample, and their mean size over the lane (1 where not wanted).
    """
    lanes = prepared.record.size
    starts = np.zeros((model.internal_states, lanes))
    spread = np.ones((model.internal_states, lanes))
    dynamic = tuple(element for element in model.elements if element.internal_states)
    if not dynamic:
        return starts, spread
    acting = sum(bool(element.internal_states) for element in model.elements[:carried])
    based = model.excitation == "base_acceleration"
    length, stages = prepared.batches[0].drive.shape[:2]
    known = {
        place: (
            *coordinate_motion(records[place], prepared.sampling.quantity, based),
            records[place].output,
            records[place].input,
        )
        for place in {segment.record for segment in prepared.segments}
    }
    # Before its record starts a lane is at rest, where internal states stay as they are.
    before, over = np.zeros((4, length + 1, lanes)), np.zeros((4, length + 1, lanes))
    for lane, segment in enumerate(prepared.segments):
        lead = min(length, segment.start)
        for row, values in enumerate(known[segment.record]):
            before[row, length - lead :, lane] = values[segment.start - lead : segment.start + 1]
            piece = values[segment.start : segment.stop]
            over[row, : piece.size, lane] = piece
            over[row, piece.size :, lane] = piece[-1]
    steps, parts = (stages - 1) // 2, len(prepared.batches)
    inside = np.ones((length, lanes), dtype=bool)
    for lane, segment in enumerate(prepared.segments):
        inside[segment.stop - segment.start :, lane] = False
    families = find_families(dynamic)
    ends = np.cumsum([0, *(element.internal_states for element in dynamic)])

    owned = [slice(part * (lanes // parts), (part + 1) * (lanes // parts)) for part in range(parts)]

    def tabulated(task: tuple[np.ndarray, slice]) -> tuple[Float[Array, "node 3 lanes"], ...]:
        motion, own = task
        return tuple(_stages(row, steps) for row in motion[: 4 if based else 3, :, own])

    def along(task: tuple[ElementFamily, int]) -> None:
        family, part = task
        own, step = owned[part], prepared.sampling.time / steps
        rest = (on_device(np.zeros((len(family.places), lanes // parts))),) * family.elements.internal_states
        first, _ = internal_state_path(family.elements, leading[part], rest, step)
        places = [[int(ends[place]) + state for place in family.places] for state in range(len(rest))]
        for state, values in zip(places, first, strict=True):
            starts[state, own] = np.asarray(values)
        if min(family.places) >= acting:
            return
        _, path = internal_state_path(family.elements, within[part], first, step)
        for state, values in zip(places, path, strict=True):
            # Not the square: an internal state that diverged may be too large for it.
            size = np.where(inside[:, None, own], np.abs(np.asarray(values)[::steps]), 0.0)
            mean = size.sum(axis=0) / inside[:, own].sum(axis=0)
            spread[state, own] = np.maximum(mean, 1e-300)

    # Each kind is compiled by itself, once whatever it rides along with: every core starts with another.
    orders = [in_turn(families, part) for part in range(parts)]
    tasks = [(order[turn], part) for turn in range(len(families)) for part, order in enumerate(orders)]
    with ThreadPoolExecutor(workers()) as pool:
        # Once for all kinds: to lay out a motion takes longer than to follow it.
        leading = list(pool.map(tabulated, [(before, own) for own in owned]))
        within = list(pool.map(tabulated, [(over, own) for own in owned])) if acting else []
        list(pool.map(along, tasks))
    return starts, spread
