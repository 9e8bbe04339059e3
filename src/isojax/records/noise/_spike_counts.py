"""How many spikes the channels of a campaign have, and how large they are."""

from dataclasses import dataclass
from typing import Literal

import numpy as np

from ..._show import shown
from .._campaign import Campaign
from .._record import Record
from .._spikes import find_spikes


@shown
@dataclass(frozen=True)
class Spikes:
    """Spikes of one channel of a record.

    Attributes:
        record: Name of the record.
        channel: "input" or "output".
        count: Number of spikes.
        share: Of all samples [1].
        rms_share: rms of the spikes alone over the rms of the channel about its mean [1].
    """

    record: str
    channel: Literal["input", "output"]
    count: int
    share: float
    rms_share: float


def spikes(campaign: Campaign) -> tuple[Spikes, ...]:
    """Gives the channels of records in which single samples stand alone, in the files as they were read.

    A blow is brief by its nature, and a drive that is held may jump for one sample: such inputs, and records
    of blows, are passed over.

    Args:
        campaign: The campaign.

    Returns:
        One entry a channel with spikes, in the campaign's order.
    """
    held = campaign.input.hold == "zero_order"
    found = (
        entry
        for record in campaign.records
        if record.kind != "impulse"
        for entry in (None if held else _of_channel(record, "input"), _of_channel(record, "output"))
    )
    return tuple(entry for entry in found if entry is not None)


def _of_channel(record: Record, channel: Literal["input", "output"]) -> Spikes | None:
    signal = record.raw_input if channel == "input" else record.raw_output
    places, sizes = find_spikes(signal)
    if not places.size:
        return None
    rms_share = float(np.sqrt(np.sum(sizes**2) / np.sum((signal - np.mean(signal)) ** 2)))
    return Spikes(record.name, channel, places.size, places.size / signal.size, rms_share)
