"""Where each record is cut, so that every piece can start from its own measured state."""

import itertools
from collections.abc import Iterable
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from ..._quick_jit import quick_jit
from ..._show import shown
from ...models import Instant, Isolator
from ...records import Record

DECAY_TIMES_A_WINDOW = 25.0
"""A window of so many decay times loses less than a tenth of its information to its free start."""

SHORTEST_WINDOW = 400
"""Samples of a window at least."""

FEWEST_WINDOWS = 4
"""Windows below which a record stays whole."""

_OF_RMS = (-1.5, -1.0, -0.5, 0.0, 0.5, 1.0, 1.5)
FIRST_STATES = np.array([(place, speed) for place in _OF_RMS for speed in _OF_RMS])
"""Displacements and velocities, over their rms, at which a record is tried to begin beside the measured one:
where laws jump, or a motion bends much, the nearest minimum is not the lowest."""

SHORTEST = 8
"""Samples below which a piece of a record says nothing."""


@shown
class Segment(NamedTuple):
    """A piece of a record that is simulated from a state of its own.

    Attributes:
        record: place of its record in the list it was cut from.
        start: first sample.
        stop: sample after the last.
        counted: first sample whose error counts (later than `start` where samples may only set the state).
    """

    record: int
    start: int
    stop: int
    counted: int


def slowest_decay(model: Isolator) -> float:
    """Give the decay rate of the slowest motion about rest [1/s].

    Args:
        model: the isolator.

    Returns:
        Smallest decay rate; 0 where something does not decay (a mass without a spring).
    """
    rates = np.linalg.eigvals(np.asarray(_rates_about_rest(model))).real
    return float(max(0.0, -rates.max()))


@quick_jit
def _rates_about_rest(model: Isolator) -> Float[Array, "state state"]:
    """Give the derivative of the states' rates by the states, at rest."""
    rest = jnp.zeros(2 + model.internal_states)
    return jax.jacfwd(lambda z: jnp.stack(model.rates(tuple(z), Instant(jnp.zeros(())))))(rest)


def cut_segments(records: tuple[Record, ...], model: Isolator) -> tuple[Segment, ...]:
    """Cut records into segments: dwells of a stepped sine, else windows of many decay times.

    A record is left whole where the model's motion does not decay, or where fewer than four windows would
    fit: a free initial state would then cost more than it gives.

    Args:
        records: the records.
        model: the isolator, for its slowest decay.

    Returns:
        Segments, in the order of the records.
    """
    decay = slowest_decay(model)
    segments = []
    for place, record in enumerate(records):
        count = record.input.size
        if record.dwells:
            bounds = [(dwell.start, dwell.stop) for dwell in record.dwells]
        else:
            window = (
                count
                if decay == 0.0
                else max(SHORTEST_WINDOW, int(DECAY_TIMES_A_WINDOW / decay * record.rate))
            )
            pieces = max(1, count // window)
            bounds = cut_evenly(count, pieces if pieces >= FEWEST_WINDOWS else 1)
        segments += segments_between(place, record, bounds)
    return tuple(segments)


def cut_evenly(count: int, pieces: int) -> list[tuple[int, int]]:
    """Cut samples into windows of one length.

    Args:
        count: samples.
        pieces: windows.

    Returns:
        First sample of each window, and the sample after its last.
    """
    return list(itertools.pairwise(np.linspace(0, count, pieces + 1).astype(int).tolist()))


def segments_between(place: int, record: Record, bounds: Iterable[tuple[int, int]]) -> list[Segment]:
    """Give the pieces of a record between given samples; those that say nothing are left out.

    Args:
        place: place of the record among the records.
        record: the record.
        bounds: first sample of each piece, and the sample after its last.

    Returns:
        Segments.
    """
    return [
        Segment(place, int(start), int(stop), min(max(int(start), record.settle), int(stop)))
        for start, stop in bounds
        if stop - start >= SHORTEST and record.settle < stop
    ]
