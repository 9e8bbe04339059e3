"""A drive known at samples, and how it runs between them."""

from typing import ClassVar, Literal, cast, get_args

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float
from scipy.fft import next_fast_len
from scipy.interpolate import CubicHermiteSpline

from .._types import Lanes
from ._excitation import AbstractExcitation

Hold = Literal["band_limited", "linear", "zero_order"]
"""As in `isojax.records`, which stands beside this room: neither imports the other."""

_JUST_INSIDE = 1e-9
"""Distance from the ends of a sample, as a share of it, at which they are read: a jump there lies outside."""

_GRID_A_SAMPLE = 8
"""Points a sample of the grid between which a drive is a cubic where its delay grows."""

_CONTINUATION = 256
"""Samples of continuation on either side of a record that is interpolated by its spectrum."""


def tabulate(
    values: Float[np.ndarray, " time"],
    rate: float,
    hold: Hold,
    substeps: int,
    shift: float = 0.0,
    skew: float = 0.0,
) -> tuple[Float[np.ndarray, "time stage"], Float[np.ndarray, "time stage"]]:
    """Give a sampled drive and its derivative at the stages of the integration steps.

    "band_limited": the drive holds no power above half the rate (an anti-aliased recording). The record is
    continued oddly about its ends, freed of the line through them and interpolated by zero-padding of
    the spectrum. A record that bends at its end pays `0.036 |F''| / rate^2` in the drive and
    `0.25 |F''| / rate` in its derivative in the last interval, and a hundredth of that ten samples in.

    "linear": straight between samples.

    "zero_order": constant until the next sample (a plain converter output).

    Args:
        values: the samples, at least four.
        rate: samples a second [Hz].
        hold: how the drive runs between samples.
        substeps: integration steps a sample.
        shift: time by which the drive is delayed at the first sample [s]. Beyond either end of the record a
            band-limited drive keeps its odd continuation, any other the nearest sample.
        skew: rate at which this delay grows [1]. A band-limited drive is then a cubic between the points of
            a grid eight times as fine as the samples, whose slopes it has.

    Returns:
        Values and time derivatives; stage runs over `2 substeps + 1` equidistant times from one sample to
        the next. Where the drive jumps or bends at an end of that interval, its limit from inside counts.
        The derivative of a zero-order hold is zero: its jumps are not in it.

    Raises:
        ValueError: if `values` has fewer than 4 samples or one is not finite, `rate` or `substeps` is not
            positive, or `hold` is none of the three.
    """
    values = np.asarray(values, dtype=float)
    if values.ndim != 1 or values.size < 4:
        raise ValueError(f"Argument `values` must be at least 4 samples, but has shape {values.shape}.")
    if not np.all(np.isfinite(values)):
        where = int(np.flatnonzero(~np.isfinite(values))[0])
        raise ValueError(f"Argument `values` must be finite, but values[{where}] = {values[where]}.")
    if hold not in get_args(Hold):
        raise ValueError(f"Argument `hold` must be one of {get_args(Hold)}, but is {hold!r}.")
    for name, number in (("rate", rate), ("substeps", substeps)):
        if not number > 0:
            raise ValueError(f"Argument `{name}` must be positive, but is {number}.")
    parts = 2 * substeps
    number = np.arange(values.size)[:, None]
    late = shift * rate + skew * (number + np.arange(parts + 1) / parts)
    if hold == "band_limited" and skew != 0.0:
        reach = int(np.ceil(np.max(np.abs(late)))) + 1
        fine, slope = _band_limited(values, rate, _GRID_A_SAMPLE, 0.0, reach)
        grid = np.arange(fine.size) / _GRID_A_SAMPLE - reach
        curve = CubicHermiteSpline(grid, fine, slope / rate)
        place = number + (np.arange(parts + 1) / parts - late)
        return curve(place), curve(place, 1) * rate
    if hold == "band_limited":
        fine, slope = _band_limited(values, rate, parts, shift)
        windows = np.lib.stride_tricks.sliding_window_view
        return windows(fine, parts + 1)[::parts].copy(), windows(slope, parts + 1)[::parts].copy()
    stages = np.arange(parts + 1) / parts
    stages[[0, -1]] += _JUST_INSIDE, -_JUST_INSIDE
    # Sample and share of the sample, kept apart until the shift is known: a long record rounds the sum.
    position = number + (stages - late)
    last = values.size - 1
    if hold == "zero_order":
        held = values[np.clip(np.floor(position).astype(int), 0, last)]
        return held, np.zeros_like(held)
    place = np.clip(np.floor(position).astype(int), 0, last - 1)
    within = (position > 0) & (position < last)
    slope = np.where(within, (values[place + 1] - values[place]) * rate, 0.0)
    exact = number + (np.arange(parts + 1) / parts - late)
    return np.interp(exact, np.arange(values.size), values), slope


def _band_limited(
    values: Float[np.ndarray, " time"], rate: float, parts: int, shift: float, reach: int = 0
) -> tuple[Float[np.ndarray, " fine"], Float[np.ndarray, " fine"]]:
    """Interpolate by zero-padding the spectrum of the oddly continued record, and `reach` samples beyond."""
    count = values.size
    margin = min(count - 1, _CONTINUATION + reach + int(abs(shift) * rate))
    reach = min(reach, margin)
    length = cast(int, next_fast_len(count + 2 * margin, real=True))
    after = min(length - count - margin, count - 1)
    head = 2.0 * values[0] - values[margin:0:-1]
    tail = 2.0 * values[-1] - values[-2 : -2 - after : -1]
    extended = np.concatenate([head, values, tail])
    length = extended.size
    slope = (extended[-1] - extended[0]) / (length - 1)
    flat = extended - extended[0] - slope * np.arange(length)
    # Faded to zero outside the record: a kink where the period closes would ring far into it.
    fade = min(margin, after, _CONTINUATION)
    ramp = np.sin(0.5 * np.pi * (np.arange(fade) + 0.5) / fade) ** 2
    flat[:fade] *= ramp
    flat[length - fade :] *= ramp[::-1]
    spectrum = np.fft.rfft(flat)
    if length % 2 == 0:
        spectrum[-1] *= 0.5
    cycles = np.arange(spectrum.size) / length
    turned = spectrum * np.exp(-2j * np.pi * cycles * shift * rate)
    fine = np.fft.irfft(turned, length * parts) * parts
    rates = np.fft.irfft(turned * 2j * np.pi * cycles, length * parts) * parts
    window = slice((margin - reach) * parts, (margin + count + reach) * parts + 1)
    line = extended[0] + slope * (np.arange(length * parts)[window] / parts - shift * rate)
    return fine[window] + line, (rates[window] + slope) * rate


class Sampled(AbstractExcitation):
    """A recorded drive.

    Attributes:
        values: the samples [N, or m/s^2 for base excitation], from t = 0.
        sampling_rate: samples a second [Hz].
        hold: how it runs between samples.
        fine: the drive on a grid `PARTS` times as fine as the samples; computed from them.
        slopes: its time derivative on that grid.
    """

    values: Float[Array, " time"]
    sampling_rate: float = eqx.field(static=True)
    hold: Hold = eqx.field(static=True)
    fine: Float[Array, " fine"]
    slopes: Float[Array, " fine"]

    PARTS: ClassVar[int] = 8

    def __init__(self, values: Float[np.ndarray, " time"], sampling_rate: float, hold: Hold = "band_limited"):
        """Tabulate the record once, eight times as fine as its samples.

        Args:
            values: the samples.
            sampling_rate: samples a second [Hz].
            hold: how the drive runs between samples.

        Raises:
            ValueError: if there are fewer than 4 samples or one is not finite, `sampling_rate` is not
                positive, or `hold` is none of the three.
        """
        table, slopes = tabulate(values, sampling_rate, hold, self.PARTS // 2)
        self.values = jnp.asarray(values, dtype=float)
        self.sampling_rate = float(sampling_rate)
        self.hold = hold
        self.fine = jnp.asarray(table[:, :-1].ravel())
        self.slopes = jnp.asarray(slopes[:, :-1].ravel())

    def __call__(self, t: Lanes) -> Lanes:
        """See `AbstractExcitation.__call__`; before and after the record it keeps the nearest sample."""
        if self.hold == "zero_order":
            # Two units in the last place put a time k / rate into its own sample; RK4 looks further inside.
            place = jnp.floor(jnp.asarray(t) * self.sampling_rate * (1.0 + 2.0**-51)).astype(int)
            return self.values[jnp.clip(place, 0, self.values.size - 1)]
        position = jnp.clip(jnp.asarray(t) * self.sampling_rate * self.PARTS, 0.0, self.fine.size - 1.0)
        place = jnp.clip(jnp.floor(position).astype(int), 0, self.fine.size - 2)
        share = position - place
        if self.hold == "linear":
            return self.fine[place] + share * (self.fine[place + 1] - self.fine[place])
        # Cubic Hermite on the fine table: exact slopes make its error fourth order in an already fine step.
        step = 1.0 / (self.sampling_rate * self.PARTS)
        left, right = self.fine[place], self.fine[place + 1]
        slope_left, slope_right = step * self.slopes[place], step * self.slopes[place + 1]
        return (
            left * (1.0 + 2.0 * share) * (1.0 - share) ** 2
            + right * share**2 * (3.0 - 2.0 * share)
            + slope_left * share * (1.0 - share) ** 2
            - slope_right * share**2 * (1.0 - share)
        )
