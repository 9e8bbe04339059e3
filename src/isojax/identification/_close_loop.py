"""The closed loop: fit, find what is missing, add it, and again until nothing is left."""

import time
from collections.abc import Callable
from typing import Any

from .._results import RESULTS, is_successful
from ..elements import CATALOGUE
from ..records import Campaign
from .diagnosis import (
    MOST_OF_IT,
    Extension,
    Loop,
    Verdict,
    VerdictWord,
    bic,
    diagnose,
    find_superfluous,
    findings_in,
    is_clean,
    is_good,
)
from .experiment import with_separating_experiment
from .fitting import DEFAULT_SOLVER, Fit, complete, fit, silent
from .guess import classical_guess
from .guess import scales as campaign_scales

MOST_AT_ONCE = 2
"""Effects that explain all a campaign lacks. More are rather the parts by which they imitate one law that the
catalogue does not have, so that no more than "partly explained" is said of them."""


def extend(before: Fit, verdict: Verdict) -> Extension:
    """Add the effect that a diagnosis found, and hold the new model against every record.

    Args:
        before: the fit that was diagnosed.
        verdict: its diagnosis.

    Returns:
        The fits before and after.

    Raises:
        ValueError: if the diagnosis found nothing to add.
    """
    if verdict.refit is None:
        raise ValueError(
            "Argument `verdict` must have found an effect to add, but its verdict is "
            f'"{verdict.verdict}": {verdict.reason}'
        )
    after = complete(verdict.refit, before.model, before.campaign, before.noise)
    return Extension(before, after, verdict)


def close_loop(
    campaign: Campaign,
    *,
    max_iterations: int = 3,
    excluded: tuple[str, ...] = (),
    solver: Any = DEFAULT_SOLVER,
    progress: Callable[[str], None] = silent,
) -> Loop:
    """Fit the declared model, find the effect that it lacks, add it, and again until nothing is left.

    Held-out records are never used to fit a coefficient, to choose an effect or to stop.

    Args:
        campaign: the measurements.
        max_iterations: effects that may be added at most; with 0 the declared model is fitted and diagnosed.
        excluded: catalogue names that are not to be considered.
        solver: an optimistix least-squares solver.
        progress: told a line a step.

    Returns:
        The loop: fits before and after, the findings, and the verdict over all.

    Raises:
        ValueError: if `max_iterations` is negative, if `excluded` holds what is no catalogue name, or as
            `classical_guess` and `fit` raise it.
    """
    if max_iterations < 0:
        raise ValueError(f"Argument `max_iterations` must be 0 or more, but is {max_iterations}.")
    unknown = [name for name in excluded if name not in CATALOGUE]
    if unknown:
        raise ValueError(f"Argument `excluded` must hold catalogue names, but {unknown[0]!r} is none.")
    begin = time.perf_counter()
    progress("classical guess")
    guess = classical_guess(campaign)
    progress("fit of the declared model")
    before = current = fit(guess.model, campaign, solver=solver, progress=progress)
    first = before.estimate.excess
    extensions, verdict = _grow(before, first, excluded, max_iterations, solver, progress)
    extensions, verdict = _revise(
        before, first, extensions, verdict, excluded, max_iterations, solver, progress
    )
    extensions = tuple(map(with_separating_experiment, extensions))
    current = extensions[-1].after if extensions else before
    if not is_successful(current.result):
        verdict = _without_evidence(current)
    elif verdict.refit is not None:
        reason = f"{verdict.reason} It is not added, since max_iterations = {max_iterations}."
        verdict = verdict._replace(verdict="unexplained", reason=reason)
    # Asked for here, so that the time of the loop counts it.
    for when, held in (("before", before), ("after", current)):
        progress(f"free-run error {when}: {held.nrmse:.4g} of the measured rms")
    return Loop(
        campaign,
        guess,
        before,
        extensions,
        current,
        _overall(before, current, len(findings_in(current.model, extensions)), verdict),
        verdict,
        verdict.bounds,
        time.perf_counter() - begin,
    )


def _without_evidence(failed: Fit) -> Verdict:
    """Say that a fit that failed tells nothing: no ranking and no bound may come of it."""
    reason = f"The fit failed, so that there is nothing to diagnose. {RESULTS[failed.result]}"
    return Verdict("unexplained", None, (), (), float("nan"), (), {}, None, reason)


def _grow(
    before: Fit,
    first_excess: float,
    excluded: tuple[str, ...],
    max_iterations: int,
    solver: Any,
    progress: Callable[[str], None],
) -> tuple[tuple[Extension, ...], Verdict]:
    """Add effects until nothing is left to add; give the steps and the last diagnosis.

    A good fit is looked at like any other: a second effect may still stand out of what is left.
    """
    extensions: tuple[Extension, ...] = ()
    current, significance = before, 0.01
    while True:
        verdict = diagnose(
            current,
            first_excess=first_excess,
            significance=significance,
            excluded=excluded,
            solver=solver,
            progress=progress,
        )
        progress(verdict.reason)
        if verdict.refit is None or len(extensions) == max_iterations:
            return extensions, verdict
        extensions = (*extensions, extend(current, verdict))
        current = extensions[-1].after
        significance *= 0.5


def _revise(
    before: Fit,
    first_excess: float,
    extensions: tuple[Extension, ...],
    verdict: Verdict,
    excluded: tuple[str, ...],
    max_iterations: int,
    solver: Any,
    progress: Callable[[str], None],
) -> tuple[tuple[Extension, ...], Verdict]:
    """Search again without an effect that the later ones made superfluous; keep the better model."""
    if len(extensions) < 2:
        return extensions, verdict
    final = extensions[-1].after
    earlier = tuple(
        step.verdict.finding.effect for step in extensions[:-1] if step.verdict.finding is not None
    )
    doubtful = find_superfluous(
        final.estimate, earlier, final.campaign, campaign_scales(final.campaign), solver, progress
    )
    if doubtful is None:
        return extensions, verdict
    progress(f"{doubtful} is not needed beside the later findings: search again without it")
    again, last = _grow(before, first_excess, (*excluded, doubtful), max_iterations, solver, progress)
    if not again:
        return extensions, verdict
    new, old = again[-1].after.estimate, final.estimate
    inflation = max(1.0, min(new.chi2 / new.dof, old.chi2 / old.dof))
    return (again, last) if bic(new, inflation) <= bic(old, inflation) else (extensions, verdict)


def _overall(before: Fit, final: Fit, findings: int, last: Verdict) -> VerdictWord:
    """Give the verdict over all iterations."""
    found = final.estimate
    first = before.estimate
    good = is_good(found.chi2 / found.dof, found.excess, first.excess)
    if not findings or not is_successful(final.result):
        return last.verdict
    explained = 1.0 - found.excess / max(first.excess, 1.0)
    if good and findings <= MOST_AT_ONCE and (is_clean(first, found) or explained >= MOST_OF_IT):
        return "found"
    return "partly_explained" if explained >= MOST_OF_IT else "unexplained"
