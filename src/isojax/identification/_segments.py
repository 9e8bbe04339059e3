"""Where each record is cut, so that every piece can start from its own measured state."""

import itertools
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

from ..models import Isolator
from ..records import Record

MEMORIES_A_WINDOW = 25.0
"""A window of so many decay times loses less than a tenth of its information to its free start."""


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
    size = 2 + model.internal_states
    rest = jnp.zeros(size)
    jacobian = jax.jacfwd(lambda z: jnp.stack(model.rates(tuple(z), jnp.zeros(()), 0.0)))(rest)
    rates = np.linalg.eigvals(np.asarray(jacobian)).real
    return float(max(0.0, -rates.max()))


def cut_segments(records: tuple[Record, ...], model: Isolator) -> tuple[Segment, ...]:
    """Cut records into segments: dwells of a stepped sine, else windows much longer than the system's memory.

    A record is left whole where the model's motion does not decay, or where fewer than four windows would
    fit: a free initial state would then cost more than it gives.

    Args:
        records: the records.
        model: the isolator, for its memory.

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
            window = count if decay == 0.0 else max(400, int(MEMORIES_A_WINDOW / decay * record.rate))
            pieces = max(1, count // window)
            edges = np.linspace(0, count, (pieces if pieces >= 4 else 1) + 1).astype(int)
            bounds = list(itertools.pairwise(edges))
        segments += [
            Segment(place, int(start), int(stop), min(max(int(start), record.settle), int(stop)))
            for start, stop in bounds
            if stop - start >= 8 and record.settle < stop
        ]
    return tuple(segments)
