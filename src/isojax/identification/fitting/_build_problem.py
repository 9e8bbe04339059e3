"""Records made into a problem: cut into segments, each with a start of its own."""

import itertools

from ...excitations import Hold
from ...models import Integrator, Isolator, Quantity
from ...records import Record
from ..jacobian import cut_segments, segments_between, slowest_decay
from ._initial_states import head_segments
from ._problem import Problem

SAME_RATE = 1e-3
"""Relative difference of sampling rates that the stiffness scales of the records can still take up."""


def build_problem(
    records: tuple[Record, ...],
    model: Isolator,
    *,
    quantity: Quantity,
    hold: Hold,
    noise: tuple[float, ...],
    integrator: Integrator,
    share: float = 1.0,
    whitening: tuple[float, ...] = (),
    uncut: bool = False,
) -> Problem:
    """Cut records into segments for a model.

    Where the motion does not decay (a mass without a spring) records are left whole, and only their
    first samples may set their initial states, as in a free run: such a motion remembers its start for ever,
    and a start that the whole record may choose would imitate a missing force.

    Args:
        records: the records.
        model: the isolator, for its decay time.
        quantity: what the sensor measures.
        hold: what the drive does between samples.
        noise: of each record, rms of white noise that has the density of the noise inside its band, or of
            what the whitening filter leaves [SI unit of the output].
        integrator: solver and steps.
        share: share of the samples of which the noise is independent.
        whitening: coefficients of the filter that whitens coloured noise; none where it is white.
        uncut: whether records are left whole however fast the motion decays: the start is near.

    Returns:
        The problem.

    Raises:
        ValueError: if the records differ in sampling rate.
    """
    for record in records:
        if abs(record.rate / records[0].rate - 1.0) > SAME_RATE:
            raise ValueError(
                f"Argument `records` must share one sampling rate, but {records[0].name} has "
                f"{records[0].rate:g} Hz and {record.name} {record.rate:g} Hz."
            )
    if uncut:
        ends = ((place, record, [(0, record.output.size)]) for place, record in enumerate(records))
        segments = tuple(itertools.chain.from_iterable(segments_between(*one) for one in ends))
    else:
        segments = cut_segments(records, model)
    whole = slowest_decay(model) == 0.0 and not any(record.dwells for record in records)
    heads = head_segments(records) if whole else ()
    return Problem(
        records, segments, quantity, hold, noise, integrator, heads, share=share, whitening=whitening
    )
