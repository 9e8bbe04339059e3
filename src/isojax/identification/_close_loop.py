"""The closed loop: fit, find what is missing, add it, and again until nothing significant is missing."""

import dataclasses
import math
import time
from collections.abc import Callable
from functools import cached_property
from pathlib import Path
from typing import Any, Literal

import scipy.stats

from .._cores import in_own_threads
from .._kept import digest, kept_answers, package_digest
from .._progress import LOOP_SHARES, REPLACE_SHARE, KeyFigure, Stage, silent
from .._results import RESULTS, is_successful
from .._show import Row, number, shown
from ..elements import CATALOGUE
from ..models import Isolator, as_isolator
from ..records import Campaign, Suspicion, find_suspicions, refuse_contradictions
from ._rules import Rules
from .diagnosis import (
    Diagnosis,
    Extension,
    Finding,
    Verdict,
    VerdictWord,
    bic,
    diagnose_with,
    find_superfluous,
    findings_in,
    is_good,
)
from .experiment import with_separating_experiment
from .fitting import (
    DEFAULT_SOLVER,
    Fit,
    Fitted,
    Search,
    as_fit,
    beside_own_noise,
    beside_random_force,
    complete,
    fit_by_output,
    on_all_samples,
    search_of,
    thinned,
    unlocked_tone,
)
from .guess import ClassicalGuess, as_campaign, classical_guess
from .remainder import Alternatives, Remainder, explain_remainder, find_alternatives
from .traces import trace_free_laws

_GUESS, _FIT, _DIAGNOSIS, _NEXT, *_LAST = LOOP_SHARES
_EXPERIMENT, _LAWS, _RUNS = _LAST

Doubt = Literal["", "diverges", "worse", "not down to noise", "another law", "a further law", "a tone"]


@shown
@dataclasses.dataclass(frozen=True, eq=False)
class Loop:
    """The closed loop: from records to a model that explains them, or to the admission that it does not.

    Attributes:
        campaign: the measurements.
        guess: the classical start.
        before: the declared model, fitted.
        extensions: each effect that was added, in the order of discovery.
        after: the final fit (the same as `before` where nothing was added).
        verdict: over all iterations.
        last: the diagnosis of the final fit; what it found, if anything, is not added any more.
        bounds: for each effect that was not found, how large its strength could still be beside the
            final model, with its unit; empty where its fit is not good.
        seconds: wall time.
        rules: the numbers that decided.
        alternatives: for each finding, and for all together, the force laws that explain the records as well.
    """

    campaign: Campaign
    guess: ClassicalGuess
    before: Fit
    extensions: tuple[Extension, ...]
    after: Fit
    verdict: VerdictWord
    last: Verdict
    bounds: dict[str, tuple[float, str]]
    seconds: float
    rules: Rules = Rules()
    alternatives: tuple[Alternatives, ...] = ()

    @property
    def findings(self) -> tuple[Finding, ...]:
        """The effects found, in the order of discovery; not those that a later one contains."""
        return findings_in(self.after.model, self.extensions)

    @property
    def check_first(self) -> tuple[Suspicion, ...]:
        """What in the records does not agree with their declaration; contradictions first."""
        return find_suspicions(self.campaign)

    @cached_property
    def doubt(self) -> Doubt:
        """What held-out records, or other force laws, say against the findings; "" where there is nothing."""
        if not self.findings or not is_successful(self.after.result):
            return ""
        return doubt_of(self.before, self.after, self.last, self.rules, self.alternatives)

    @cached_property
    def remainder(self) -> Remainder | None:
        """What the last fit leaves; None where the verdict claims no remainder, or the fit failed."""
        asked = self.verdict in ("unexplained", "partly_explained") and self.after.innovations is None
        if not (asked and is_successful(self.after.result) and self.after.estimate.point.is_finite):
            return None
        return explain_remainder(self.after, rules=self.rules)

    def _headline(self) -> str:
        found = ", ".join(one.effect for one in self.findings)
        before, after = (f"{one.stats.chi2 / one.stats.dof:.4g}" for one in (self.before, self.after))
        named = f" ({found})" if found else ""
        return f"{self.campaign.title}, {self.verdict.replace('_', ' ')}{named}, χ²/dof {before} → {after}"

    def _rows(self) -> list[Row]:
        return self.after.parameters._rows()

    def _lines(self) -> list[str]:
        return [f"  {self.last.reason}", f"  {number(self.seconds)} s"]

    @property
    def model(self) -> Isolator:
        """The isolator of the last fit."""
        return self.after.model


def extend(before: Fit | Fitted, verdict: Verdict) -> Extension:
    """Add the effect that a diagnosis found, and compare the new model with every record.

    Args:
        before: the fit that was diagnosed.
        verdict: its diagnosis.

    Returns:
        The fits before and after.

    Raises:
        ValueError: if the diagnosis found nothing to add.

    Example:
        With the verdict of `diagnose`'s example; the demo hides friction of 30 N:

        >>> better = ij.extend(fitted, verdict)
        >>> print(f"{float(better.after.model['coulomb_friction.force_level']):.1f} N")
        30.0 N
    """
    if verdict.after is None:
        raise ValueError(
            "Argument `verdict` must have found an effect to add, but its verdict is "
            f'"{verdict.verdict}": {verdict.reason}'
        )
    return Extension(as_fit(before, "before"), verdict.after, verdict)


@in_own_threads
def close_loop(
    campaign: Campaign | str | Path,
    *,
    max_iterations: int = 3,
    excluded: tuple[str, ...] = (),
    solver: Any = DEFAULT_SOLVER,
    progress: Callable[[str], None] = silent,
    rules: Rules = Rules(),
    anyway: bool = False,
    checkpoint: str | Path | None = None,
) -> Loop:
    """Fit the declared model, add the effect that it lacks, and repeat until nothing significant is missing.

    Held-out records are never used to fit a coefficient, to choose an effect or to stop. What they speak
    against is not called "found".

    Args:
        campaign: the measurements, or the path of their campaign.toml or its folder.
        max_iterations: effects that may be added at most; with 0 the declared model is fitted and diagnosed.
        excluded: catalogue names that are not to be considered.
        solver: an optimistix least-squares solver.
        progress: receives a `Stage` and a `KeyFigure` for each stage, and a line for each of its steps.
        rules: the numbers that decide verdicts.
        anyway: whether records that contradict their declaration are fitted all the same.
        checkpoint: file in which the answer of each computation is kept as it comes. A run that was killed
            goes on from there and ends with the same digits; what other data, another declaration or another
            version of isojax left there is not used.

    Returns:
        The loop: fits before and after, the findings, and the verdict over all.

    Raises:
        ValueError: if `max_iterations` is negative, if `excluded` holds what is no catalogue name, if the
            records contradict their declaration, or as `classical_guess` and `fit` raise it.
    """
    if max_iterations < 0:
        raise ValueError(f"Argument `max_iterations` must be 0 or more, but is {max_iterations}.")
    unknown = [name for name in excluded if name not in CATALOGUE]
    if unknown:
        raise ValueError(f"Argument `excluded` must hold catalogue names, but {unknown[0]!r} is none.")
    start, campaign = time.perf_counter(), as_campaign(campaign)
    if not anyway:
        refuse_contradictions(campaign)
    if checkpoint is None:
        return _loop(campaign, max_iterations, excluded, solver, progress, rules, start)
    identity = {
        "version of isojax": package_digest(),
        "campaign": digest(campaign),
        "question": digest(max_iterations, excluded, solver, rules),
    }
    with kept_answers(Path(checkpoint), identity, progress):
        return _loop(campaign, max_iterations, excluded, solver, progress, rules, start)


def _loop(
    campaign: Campaign,
    max_iterations: int,
    excluded: tuple[str, ...],
    solver: Any,
    progress: Callable[[str], None],
    rules: Rules,
    start: float,
) -> Loop:
    """Close the loop over a campaign that agrees with its declaration."""
    progress(Stage("classical guess", _GUESS, LOOP_SHARES[1:]))
    guess = classical_guess(campaign)
    progress(Stage("fit of the declared model", _FIT, LOOP_SHARES[2:]))
    search = search_of(campaign, rules, solver, progress)
    first = fit_by_output(as_isolator(guess.model, recorded=True), campaign, search)
    before = beside_random_force(first, search)
    progress(KeyFigure(f"chi2/dof {before.stats.chi2 / before.stats.dof:.4g}"))
    extensions, (verdict, beside) = search_effects(before, search, max_iterations, excluded)
    if extensions:
        progress(Stage("search for separating experiments", _EXPERIMENT, (_LAWS, _RUNS)))
        extensions = tuple(with_separating_experiment(step, rules) for step in extensions)
    after = extensions[-1].after if extensions else before
    if not is_successful(after.result):
        verdict = _without_evidence(after)
    elif verdict.after is not None:
        reason = f"{verdict.reason} It is not added, since max_iterations = {max_iterations}."
        verdict = verdict._replace(verdict="unexplained", reason=reason)
    names = tuple(finding.effect for finding in findings_in(after.model, extensions))
    alternatives: tuple[Alternatives, ...] = ()
    if names and is_successful(after.result) and after.innovations is None:
        progress(Stage("other force laws in the place of the findings", _LAWS, (_RUNS,)))
        beside = beside or trace_free_laws(*thinned(after.estimate, search))
        alternatives = find_alternatives(beside, names, rules)
    del beside  # the traces are large
    judged = overall_verdict(before, after, len(names), verdict, rules, alternatives)
    if after is before:
        # Where nothing was added there are no two fits whose errors must be comparable.
        before = after = beside_own_noise(before, search)
    progress(Stage("free runs of every record", _RUNS))  # here, so that the time of the loop counts them
    if is_successful(before.result) and is_successful(after.result):
        progress(KeyFigure(f"error {before.nrmse:.2%} of the measured rms before, {after.nrmse:.2%} after"))
    for step in (before, after):
        step.estimate.simulator.forget()
    seconds, bounds = time.perf_counter() - start, verdict.bounds
    return Loop(
        campaign, guess, before, extensions, after, judged, verdict, bounds, seconds, rules, alternatives
    )


def _without_evidence(failed: Fit) -> Verdict:
    """Say that a fit that failed says nothing: no ranking and no bound may come of it."""
    reason = f"The fit failed, so that there is nothing to diagnose. {RESULTS[failed.result]}"
    return Verdict("unexplained", None, (), (), float("nan"), (), {}, None, reason)


def search_effects(
    before: Fit, search: Search, max_iterations: int, excluded: tuple[str, ...] = ()
) -> tuple[tuple[Extension, ...], Diagnosis]:
    """Add effects while they are significant; search again without one that later ones made superfluous.

    Where that search finds nothing better, but the later effects alone explain as much, the effect is dropped
    and the search goes on from there.
    """
    extensions, last = _grow(before, search, max_iterations, excluded)
    if len(extensions) < 2 or before.innovations is not None:
        return extensions, last
    whole = extensions[-1].after.estimate
    final, coarser = thinned(whole, search)
    search.progress(
        Stage("test whether the later findings replace an earlier one", REPLACE_SHARE, tuple(_LAST))
    )
    earlier = tuple(
        step.verdict.finding.effect for step in extensions[:-1] if step.verdict.finding is not None
    )
    doubtful = find_superfluous(final, earlier, coarser)
    if doubtful is None:
        return extensions, last
    name = doubtful.effect
    search.progress(KeyFigure(f"{name} is not needed beside the later findings: search again without it"))
    again, other = _grow(before, search, max_iterations, (*excluded, name))
    without = on_all_samples(doubtful.without, whole, coarser, search) if doubtful.is_better else whole
    best = without if is_successful(without.result) else whole
    if again:
        new = again[-1].after.estimate
        inflation = min(new.inflation, best.inflation)
        if bic(new, inflation) <= bic(best, inflation):
            return again, other
    if best is whole:
        return extensions, last
    dropped = complete(best, before.model, before.campaign, before.noise)
    more, last = _grow(dropped, search, max_iterations - len(extensions) + 1, (*excluded, name))
    return (*extensions[:-1], extensions[-1]._replace(fit=dropped), *more), last


def _grow(
    before: Fit, search: Search, max_iterations: int, excluded: tuple[str, ...]
) -> tuple[tuple[Extension, ...], Diagnosis]:
    """Add effects until no further one is significant; give the steps and the last diagnosis.

    A good fit is diagnosed like any other: a second effect may still stand out of the residual.
    """
    extensions: tuple[Extension, ...] = ()
    current = before
    while True:
        # Halved after each addition: the levels of all searches sum up to twice the first.
        significance = search.rules.significance / 2 ** len(extensions)
        search.progress(_diagnosis(len(extensions), max_iterations))
        found = diagnose_with(search, current, significance, excluded)
        search.progress(KeyFigure(found.verdict.reason))
        if found.verdict.after is None or len(extensions) == max_iterations:
            return extensions, found
        extensions = (*extensions, extend(current, found.verdict))
        current.estimate.simulator.forget()
        current = extensions[-1].after


def _diagnosis(added: int, most: int) -> Stage:
    """Open a diagnosis: the first is expected to find an effect, those after it are not."""
    later = tuple(_LAST) if added else (_NEXT, *_LAST) if most else (_RUNS,)
    later = (REPLACE_SHARE, *later) if added > 1 else later
    return Stage(f"diagnosis {added + 1}: which effect is missing", _NEXT if added else _DIAGNOSIS, later)


def doubt_of(
    before: Fit, final: Fit, last: Verdict, rules: Rules, alternatives: tuple[Alternatives, ...]
) -> Doubt:
    """Say what speaks against the findings, although the fit is good.

    Args:
        before: the declared model, fitted.
        final: the model with the findings, fitted.
        last: the diagnosis of the final fit.
        rules: when a fit is good, and what chance does not explain.
        alternatives: laws that explain the fitted records as well.

    Returns:
        Whether the final model diverges on held-out records, predicts them worse than without the findings,
        or not down to their noise; whether another law explains the fitted ones better, or a further one
        stands out of them; whether they hold a tone that is not locked to the drive; "" where nothing speaks
        against it.
    """
    if final.innovations is not None:
        old, new = before.errors["holdout"], final.errors["holdout"]
        if old is None or new is None or final.innovations.is_noise:
            return ""
        return "" if new.nrmse <= old.nrmse else "worse"
    tone: Doubt = "" if unlocked_tone(final, rules) is None else "a tone"
    other: Doubt = tone if last.law is None else "a further law"
    if any(one.better is not None for one in alternatives):
        other = "another law"
    old, new = before.errors["holdout"], final.errors["holdout"]
    if old is None or new is None:
        return other
    if not math.isfinite(new.chi2_per_dof):
        return "diverges"
    chance = scipy.stats.chi2.sf(new.chi2_per_dof * new.dof, new.dof)
    if new.chi2_per_dof <= rules.good or chance > rules.significance:
        return other
    # The noise is common to both figures, so that their difference scatters by 2 sqrt(rise / dof) only.
    rise = new.chi2_per_dof - old.chi2_per_dof
    scatter = 2.0 * math.sqrt(max(rise, 0.0) / new.dof)
    worse = rise > scipy.stats.norm.isf(rules.significance) * scatter
    return "worse" if worse else tone or "not down to noise"


def overall_verdict(
    before: Fit,
    final: Fit,
    findings: int,
    last: Verdict,
    rules: Rules,
    alternatives: tuple[Alternatives, ...] = (),
) -> VerdictWord:
    """Give the verdict over all iterations."""
    first, found = before.estimate, final.estimate
    if not findings or not is_successful(final.result):
        return last.verdict
    if findings <= rules.most_at_once and is_good(final, rules):
        return "partly_explained" if doubt_of(before, final, last, rules, alternatives) else "found"
    explained = 1.0 - found.excess / max(first.excess, 1.0)
    if final.innovations is not None:
        explained = 1.0 - (final.nrmse / before.nrmse) ** 2
    return "partly_explained" if explained >= 1.0 - rules.smallest_share else "unexplained"
