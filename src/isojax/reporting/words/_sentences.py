"""The finding in words: headline, what it rests on, what it does not say."""

import math

from ..._parameters import Parameter, list_parameters
from ..._quantities import (
    typeset_formula,
    typeset_goodness,
    typeset_number,
    typeset_p_value,
    typeset_share,
    typeset_unit,
    typeset_with_error,
)
from ..._results import RESULTS, is_successful
from ...elements import CATALOGUE
from ...identification import OUTPUT_UNITS, Errors, Finding, Fit, Loop, plain_unit
from ...identification.diagnosis import is_good, leaves_noise
from ...identification.fitting import bent_words
from ...records import DataHealth


def effect_words(effect: str) -> str:
    """Give the words for a catalogue name.

    Args:
        effect: catalogue name.

    Returns:
        Its words.
    """
    return typeset_unit(CATALOGUE[effect].words) if effect in CATALOGUE else effect


def own_strength(fit: Fit, effect: str) -> tuple[Parameter, float]:
    """Give the strength of an effect in a fitted model.

    Args:
        fit: a fit whose model has the effect.
        effect: catalogue name.

    Returns:
        The parameter, and its standard error (NaN where it has none).
    """
    name = f"{effect}.{CATALOGUE[effect].strength}"
    entry = next(entry for entry in list_parameters(fit.model) if entry.name == name)
    return entry, fit.standard_errors.get(name, math.nan)


def strength_words(fit: Fit, effect: str) -> str:
    """Give the strength of an effect with its error.

    Args:
        fit: a fit whose model has the effect.
        effect: catalogue name.

    Returns:
        Such as "Fc = 3.983 ± 0.051 N".
    """
    entry, error = own_strength(fit, effect)
    unit = plain_unit(entry.spec.unit, fit.campaign)
    return f"{entry.spec.symbol} = {typeset_with_error(float(entry.value), error, unit)}"


def error_words(before: Fit, after: Fit) -> str:
    """Give what happened to the error: on held-out records, else on the fitted ones.

    Args:
        before: the declared model, fitted.
        after: the final fit.

    Returns:
        Such as "held-out χ²/dof 3.00 → 1.02"; where the declared model's error is not noise of the output,
        the error of free runs.
    """
    role = "holdout" if before.errors["holdout"] is not None else "fit"
    place = "held-out χ²/dof" if role == "holdout" else "χ²/dof on the fitted records (none was held out)"
    first, last = before.errors[role], after.errors[role]
    if first is None or last is None:
        return f"{place} unknown"
    if has_model_error(before):
        return _free_run_words(role, first, None if before is after else last)
    if before is after:
        return f"{place} {typeset_goodness(last.chi2_per_dof, 2)}"
    return f"{place} {typeset_goodness(first.chi2_per_dof, 2)} → {typeset_goodness(last.chi2_per_dof, 2)}"


def has_model_error(fit: Fit) -> bool:
    """Say whether a fit's error is known to be more than noise of the output."""
    return fit.innovations is not None and not fit.innovations.is_noise_of_output


def _free_run_words(role: str, first: Errors, last: Errors | None) -> str:
    place = "held-out" if role == "holdout" else "fitted"
    shares = typeset_share(first.nrmse) + ("" if last is None else f" → {typeset_share(last.nrmse)}")
    return f"free runs of the {place} records are off by {shares} of their rms"


_DOUBTS = {
    "": "",
    "diverges": "The held-out records contradict it: the model diverges on them.",
    "worse": "The held-out records contradict it: they are predicted worse than without it.",
    "not down to noise": (
        "The model does not explain the held-out records down to their noise: another law may act there."
    ),
    "another law": "",  # the verdict itself says these two
    "a further law": "",
    "a tone": (
        "A tone that is not locked to the drive is left: something that no channel records shakes the mass "
        "or its sensor."
    ),
}


def verdict_sentence(loop: Loop) -> str:
    """Give the verdict in one sentence, and in a second one what held-out records say against it.

    Args:
        loop: the closed loop.

    Returns:
        The sentences.
    """
    return " ".join(part for part in (_verdict_words(loop), _DOUBTS[loop.doubt]) if part)


def _verdict_words(loop: Loop) -> str:
    if not is_successful(loop.after.result):
        return f"The fit failed, so there is no statement about the model. {RESULTS[loop.after.result]}"
    found = [_finding_sentence(loop.after, one) for one in loop.findings]
    effects, error = " and ".join(found), error_words(loop.before, loop.after)
    verb = "were" if len(found) > 1 else "was"
    if loop.verdict == "none":
        return f"Nothing is missing: the declared model explains the records down to their noise; {error}."
    if loop.verdict == "found" and found:
        return f"{_capital(effects)}, {verb} missing; {error}."
    if loop.verdict == "partly_explained" and len(found) > 2 and loop.bounds:
        return (
            f"{_capital(effects)}, explain the records together, but so many effects can imitate a single "
            f"law outside the catalogue{_standing_out(loop)}; {error} (noise alone: 1)."
        )
    better = next((one.better for one in loop.alternatives if one.better is not None), None)
    if (
        loop.verdict == "partly_explained"
        and found
        and better is not None
        and is_good(loop.after, loop.rules)
    ):
        return (
            "Something is missing, but its law is not identified: "
            f"a force c {typeset_formula(better.formula)} explains the records clearly better than "
            f"{effects}; {error}."
        )
    if loop.verdict == "partly_explained" and found and not has_model_error(loop.after):
        return (
            f"{_capital(effects)}, {verb} missing, and something else is missing too{_standing_out(loop)}; "
            f"{error} (noise alone: 1)."
        )
    pending = loop.last.finding
    if pending is not None and not found:
        return (
            f"Something is missing. {_capital(effect_words(pending.effect))} explains it best but was not "
            f"added; {error} (noise alone: 1)."
        )
    tone = loop.last.tone
    if tone is not None and not found:
        unit = typeset_unit(OUTPUT_UNITS[loop.campaign.output.quantity])
        good = is_good(loop.after, loop.rules)
        rest = "Otherwise the model explains the records" if good else "More than noise is left beside it"
        return f"{tone.words(unit)}. {rest}; {error}."
    if loop.last.law is not None and not found:
        return f"Something small is missing, and its cause is not identified{_standing_out(loop)}; {error}."
    if not found and leaves_noise(loop.after, loop.rules):
        goodness = max(loop.after.stats.chi2 / loop.after.stats.dof, loop.after.noise.excess)
        return (
            "The model explains what comes back with the drive, but the records hold more noise than the "
            f"output shows by itself, or a disturbance (χ²/dof {typeset_goodness(goodness)} by that noise); "
            f"{error}."
        )
    if has_model_error(loop.after) and found:
        taken = 1.0 - (loop.after.nrmse / loop.before.nrmse) ** 2
        take = "take" if len(found) > 1 else "takes"
        return (
            f"{_capital(effects)}, {take} {typeset_share(taken)} off the squared error of the fitted "
            f"records; the rest is an error of the model and not noise; {error}."
        )
    if has_model_error(loop.after):
        return f"Something is missing that no known effect explains: {error}, which is not noise."
    known = f" even with {effects}" if found else ""
    return f"Something is missing that no known effect explains{known}; {error} (noise alone: 1)."


def _standing_out(loop: Loop) -> str:
    """Give the free force law that stands out beside the last fit, after a colon; "" where none does."""
    law = loop.last.law
    if law is None:
        return ""
    return f": {typeset_formula(law.force_words)} stands out of the noise (z = {typeset_number(law.z, 2)})"


def _finding_sentence(fit: Fit, finding: Finding) -> str:
    others = [effect_words(name) for name in finding.indistinguishable if name != finding.effect]
    words = f"{effect_words(finding.effect)}, {strength_words(fit, finding.effect)}"
    return (
        f"{words} (or {' or '.join(others)}, which these data cannot distinguish from it)"
        if others
        else words
    )


def _capital(text: str) -> str:
    return text[:1].upper() + text[1:]


def finding_words(finding: Finding) -> tuple[str, ...]:
    """Give what a finding rests on, and what it leaves open.

    Args:
        finding: the finding.

    Returns:
        A sentence each.
    """
    chance = typeset_p_value(finding.p_value)
    chance = chance if chance.startswith("<") else f"= {chance}"
    lines = [
        f"Adding it removes {typeset_share(finding.excess_explained)} of the excess over the noise "
        f"(family-wise p {chance})."
    ]
    if math.isfinite(finding.transfer):
        # Above one chi2 is below its degrees of freedom there; next to no excess, a share means nothing.
        removed = (
            "leaves no excess"
            if finding.transfer > 1.0
            else f"removes {typeset_share(finding.transfer)} of the excess"
        )
        lines.append(f"On data that its refit did not see, it {removed}.")
    told = [
        f"{effect_words(one.effect)} {typeset_share(one.held_out_share)}"
        for one in finding.ranking
        if one.effect != finding.effect and one.held_out_share > 0.0
    ]
    if told:
        lines.append(f"In its place others would remove there: {', '.join(told)}.")
    others = [name for name in finding.indistinguishable if name != finding.effect]
    if others:
        lines.append(
            f"These data cannot distinguish it from: {', '.join(effect_words(name) for name in others)}."
        )
        if finding.separating_experiment:
            lines.append(f"A test that separates them: {finding.separating_experiment}")
    return tuple(lines)


def scatter_words(between: float, within: float) -> str:
    """Give the scatter of the linear stiffness.

    Args:
        between: standard deviation from record to record [relative].
        within: standard deviation from segment to segment of a record [relative]; 0 where none shows.

    Returns:
        Such as "0.05 % between records and 0.1 % within them".
    """
    words = f"{typeset_share(between)} between records"
    return f"{words} and {typeset_share(within)} within them" if within > 0.0 else words


def health_words(health: DataHealth, fit: Fit) -> tuple[str, ...]:
    """Give the state of the data, before a model is blamed.

    Args:
        health: dwells, blows and repeats.
        fit: the final fit.

    Returns:
        A sentence each.
    """
    sigma = typeset_number(fit.noise.sigma, 3)
    unit = typeset_unit(OUTPUT_UNITS[fit.campaign.output.quantity])
    lines = [f"Noise of the output: {sigma} {unit} rms, from {fit.noise.method.replace('_', ' ')}."]
    if fit.noise.note:
        lines.append(f"{_capital(fit.noise.note)}.")
    if health.noise_peak is not None:
        peak = health.noise_peak
        lines.append(
            "The scatter from cycle to cycle is not white: it peaks at "
            f"{typeset_number(peak.frequency, 2)} Hz, {typeset_number(peak.height, 2)} times its level at "
            f"high frequency, and holds {typeset_number(peak.rms, 2)} {unit} rms there. An isolator "
            "scatters so if something unmeasured shakes it, such as a moving floor: measure the floor "
            "and declare it as [floor]."
        )
    if health.dwells:
        worst = sorted(health.unsettled, key=lambda one: -one.change)[:3]
        examples = "; ".join(
            f"{one.record} at {one.dwell.frequency:.3g} Hz ({typeset_share(one.change)})" for one in worst
        )
        lines.append(
            f"{len(health.unsettled)} of {health.dwells} dwells never settled; the worst: {examples}."
            if worst
            else f"All {health.dwells} dwells settled."
        )
    if health.brief_blows:
        names = ", ".join(f"{blow.record} ({blow.samples})" for blow in health.brief_blows)
        lines.append(
            "Blows of fewer than four samples, whose shape between samples, and so whose momentum, is "
            f"uncertain: {names}."
        )
    for channel in ("input", "output"):
        own = [one for one in health.spikes if one.channel == channel]
        if own:
            worst = max(own, key=lambda one: one.rms_share)
            lines.append(
                f"Spikes, single samples that their neighbours do not explain, on the {channel} of "
                f"{len(own)} records: {sum(one.count for one in own)} samples. In {worst.record} they are "
                f"{typeset_number(1e6 * worst.share, 2)} ppm of the samples and hold "
                f"{typeset_share(worst.rms_share)} of the rms. They all count in the fit. If a bad "
                f"contact or a lost bit made them, and no rattle, `[{channel}] remove_spikes = true` "
                "replaces each by the cubic through its neighbours."
            )
    removed = sum(record.removed_spikes for record in fit.campaign.records)
    if removed:
        lines.append(f"{removed} spikes were replaced by the cubic through their neighbours, as declared.")
    if health.repeats:
        lines.append(
            f"Repeats agree to {typeset_share(health.repeatability)} (median of {len(health.repeats)})."
        )
    scatter = fit.stats.stiffness_scatter
    if math.isfinite(scatter):
        lines.append(f"The linear stiffness scatters by {scatter_words(scatter, fit.stats.segment_scatter)}.")
    return tuple(lines)


def caveats(loop: Loop) -> tuple[str, ...]:
    """Give what the verdict does not say.

    Args:
        loop: the closed loop.

    Returns:
        A sentence each.
    """
    after = loop.after
    lines = [
        f"The search covers a catalogue of {len(CATALOGUE)} effects. Another cause shows as unexplained, "
        "or as one of them beside the laws that would do as well.",
        "χ²/dof is relative to the estimated noise of the output; an error of that estimate scales it.",
    ]
    if after.evaluation.bent:
        lines.append(bent_words(after))
    if after.errors["holdout"] is None:
        lines.append("No record was held out, so no error here is one on unseen data.")
    if loop.last.hidden:
        names = ", ".join(effect_words(name) for name in loop.last.hidden)
        lines.append(f"Invisible in these data beside the fitted coefficients: {names}.")
    held = {entry.name for entry in list_parameters(loop.before.model)}
    for entry in list_parameters(after.model):
        if not entry.spec.fitted and entry.name not in held:
            unit = typeset_unit(plain_unit(entry.spec.unit, after.campaign))
            value = f"{typeset_number(float(entry.value), 3)} {unit}"
            lines.append(f"{entry.name} = {value} is declared, not fitted.")
    jumps = after.errors["fit"]
    if jumps is not None and jumps.nrmse > 2.0 * jumps.nrmse_segments:
        lines.append(
            "Free runs are far worse than restarted segments: near a fold a sweep may jump earlier or later "
            "than its model. Judge by χ²/dof there."
        )
    return tuple(lines)
