"""Channels with samples that stand alone."""

from .._campaign import Campaign
from ..noise import spikes
from ._suspicion import Cause, Suspicion


def find_stray_samples(campaign: Campaign, smallest: float) -> list[Suspicion]:
    """Gives the channels with spikes: single samples that their neighbours do not explain.

    Args:
        campaign: The records.
        smallest: rms of the spikes, over that of the channel, from which they count.

    Returns:
        Doubts only: a part that rattles makes such samples as well as a bad contact.
    """
    found = []
    for section, column in (("input", campaign.input.column), ("output", campaign.output.column)):
        own = [one for one in spikes(campaign) if one.channel == section and one.rms_share > smallest]
        if not own:
            continue
        worst = max(own, key=lambda one: one.rms_share)
        figure = (
            f"{sum(one.count for one in own)} single samples in {len(own)} records stand far from their "
            f"neighbours; in {worst.record} they are {1e6 * worst.share:.2g} ppm and hold "
            f"{100.0 * worst.rms_share:.2g} % of the rms"
        )
        words = "a bad contact or lost bits, if no part rattles"
        cause = Cause("spikes", words, f"[{section}] remove_spikes = true")
        found.append(
            Suspicion("single samples", f'"{column}"', figure, "samples between neighbours", (cause,), False)
        )
    return found
