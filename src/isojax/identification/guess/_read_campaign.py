"""A campaign that can be identified: every name in its [model] is in the catalogue."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from ...elements import CATALOGUE
from ...records import Campaign, read_declaration, read_measurements
from ._declared_model import catalogue_names


def read_campaign(
    source: str | Path | Mapping[str, Any], *, data: Mapping[str, Any] | None = None
) -> Campaign:
    """Give a measurement campaign, its records in SI units and in the order of the test.

    The whole declaration is checked, the names of [model] against the catalogue included, before the first
    data file is opened.

    Args:
        source: the campaign.toml, its folder, or a mapping with the sections of one, checked alike. Paths in
            a mapping are relative to the working directory.
        data: records in memory in place of files, by the `file` of each [[record]]: arrays by name, a pandas
            `DataFrame`, an xarray `Dataset`, a NumPy array or a list of SEP 005 channels.

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

        Without files, of arrays; the unit of the force stands in its name:

        >>> declared = {
        ...     "campaign": {"mass": 2.0},
        ...     "input": {"quantity": "force", "column": "force"},
        ...     "output": {"quantity": "acceleration", "column": "a", "unit": "g"},
        ...     "sampling": {"rate": 200.0},
        ...     "record": [{"file": "run", "role": "fit"}],
        ... }
        >>> force = np.random.default_rng(0).normal(size=400)
        >>> noisy = ij.read_campaign(declared, data={"run": {"force [kN]": force, "a": 0.5 * force}})
        >>> noisy.input.unit, noisy.records[0].rate
        ('kN', 200.0)
    """
    declared = read_declaration(source, data)
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
