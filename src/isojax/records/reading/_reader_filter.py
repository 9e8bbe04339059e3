"""The reader's [filter]: a low-pass on all channels alike, or the compensation of the test rig's own."""

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Float

from .._campaign import Filter
from ..spectrum import compensate_butterworth, unsure_samples, zero_phase_butterworth
from ._record_channels import FEWEST_SAMPLES, RecordChannels

_LOST = 0.5
"""Share of the drive's peak that a record must keep between the ends that a compensation loses."""


def filter_channels(
    where: str, file: Path, entry: Mapping[str, Any], declared: Filter, channels: RecordChannels
) -> RecordChannels:
    """Gives the channels of a record after the reader's filter.

    Args:
        where: The [[record]], for errors.
        file: The campaign.toml, for errors.
        entry: The [[record]] as declared.
        declared: The filter.
        channels: The channels as measured.

    Returns:
        The channels: low-passed where `applied = false`; without the filter of the test rig, and shorter at
        either end, where `compensate = true`; else as they were.

    Raises:
        ValueError: If the filter contradicts itself or the rate, or leaves too little of the record.
    """
    if declared.cutoff_hz >= 0.5 * channels.rate:
        raise ValueError(
            f"{file}: [filter] cutoff_hz = {declared.cutoff_hz:g} must be below half the sampling rate, "
            f"{0.5 * channels.rate:g} Hz"
        )
    if declared.compensate and not declared.applied:
        raise ValueError(
            f"{file}: [filter] compensate = true removes the filter of the test rig, but applied = false "
            "says that there was none"
        )
    if declared.applied and not declared.compensate:
        return channels
    run = compensate_butterworth if declared.compensate else zero_phase_butterworth
    shape = channels.rate, declared.order, declared.cutoff_hz
    try:
        channels = replace(
            channels,
            input=run(channels.raw_input, *shape),
            output=run(channels.raw_output, *shape),
            floor=None if channels.floor is None else run(channels.floor, *shape),
        )
    except ValueError as error:
        raise ValueError(f"{where}: the [filter] cannot be computed. {error}") from error
    return _without_ends(where, entry, unsure_samples(*shape), channels) if declared.compensate else channels


def _without_ends(
    where: str, entry: Mapping[str, Any], unsure: int, channels: RecordChannels
) -> RecordChannels:
    """Gives the channels without the samples at either end that a compensation leaves unknown."""
    start, stop, settle = channels.start + unsure, channels.stop - unsure, max(0, channels.settle - unsure)
    if stop - start - settle < FEWEST_SAMPLES:
        raise ValueError(
            f"{where} is too short: of its samples {unsure} at either end are lost where [filter] "
            f"compensate = true takes a filter out, and at least {FEWEST_SAMPLES} must be left"
        )
    if entry["period"] is not None and entry["period"] > stop - start:
        raise ValueError(
            f"{where} has {stop - start} samples left, because [filter] compensate = true loses "
            f"{unsure} at either end; expected at least its period = {entry['period']}"
        )
    kept = slice(unsure, -unsure)
    if entry["kind"] != "free_decay":
        _check_not_lost(where, channels.raw_input, kept)
    return replace(
        channels,
        start=start,
        stop=stop,
        settle=settle,
        raw_input=channels.raw_input[kept],
        raw_output=channels.raw_output[kept],
        input=channels.input[kept],
        output=channels.output[kept],
        floor=None if channels.floor is None else channels.floor[kept],
    )


def _check_not_lost(where: str, drive: Float[np.ndarray, " time"], kept: slice) -> None:
    """Refuses a record whose drive acts at its ends only, such as a blow that is lost with them."""
    size = np.abs(drive - np.median(drive))
    whole, left = float(np.max(size)), float(np.max(size[kept]))
    if left < _LOST * whole:
        raise ValueError(
            f"{where}: [filter] compensate = true loses {kept.start} samples at either end, in which the "
            f"drive reaches {whole:.4g} (SI), and {left:.4g} between them; expected a record that starts "
            "earlier, or compensate = false"
        )
