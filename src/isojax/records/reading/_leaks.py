"""Held-out records that are also fitted, under another name, at other samples or with other digits."""

from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np
import scipy
from jaxtyping import Float

from .._record import Record

_SHARED = 0.5
"""Share of the shorter record that both must cover."""

_OTHER_DIGITS = 1.5
"""Rounding errors, by rms, within which samples are one number with other digits ..."""

_SAME_DIGITS = 0.1
"""... and with as many digits: both then come from one number, and are one."""

_DIGITS_ALIKE = 2.0
"""Ratio of rounding errors up to which both are written with as many digits."""

_SINGLE_PRECISION = 1e-6
"""Difference over the rms of a record up to which it is the other, as in single precision."""


class _Prepared(NamedTuple):
    """The counted output of a record about its mean, and running sums of it and of its square."""

    number: int
    record: Record
    output: Float[np.ndarray, " time"]
    rounding: float
    sums: Float[np.ndarray, "2 place"]


def refuse_leaks(file: Path, records: Sequence[Record], rounding: Sequence[float]) -> None:
    """Refuses a held-out record that is the measurement of a fitted one: no later answer could be trusted.

    Each pair is aligned where the outputs correlate best, over at least half of the shorter record. It is
    one measurement if, scale and mean apart, they differ there by no more than their digits leave, so that
    the noise is the same as well. Repeats under one drive differ by their noise.

    Args:
        file: The campaign.toml, for the error.
        records: As read.
        rounding: rms error that the digits of the output of each leave, in SI.

    Raises:
        ValueError: At the first such pair: which, and from which sample to which.
    """
    if len({record.role for record in records}) < 2:
        return
    rounded = zip(records, rounding, strict=True)
    prepared = [_prepare(number, *one) for number, one in enumerate(rounded, start=1)]
    for held in (one for one in prepared if one.record.role == "holdout"):
        for fitted in (one for one in prepared if one.record.role == "fit"):
            _refuse_leak(file, held, fitted)


def _prepare(number: int, record: Record, rounding: float) -> _Prepared:
    # Settle samples of a held-out record only set its state.
    output = record.raw_output[record.settle if record.role == "holdout" else 0 :]
    output = output - np.mean(output)
    sums = np.cumsum([np.append(0.0, output), np.append(0.0, output**2)], axis=1)
    return _Prepared(number, record, output, rounding, sums)


def _best_lag(held: _Prepared, fitted: _Prepared) -> int:
    """Gives how many samples later the held-out output stands in the fitted one, by Pearson's correlation."""
    shortest = int(np.ceil(_SHARED * min(held.output.size, fitted.output.size)))
    lags = np.arange(shortest - held.output.size, fitted.output.size - shortest + 1)
    products = scipy.signal.oaconvolve(fitted.output, held.output[::-1])[lags + held.output.size - 1]
    low, high = np.maximum(0, -lags), np.minimum(held.output.size, fitted.output.size - lags)
    (one, one_square), (other, other_square) = (
        sums[:, high + shift] - sums[:, low + shift] for sums, shift in ((held.sums, 0), (fitted.sums, lags))
    )
    count = high - low
    power = (one_square - one**2 / count) * (other_square - other**2 / count)
    least = np.finfo(float).eps * held.sums[1, -1] * fitted.sums[1, -1]
    correlation = np.abs(products - one * other / count) / np.sqrt(np.maximum(power, least))
    return int(lags[np.argmax(correlation)])


def _refuse_leak(file: Path, held: _Prepared, fitted: _Prepared) -> None:
    lag = _best_lag(held, fitted)
    low, high = max(0, -lag), min(held.output.size, fitted.output.size - lag)
    one, other = held.output[low:high], fitted.output[low + lag : high + lag]
    one, other = one - np.mean(one), other - np.mean(other)
    size = float(np.sqrt(np.mean(one**2)))
    power = float(other @ other)
    if size == 0.0 or power == 0.0:
        return
    scale = float(one @ other) / power
    left = float(np.sqrt(np.mean((one - scale * other) ** 2)))
    errors = held.rounding, abs(scale) * fitted.rounding
    same = max(errors) <= _DIGITS_ALIKE * min(errors)
    if left > max(
        _SINGLE_PRECISION * size, (_SAME_DIGITS if same else _OTHER_DIGITS) * float(np.hypot(*errors))
    ):
        return
    first = held.record.start + held.record.raw_output.size - held.output.size + low
    begin = fitted.record.start + low + lag
    span = f"{first}:{first + high - low} of {held.record.file}"
    its_span = f"{begin}:{begin + high - low} of {fitted.record.file}"
    raise ValueError(
        f"{file}: [[record]] number {held.number}, held out, is the measurement of number {fitted.number}, "
        f"which is fitted: samples {span} and {its_span} differ by {100.0 * left / size:.2g} % of their rms, "
        "noise included; held-out samples must not be used to fit"
    )
