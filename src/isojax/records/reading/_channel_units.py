"""Units: the factor from a channel's unit to SI, by pint, with the dimension checked against the quantity."""

from pathlib import Path
from typing import Any

from .._wording import listing, nearest
from ..formats import SI_UNITS, channel_unit, gravity_factor, one_of

_EXPECTED = {
    "force": ("N", ("N", "kN", "mN", "MN", "lbf", "kgf", "V", "mV")),
    "acceleration": ("m/s^2", ("m/s^2", "mm/s^2", "g", "mg", "in/s^2", "ft/s^2", "V", "mV")),
    "velocity": ("m/s", ("m/s", "mm/s", "um/s", "in/s", "km/h", "V", "mV")),
    "displacement": ("m", ("m", "mm", "um", "nm", "cm", "in", "mil", "V", "mV")),
    "command": ("V", ("V", "mV", "A", "N", "%", "1")),
    "time": ("s", ("s", "ms", "us", "min")),
}

_SAME_FACTOR = 1e-6
"""Relative difference of the factors of two names of one unit."""


def si_factor(unit: str, quantity: str, where: str) -> float:
    """Gives the factor that takes a number in `unit` to SI.

    A voltage is accepted for every quantity as it is: one volt counts as one SI unit (one mV as a
    thousandth). "g" for an acceleration is standard gravity, not gram. A command may have any unit.

    Args:
        unit: As written in campaign.toml, e.g. "kN", "m/s2", "m/s²", "um".
        quantity: "force", "acceleration", "velocity", "displacement" or "command".
        where: The field, for the error.

    Returns:
        SI units per unit.

    Raises:
        ValueError: If pint does not know the unit, or if it is not a unit of the quantity.
    """
    si, examples = _EXPECTED[quantity]
    gravity = gravity_factor(unit) if quantity == "acceleration" else None
    if gravity is not None:
        return gravity
    expected = (
        f"expected a unit such as {listing(examples)}{_meant(unit, quantity) or nearest(unit, examples)}"
    )
    try:
        one = one_of(unit)
    except ValueError as error:
        raise ValueError(f'{where} = "{unit:.80}" is not a unit; {expected}') from error
    if quantity == "command":
        return float(one.to_root_units().magnitude) if not one.check("[electric_potential]") else _volts(one)
    if one.check("[electric_potential]") and quantity != "time":
        return _volts(one)
    if not one.is_compatible_with(si):
        raise ValueError(
            f'{where} = "{unit}" ({one.units}) does not measure {_article(quantity)}; {expected}'
        )
    return float(one.to(si).magnitude)


def unit_in_force(
    declared: str | None, stated: str | None, quantity: str, column: str, where: str, file: Path
) -> str:
    """Gives the unit of a column: the declared one, else that which the file states.

    Args:
        declared: Unit in campaign.toml, or None.
        stated: Unit in the heading or beside the samples, or None.
        quantity: As in `si_factor`.
        column: Name of the column, for the error.
        where: The field, for the error.
        file: The data file, for the error.

    Returns:
        The unit.

    Raises:
        ValueError: If neither gives one, or if the two contradict each other.
    """
    if declared is None:
        if stated is None:
            si = _EXPECTED[quantity][0]
            raise ValueError(
                f"{where} is not declared, and {file} states no unit of column `{column}`; write "
                f'unit = "{si}", or whatever it is, or put it into the heading: {column} [{si}]'
            )
        return stated
    found = None if stated is None else channel_unit(stated)
    if found is None or gravity_factor(declared) == found.factor:
        return declared
    one = one_of(declared)
    if one.is_compatible_with(SI_UNITS[found.quantity]):
        factor = float(one.to(SI_UNITS[found.quantity]).magnitude)
        if abs(factor / found.factor - 1.0) < _SAME_FACTOR:
            return declared
    raise ValueError(
        f'{where} = "{declared}", but {file} says that column `{column}` is in {stated}; they must agree. If '
        "the file is right, leave out `unit`"
    )


def _meant(unit: str, quantity: str) -> str:
    """Gives the hint to a unit that is often written in another way."""
    if quantity == "acceleration" and unit.strip() in ("G", "mG", "Gs"):
        gravity = unit.strip().replace("G", "g").rstrip("s")
        return f"; G is the gauss: did you mean `{gravity}`, standard gravity?"
    return ""


def _volts(one: Any) -> float:
    return float(one.to("V").magnitude)


def _article(quantity: str) -> str:
    return f"an {quantity}" if quantity[0] in "aeiou" else f"a {quantity}"
