"""result.json: what the loop found, as plain numbers and words."""

import math
from typing import Any

from ..._parameters import list_parameters
from ..._results import is_successful
from ...health import CampaignHealth
from ...identification import Errors, Finding, Fit, Loop, plain_unit, prediction_errors
from ..words import (
    alternatives_list,
    check_first_dicts,
    finite_or_none,
    health_dict,
    law_dict,
    remainder_dict,
)

SCHEMA = 1


def result_dict(loop: Loop, health: CampaignHealth | None = None) -> dict[str, Any]:
    """Give a closed loop as schema 1 of result.json.

    "errors" are rms errors of predictions [SI unit of the output] by how long they run [s], the free run last
    with None for its time. "alternatives", other force laws in the place of the findings, is there only where
    something was found; "remainder" only where the verdict is "unexplained" or "partly_explained";
    "integration", beside the coefficients of a fit, only where a solver of diffrax other than RK4 simulated
    the records; "tone" and "law" only where the last diagnosis found no further effect, but one of these is
    left.

    Args:
        loop: the closed loop.
        health: of its campaign, which adds the key "health"; none if omitted.

    Returns:
        Numbers, words, lists and dictionaries that JSON holds; None where a number is not finite, and for the
        coefficients of a fit that failed.
    """
    remainder = loop.remainder
    return {
        "schema": SCHEMA,
        "campaign": loop.campaign.title,
        "check_first": check_first_dicts(loop.check_first),
        "before": _fit_dict(loop.before),
        "verdict": loop.verdict,
        "findings": [_finding_dict(finding) for finding in loop.findings],
        "after": _fit_dict(loop.after),
        "bounds": {
            effect: {"upper": finite_or_none(upper), "unit": plain_unit(unit, loop.campaign)}
            for effect, (upper, unit) in loop.bounds.items()
        },
        "seconds": finite_or_none(loop.seconds),
        "errors": {"before": _horizon_dicts(loop.before), "after": _horizon_dicts(loop.after)},
        **({"alternatives": alternatives_list(loop)} if loop.alternatives else {}),
        **({} if health is None else {"health": health_dict(health)}),
        **({} if remainder is None else {"remainder": remainder_dict(remainder)}),
        **({} if loop.last.tone is None else {"tone": loop.last.tone._asdict()}),
        **({} if loop.last.law is None else {"law": law_dict(loop.last.law)}),
    }


def _fit_dict(fit: Fit) -> dict[str, Any]:
    errors, found = fit.standard_errors, is_successful(fit.result)
    return {
        "elements": [element.name for element in fit.model.elements],
        "parameters": {
            entry.name: {
                "value": finite_or_none(float(entry.value)) if found or entry.name not in errors else None,
                "standard_error": finite_or_none(errors.get(entry.name, math.nan)),
                "unit": plain_unit(entry.spec.unit, fit.campaign),
            }
            for entry in list_parameters(fit.model)
        },
        "error": {role: _error_dict(fit.errors[role]) for role in ("fit", "holdout")},
        **({} if fit.estimate.problem.integrator.is_locked else {"integration": fit.integration}),
    }


def _horizon_dicts(fit: Fit) -> list[dict[str, float | None]]:
    """Give rms errors by how long the model runs with nothing fed back; None is from start to end."""
    ahead = prediction_errors(fit)
    free = (math.nan if one is None else one.rmse for one in (fit.errors["fit"], fit.errors["holdout"]))
    rows = [*zip(ahead.horizons, ahead.fit, ahead.holdout, strict=True), (math.inf, *free)]
    return [dict(zip(("horizon", "fit", "holdout"), map(finite_or_none, row), strict=True)) for row in rows]


_ERROR_FIELDS = ("rmse", "nrmse", "nrmse_segments", "chi2_per_dof")


def _error_dict(errors: Errors | None) -> dict[str, float | None] | None:
    return None if errors is None else {name: finite_or_none(getattr(errors, name)) for name in _ERROR_FIELDS}


def _finding_dict(finding: Finding) -> dict[str, Any]:
    return {
        "effect": finding.effect,
        "indistinguishable": list(finding.indistinguishable),
        "p_value": finite_or_none(finding.p_value),
        "excess_explained": finite_or_none(finding.excess_explained),
        "held_out_share": finite_or_none(finding.transfer),
        "ranking": [
            {
                "effect": candidate.effect,
                "z": finite_or_none(candidate.z),
                "p_value": finite_or_none(candidate.p_value),
                "delta_bic": finite_or_none(candidate.delta_bic),
                "admissible": candidate.admissible,
                **({"held_out_share": share} if math.isfinite(share := candidate.held_out_share) else {}),
            }
            for candidate in finding.ranking
        ],
        "separating_experiment": finding.separating_experiment,
    }
