"""The noise of the output channel: the rms per sample that the residual of a perfect model would have."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal

import numpy as np
import scipy
from jaxtyping import Bool, Float

from ..._show import number, shown
from .._blow import ring_down
from .._campaign import Campaign
from .._record import Dwell, Record
from ..spectrum import NoiseBand, Rest, dwell_rest, dwell_window, hum_lines, spectral_floor
from ._colour import Colour, Piece, noise_colour, whitened_square
from ._repeats import repeat_difference, repeat_groups

NoiseMethod = Literal["declared", "repeats", "periods", "cycle_scatter", "high_frequency"]
_SETTLED_QUANTILE = 0.25
"""Quantile of the dwells' scatters that is taken for noise: up to three quarters of them may be unsettled."""

_FEWEST_DWELLS = 4
"""Dwells without which the median is taken instead."""

_UNSETTLED = 1e-3
"""Chance that a settled dwell scatters so much that it is left out."""

_TRANSIENT = 1.2
"""The first period is left out where it raises the scatter of the others by this factor."""

_FLOOR_SPANS = ((0.35, 0.5), (0.5, 0.65), (0.65, 0.8), (0.8, 0.95))
"""Sections of the noise band, as shares of it, whose spectral floors are compared."""

_WHOLE_SPAN = (0.4, 0.95)
"""The section for a record that is too short for these."""

_EQUAL_FLOORS = 3.0
"""Standard errors within which two floors count as equal."""

_SELECTIONS = 3
"""Times that the settled dwells are chosen anew with the colour that the last choice showed."""

_TRIMMED = 6
"""From so many records on, the pooled noise comes from the inner half: one bad record does not count."""


@shown
@dataclass(frozen=True)
class NoiseEstimate:
    """rms noise of the output channel [its SI unit].

    Attributes:
        sigma: Pooled over the records; of the samples as the campaign holds them, filtered where it filters.
        method: How it was estimated; where records differ, the method of most of them.
        per_record: One value per record, in the campaign's order.
        methods: The method of each record.
        bandwidth_hz: Frequency up to which the noise reaches [Hz]: half the rate, or the [filter]'s cut-off.
        note: What the reader must know, or "".
        share: Noise bandwidth over half the rate, 1 for white noise: of so many of the samples the noise is
            independent. Of coloured noise it is `Colour.share`.
        colour: The law of coloured noise; None where the noise is not significantly coloured.
    """

    sigma: float
    method: NoiseMethod
    per_record: tuple[float, ...]
    methods: tuple[NoiseMethod, ...]
    bandwidth_hz: float
    note: str = ""
    share: float = 1.0
    colour: Colour | None = None

    @property
    def white(self) -> float:
        """The rms of white noise with the density that this noise has inside its band: sigma / sqrt(share).

        It sets the uncertainty of a coefficient, and not the smaller rms of the filtered noise: the motion
        lies inside the band, where a filter leaves the noise as it is. Of coloured noise it is what the
        filter that weighs the samples leaves of noise of the weighing density.
        """
        return self.sigma / float(np.sqrt(self.share)) if self.colour is None else self.colour.level

    @property
    def whitening(self) -> tuple[float, ...]:
        """The coefficients of the filter that weighs the samples of coloured noise, see `Colour`."""
        return () if self.colour is None else self.colour.whitening

    @property
    def law(self) -> tuple[float, ...]:
        """The coefficients of the law of coloured noise, see `Colour`."""
        return () if self.colour is None else self.colour.law

    def _headline(self) -> str:
        known = f"{number(self.sigma)} rms up to {number(self.bandwidth_hz)} Hz"
        return f"{known}, from {self.method.replace('_', ' ')}"


def estimate_noise(campaign: Campaign) -> NoiseEstimate:
    """Gives the output noise of a campaign.

    Per record, the first that applies: the declared one (of the column as it stands in the file); the scatter
    about the harmonics of settled dwells; the scatter between periods; the difference of repeats at equal
    level and direction, as far as the records do not explain it; the floor of the spectrum above the excited
    band. Where the building's floor was measured only the last applies, since a model can explain the scatter
    that the floor causes. Stepped sines never need the repeats: forces and stiffness that change between
    repeats move the harmonics, and not the scatter about them.

    Settled dwells and periods also show the spectrum of the noise. Where it is significantly coloured, the
    estimate holds its law and the filter that weighs the samples. Declared noise and noise behind a [filter]
    count as white inside their band; repeats and the floor of a spectrum show no colour.

    Args:
        campaign: The campaign.

    Returns:
        The estimate.
    """
    if not campaign.records:
        return _estimate(campaign)
    seen = (campaign.output.noise, campaign.filter, campaign.records)
    return campaign.records[0].once(("noise", seen), lambda: _estimate(campaign))


def _estimate(campaign: Campaign) -> NoiseEstimate:
    band, note = NoiseBand(campaign.rate, campaign.filter), ""
    if campaign.filter is not None:
        note = (
            f"the noise is band limited by the {campaign.filter.kind} filter at {band.highest:g} Hz: "
            f"its samples are correlated, and {100.0 * band.share:.2g} % of them count as independent"
        )
    records = campaign.records
    if campaign.output.noise is not None:
        declared = float(campaign.output.noise)
        declared *= float(np.sqrt(band.share / band.as_filed.share))
        methods: tuple[NoiseMethod, ...] = ("declared",) * len(records)
        each = (declared,) * len(records)
        return NoiseEstimate(declared, "declared", each, methods, band.highest, note, band.share)
    found = _estimate_each(records, band)
    seen: list[NoiseMethod] = [
        method for value, method in found if np.isfinite(value) and method != "high_frequency"
    ]
    common: NoiseMethod = max(dict.fromkeys(seen), key=seen.count) if seen else "high_frequency"
    sigma = _pool([value for value, method in found if method == common and np.isfinite(value)])
    # All records share one channel: a spectral floor does not count where other records show the noise
    # itself.
    kept = [np.isfinite(value) and method in (*seen, common) for value, method in found]
    colour = None
    if campaign.filter is None:
        chosen = [record for record, (_, method) in zip(records, found, strict=True) if method == common]
        colour = _common_colour(chosen, common, band)
    if colour is not None:
        sigma, note = colour.sigma, _words_of(colour)
    return NoiseEstimate(
        sigma=sigma,
        method=common,
        per_record=tuple(value if keep else sigma for (value, _), keep in zip(found, kept, strict=True)),
        methods=tuple(method if keep else common for (_, method), keep in zip(found, kept, strict=True)),
        bandwidth_hz=band.highest,
        note=note,
        share=band.share if colour is None else colour.share,
        colour=colour,
    )


def _common_colour(records: list[Record], method: NoiseMethod, band: NoiseBand) -> Colour | None:
    """Gives the autoregressive law of the noise that records show; None where it is white or unknown."""
    if method == "periods":
        periods = [_settled_periods(record) for record in records]
        return noise_colour(
            [
                Piece(Rest(row, np.zeros(0), np.zeros(row.size // 2 + 1)), 1.0 - 1.0 / len(rows))
                for rows in periods
                for row in rows - np.mean(rows, axis=0)
            ],
            band.rate,
        )
    if method != "cycle_scatter":
        return None
    pieces = [
        [piece for dwell in record.dwells if (piece := _dwell_piece(record, dwell))] for record in records
    ]
    colour: Colour | None = None
    # Which dwells have settled is judged by white innovations: the scatter of coloured noise itself varies
    # more, and with the frequency of the dwell.
    for _ in range(_SELECTIONS):
        settled = []
        for own in pieces:
            scatters = np.array([_piece_scatter(piece, colour) for piece in own]).reshape(-1, 2)
            if scatters.size:
                kept = _settled_level(*scatters.T)[1]
                settled += [piece for piece, keep in zip(own, kept, strict=True) if keep]
        colour = noise_colour(settled, band.rate)
        if colour is None:
            return None
    return colour


def _dwell_piece(record: Record, dwell: Dwell) -> Piece | None:
    """Gives what the end of a dwell leaves; None if it is too short."""
    window = dwell_window(record, dwell)
    if window is None:
        return None
    piece = Piece(dwell_rest(record, dwell, window, tuple(line.frequency for line in hum_lines(record))))
    return None if piece.freedom < piece.rest.taken.size else piece


def _piece_scatter(piece: Piece, colour: Colour | None) -> tuple[float, float]:
    """Gives mean square and degrees of freedom of a window's noise, or of its innovations."""
    if colour is not None:
        return whitened_square(piece, colour)
    return float(piece.rest.signal @ piece.rest.signal) / piece.freedom, piece.freedom


def _words_of(colour: Colour) -> str:
    """Gives what a reader must know of the colour of the noise."""
    return (
        "the noise is coloured: its samples are correlated, and its spectrum (an autoregressive law of order "
        f"{len(colour.law)}) weighs the residual; no band counts more than under white noise of that rms"
    )


def _estimate_each(records: tuple[Record, ...], band: NoiseBand) -> list[tuple[float, NoiseMethod]]:
    partners = repeat_groups(records)
    found = []
    for record in records:
        group = [one for one in partners.get(record.name, ()) if one.kind != "stepped_sine"]
        tries: list[tuple[NoiseMethod, Callable[[], float]]] = [
            ("cycle_scatter", lambda record=record: cycle_scatter(record, band)),
            ("periods", lambda record=record: period_scatter(record)),
            ("repeats", lambda record=record, group=group: _repeat_scatter(record, group, band)),
        ]
        if record.floor is not None:
            # A measured floor also causes scatter from cycle to cycle, but a model can explain that: no
            # noise.
            tries = []
        for method, estimate in tries:
            value = estimate()
            if np.isfinite(value):
                found.append((value, method))
                break
        else:
            found.append((high_frequency_floor(record, band), "high_frequency"))
    return found


def cycle_scatter(record: Record, band: NoiseBand) -> float:
    """Gives the rms about the harmonics of the last quarter of each dwell, at least four cycles; NaN if none
    is long.

    Up to 120 harmonics below 0.45 of the rate are removed, also beyond a filter's cut-off, where they can
    exceed the noise; the fundamental may drift linearly. Significant lines of the mains are removed as well:
    a model can explain them. Dwells that never settle, near a fold or in modulation, are left out: those
    whose scatter exceeds the level of the lower quartile by more than chance (1e-3, chi-square) allows.

    Args:
        record: The record.
        band: The band that the noise fills.

    Returns:
        rms per sample in the output's unit.
    """
    found = [dwell_scatter(record, dwell, band) for dwell in record.dwells]
    scatters = np.array([one for one in found if one is not None]).reshape(-1, 2)
    if not scatters.size:
        return float("nan")
    return float(np.sqrt(_settled_level(*scatters.T)[0]))


def _settled_level(
    squares: Float[np.ndarray, " dwell"], freedom: Float[np.ndarray, " dwell"]
) -> tuple[float, Bool[np.ndarray, " dwell"]]:
    """Gives the mean square of the dwells that have settled, and which ones have."""
    quantile = _SETTLED_QUANTILE if squares.size >= _FEWEST_DWELLS else 0.5
    level = np.quantile(squares * freedom / scipy.stats.chi2.ppf(quantile, freedom), quantile)
    limit = scipy.stats.chi2.isf(_UNSETTLED, freedom)
    for _ in range(3):
        settled = squares * freedom <= level * limit
        level = np.average(squares[settled], weights=freedom[settled]) if np.any(settled) else level
    return float(level), squares * freedom <= level * limit


def dwell_scatter(record: Record, dwell: Dwell, band: NoiseBand) -> tuple[float, float] | None:
    """Gives mean square about the harmonics of a dwell's end and its degrees of freedom; None if it is too
    short.
    """
    window = dwell_window(record, dwell)
    if window is None:
        return None
    lines = tuple(line.frequency for line in hum_lines(record))
    rest, frequencies, _ = dwell_rest(record, dwell, window, lines)
    taken = float(np.sum(band.power_gain(frequencies)))
    # Noise of a narrow band has fewer degrees of freedom than samples, and the harmonics use some of them.
    freedom = window * band.share - taken
    if freedom < taken:
        return None
    return float(rest @ rest) * band.share / freedom, float(freedom)


def period_scatter(record: Record) -> float:
    """Gives the rms of what does not repeat from period to period; NaN without two periods.

    Only whole periods after the settle samples count. With three and more the first ones are left out as long
    as they scatter clearly more than the others (a transient).
    """
    periods = _settled_periods(record)
    return float(np.sqrt(_variance_of_periods(periods))) if len(periods) else float("nan")


def _settled_periods(record: Record) -> Float[np.ndarray, "period time"]:
    """Gives the periods that count; none without two."""
    periods = record.periods
    if len(periods) < 2:
        return periods[:0]
    squares = [_variance_of_periods(periods[first:]) for first in range(max(1, len(periods) - 1))]
    chosen = len(squares) - 1
    for first in range(len(squares) - 1, -1, -1):
        chosen = first if squares[first] < _TRANSIENT * squares[chosen] else chosen
    return periods[chosen:]


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


def _rms_of_density(density: float, band: NoiseBand) -> float:
    """Gives the rms per sample of noise whose white density [per Hz] is known."""
    return float(np.sqrt(density * band.share * 0.5 * band.rate))


def _variance_of_periods(periods: Float[np.ndarray, "period time"]) -> float:
    rest = periods - np.mean(periods, axis=0)
    return float(np.mean(rest**2)) * periods.shape[0] / (periods.shape[0] - 1)


def _repeat_scatter(record: Record, group: list[Record], band: NoiseBand) -> float:
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


def _pool(values: list[float]) -> float:
    """Gives the rms of the records' values, or of their inner half."""
    if not values:
        return float("nan")
    ordered = np.sort(values)
    if ordered.size >= _TRIMMED:
        ordered = ordered[ordered.size // 4 : ordered.size - ordered.size // 4]
    return float(np.sqrt(np.mean(ordered**2)))
