"""The campaign that is meant by a campaign or by its path."""

from pathlib import Path

from ..._read_campaign import read_campaign
from ...records import Campaign


def as_campaign(value: object) -> Campaign:
    """Give the campaign that is meant.

    Args:
        value: a campaign, or the path of its campaign.toml or its folder.

    Returns:
        The campaign.

    Raises:
        ValueError: if it is neither, and as `read_campaign` does.
    """
    if isinstance(value, str | Path):
        return read_campaign(value)
    if not isinstance(value, Campaign):
        raise ValueError(
            "Argument `campaign` must be a campaign, such as `read_campaign(path)` gives it, or a path, but "
            f"is of type {type(value).__name__}."
        )
    return value
