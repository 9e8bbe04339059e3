"""What a unit measures and its factor to SI, by pint."""

import functools
import re
from typing import Any, NamedTuple

import pint

from .._physical_limits import Limits

STANDARD_GRAVITY = 9.80665
"""Of 1 g [m/s^2]."""

_GRAVITIES = {"g": 1.0, "gn": 1.0, "g_n": 1.0, "mg": 1e-3, "ug": 1e-6, "µg": 1e-6, "μg": 1e-6}

SI_UNITS = {
    "time": "s",
    "force": "N",
    "acceleration": "m/s^2",
    "velocity": "m/s",
    "displacement": "m",
    "voltage": "V",
    "current": "A",
}
"""What a channel of a vibration test measures."""

_LONGEST = 24
"""Letters beyond which a text in a heading is no unit."""

_LONGEST_DECLARED = 64
"""Letters beyond which a declared text is none."""

_NAME = r"(?:[^\W\d]|[%°])+\.?(?:(?:\*\*|\^)?[-+]?\d(?![\d.])|⁻?[¹²³⁴])?"
_TIMES = "[*/· ]"
_PRODUCT = rf"(?:{_NAME}|1)(?:{_TIMES}(?:{_NAME}|1))*"
_FACTOR = rf"(?:\({_PRODUCT}\)|{_NAME}|1)"
_UNIT = re.compile(rf"{_FACTOR}(?:{_TIMES}{_FACTOR})*")
"""Names with powers of one digit, multiplied and divided, and products of them in brackets."""

_FACTORS = Limits(1e-15, 1e15)
"""Of a unit that a channel may have, in SI units."""


class ChannelUnit(NamedTuple):
    """A unit that a channel of a vibration test may have.

    Attributes:
        quantity: "time", "force", "acceleration", "velocity", "displacement", "voltage" or "current".
        factor: SI units per unit.
    """

    quantity: str
    factor: float


@functools.cache
def _registry() -> "pint.UnitRegistry[Any]":
    return pint.UnitRegistry()


def gravity_factor(unit: str) -> float | None:
    """Gives the factor of a unit of standard gravity to m/s^2, or None where it is none: `G` is the gauss."""
    share = _GRAVITIES.get(unit.strip())
    return None if share is None else STANDARD_GRAVITY * share


def one_of(unit: str) -> Any:
    """Gives one of a unit as a pint quantity: "m/s2", "m/s²" and "N·m" are understood.

    Raises:
        ValueError: If it is no unit.
    """
    unit = re.sub(r" ?([*/·()]) ?", r"\1", " ".join(unit[: _LONGEST_DECLARED + 1].split()))
    if len(unit) > _LONGEST_DECLARED or _UNIT.fullmatch(unit) is None:
        raise ValueError(f'"{unit:.{_LONGEST_DECLARED}}" is not a unit')
    spelled = re.sub(r"(?<=[A-Za-zµμ])(\d)(?=$|[/*· ])", r"^\1", unit.replace("·", "*"))
    try:
        one = _registry().Quantity(1.0, _registry().parse_units(spelled))
        if not _FACTORS.hold(float(one.to_root_units().magnitude)):
            raise ValueError("too large or too small, or counted from another zero")
        return one
    except Exception as error:  # pint raises a dozen kinds on text that is no unit; all mean the same here
        raise ValueError(f'"{unit}" is not a unit') from error


@functools.lru_cache(maxsize=4096)
def channel_unit(text: str) -> ChannelUnit | None:
    """Gives what a text measures if it is a unit that a channel may have, else None.

    "g" is standard gravity. What no channel of a vibration test measures, such as "F" (farad), is no unit
    here: it is rather part of a name.
    """
    text = text.strip()
    gravity = gravity_factor(text)
    if gravity is not None:
        return ChannelUnit("acceleration", gravity)
    if not 0 < len(text) <= _LONGEST:
        return None
    for spelled in (text, text.lower()) if len(text) > 3 else (text,):
        try:
            one = one_of(spelled)
        except ValueError:
            continue
        for quantity, si in SI_UNITS.items():
            if one.is_compatible_with(si):
                return ChannelUnit(quantity, float(one.to(si).magnitude))
        return None
    return None
