"""Channels whose tops are cut off at one level."""

import numpy as np
from jaxtyping import Float

from .._campaign import Campaign
from ..noise import clipped_share
from ._suspicion import Cause, Suspicion

_TOP = 0.9
_FLANK = 0.5
"""Shares of a top over which the time spent is compared: of that above a half, a sine spends 43 % above nine
tenths, a parabola 45 %, a sine cut at 1/1.1 of its top 56 %, at 1/1.3 70 %."""

_FLAT = 0.6
"""That share from which tops are flat. An asymmetric spring flattens those of one side to 0.55."""

_SPREAD = 0.05
"""Relative distance from the level within which a top lies at it."""

_FEWEST_TOPS = 12
"""Tops at one level without which nothing is said."""

_COMMON = 0.03
"""And their smallest share of all half cycles."""

_FEWEST_AT_TOP = 6.0
"""Samples of a half cycle, at least, that show a shape."""


def find_clipping(campaign: Campaign) -> list[Suspicion]:
    """Gives the channels that look clipped: many half cycles end flat at one level, whatever drives them.

    Args:
        campaign: The records.

    Returns:
        Doubts only: a stop of the isolator looks alike, and an effect of the catalogue stands for either.
    """
    found = []
    for section, column in (("input", campaign.input.column), ("output", campaign.output.column)):
        driven = [record for record in campaign.records if section == "output" or record.kind != "free_decay"]
        signals = [record.raw_input if section == "input" else record.raw_output for record in driven]
        figure, expected = _end_figure(signals), "a few, as of a sine"
        if figure is None:
            figure, expected = _flat_figure(signals), "43 %, as of a sine"
        if figure is None:
            continue
        line = '[model] elements = ["clipping"]' if section == "output" else "measure again, with more range"
        cause = Cause("flat tops", f"the {section} left the range of its channel", line)
        found.append(Suspicion("flat tops", f'"{column}"', figure, expected, (cause,), False))
    return found


def _end_figure(signals: list[Float[np.ndarray, " _"]]) -> str | None:
    """Gives what is seen of a converter at the end of its range: it repeats one number, digit for digit."""
    counts = [round(clipped_share(signal) * signal.size) for signal in signals]
    clipped = [signal for signal, count in zip(signals, counts, strict=True) if count]
    if not clipped:
        return None
    reach = max(float(np.max(np.abs(signal - np.mean(signal)))) for signal in clipped)
    return (
        f"{sum(counts)} samples stand exactly at an end of the range, {reach:.3g} in SI from the mean, in "
        f"{len(clipped)} of {len(counts)} records"
    )


def _flat_figure(signals: list[Float[np.ndarray, " _"]]) -> str | None:
    """Gives what is seen of an amplifier or a filter at the end of its range: tops are flat."""
    ends = [(sign, _flat_tops([sign * signal for signal in signals])) for sign in (1.0, -1.0)]
    flat = [(sign * one[0], *one[1:]) for sign, one in ends if one is not None]
    if not flat:
        return None
    levels = " and ".join(f"{level:.3g}" for level, _, _ in flat)
    return (
        f"{sum(count for _, count, _ in flat)} half cycles end flat at {levels} in SI about the mean: "
        f"of the time above half of it they spend {100.0 * max(share for *_, share in flat):.0f} % in "
        "the last tenth"
    )


def _flat_tops(signals: list[Float[np.ndarray, " _"]]) -> tuple[float, int, float] | None:
    """Gives the level at which tops are flat, how many are, and the share of their time near it; or None."""
    cycles = [_half_cycles(signal) for signal in signals]
    if sum(tops.size for tops, _, _ in cycles) < _FEWEST_TOPS:
        return None
    tops, near, above = (np.concatenate(parts) for parts in zip(*cycles, strict=True))
    level = float(np.quantile(tops, 1.0 - 0.5 * _COMMON))
    at = np.abs(tops / level - 1.0) < _SPREAD
    count = int(np.count_nonzero(at))
    if count < max(_FEWEST_TOPS, _COMMON * tops.size) or np.mean(above[at]) < _FEWEST_AT_TOP:
        return None
    share = float(np.sum(near[at]) / np.sum(above[at]))
    return (level, count, share) if share > _FLAT else None


def _half_cycles(
    signal: Float[np.ndarray, " time"],
) -> tuple[Float[np.ndarray, " cycle"], Float[np.ndarray, " cycle"], Float[np.ndarray, " cycle"]]:
    """Gives the top of each positive half cycle, and its samples above the two shares of that top."""
    own = signal - np.mean(signal)
    starts = np.flatnonzero(np.diff(np.signbit(own))) + 1
    if starts.size < 2:
        return np.zeros(0), np.zeros(0), np.zeros(0)
    own, starts = own[: starts[-1]], starts[:-1]
    lengths = np.diff(np.append(starts, own.size))
    own = own[starts[0] :]
    tops = np.maximum.reduceat(own, starts - starts[0])
    every = np.repeat(tops, lengths)
    near, above = (
        np.add.reduceat((own > share * every).astype(float), starts - starts[0]) for share in (_TOP, _FLANK)
    )
    kept = tops > 0.0
    return tops[kept], near[kept], above[kept]
