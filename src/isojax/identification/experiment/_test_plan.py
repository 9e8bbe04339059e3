"""What a caller asks of the record to measure next, checked."""

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np

from ..._given_numbers import given_number, given_numbers
from ..._quantities import CONDITIONS
from ..._show import shown
from ..diagnosis import DWELLS, Conditions


@shown
class TestPlan(NamedTuple):
    """What a caller asks of the records; None where the campaign says it.

    Attributes:
        seconds: length of the record [s].
        levels: rms of the drive [N, or m/s^2 of the base].
        bands: lowest and highest frequency of each [Hz].
        dwells: of a stepped sine.
        farthest: largest displacement over that of the campaign.
        conditions: operating conditions, by name [SI].
    """

    seconds: float | None
    levels: tuple[float, ...] | None
    bands: tuple[tuple[float, float], ...] | None
    dwells: tuple[int, ...]
    farthest: float
    conditions: tuple[Conditions, ...] | None = None


def plan_of(
    seconds: Any, levels: Any, bands: Any, dwells: Any, farthest: Any, conditions: Any = None
) -> TestPlan:
    """Give the plan that a caller asks for; one of several may stand alone.

    Args:
        seconds: as `TestPlan` has it, or None.
        levels: likewise.
        bands: likewise.
        dwells: likewise, never None.
        farthest: likewise, never None.
        conditions: mappings from names.

    Returns:
        The plan.

    Raises:
        ValueError: if a number is not positive, a band does not ascend, a number of dwells does not divide
            the record, or a condition is none that a record may state.
    """

    def positive(value: float) -> bool:
        return 0.0 < value < np.inf

    if seconds is not None:
        seconds = given_number("seconds", seconds, "be positive and finite", positive)
    if levels is not None:
        levels = tuple(given_numbers("levels", levels, "hold positive numbers", positive).ravel().tolist())
    if bands is not None:
        wanted, given = "hold pairs 0 < lowest < highest", bands
        bands = given_numbers("bands", given, wanted, positive)
        if bands.shape[-1:] != (2,) or bands.ndim > 2 or not np.all(np.diff(bands) > 0.0):
            raise ValueError(f"Argument `bands` must {wanted}, but is {given}.")
        bands = tuple((low, high) for low, high in bands.reshape(-1, 2).tolist())
    # Each segment of a simulated record has an even number of samples.
    samples = 2 * DWELLS
    counts = given_numbers(
        "dwells",
        dwells,
        f"hold divisors of {samples}",
        lambda count: count > 0.0 and count == round(count) and samples % count == 0.0,
    )
    return TestPlan(
        seconds,
        levels,
        bands,
        tuple(map(int, counts.ravel())),
        given_number("farthest", farthest, "be positive", lambda value: value > 0.0),
        None if conditions is None else _conditions(conditions),
    )


def _conditions(given: Any) -> tuple[Conditions, ...]:
    """Give operating conditions in the order in which records state them."""
    several = [given] if isinstance(given, Mapping) else list(given) if isinstance(given, Sequence) else []
    known = all(isinstance(one, Mapping) and one and set(one) <= set(CONDITIONS) for one in several)
    if not several or not known:
        raise ValueError(
            f"Argument `conditions` must give {' or '.join(CONDITIONS)} of a record by name, such as "
            f"{{'pressure': 2e5}}, or several of these, but is {given!r}."
        )

    def value(one: Mapping[str, Any], name: str) -> float:
        return given_number("conditions", one[name], f"hold a positive {name}", lambda size: size > 0.0)

    return tuple(tuple((name, value(one, name)) for name in CONDITIONS if name in one) for one in several)
