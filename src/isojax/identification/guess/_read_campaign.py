"""A campaign that can be identified: every name in its [model] is in the catalogue."""

from pathlib import Path

from ...elements import CATALOGUE
from ...records import Campaign, read_declaration, read_measurements
from ._declared_model import catalogue_names


def read_campaign(path: str | Path) -> Campaign:
    """Give a measurement campaign, its records in SI units and in the order of the test.

    The whole declaration is checked, the names of [model] against the catalogue included, before the first
    data file is opened.

    Args:
        path: the campaign.toml or its folder.

    Returns:
        The campaign.

    Raises:
        ValueError: at the first thing that is wrong with the .toml or a data file: which file, which field or
            row, what was found and what was expected.

    Source: the form of campaign.toml is described in docs/campaign.md.

    Example:
        The demo campaign is in the package:

        >>> from isojax.demo import campaign_folder
        >>> campaign = ij.read_campaign(campaign_folder())
        >>> len(campaign.fit_records), len(campaign.holdout_records)
        (4, 2)
    """
    declared = read_declaration(path)
    model = declared.sections["model"]
    names = catalogue_names(declared.file, model["stiffness"], model["damping"], model["elements"])
    for name in names:
        if "floor" in CATALOGUE[name].channels and declared.sections["floor"] is None:
            raise ValueError(
                f"{declared.file}: [model] names `{name}`, which follows the measured motion of the "
                "floor, but section [floor], which says where that was measured, is missing"
            )
    return read_measurements(declared)


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
