"""Internal states along measured motions: what a memory holds where a segment begins."""

import diffrax
import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from ..elements import AbstractElement
from ..models import RK4, Isolator, State
from ..records import Record
from ._batch import Prepared, coordinate_motion
from ._families import Family, find_families, follow_motion, share_states

_STEPS = 2
"""Integration steps a sample where internal states follow a measured motion."""


@eqx.filter_jit
def _along(
    families: tuple[Family, ...],
    motion: tuple[Array, ...],
    begin: Array,
    based: bool,
    sample_time: float,
) -> tuple[State, State]:
    """Integrate internal states along motions, straight between samples.

    Returns:
        The states at each lane's beginning, and their mean size from there on; members first, lanes last.
    """
    solver = RK4()

    def field(t: float, internal: State, ends: tuple[tuple[Array, ...], tuple[Array, ...]]) -> State:
        x, v, y, u = (one + t * (other - one) for one, other in zip(*ends, strict=True))
        rates: list[Array] = []
        for family, own in zip(families, share_states(families, internal), strict=True):

            def follow(element: AbstractElement, s: State) -> State:
                return follow_motion(element, x, v, y, u if based else None, s)

            rates.extend(jax.vmap(follow)(family.elements, own))
        return tuple(sample_time * rate for rate in rates)

    term = diffrax.ODETerm(field)  # pyright: ignore[reportArgumentType]

    def body(carry: tuple, table: tuple) -> tuple[tuple, None]:
        internal, first, total = carry
        index, now, ahead = table
        started, past = (index == begin)[None], (index >= begin)[None]
        first = tuple(jnp.where(started, s, kept) for s, kept in zip(internal, first, strict=True))
        # Not the square: a memory that ran away may be too large for it.
        total = tuple(
            jnp.where(past, part + jnp.abs(s), part) for s, part in zip(internal, total, strict=True)
        )
        for step in range(_STEPS):
            t0, t1 = step / _STEPS, (step + 1) / _STEPS
            internal, *_ = solver.step(term, t0, t1, internal, (now, ahead), None, False)
        return (internal, first, total), None

    length, lanes = motion[0].shape
    rest = tuple(jnp.zeros((len(family.places), lanes)) for family in families for _ in range(family.states))
    now, ahead = (tuple(values[part] for values in motion) for part in (slice(None, -1), slice(1, None)))
    (_, first, total), _ = jax.lax.scan(body, (rest, rest, rest), (jnp.arange(length - 1), now, ahead))
    count = jnp.maximum(length - 1 - begin, 1)[None]
    return first, tuple(part / count for part in total)


def internal_starts(
    model: Isolator, records: tuple[Record, ...], prepared: Prepared
) -> tuple[Float[np.ndarray, "internal lanes"], Float[np.ndarray, "internal lanes"]]:
    """Run the internal states of a model along the measured motion.

    Each lane sets out from rest, as long before its segment as the longest segment lasts, or at the start of
    its record; memories of sensors follow the measured output.

    Args:
        model: the isolator; its memories are taken along, its force balance is not.
        records: the records of the segments.
        prepared: the segments.

    Returns:
        Internal states at each lane's first sample, and their mean size over the lane.
    """
    lanes = prepared.record.size
    starts = np.zeros((model.internal_states, lanes))
    spread = np.ones((model.internal_states, lanes))
    with_memory = tuple(element for element in model.elements if element.internal_states)
    if not with_memory:
        return starts, spread
    based = model.excitation == "base_acceleration"
    before = max(segment.stop - segment.start for segment in prepared.segments)
    lead = [min(before, segment.start) for segment in prepared.segments]
    length = 1 + max(
        segment.stop - segment.start + ahead for segment, ahead in zip(prepared.segments, lead, strict=True)
    )
    motion = np.zeros((4, length, lanes))
    begin = np.zeros(lanes, dtype=int)
    known = {
        place: (
            *coordinate_motion(records[place], prepared.quantity, based),
            records[place].output,
            records[place].input,
        )
        for place in {segment.record for segment in prepared.segments}
    }
    for lane, (segment, ahead) in enumerate(zip(prepared.segments, lead, strict=True)):
        window = slice(segment.start - ahead, segment.stop)
        for row, values in enumerate(known[segment.record]):
            piece = values[window]
            motion[row, : piece.size, lane] = piece
            motion[row, piece.size :, lane] = piece[-1]
        begin[lane] = ahead
    families = find_families(with_memory)
    tables = tuple(jnp.asarray(values) for values in motion)
    found = _along(families, tables, jnp.asarray(begin), based, prepared.sample_time)
    ends = np.cumsum([0, *(element.internal_states for element in with_memory)])
    first, size = (share_states(families, values) for values in found)
    for family, own, sizes in zip(families, first, size, strict=True):
        for state in range(family.states):
            rows = [int(ends[place]) + state for place in family.places]
            starts[rows] = np.asarray(own[state])
            spread[rows] = np.maximum(np.asarray(sizes[state]), 1e-300)
    return starts, spread
