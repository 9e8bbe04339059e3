"""What a caller asks of the record to measure next, checked."""

from typing import Any, NamedTuple

import numpy as np

from ..._given_numbers import given_number, given_numbers
from ..._show import shown
from ..diagnosis import DWELLS


@shown
class TestPlan(NamedTuple):
    """What a caller asks of the records; None where the campaign says it.

    Attributes:
        seconds: length of the record [s].
        levels: rms of the drive [N, or m/s^2 of the base].
        bands: lowest and highest frequency of each [Hz].
        dwells: of a stepped sine.
        farthest: largest displacement over that of the campaign.
    """

    seconds: float | None
    levels: tuple[float, ...] | None
    bands: tuple[tuple[float, float], ...] | None
    dwells: tuple[int, ...]
    farthest: float


def plan_of(seconds: Any, levels: Any, bands: Any, dwells: Any, farthest: Any) -> TestPlan:
    """Give the plan that a caller asks for; one level, one band or one number of dwells may stand alone.

    Args:
        seconds: as `TestPlan` has it, or None.
        levels: likewise.
        bands: likewise.
        dwells: likewise, never None.
        farthest: likewise.

    Returns:
        The plan.

    Raises:
        ValueError: if a number is not positive, a band does not ascend, or a number of dwells does not divide
            the record.
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
    )
