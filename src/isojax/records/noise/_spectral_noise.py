"""The noise of a record by its spectrum: the floor above the response, or what repeats do not explain."""

import numpy as np

from .._blow import ring_down
from .._record import Record
from ..spectrum import NoiseBand, spectral_floor
from ._repeats import repeat_difference

_FLOOR_SPANS = ((0.35, 0.5), (0.5, 0.65), (0.65, 0.8), (0.8, 0.95))
"""Sections of the noise band, as shares of it, whose spectral floors are compared."""

_WHOLE_SPAN = (0.4, 0.95)
"""The section for a record that is too short for these."""

_EQUAL_FLOORS = 3.0
"""Standard errors within which two floors count as equal."""


def high_frequency_floor(record: Record, band: NoiseBand) -> float:
    """Gives the rms of noise that has the density of the spectrum's quietest upper section.

    The smallest of four estimates is biased low, so the sections that agree with the quietest are averaged
    with it. Where the response fills the lower sections, the quietest one remains alone and has no such bias.
    Of a record that rings down only what follows the release or the blow counts, since the spectrum of a
    release or a blow itself has no upper end.

    Args:
        record: The record.
        band: The band that the noise fills.

    Returns:
        rms per sample in the output's unit.
    """
    output = ring_down(record)
    whole, *spans = [(low * band.highest, high * band.highest) for low, high in (_WHOLE_SPAN, *_FLOOR_SPANS)]
    found = [(*spectral_floor(output, band, span), span) for span in spans]
    known = sorted(one for one in found if np.isfinite(one[0]))
    if not known:  # a short record has too few lines for narrow sections
        density, _ = spectral_floor(output, band, whole)
    else:
        density, error, quietest = known[0]
        alike = [quietest]
        for level, own, span in known[1:]:
            if level <= density * (1.0 + _EQUAL_FLOORS * np.hypot(own, error)):
                alike.append(span)
                density, error = spectral_floor(output, band, *alike)
    return _rms_of_density(density, band)


def repeat_scatter(record: Record, group: list[Record], band: NoiseBand) -> float:
    """Gives the rms noise of a record from the unexplained difference to its repeats; NaN without any.

    The median over the band counts, because a drift changes only a minority of the lines.
    """
    squares = []
    for other in group:
        difference = repeat_difference(record, other)
        if difference is not None:
            density, _ = spectral_floor(difference, band, (0.0, _WHOLE_SPAN[1] * band.highest))
            squares.append(0.5 * _rms_of_density(density, band) ** 2)
    known = [one for one in squares if np.isfinite(one)]
    return float(np.sqrt(np.mean(known))) if known else float("nan")


def _rms_of_density(density: float, band: NoiseBand) -> float:
    """Gives the rms per sample of noise whose white density [per Hz] is known."""
    return float(np.sqrt(density * band.share * 0.5 * band.rate))
