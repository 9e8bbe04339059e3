"""What a verdict says of an error that a filter weighed."""

import numpy as np

from ..._quantities import typeset_share, typeset_unit
from .._rules import Rules
from ..fitting import Fit
from ..innovations import ErrorFit
from ._findings import Candidate


def error_words(found: ErrorFit, fit: Fit, rules: Rules) -> str:
    """Say what the error of a model is.

    Args:
        found: the model with the sizes of its errors.
        fit: the same, with its campaign.
        rules: numbers that decide the verdict.

    Returns:
        A sentence.
    """
    if found.is_noise_of_output:
        return "What the model leaves is noise of the output."
    unit = typeset_unit("m/s^2" if fit.model.excitation == "base_acceleration" else "N")
    force, declared = f"{np.sqrt(found.sizes.variance):.3g} {unit} rms", found.filter.measured.force[0]
    if found.is_noise and found.sizes.variance < rules.as_declared * declared**2:
        drive = fit.campaign.input.noise
        other = (
            "the declared random force" if drive is None else f"noise of the drive, {drive:.3g} {unit} rms"
        )
        return f"What the model leaves is noise of the output and {other}."
    if found.is_noise:
        return (
            f"What the model leaves is noise of the output, and {force} of noise of the drive or of a force "
            "on the mass: repeats at equal drive would separate the two."
        )
    return f"The error is the model's and not noise: a random force of {force} would explain it."


def added_words(ranking: tuple[Candidate, ...], share: float, noise: bool) -> str:
    """Say what a finding adds, and what others would in its place.

    Args:
        ranking: the finding, and the other candidates.
        share: of the squared error of unseen records that the finding takes off.
        noise: whether only noise is left.

    Returns:
        A sentence or two.
    """
    words, unseen = ranking[0].words, "records left out of its refit"
    if noise:
        return f"With {words} what the model leaves is noise."
    if share <= 0.0:
        return f"Adding {words} foretells {unseen} better. Their motion is irregular: no free run follows it."
    others = [
        f"{one.words} {typeset_share(one.held_out_share)}" for one in ranking[1:] if one.held_out_share > 0.0
    ]
    instead = f"; in its place {', '.join(others)}" if others else ""
    taken = f"{typeset_share(share)} off the squared error of free runs of {unseen}"
    return f"Adding {words} takes {taken}{instead}."
