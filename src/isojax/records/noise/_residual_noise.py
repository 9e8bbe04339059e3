"""The noise as the residual of a good model shows it: over whole segments, with the drive channel's share."""

import dataclasses
from collections.abc import Sequence

import numpy as np
from jaxtyping import Float

from ..._show import number
from .._campaign import Campaign
from .._record import Record
from ..spectrum import NoiseBand, Rest, harmonic_basis, hum_lines
from ._colour import Colour, Piece
from ._levels import record_levels
from ._noise import (
    NoiseEstimate,
    NoiseMethod,
    coloured,
    estimate_noise,
    output_scatters,
    words_of_colour,
)
from ._scatter import Scatter, piece_scatter, pooled_scatter

_AS_SEEN = 1.05
"""Factor within which the noise of the residual and that of the output count as one."""


def residual_noise(
    campaign: Campaign, known: NoiseEstimate, windows: Sequence[Sequence[Float[np.ndarray, " _"]]]
) -> NoiseEstimate | None:
    """Gives the noise that the residual of a good model shows, where it differs from the output's.

    The output shows noise in the settled ends of dwells only, and not at the harmonics that are taken out
    there. The residual of a good model is noise over whole segments and at every frequency. It also holds
    what the noise of the drive channel becomes in the simulation, with the density `S_u |H|^2`, and noise of
    sweeps.

    Args:
        campaign: The campaign.
        known: The noise that the output shows.
        windows: For each record, its residual in pieces; none of a record whose residual must not count, such
            as a held-out one.

    Returns:
        The estimate; None where the residual is white, and where the noise is declared, filtered or beside a
        recorded motion of the floor.

    Source: Pintelon & Schoukens 2012, System Identification: A Frequency Domain Approach, secs. 9.2 and 10.
    """
    pieces = _pieces(campaign, windows)
    counts, band = [bool(own) for own in pieces], NoiseBand(campaign.rate, None)
    law, scatters = coloured(lambda _: pieces, counts, known.sigma, band)
    if law is None:
        return None
    levels = record_levels(law.sigma, _beside(campaign, law, scatters), counts)
    return dataclasses.replace(
        known,
        sigma=law.sigma,
        method="residual",
        methods=_methods(known, counts),
        note=_words_of(campaign, law, known.sigma),
        levels=levels,
        share=law.share,
        colour=law,
    )


def quieter_noise(
    campaign: Campaign,
    known: NoiseEstimate,
    taken: NoiseEstimate,
    windows: Sequence[Sequence[Float[np.ndarray, " _"]]],
) -> NoiseEstimate | None:
    """Gives white noise of the rms that a model leaves, where that is less than what it was weighted by.

    Noise is at most what a model leaves, whatever that lacks. The output shows more where random forces move
    it, or where the start of a dwell rings on to its end: the model follows both.

    Args:
        campaign: The campaign.
        known: The noise that the output shows.
        taken: The noise that weighted the fit.
        windows: As in `residual_noise`.

    Returns:
        The estimate, each record with a level of its own where they differ significantly; None where it is
        not less, and where the noise is declared, filtered or beside a recorded motion of the floor.
    """
    pieces = _pieces(campaign, windows)
    scatters = [pooled_scatter([piece_scatter(piece) for piece in own]) for own in pieces]
    whole = pooled_scatter([one for one in scatters if one is not None])
    if whole is None:
        return None
    counts, sigma = [bool(own) for own in pieces], float(np.sqrt(whole.square))
    seen, weighed = (float(np.sqrt(np.mean(np.square(one.levels)[counts]))) for one in (known, taken))
    if sigma * _AS_SEEN >= weighed:
        return None
    return dataclasses.replace(
        known,
        sigma=sigma,
        method="residual",
        methods=_methods(known, counts),
        note=f"the response itself scatters by {number(seen)} rms, most of which the model explains",
        levels=record_levels(sigma, _beside(campaign, None, scatters), counts),
        share=1.0,
        colour=None,
    )


def _pieces(campaign: Campaign, windows: Sequence[Sequence[Float[np.ndarray, " _"]]]) -> list[list[Piece]]:
    """Gives the windows of each record; none where the noise is not to be taken from them."""
    declared = campaign.output.noise is not None or campaign.filter is not None
    if declared or any(record.floor is not None for record in campaign.records):
        return [[] for _ in windows]
    return [
        [_piece(window, record) for window in own]
        for record, own in zip(campaign.records, windows, strict=True)
    ]


def _methods(known: NoiseEstimate, counts: list[bool]) -> tuple[NoiseMethod, ...]:
    return tuple("residual" if own else method for own, method in zip(counts, known.methods, strict=True))


def _beside(
    campaign: Campaign, law: Colour | None, scatters: Sequence[Scatter | None]
) -> list[Scatter | None]:
    """Gives the scatters with those of the other records, as their outputs differ from the first ones'."""
    outputs = output_scatters(campaign, law)
    both = [
        (own.square * own.freedom, seen.square * own.freedom)
        for own, seen in zip(scatters, outputs, strict=True)
        if own and seen
    ]
    if not both:
        return list(scatters)
    scale = float(np.divide(*np.sum(both, axis=0)))
    return [
        own or (seen and seen._replace(square=scale * seen.square))
        for own, seen in zip(scatters, outputs, strict=True)
    ]


def _piece(residual: Float[np.ndarray, " time"], record: Record) -> Piece:
    """Gives a window of noise without the lines of the mains, which a model can explain."""
    lines = hum_lines(record)
    if not lines:
        return Piece(Rest(residual, np.zeros(0), np.zeros(residual.size // 2 + 1)))
    time = np.arange(residual.size) / record.rate
    columns = [harmonic_basis(time, line.frequency, 1)[:, 1:] for line in lines]
    basis = np.linalg.qr(np.concatenate(columns, axis=1))[0]
    taken = np.repeat([line.frequency for line in lines], 2)
    removed = np.sum(np.abs(np.fft.rfft(basis, axis=0)) ** 2, axis=1) / residual.size
    return Piece(Rest(residual - basis @ (basis.T @ residual), taken, removed))


def _words_of(campaign: Campaign, law: Colour, known: float) -> str:
    """Gives what a reader must know of noise that the residual shows."""
    words = words_of_colour(law, " of what a good fit leaves")
    if law.sigma <= _AS_SEEN * known:
        return words
    drives = tuple(dataclasses.replace(one, output=one.input) for one in campaign.fit_records)
    drive = estimate_noise(dataclasses.replace(campaign, records=drives))
    shows = drive.method in ("cycle_scatter", "periods")
    own = f", whose own noise is {number(drive.sigma)} rms" if shows else ""
    return (
        f"{words}; the response without the drive's harmonics shows {number(known)} rms: the rest is slower, "
        f"or comes through the drive channel{own}"
    )
