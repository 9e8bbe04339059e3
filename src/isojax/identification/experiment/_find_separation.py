"""The experiment that separates a finding from its look-alikes, found by simulation with the fitted model."""

from typing import Protocol, runtime_checkable

import jax.numpy as jnp
import numpy as np

from ..._cores import in_own_threads
from ..._parameters import own_parameters
from ...elements import CATALOGUE, Scales
from .._rules import Rules
from ..diagnosis import Extension, Prospect, Separation, rank_prospects
from ..guess import scales as campaign_scales
from ._candidate_experiments import candidate_experiments, repeated_campaign
from ._simulated_records import TrialRun
from ._test_outline import find_test_outline
from ._trial_information import (
    DIVERGES,
    Columns,
    absent,
    carry_out,
    expected_chi2,
    full_matrix,
    needs_every_sample,
    old_point,
    trial_columns,
    trial_point,
)


@runtime_checkable
class Extended(Protocol):
    """Whatever holds extensions: a closed loop."""

    @property
    def extensions(self) -> tuple[Extension, ...]:
        """Each effect that was added, in the order of discovery."""
        ...


@in_own_threads
def find_separating_experiment(
    extension: Extension | Extended, *, seconds: float | None = None, rules: Rules = Rules()
) -> Separation:
    """Find the test that separates a finding from its look-alikes.

    Each candidate is simulated with the fitted model without the effect. With the effect A and a look-alike B
    riding along at zero strength, I the information on their strengths in the old records and the new ones
    together, all that the fitted coefficients, initial states and stiffness scales would absorb projected
    out, A explains them better than B by `s^2 (I_AA - I_AB^2 / I_BB)`, s the strength found; that is the
    expected chi2, per max(chi2/dof, 1) of the fit. Shapes of A and B stay as they were refitted.

    Args:
        extension: a model before and after the finding, such as one of `close_loop(campaign).extensions`; of
            a closed loop the last.
        seconds: measuring time of the new test [s]; that of the campaign if omitted.
        rules: the evidence that separates two effects.

    Returns:
        The candidates, best first. Without look-alikes, or where nothing drove the isolator on and on, there
        are none.

    Raises:
        ValueError: if the extension holds no finding, or `seconds` is not positive.

    Source: expected information for discrimination, Hunter & Reiner 1965, Technometrics 7:307.

    Example:
        With the extension of `extend`'s example, where no look-alike is left to separate:

        >>> ij.find_separating_experiment(better).others
        ()
    """
    extension = _last_extension(extension)
    finding = extension.verdict.finding
    if finding is None:
        raise ValueError("Argument `extension` must hold a finding, but its verdict names no effect.")
    if seconds is not None and not 0.0 < seconds < np.inf:
        raise ValueError(f"Argument `seconds` must be positive and finite, but is {seconds}.")
    campaign = extension.before.campaign
    problem = extension.before.estimate.problem
    lasted = sum(part.stop - part.counted for part in problem.segments) / campaign.rate
    seconds = lasted if seconds is None else seconds
    after = extension.fit.estimate
    # From here on a diagnosis of the old records and the new ones separates them.
    needed = max(rules.close_bic, rules.smallest_gain * after.dof * (1.0 + seconds / lasted))
    nothing = Separation(finding.effect, finding.indistinguishable, (), needed, seconds)
    if not finding.indistinguishable:
        return nothing
    columns, strength = _columns(extension, campaign_scales(campaign))
    steps = problem.integrator.record_steps(extension.before.model)
    outline = find_test_outline(campaign, steps, every_sample=needs_every_sample(columns))
    if outline is None:
        return nothing
    first = carry_out(columns, repeated_campaign(campaign, outline), 0.0)
    if not isinstance(first, TrialRun) or not first.finite.all():
        return nothing
    model = columns.fitted.model
    rest = float(np.sqrt(2.0) * np.max(np.std(first.displacement, axis=1)))
    resting = (jnp.asarray(rest), *(jnp.zeros(()),) * (1 + model.internal_states))
    load = float(model.restoring_force(resting))
    # One noise for every sensor: as large beside the reading as the campaign's own.
    share = float(np.std(first.displacement) / np.std([record.output for record in first.records]))
    old, count = full_matrix(columns, old_point(columns)), len(columns.fitted.names)
    inflation = after.inflation
    prospects = []
    for experiment in candidate_experiments(campaign, outline, load):
        made = carry_out(columns, experiment, rest)
        if isinstance(made, str):
            prospects.append(Prospect(experiment, (), made))
            continue
        relative = share if experiment.quantity != problem.quantity else 1.0
        point = trial_point(columns, experiment, made, campaign.rate, relative) if made.finite.all() else None
        if point is None or not point.is_finite:
            prospects.append(Prospect(experiment, (), DIVERGES))
            continue
        total = old + seconds / experiment.seconds * full_matrix(columns, point)
        others = range(count + 1, len(columns.names))
        gains = tuple(
            expected_chi2(total, tuple(range(count)), count, other, strength) / inflation for other in others
        )
        prospects.append(Prospect(experiment, gains))
    return nothing._replace(prospects=rank_prospects(tuple(prospects), needed))


def _last_extension(given: Extension | Extended) -> Extension:
    """Give the extension that is meant: of a loop the last."""
    last = (None, *given.extensions)[-1] if isinstance(given, Extended) else given
    if not isinstance(last, Extension):
        raise ValueError(
            "Argument `extension` must be an extension, such as `extend` gives it, or a loop that added an "
            f"effect, but is of type {type(given).__name__}."
        )
    return last


def with_separating_experiment(extension: Extension, rules: Rules = Rules()) -> Extension:
    """Put the test that separates a finding from its look-alikes into the finding.

    Args:
        extension: a model before and after the finding.
        rules: the evidence that separates two effects.

    Returns:
        The same extension; where nothing can be simulated, its finding keeps the advice in words.
    """
    finding = extension.verdict.finding
    # Plans are simulated without the random force that a filter's fit has.
    if finding is None or not finding.indistinguishable or extension.fit.innovations is not None:
        return extension
    separation = find_separating_experiment(extension, rules=rules)
    best, words = separation.best, separation.words
    if best is None:
        return extension
    if best.separated(separation.needed) == 0:
        words = f"{words} {finding.separating_experiment}"
    finding = finding._replace(separating_experiment=words, separation=separation)
    return extension._replace(verdict=extension.verdict._replace(finding=finding))


def _columns(extension: Extension, scales: Scales) -> tuple[Columns, float]:
    """Give the columns that count, the effect first of the absent ones, and its strength in its own unit."""
    finding, fitted = extension.verdict.finding, extension.before.estimate
    assert finding is not None
    effect = extension.fit.model.element(finding.effect)
    assert effect is not None
    known = {rival.name: rival for rival in finding.rivals}
    others = (known.get(name, CATALOGUE[name].guess(scales)) for name in finding.indistinguishable)
    probes = tuple(map(absent, (effect, *others)))
    columns = trial_columns(fitted, probes, tuple(probe.typical_strength(scales) for probe in probes))
    strength = float(getattr(effect, effect.strength))
    unit = dict(own_parameters(effect))[effect.strength].unit
    for held in fitted.model.elements:
        if held.name in effect.absorbs and dict(own_parameters(held))[held.strength].unit == unit:
            # What the model had of the law before is no part of the effect.
            strength -= float(getattr(held, held.strength))
    return columns, strength / columns.sizes[len(fitted.names)]
