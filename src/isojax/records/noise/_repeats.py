"""Records that repeat each other at equal level, direction and conditions; their unexplained difference."""

from collections.abc import Sequence

import numpy as np
import scipy
from jaxtyping import Float

from .._record import Record

_REACH = 6
"""Samples before and after an instant that the filters of the inputs use."""

_SAME_INPUT = 0.9
"""Correlation of two inputs below which their records do not repeat each other."""


def repeat_groups(records: Sequence[Record]) -> dict[str, tuple[Record, ...]]:
    """Gives for each record, by name, the others at its level, direction and conditions: its repeats."""
    return {
        one.name: tuple(
            other
            for other in records
            if other is not one and one.level is not None and _test(other) == _test(one)
        )
        for one in records
    }


def _test(record: Record) -> tuple[object, ...]:
    """Gives what two records have in common that repeat each other."""
    return record.level, record.direction, record.kind, record.conditions


def repeat_difference(one: Record, other: Record) -> Float[np.ndarray, " time"] | None:
    """Gives output(one) - output(other), aligned by the inputs, less what the inputs and a drift explain.

    Least squares removes the difference of the inputs and the input itself, each through a short filter, and
    a change of gain. The output is used without a filter, since a filter could reproduce its own noise.

    Args:
        one: A record.
        other: A repeat of it.

    Returns:
        The residual (time,), or None where the correlation of the inputs is below 0.9.
    """
    size = min(one.input.size, other.input.size)
    a, b = one.input[:size] - np.mean(one.input[:size]), other.input[:size] - np.mean(other.input[:size])
    scale = float(np.sqrt((a @ a) * (b @ b)))
    if scale == 0.0:
        return None
    lags = scipy.signal.correlate(a, b, mode="full", method="fft")
    lag = int(np.argmax(lags)) - (size - 1)
    if lags[lag + size - 1] < _SAME_INPUT * scale:
        return None
    first, second = slice(max(lag, 0), size + min(lag, 0)), slice(max(-lag, 0), size + min(-lag, 0))
    drive, response = one.input[first] - other.input[second], one.output[first] - other.output[second]
    columns = [np.ones_like(response), other.output[second]]
    for signal in (drive, other.input[second]):
        spread = float(np.std(signal))
        if spread > 0.0:
            columns += [np.roll(signal / spread, shift) for shift in range(-_REACH, _REACH + 1)]
    design = np.stack(columns, axis=1)[_REACH:-_REACH]
    inner = response[_REACH:-_REACH]
    return inner - design @ np.linalg.lstsq(design, inner, rcond=1e-10)[0]
