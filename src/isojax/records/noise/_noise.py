"""The noise of the output channel: the rms per sample that the residual of a perfect model would have."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal, NamedTuple

import numpy as np
from jaxtyping import Float

from ..._show import number, shown
from .._campaign import Campaign
from .._record import Record, Role
from ..spectrum import NoiseBand
from ._colour import Colour, Piece, noise_colour
from ._levels import differ, record_levels, words_of_levels
from ._repeats import repeat_groups
from ._scatter import (
    Scatter,
    cycle_scatter,
    innovation_scatter,
    period_scatter,
    settled_pieces,
)
from ._spectral_noise import high_frequency_floor, repeat_scatter

NoiseMethod = Literal["declared", "repeats", "periods", "cycle_scatter", "high_frequency", "residual"]

_BETTER: tuple[NoiseMethod, ...] = ("cycle_scatter", "periods", "repeats")
"""Methods that show the noise itself. The floor of a spectrum may be response."""

_SELECTIONS = 3
"""Times that the settled dwells are chosen anew with the colour that the last choice showed."""

_TRIMMED = 6
"""From so many records on, the pooled noise comes from the inner half: one bad record does not count."""


class _Seen(NamedTuple):
    """What one record shows of the noise.

    Attributes:
        record: The record.
        counts: Whether it may weigh the others: a held-out record may not.
        sigma: rms; NaN where it shows nothing.
        method: How it was estimated.
        scatter: Where noise alone shows, its mean square with degrees of freedom; else None.
    """

    record: Record
    counts: bool
    sigma: float
    method: NoiseMethod
    scatter: Scatter | None = None

    def shows(self, *methods: NoiseMethod) -> bool:
        """Whether it shows the noise by one of these methods."""
        return bool(np.isfinite(self.sigma)) and self.method in methods


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
        levels: rms by which each record weighs: its own where records differ significantly, else `sigma`.
        share: Noise bandwidth over half the rate, 1 for white noise: of so many of the samples the noise is
            independent. Of coloured noise it is `Colour.share`.
        colour: The law of coloured noise; None where the noise is not significantly coloured.
        excess: chi2/dof of the fit by the noise that the output shows, where the residual's is in its place:
            above 1 the drive channel or something else disturbs. 1 elsewhere.
    """

    sigma: float
    method: NoiseMethod
    per_record: tuple[float, ...]
    methods: tuple[NoiseMethod, ...]
    bandwidth_hz: float
    note: str = ""
    levels: tuple[float, ...] = ()
    share: float = 1.0
    colour: Colour | None = None
    excess: float = 1.0

    @property
    def white(self) -> float:
        """The rms of white noise with the density that this noise has inside its band: sigma / sqrt(share).

        It sets the uncertainty of a coefficient, and not the smaller rms of the filtered noise: the motion
        lies inside the band, where a filter leaves the noise as it is. Of coloured noise it is what the
        filter that weighs the samples leaves of noise of the weighing density.
        """
        return self.sigma / float(np.sqrt(self.share)) if self.colour is None else self.colour.level

    @property
    def whites(self) -> tuple[float, ...]:
        """`white` of each record, by its level."""
        return tuple(level / self.sigma * self.white for level in self.levels)

    @property
    def range_words(self) -> str:
        """How much the records differ, such as "0.003 to 0.009 by record"; "" where they do not."""
        low, high = min(self.levels, default=0.0), max(self.levels, default=0.0)
        return "" if low == high else f"{number(low)} to {number(high)} by record"

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
        return ", ".join(filter(None, (f"{known}, from {self.method.replace('_', ' ')}", self.range_words)))


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

    Where the scatter of dwells or periods differs from record to record by more than chance (Bartlett's test
    at 0.001), each record weighs with its own, else all weigh with the pooled one. Coloured noise has one
    law, and a level in each record. Held-out records change nothing of the others; such a record weighs with
    its own noise where that differs from theirs.

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
        return NoiseEstimate(declared, "declared", each, methods, band.highest, note, each, band.share)
    found = _estimate_each(records, _weighing(campaign), band)
    better: list[NoiseMethod] = [one.method for one in found if one.counts and one.shows(*_BETTER)]
    common: NoiseMethod = max(dict.fromkeys(better), key=better.count) if better else "high_frequency"
    sigma = _pool([one.sigma for one in found if one.counts and one.shows(common)])
    colour, scatters = None, [one.scatter for one in found]
    if campaign.filter is None:
        shown = [one.counts and one.shows(common) for one in found]
        colour, innovations = coloured(lambda law: _pieces(found, law), shown, sigma, band)
        scatters = innovations or scatters
    if colour is not None:
        sigma, note = colour.sigma, words_of_colour(colour)
    levels = record_levels(sigma, scatters, [one.counts for one in found])
    # All records share one channel: a spectral floor does not count where other records show the noise
    # itself.
    kept = [one.shows(common, *_BETTER) for one in found]
    return NoiseEstimate(
        sigma=sigma,
        method=common,
        per_record=tuple(one.sigma if keep else sigma for one, keep in zip(found, kept, strict=True)),
        methods=tuple(one.method if keep else common for one, keep in zip(found, kept, strict=True)),
        bandwidth_hz=band.highest,
        note="; ".join(filter(None, (note, words_of_levels(records, levels)))),
        levels=levels,
        share=band.share if colour is None else colour.share,
        colour=colour,
    )


def _pieces(found: list[_Seen], law: Colour | None) -> list[list[Piece]]:
    """Gives the windows of each record that hold noise alone, as a law shows them."""
    return [settled_pieces(one.record, one.method, law) if one.scatter else [] for one in found]


def coloured(
    pieces_of: Callable[[Colour | None], list[list[Piece]]], counts: list[bool], sigma: float, band: NoiseBand
) -> tuple[Colour | None, list[Scatter | None]]:
    """Gives the law of coloured noise, one for all records, and the scatter of each record by it.

    Args:
        pieces_of: The windows of each record that hold noise alone, as a law shows them; which windows these
            are may depend on it.
        counts: Which records set the law.
        sigma: Pooled rms.
        band: The band that the noise fills.

    Returns:
        The law, None where it is white or no record shows it; the scatters, None of a record that shows none.
    """
    law = _common_colour(pieces_of, counts, np.ones(len(counts)), band)
    if law is None:
        return None, []
    scatters = _innovations(pieces_of(law), law)
    if differ([own for own, counted in zip(scatters, counts, strict=True) if counted and own]):
        # The loudest record must not set the law.
        scales = np.array([sigma / np.sqrt(own.square) if own else 1.0 for own in scatters])
        law = _common_colour(pieces_of, counts, scales, band)
        scatters = [] if law is None else _innovations(pieces_of(law), law)
    return law, scatters


def output_scatters(campaign: Campaign, law: Colour | None) -> list[Scatter | None]:
    """Gives the scatter of each record's output, by its innovations where the noise has a law.

    Args:
        campaign: The campaign.
        law: Of its noise; None of white noise.
    """
    found = _estimate_each(campaign.records, _weighing(campaign), NoiseBand(campaign.rate, None))
    if law is None:
        return [one.scatter for one in found]
    return _innovations(_pieces(found, law), law)


def _weighing(campaign: Campaign) -> Role:
    """Gives the role of the records that set the noise."""
    return "fit" if campaign.fit_records else "holdout"


def _innovations(pieces: list[list[Piece]], law: Colour) -> list[Scatter | None]:
    """Gives the scatter of each record by that of its innovations."""
    scale = (law.sigma / law.innovation) ** 2
    found = [innovation_scatter(own, law) for own in pieces]
    return [own and own._replace(square=scale * own.square) for own in found]


def _common_colour(
    pieces_of: Callable[[Colour | None], list[list[Piece]]],
    counts: list[bool],
    scales: Float[np.ndarray, " record"],
    band: NoiseBand,
) -> Colour | None:
    """Gives the autoregressive law of the noise, each record times its scale; None where it is white, or
    where the records do not show its spectrum.
    """
    law: Colour | None = None
    for _ in range(_SELECTIONS):
        each = zip(pieces_of(law), scales, counts, strict=True)
        pieces = [piece.scaled(scale) for own, scale, counted in each if counted for piece in own]
        found = noise_colour(pieces, band.rate)
        if found is None or found == law:
            return found
        law = found
    return law


def words_of_colour(colour: Colour, source: str = "") -> str:
    """Gives what a reader must know of the colour of the noise, and of what it was seen in."""
    return (
        "the noise is coloured: its samples are correlated, and its spectrum (an autoregressive law of order "
        f"{len(colour.law)}{source}) weighs the residual; no band counts more than under white noise of that "
        "rms"
    )


def _estimate_each(records: tuple[Record, ...], weighing: Role, band: NoiseBand) -> list[_Seen]:
    """Gives what each record shows of the noise; those of one role may weigh the others."""
    partners = repeat_groups(records)
    scatters: tuple[tuple[NoiseMethod, Callable[[Record, NoiseBand], Scatter | None]], ...] = (
        ("cycle_scatter", cycle_scatter),
        ("periods", period_scatter),
    )

    def seen(record: Record) -> _Seen:
        counts = record.role == weighing
        if record.floor is None:
            for method, scatter_of in scatters:
                scatter = scatter_of(record, band)
                if scatter is not None:
                    return _Seen(record, counts, float(np.sqrt(scatter.square)), method, scatter)
            group = [
                one for one in partners[record.name] if one.kind != "stepped_sine" and one.role == weighing
            ]
            sigma = repeat_scatter(record, group, band)
            if np.isfinite(sigma):
                return _Seen(record, counts, sigma, "repeats")
        # A measured floor also causes scatter from cycle to cycle, but a model can explain that: no noise.
        return _Seen(record, counts, high_frequency_floor(record, band), "high_frequency")

    return [seen(record) for record in records]


def _pool(values: list[float]) -> float:
    """Gives the rms of the records' values, or of their inner half."""
    if not values:
        return float("nan")
    ordered = np.sort(values)
    if ordered.size >= _TRIMMED:
        ordered = ordered[ordered.size // 4 : ordered.size - ordered.size // 4]
    return float(np.sqrt(np.mean(ordered**2)))
