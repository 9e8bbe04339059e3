"""How large an effect that was not found could still be."""

from ..._parameters import own_parameters
from ...elements import AbstractElement
from ._score import ScoreTest

WIDTH_95 = 1.96
"""Half the width of a 95 % interval, in standard errors."""


def strength_unit(element: AbstractElement) -> str:
    """Give the unit of an element's strength."""
    return dict(own_parameters(element))[element.strength].unit


def upper_bounds(test: ScoreTest, found: str | None) -> dict[str, tuple[float, str]]:
    """Say how large each effect that was not found could still be.

    A bound takes the rest of the residual for noise. Far from a good fit that rest is another effect, and the
    linear step from there says nothing of any strength: it is for good fits.

    Args:
        test: the score test.
        found: catalogue name of the effect that was found, or None.

    Returns:
        Strength and 1.96 standard errors added up, and their unit, by catalogue name.
    """
    return {
        score.element.name: (abs(score.strength) + WIDTH_95 * score.error, strength_unit(score.element))
        for score in test.scores
        if score.element.name != found
    }
