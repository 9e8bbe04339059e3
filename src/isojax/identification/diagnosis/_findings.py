"""What a diagnosis says: candidates, findings and verdicts."""

from typing import Literal, NamedTuple

from ...elements import AbstractElement
from ...models import Isolator
from ..fitting import Estimate, Fit
from ._separation import Separation

VerdictWord = Literal["none", "found", "partly_explained", "unexplained"]


class Candidate(NamedTuple):
    """One absent effect, as the evidence ranks it.

    Attributes:
        effect: catalogue name.
        words: what it is.
        z: score over its standard deviation, before any refit; signed like the strength.
        p_value: family-wise, over all candidates.
        visibility: share of its trace in the data that the fitted coefficients cannot imitate.
        strength: its strength: refitted where it was refitted, else by one linear step [its unit].
        strength_error: standard error of the strength [its unit].
        unit: unit of the strength.
        chi2_per_dof: after the refit; NaN where it was not refitted.
        delta_bic: Schwarz's criterion over that of the best candidate, per max(chi2/dof, 1); NaN where not
            refitted.
        likeness: correlation with the best candidate's trace, -1 to 1.
        admissible: whether its sign and its dissipation are physical.
    """

    effect: str
    words: str
    z: float
    p_value: float
    visibility: float
    strength: float
    strength_error: float
    unit: str
    chi2_per_dof: float
    delta_bic: float
    likeness: float
    admissible: bool


class Finding(NamedTuple):
    """An effect that the model lacked.

    Attributes:
        effect: catalogue name.
        indistinguishable: catalogue names of effects that these data do not distinguish from it.
        p_value: family-wise chance of so large a score without the effect.
        excess_explained: share of chi2 - dof that adding it removed.
        transfer: share of the excess that it removed on records (or halves) that its refit did not see.
        ranking: all candidates, best first.
        separating_experiment: what test would separate the indistinguishable ones, in words.
        rivals: the indistinguishable effects, with the shapes that imitate the finding best.
        separation: the candidate tests, weighed by simulation; None where none was simulated.
    """

    effect: str
    indistinguishable: tuple[str, ...]
    p_value: float
    excess_explained: float
    transfer: float
    ranking: tuple[Candidate, ...]
    separating_experiment: str
    rivals: tuple[AbstractElement, ...] = ()
    separation: Separation | None = None


class Verdict(NamedTuple):
    """What the residual of a fit says.

    Attributes:
        verdict: "none" (nothing is missing), "found" (named, and the fit is then good), "partly_explained",
            or "unexplained".
        finding: the effect, or None.
        ranking: all candidates, best first.
        indistinguishable: catalogue names within the evidence of the best; empty where nothing was found.
        unexplained: share of the excess that is left after the best effect.
        hidden: catalogue names that these data cannot show beside the fitted coefficients.
        bounds: for each effect that was not found, how large its strength could still be, with its unit;
            empty where the fit is not good, because a bound takes the rest of the residual for noise.
        after: the fit with the effect; None where nothing was found.
        reason: one sentence.
    """

    verdict: VerdictWord
    finding: Finding | None
    ranking: tuple[Candidate, ...]
    indistinguishable: tuple[str, ...]
    unexplained: float
    hidden: tuple[str, ...]
    bounds: dict[str, tuple[float, str]]
    after: Fit | None
    reason: str

    @property
    def refit(self) -> Estimate | None:
        """The equations of the fit with the effect; None where nothing was found."""
        return None if self.after is None else self.after.estimate


class Extension(NamedTuple):
    """A model before and after an effect was added.

    Attributes:
        before: the fit without it.
        fit: the fit with it.
        verdict: why it was added.
    """

    before: Fit
    fit: Fit
    verdict: Verdict

    @property
    def after(self) -> Fit:
        """The fit with the effect."""
        return self.fit


def findings_in(model: Isolator, extensions: tuple[Extension, ...]) -> tuple[Finding, ...]:
    """List what was found and is part of a model.

    Args:
        model: the isolator.
        extensions: each effect that was added.

    Returns:
        The findings, in the order of discovery, but for those that a later one took the place of.
    """
    found = (step.verdict.finding for step in extensions)
    return tuple(one for one in found if one is not None and model.element(one.effect) is not None)
