"""result.json: what the loop found, as plain numbers and words."""

import math
from typing import Any

from ..._parameters import list_parameters
from ..._results import is_successful
from ...health import CampaignHealth
from ...identification import Errors, Finding, Fit, Loop, plain_unit
from ..words import health_dict, remainder_dict

SCHEMA = 1


def result_dict(loop: Loop, health: CampaignHealth | None = None) -> dict[str, Any]:
    """Give a closed loop as schema 1 of result.json.

    "remainder" is there only where the verdict is "unexplained" or "partly_explained".

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
        "before": _fit(loop.before),
        "verdict": loop.verdict,
        "findings": [_finding(finding) for finding in loop.findings],
        "after": _fit(loop.after),
        "bounds": {
            effect: {"upper": _number(upper), "unit": plain_unit(unit, loop.campaign)}
            for effect, (upper, unit) in loop.bounds.items()
        },
        "seconds": _number(loop.seconds),
        **({} if health is None else {"health": health_dict(health)}),
        **({} if remainder is None else {"remainder": remainder_dict(remainder)}),
    }


def _number(value: float) -> float | None:
    return float(value) if math.isfinite(value) else None


def _fit(fit: Fit) -> dict[str, Any]:
    errors, found = fit.standard_errors, is_successful(fit.result)
    return {
        "elements": [element.name for element in fit.model.elements],
        "parameters": {
            entry.name: {
                "value": _number(float(entry.value)) if found or entry.name not in errors else None,
                "standard_error": _number(errors.get(entry.name, math.nan)),
                "unit": plain_unit(entry.spec.unit, fit.campaign),
            }
            for entry in list_parameters(fit.model)
        },
        "error": {role: _errors(fit.errors[role]) for role in ("fit", "holdout")},
    }


_ERROR_FIELDS = ("rmse", "nrmse", "nrmse_segments", "chi2_per_dof")


def _errors(errors: Errors | None) -> dict[str, float | None] | None:
    return None if errors is None else {name: _number(getattr(errors, name)) for name in _ERROR_FIELDS}


def _finding(finding: Finding) -> dict[str, Any]:
    return {
        "effect": finding.effect,
        "indistinguishable": list(finding.indistinguishable),
        "p_value": _number(finding.p_value),
        "excess_explained": _number(finding.excess_explained),
        "ranking": [
            {
                "effect": candidate.effect,
                "z": _number(candidate.z),
                "p_value": _number(candidate.p_value),
                "delta_bic": _number(candidate.delta_bic),
                "admissible": candidate.admissible,
            }
            for candidate in finding.ranking
        ],
        "separating_experiment": finding.separating_experiment,
    }
