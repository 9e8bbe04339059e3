"""The state of one channel: range, rms, clipping, missing samples, drift, noise floor, spikes."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from ..._show import shown
from .._spikes import find_spikes
from ..noise import clipped_share
from ..spectrum import NoiseBand, spectral_floor

_ENDS = 4
"""The drift is that between the first and the last of so many parts."""

_FLOOR = (0.4, 0.95)
"""Section of the band, as shares of half the rate, whose median density is taken for the noise floor."""


@shown
@dataclass(frozen=True, eq=False)
class ChannelInspection:
    """One channel of a file, in the file's own unit.

    Attributes:
        name: As a campaign.toml names the column.
        unit: Unit that the file states, or None.
        quantity: What it seems to measure: "force", "acceleration", "velocity", "displacement", "command", or
            None.
        samples: Its values, (time,).
        low: Smallest value.
        high: Largest value.
        mean: Mean.
        rms: Root mean square about the mean.
        missing: Samples that are not finite; all else is of the others.
        clipped: Share of the samples that stand at an end of the range because the channel clips [1].
        drift: Mean of the last quarter less that of the first, weighted so that a sine has none, over the
            rms [1].
        noise: rms of white noise with the density of the spectrum's floor.
        spikes: Single samples that their neighbours do not explain.
    """

    name: str
    unit: str | None
    quantity: str | None
    samples: Float[np.ndarray, " time"]
    low: float
    high: float
    mean: float
    rms: float
    missing: int
    clipped: float
    drift: float
    noise: float
    spikes: int


def inspect_channel(
    name: str, unit: str | None, quantity: str | None, samples: Float[np.ndarray, " time"]
) -> ChannelInspection:
    """Gives the state of a channel.

    Args:
        name: Its name.
        unit: Its unit, or None.
        quantity: What it measures, or None.
        samples: Its values, (time,).

    Returns:
        The state; NaN where no sample is finite.
    """
    finite = samples[np.isfinite(samples)]
    missing = samples.size - finite.size
    if finite.size < 2:
        nan = float("nan")
        return ChannelInspection(name, unit, quantity, samples, nan, nan, nan, nan, missing, 0.0, 0.0, nan, 0)
    rms = float(np.std(finite))
    quarter = finite.size // _ENDS
    weight = np.blackman(quarter + 2)[1:-1] if quarter else np.ones(0)
    moved = float((finite[-quarter:] - finite[:quarter]) @ weight / np.sum(weight)) if quarter else 0.0
    return ChannelInspection(
        name,
        unit,
        quantity,
        samples,
        float(np.min(finite)),
        float(np.max(finite)),
        float(np.mean(finite)),
        rms,
        missing,
        clipped_share(finite),
        moved / rms if rms > 0.0 else 0.0,
        _noise_floor(finite) if rms > 0.0 else 0.0,
        int(find_spikes(finite)[0].size),
    )


def _noise_floor(samples: Float[np.ndarray, " time"]) -> float:
    band = NoiseBand(1.0)
    density = spectral_floor(samples, band, (0.5 * _FLOOR[0], 0.5 * _FLOOR[1]))[0]
    return float(np.sqrt(0.5 * density))
