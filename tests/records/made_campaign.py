"""A campaign of records that a test made, for what needs no more than their noise."""

from pathlib import Path

from isojax.records import Campaign, Filter, InputChannel, OutputChannel, Record


def campaign_of(*records: Record, noise: float | None = None, low: Filter | None = None) -> Campaign:
    """Give a campaign of made records, all of one rate."""
    return Campaign(
        title="made",
        file=Path("campaign.toml"),
        mass=1.0,
        mass_free=False,
        input=InputChannel("force", "f", "N"),
        output=OutputChannel("displacement", "x", "m", noise=noise),
        filter=low,
        rate=records[0].rate,
        stiffness=(),
        damping=(),
        elements=(),
        records=records,
    )
