"""Where in the plane of the drive a special point lies, in words."""

import math

import numpy as np
from jaxtyping import Array, Float

from ..._parameters import list_parameters
from ..._quantities import DRIVE_UNITS, typeset_unit
from ..._show import amount, number
from ...models import Band, Isolator


def unit_of(model: Isolator, parameter: str) -> str:
    """Give the unit of what varies along a branch.

    Args:
        model: the isolator.
        parameter: "amplitude", "frequency", or a coefficient by its name in reports.

    Returns:
        The unit.
    """
    units = {"amplitude": DRIVE_UNITS[model.excitation], "frequency": "Hz"}
    entries = {entry.name: entry.spec.unit for entry in list_parameters(model)}
    return units.get(parameter) or entries[parameter]


def drive_in_words(
    model: Isolator, amplitude: Float[Array, ""], frequency: Float[Array, ""], band: Band | None
) -> str:
    """Give amplitude and frequency of a drive with their units and, as far as they are known, errors.

    Args:
        model: the isolator: what drives it says the unit.
        amplitude: F0 [N, or m/s^2 for base excitation].
        frequency: f [Hz].
        band: of both, where a fit was given.

    Returns:
        Such as "95 N, 5.0502 ± 0.0013 Hz": what is held fixed has no error.
    """
    words = []
    units = {"amplitude": DRIVE_UNITS[model.excitation], "frequency": "Hz"}
    for (name, unit), value in zip(units.items(), (amplitude, frequency), strict=True):
        error = math.nan if band is None else float(np.asarray(band.standard_error[name]))
        known = number(float(value)) + f" {typeset_unit(unit)}"
        words.append(amount(value, unit, error) if error > 0.0 else known)
    return ", ".join(words)
