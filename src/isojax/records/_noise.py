"""The noise of the output channel: the rms per sample that the residual of a perfect model would have."""

import functools
from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal

import numpy as np
import scipy.stats
from jaxtyping import Float

from ._band import spectral_floor
from ._campaign import Campaign
from ._harmonics import harmonic_basis
from ._record import Dwell, Record
from ._repeats import repeat_difference, repeat_groups

NoiseMethod = Literal["declared", "repeats", "periods", "cycle_scatter", "high_frequency"]
_MOST_HARMONICS = 40
_QUANTILE = 0.25


@dataclass(frozen=True)
class NoiseEstimate:
    """rms noise of the output channel [its SI unit].

    Attributes:
        sigma: Pooled over the records.
        method: How it was found; where records differ, the method of most of them.
        per_record: One value per record, in the campaign's order.
        methods: The method of each record.
        bandwidth_hz: Frequency up to which the noise reaches [Hz]: half the rate, or the [filter]'s cut-off.
        note: What to keep in mind, or "".
    """

    sigma: float
    method: NoiseMethod
    per_record: tuple[float, ...]
    methods: tuple[NoiseMethod, ...]
    bandwidth_hz: float
    note: str = ""


def estimate_noise(campaign: Campaign) -> NoiseEstimate:
    """Gives the output noise of a campaign.

    Per record, the first that applies: the declared one; the scatter about the harmonics of settled dwells;
        the
    scatter between periods; the difference of repeats at equal level and direction, where it is not explained
    by the records themselves; the floor of the spectrum above the excited band. Forces and stiffness that
    change from repeat to repeat move harmonics, not the scatter about them, so stepped sines never need the
    repeats.

    Args:
        campaign: The campaign.

    Returns:
        The estimate.
    """
    nyquist = 0.5 * campaign.rate
    bandwidth, note = nyquist, ""
    if campaign.filter is not None:
        bandwidth = min(campaign.filter.cutoff_hz, nyquist)
        note = (
            f"the noise is band limited by the {campaign.filter.kind} filter at {bandwidth:g} Hz: "
            "its samples are correlated"
        )
    records = campaign.records
    if campaign.output.noise is not None:
        declared = float(campaign.output.noise)
        methods: tuple[NoiseMethod, ...] = ("declared",) * len(records)
        return NoiseEstimate(declared, "declared", (declared,) * len(records), methods, bandwidth, note)
    found = _estimate_each(records, bandwidth)
    seen: list[NoiseMethod] = [
        method for value, method in found if np.isfinite(value) and method != "high_frequency"
    ]
    common: NoiseMethod = max(dict.fromkeys(seen), key=seen.count) if seen else "high_frequency"
    sigma = _pool([value for value, method in found if method == common and np.isfinite(value)])
    # it is one channel: a floor is a makeshift where other records show the noise itself
    kept = [np.isfinite(value) and method in (*seen, common) for value, method in found]
    return NoiseEstimate(
        sigma=sigma,
        method=common,
        per_record=tuple(value if keep else sigma for (value, _), keep in zip(found, kept, strict=True)),
        methods=tuple(method if keep else common for (_, method), keep in zip(found, kept, strict=True)),
        bandwidth_hz=bandwidth,
        note=note,
    )


def _estimate_each(records: tuple[Record, ...], bandwidth: float) -> list[tuple[float, NoiseMethod]]:
    partners = repeat_groups(records)
    found = []
    for record in records:
        group = [one for one in partners.get(record.name, ()) if one.kind != "stepped_sine"]
        tries: list[tuple[NoiseMethod, Callable[[], float]]] = [
            ("cycle_scatter", lambda record=record: cycle_scatter(record, bandwidth)),
            ("periods", lambda record=record: period_scatter(record)),
            ("repeats", lambda record=record, group=group: _repeat_scatter(record, group, bandwidth)),
        ]
        for method, estimate in tries:
            value = estimate()
            if np.isfinite(value):
                found.append((value, method))
                break
        else:
            found.append((high_frequency_floor(record, bandwidth), "high_frequency"))
    return found


def cycle_scatter(record: Record, bandwidth: float) -> float:
    """Gives the rms about the harmonics of the last quarter of each dwell, at least four cycles; NaN if none
    is long.

    As many harmonics are taken as the band holds, up to 40, and the fundamental may drift linearly. Over the
    dwells the lower quartile of the mean squares counts, corrected to their mean by chi-square: dwells that
    never settle, near a fold or in modulation, do not raise it.

    Args:
        record: The record.
        bandwidth: Highest frequency of the noise [Hz].

    Returns:
        rms per sample in the output's unit.
    """
    scatters = [
        one for dwell in record.dwells if (one := dwell_scatter(record, dwell, bandwidth)) is not None
    ]
    if not scatters:
        return float("nan")
    squares = [square for square, _ in scatters]
    freedom = float(np.median([freedom for _, freedom in scatters]))
    quantile = _QUANTILE if len(squares) >= 4 else 0.5
    corrected = np.quantile(squares, quantile) * freedom / scipy.stats.chi2.ppf(quantile, freedom)
    return float(np.sqrt(corrected))


def dwell_scatter(record: Record, dwell: Dwell, bandwidth: float) -> tuple[float, float] | None:
    """Gives mean square about the harmonics of a dwell's end and its degrees of freedom; None if it is too
    short.
    """
    cycle = record.rate / dwell.frequency
    window = round(max(dwell.cycles / 4.0, 4.0) * cycle)
    if window > 0.7 * (dwell.stop - dwell.start):
        return None
    signal = record.output[dwell.stop - window : dwell.stop]
    highest = 0.9 * min(0.5 * record.rate, bandwidth)
    orders = min(_MOST_HARMONICS, int(highest / dwell.frequency), max(1, window // 8))
    design, inverse = _drifting_harmonics(window, record.rate, dwell.frequency, orders)
    # noise of a narrow band has fewer degrees of freedom than samples; the harmonics take theirs from them
    share = bandwidth / (0.5 * record.rate)
    freedom = window * share - design.shape[1]
    if freedom < design.shape[1]:
        return None
    rest = signal - design @ (inverse @ (design.T @ signal))
    return float(rest @ rest) * share / freedom, float(freedom)


@functools.lru_cache(maxsize=64)
def _drifting_harmonics(
    window: int, rate: float, frequency: float, orders: int
) -> tuple[Float[np.ndarray, "time column"], Float[np.ndarray, "column column"]]:
    """Gives harmonics whose fundamental drifts linearly, and the inverse of their products.

    The records of a campaign dwell at the same frequencies: all but the first find both ready.
    """
    time = (np.arange(window) - 0.5 * (window - 1)) / rate
    basis = harmonic_basis(time, frequency, orders)
    slope = (time / time[-1])[:, None]
    design = np.concatenate([basis, slope * basis[:, :3]], axis=1)
    return design, np.linalg.inv(design.T @ design)


def period_scatter(record: Record) -> float:
    """Gives the rms of what does not repeat from period to period after the settle samples; NaN without two
    periods.

    Only whole periods count, taken from the end. With three and more the first ones are left out as long as
    they scatter clearly more than the rest (a transient).
    """
    if record.period is None:
        return float("nan")
    count = (record.output.size - record.settle) // record.period
    if count < 2:
        return float("nan")
    periods = record.output[record.output.size - count * record.period :].reshape(count, record.period)
    squares = [_between(periods[first:]) for first in range(max(1, count - 1))]
    chosen = squares[-1]
    for square in reversed(squares):
        chosen = square if square < 1.2 * chosen else chosen
    return float(np.sqrt(chosen))


def high_frequency_floor(record: Record, bandwidth: float) -> float:
    """Gives the rms of white noise up to `bandwidth` that has the density of the spectrum's quietest upper
    part.
    """
    floors = [
        spectral_floor(record.output, record.rate, low * bandwidth, (low + 0.15) * bandwidth)
        for low in (0.35, 0.5, 0.65, 0.8)
    ]
    known = [one for one in floors if np.isfinite(one)]
    if not known:  # a short record has too few lines for narrow bands
        known = [spectral_floor(record.output, record.rate, 0.4 * bandwidth, 0.95 * bandwidth)]
    return float(np.sqrt(min(known) * bandwidth))


def _between(periods: Float[np.ndarray, "period time"]) -> float:
    rest = periods - np.mean(periods, axis=0)
    return float(np.mean(rest**2)) * periods.shape[0] / (periods.shape[0] - 1)


def _repeat_scatter(record: Record, group: list[Record], bandwidth: float) -> float:
    """Gives the rms noise of a record from the unexplained difference to its repeats; NaN without any."""
    squares = []
    for other in group:
        difference = repeat_difference(record, other)
        if difference is not None:
            squares.append(0.5 * high_density(difference, record.rate, bandwidth) * bandwidth)
    known = [one for one in squares if np.isfinite(one)]
    return float(np.sqrt(np.mean(known))) if known else float("nan")


def high_density(difference: Float[np.ndarray, " time"], rate: float, bandwidth: float) -> float:
    """Gives the median power density of a difference of repeats: lines that a drift still moves are the
    minority.
    """
    return spectral_floor(difference, rate, 0.0, 0.95 * bandwidth)


def _pool(values: list[float]) -> float:
    """Gives the rms of the records' values; above five records, of the inner half: one bad record does not
    count.
    """
    if not values:
        return float("nan")
    ordered = np.sort(values)
    if ordered.size >= 6:
        ordered = ordered[ordered.size // 4 : ordered.size - ordered.size // 4]
    return float(np.sqrt(np.mean(ordered**2)))
