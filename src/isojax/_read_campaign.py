"""A campaign that can be identified: every name in its [model] is in the catalogue."""

import difflib
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from ._quantities import CONDITIONS
from .records import Campaign, Declaration, read_declaration, read_measurements


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
    # The catalogue starts JAX, which a bad data file need not wait for: names of its files pass until then.
    model = declared.sections["model"]
    names = _declared_names(model["stiffness"], model["damping"], model["elements"])
    if not all(_has_file(found, suffix) for _, found, suffix in names):
        _check_names(declared)
    measured = read_measurements(declared)
    _check_names(declared)
    return measured


def _declared_names(
    stiffness: Sequence[str], damping: Sequence[str], elements: Sequence[str]
) -> list[tuple[str, str, str]]:
    """Give the field of each declared name, the name, and the ending that it may lack."""
    return [
        (field, found, suffix)
        for field, names, suffix in (
            ("model.stiffness", stiffness, "_stiffness"),
            ("model.damping", damping, "_damping"),
            ("model.elements", elements, ""),
        )
        for found in names
    ]


def _has_file(found: str, suffix: str) -> bool:
    """Whether a file of the catalogue is named after an effect."""
    files = {file.stem for file in Path(__file__).with_name("elements").glob("_*.py")}
    return bool(files & {f"_{found}{suffix}", f"_{found}"})


def _check_names(declared: Declaration) -> None:
    from .elements import CATALOGUE

    model = declared.sections["model"]
    fitted = [record for record in declared.records if record["role"] == "fit"]
    for name in catalogue_names(declared.file, model["stiffness"], model["damping"], model["elements"]):
        for condition in set(CONDITIONS).intersection(CATALOGUE[name].channels):
            first = fitted[0][condition]
            if all(record[condition] == first for record in fitted):
                raise ValueError(
                    f"{declared.file}: [model] names `{name}`, which follows the {condition} of the records "
                    f"to fit, so that `{condition}` must differ between these [[record]], but "
                    + ("none states it" if first is None else f"of each it is {first:g}")
                )
        if "floor" in CATALOGUE[name].channels and declared.sections["floor"] is None:
            raise ValueError(
                f"{declared.file}: [model] names `{name}`, which follows the measured motion of the "
                "floor, but section [floor], which says where that was measured, is missing"
            )


def _catalogue_name(file: Path, field: str, found: str, suffix: str) -> str:
    """Give the catalogue's name for a declared one, short (`cubic`) or in full (`cubic_stiffness`)."""
    from .elements import CATALOGUE

    for name in (found + suffix, found):
        if name in CATALOGUE:
            return name
    short = [name.removesuffix(suffix) for name in CATALOGUE if suffix and name.endswith(suffix)]
    near = difflib.get_close_matches(found, [*short, *CATALOGUE], n=1, cutoff=0.0)[0]
    raise ValueError(
        f"Field `{field}` of {file} must name effects of the catalogue, but has {found[:80]!r}; nearest: "
        f"{near!r}."
    )


def catalogue_names(
    file: Path, stiffness: Sequence[str], damping: Sequence[str], elements: Sequence[str]
) -> tuple[str, ...]:
    """List the catalogue names that the [model] of a campaign.toml means.

    Args:
        file: the campaign.toml.
        stiffness: springs, short (`cubic`) or in full (`cubic_stiffness`).
        damping: dampers, likewise.
        elements: further effects.

    Returns:
        Their names, as written and in this order.

    Raises:
        ValueError: if a name is not in the catalogue, or two mean one effect; names the file, the field and,
            of the first, the nearest right name.
    """
    meant: dict[str, str] = {}
    for field, found, suffix in _declared_names(stiffness, damping, elements):
        name = _catalogue_name(file, field, found, suffix)
        if name in meant:
            raise ValueError(
                f"Field `{field}` of {file} has {found!r}, but `{name}` is named already, as "
                f"{meant[name]!r}; each effect may be named once."
            )
        meant[name] = found
    return tuple(meant)
