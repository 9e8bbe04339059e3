"""What a diagnosis says: candidates, findings and verdicts."""

import math
from typing import Literal, NamedTuple

from ..._quantities import typeset_p_value
from ..._show import Row, amount, shown
from ...elements import AbstractElement
from ...models import Isolator
from ..fitting import Estimate, Fit, Tone
from ..traces import SelectedLaw
from ._separation import Separation

VerdictWord = Literal["none", "found", "partly_explained", "unexplained"]

_CANDIDATES_SHOWN = 8
"""Candidates of a ranking that are shown."""


@shown
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
        held_out_share: share of the squared error of free runs that it takes off records which its refit did
            not see; NaN where that was not asked.
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
    held_out_share: float = math.nan

    def _headline(self) -> str:
        likely = "" if self.admissible else ", not physical"
        return f"{self.effect}, z = {self.z:.3g}, p {_chance(self.p_value)}, {self.strength_words}{likely}"

    @property
    def strength_words(self) -> str:
        """Strength with standard error and unit."""
        return amount(self.strength, self.unit, self.strength_error)


@shown
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

    def _headline(self) -> str:
        others = f", or {' or '.join(self.indistinguishable)}" if self.indistinguishable else ""
        return f"{self.effect}{others}, explains {100.0 * self.excess_explained:.3g} % of the excess"

    def _rows(self) -> list[str | Row]:
        first = ["p_value", "excess_explained", "transfer"]
        return [*first, *_ranked(self.ranking)]

    def _lines(self) -> list[str]:
        return [f"  {self.separating_experiment}"] if self.separating_experiment else []


@shown
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
        tone: a tone that is left where nothing was found, and does not belong to the drive; or None.
        law: the free force law that stands out most where the fit is good and nothing was found; or None.
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
    tone: Tone | None = None
    law: SelectedLaw | None = None

    @property
    def refit(self) -> Estimate | None:
        """The equations of the fit with the effect; None where nothing was found."""
        return None if self.after is None else self.after.estimate

    def _headline(self) -> str:
        named = "" if self.finding is None else f" ({self.finding.effect})"
        return f"{self.verdict.replace('_', ' ')}{named}. {self.reason}"

    def _rows(self) -> list[Row]:
        return _ranked(self.ranking)

    def _lines(self) -> list[str]:
        lines = []
        if self.indistinguishable:
            lines.append(f"  these data do not distinguish it from: {', '.join(self.indistinguishable)}")
        if self.law is not None:
            lines.append(f"  a free force law stands out: {self.law._headline()}")
        if self.hidden:
            lines.append(f"  these data cannot show: {', '.join(self.hidden)}")
        return lines


@shown
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

    def _headline(self) -> str:
        finding = self.verdict.finding
        before, after = (f"{one.stats.chi2 / one.stats.dof:.4g}" for one in (self.before, self.fit))
        added = "nothing" if finding is None else finding.effect
        return f"{added} added, χ²/dof {before} before and {after} after"

    def _rows(self) -> list[Row]:
        return self.fit.parameters._rows()

    @property
    def model(self) -> Isolator:
        """The isolator of the last fit."""
        return self.fit.model


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


def _chance(p_value: float) -> str:
    """Give a chance with the sign before it: "= 0.03", "< 10⁻⁶"."""
    words = typeset_p_value(p_value)
    return words if words.startswith("<") else f"= {words}"


def _ranked(ranking: tuple[Candidate, ...]) -> list[Row]:
    """Give the best candidates, a row each."""
    return [
        Row(one.effect, f"z = {one.z:.3g}, p {_chance(one.p_value)}, {one.strength_words}", one.words)
        for one in ranking[:_CANDIDATES_SHOWN]
    ]
