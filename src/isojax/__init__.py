"""Identify nonlinear vibration isolators from measured time histories, and name what their model lacks.

From records to a model: `read_campaign`, `classical_guess`, `fit`, `residual`, `diagnose`, `extend`, or all
of them with `close_loop`. From a model to its stability: `find_periodic_orbit`, `stability_map`,
`continue_branch`, `sensitivity`. Namespaces hold the rest: `elements` every physical effect, `excitations`
what drives it, `plot` the pictures, `reporting` the tables; the others hold the classes of the results.

Examples in docstrings assume `import isojax as ij`, `import numpy as np` and JAX's 64-bit mode.
"""

import importlib
import importlib.metadata
from typing import Any

import lazy_loader

__version__ = importlib.metadata.version("isojax")

# The names listed in __init__.pyi, where type checkers find them too, are imported when they are first used.
_listed, __dir__, _NAMES = lazy_loader.attach_stub(__name__, __file__)

_ROOMS = (
    "elements",
    "excitations",
    "records",
    "models",
    "identification",
    "stability",
    "inference",
    "reporting",
    "reporting.plots",
)


def __getattr__(name: str) -> Any:
    """Find a name that is not listed where it lives: `isojax.CubicStiffness`, `isojax.plot_record`."""
    if name in _NAMES:
        return _listed(name)
    for room in _ROOMS if not name.startswith("_") else ():
        found = vars(importlib.import_module(f"{__name__}.{room}"))
        if name in found:
            return found[name]
    if name in globals():
        return globals()[name]  # a folder that a room imports, such as `health`
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
