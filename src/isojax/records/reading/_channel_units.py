"""Units: the factor from a channel's unit to SI, by pint, with the dimension checked against the quantity."""

import functools
import re
from typing import Any

import pint

from .._wording import listing, nearest

_EXPECTED = {
    "force": ("N", ("N", "kN", "mN", "MN", "lbf", "kgf", "V", "mV")),
    "acceleration": ("m/s^2", ("m/s^2", "mm/s^2", "g", "mg", "in/s^2", "ft/s^2", "V", "mV")),
    "velocity": ("m/s", ("m/s", "mm/s", "um/s", "in/s", "km/h", "V", "mV")),
    "displacement": ("m", ("m", "mm", "um", "nm", "cm", "in", "mil", "V", "mV")),
    "command": ("V", ("V", "mV", "A", "N", "%", "1")),
}
_STANDARD_GRAVITY = {
    "g": 1.0,
    "gn": 1.0,
    "g_n": 1.0,
    "G": 1.0,
    "mg": 1e-3,
    "mG": 1e-3,
    "ug": 1e-6,
    "µg": 1e-6,
}


@functools.cache
def _registry() -> "pint.UnitRegistry[Any]":
    return pint.UnitRegistry()


def si_factor(unit: str, quantity: str, where: str) -> float:
    """Gives the factor that takes a number in `unit` to SI.

    A voltage is accepted for every quantity as it is: one volt counts as one SI unit (one mV as a
        thousandth).
    "g" for an acceleration is standard gravity, not gram. A command may have any unit.

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
    if quantity == "acceleration" and unit in _STANDARD_GRAVITY:
        return 9.80665 * _STANDARD_GRAVITY[unit]
    registry = _registry()
    spelled = re.sub(r"(?<=[A-Za-zµμ])(\d)(?=$|[/*· ])", r"^\1", unit.strip().replace("·", "*"))
    expected = f"expected a unit such as {listing(examples)}{nearest(unit, examples)}"
    try:
        parsed = registry.parse_units(spelled)
        one = registry.Quantity(1.0, parsed)
    except Exception as error:  # pint raises a dozen kinds on text that is no unit; all mean the same here
        raise ValueError(f'{where} = "{unit}" is not a unit; {expected}') from error
    if quantity == "command":
        return float(one.to_root_units().magnitude) if not one.check("[electric_potential]") else _volts(one)
    if one.check("[electric_potential]"):
        return _volts(one)
    if not one.is_compatible_with(si):
        raise ValueError(f'{where} = "{unit}" ({parsed}) does not measure {_article(quantity)}; {expected}')
    return float(one.to(si).magnitude)


def _volts(one: Any) -> float:
    return float(one.to("V").magnitude)


def _article(quantity: str) -> str:
    return f"an {quantity}" if quantity[0] in "aeiou" else f"a {quantity}"
