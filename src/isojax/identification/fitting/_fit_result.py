"""What a fit gives, and its report as text in the layout that users of lmfit know."""

import math
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from jaxtyping import Float

from ..._parameters import Parameter, list_parameters
from ..._quantities import CONDITIONS
from ..._results import RESULTS, is_successful, name_of_result
from ..._show import LINES, Row, brief, shown
from ...models import Isolator, NormalMixture
from ...records import Campaign, NoiseEstimate, brief_blows
from ..innovations import ErrorFit
from ._coefficients import Coefficient, Coefficients
from ._errors import Errors, Restarts, Run
from ._estimate import Estimate
from ._evaluation import Evaluation
from ._output_units import OUTPUT_UNITS, plain_unit
from ._saved_fit import SavedFit, Statistics, fit_words, save_fit, to_dataframe

if TYPE_CHECKING:
    import pandas as pd

_ROLES = {"fit": "fitted", "holdout": "held out"}
_STRONG = 0.9
"""Correlations of this magnitude and more are listed."""

_UNMOVED = 1e-12
"""A coefficient that changed by less than this share of itself never moved."""


@shown
class Fit(NamedTuple):
    """A fitted model, its error bars and its errors.

    Attributes:
        model: the fitted isolator.
        start: the isolator that the search started from.
        campaign: the measurements.
        free: names of the fitted coefficients.
        covariance: of the fitted coefficients [product of their units]; max(1, chi2/dof) enlarges it.
        stats: counts and criteria.
        noise: the noise that errors are compared with.
        result: how the search ended.
        estimate: the equations at the solution.
        evaluation: the model compared with every record, fitted and held out, when first asked for.
        innovations: the same with the sizes of its errors, where a filter found it; else None.
    """

    model: Isolator
    start: Isolator
    campaign: Campaign
    free: tuple[str, ...]
    covariance: Float[np.ndarray, "parameter parameter"]
    stats: Statistics
    noise: NoiseEstimate
    result: RESULTS
    estimate: Estimate
    evaluation: Evaluation
    innovations: ErrorFit | None = None

    @property
    def mixture(self) -> NormalMixture | None:
        """Law of the coefficients' deviations where its tails are longer than normal ones."""
        return self.estimate.uncertainty.mixture

    @property
    def errors(self) -> dict[str, Errors | None]:
        """Errors by role, "fit" and "holdout" (None without such records)."""
        return self.evaluation.errors

    @property
    def free_runs(self) -> tuple[Run, ...]:
        """Every record simulated from its start to its end with nothing fed back."""
        return self.evaluation.free_runs

    @property
    def restarts(self) -> Restarts:
        """Every record with each segment restarted from its own best initial state."""
        return self.evaluation.restarts

    @property
    def nrmse(self) -> float:
        """Free-run error on the fitted records over the rms of their measured output about the mean."""
        errors = self.errors["fit"]
        return float("nan") if errors is None else errors.nrmse

    @property
    def standard_errors(self) -> dict[str, float]:
        """Standard error of each fitted coefficient [its unit]; NaN where the data do not determine it."""
        return dict(zip(self.free, (float(e) for e in self.estimate.uncertainty.standard_error), strict=True))

    @property
    def integration(self) -> str:
        """What integrated the records: the solver with its steps or tolerances."""
        return self.estimate.problem.integrator.words(self.model)

    @property
    def parameters(self) -> Coefficients:
        """The coefficients by full name or symbol: `fit.parameters["k1"].standard_error`."""
        start = {entry.name: float(entry.value) for entry in list_parameters(self.start)}
        errors, found = self.standard_errors, name_of_result(self.result) == "successful"
        return Coefficients(
            tuple(
                Coefficient(
                    entry.name,
                    entry.spec.symbol,
                    float(entry.value) if found or entry.name not in errors else math.nan,
                    errors.get(entry.name, math.nan),
                    plain_unit(entry.spec.unit, self.campaign),
                    start.get(entry.name, math.nan),
                    entry.name in errors,
                )
                for entry in list_parameters(self.model)
            )
        )

    @property
    def tested_conditions(self) -> dict[str, tuple[float, float]]:
        """Lowest and highest value of each operating condition that every fitted record states [SI]."""
        stated = [dict(record.conditions) for record in self.campaign.fit_records]
        common = [name for name in CONDITIONS if stated and all(name in one for one in stated)]
        return {name: (min(one[name] for one in stated), max(one[name] for one in stated)) for name in common}

    @property
    def saved(self) -> SavedFit:
        """The numbers of the fit, without the measurements."""
        return SavedFit(
            self.campaign.title,
            self.model,
            self.start,
            self.free,
            self.parameters,
            self.covariance,
            self.stats,
            self.noise,
            self.errors,
            self.result,
            self.mixture,
            self.tested_conditions,
        )

    def to_dict(self) -> dict[str, Any]:
        """Give the fit as plain numbers, words, lists and dictionaries, as `save` writes them."""
        return self.saved.to_dict()

    def to_dataframe(self) -> "pd.DataFrame":
        """Give the coefficients as a pandas table: a row each, by full name."""
        return to_dataframe(self.parameters)

    def save(self, path: str | Path) -> None:
        """Write model, start, coefficients, covariance, statistics, noise and errors; `load_fit` reads them.

        The file is written whole or not at all. The campaign with its records, the residuals and the
        equations of the search (`campaign`, `estimate`, `evaluation`) are not saved.

        Args:
            path: the JSON file to write; its folder must exist.

        Raises:
            ValueError: if a number of the model is not finite.
        """
        save_fit(self.saved, path)

    def _headline(self) -> str:
        return f"{self.campaign.title}, {fit_words(self.stats, self.parameters, self.result)}"

    def _rows(self) -> list[Row]:
        return self.parameters._rows()

    def _lines(self) -> list[str]:
        known = self.evaluation.known_errors or {}
        said = [
            f"  {_ROLES[role]}: free-run NRMSE {100 * one.nrmse:.3g} %, χ²/dof {one.chi2_per_dof:.4g}"
            for role, one in known.items()
            if one is not None
        ]
        return [*said, "  print(fit) gives the report with statistics, correlations and warnings"]

    def __str__(self) -> str:
        """Give the fit report, its longest lists cut where it would take more than 30 lines."""
        return _joined(_within(_sections(self), LINES))


Sections = list[tuple[str, list[str]]]


def fit_report(fit: Fit) -> str:
    """Give the report of a fit.

    Coefficients with standard error, relative error and start value; those at a bound, never moved, or not
    determined by the data by name; strong correlations; errors in physical units and over the noise. Of a
    search that failed there are no numbers but NaN, and why it failed.
    """
    return _joined(_sections(fit))


def _sections(fit: Fit) -> Sections:
    return [
        ("Model", _model(fit)),
        ("Fit statistics", _statistics(fit)),
        ("Errors", _error_table(fit)),
        ("Coefficients", _coefficients(fit)),
        (f"Correlations of {_STRONG:g} and more", _correlations(fit)),
        ("Warnings", warnings_of(fit)),
    ]


def _joined(sections: Sections) -> str:
    blocks = (
        "\n".join([f"[[{title}]]", *(f"    {line}" for line in lines)]) for title, lines in sections if lines
    )
    return "\n".join(blocks)


def _within(sections: Sections, most: int) -> Sections:
    """Cut the longest section, again and again, until title and lines of all take no more than `most`."""
    kept = [len(lines) for _, lines in sections]
    shown = list(kept)

    def taken() -> int:
        cut = sum(one < all_of_it for one, all_of_it in zip(shown, kept, strict=True))
        return sum(shown) + cut + sum(count > 0 for count in kept)

    while taken() > most:
        shown[max(range(len(shown)), key=lambda place: shown[place])] -= 1
    return [
        (title, lines if count == len(lines) else [*lines[:count], f"... and {len(lines) - count} more"])
        for (title, lines), count in zip(sections, shown, strict=True)
    ]


def _model(fit: Fit) -> list[str]:
    campaign = fit.campaign
    driven = "its base" if fit.model.excitation == "base_acceleration" else "a force"
    fitted, held_out = len(campaign.fit_records), len(campaign.holdout_records)
    return [
        f"{brief(campaign.title)}: {fitted} records fitted, {held_out} held out",
        f"{float(fit.model.mass):g} kg driven by {driven}, output {campaign.output.quantity}",
        f"elements: {', '.join(element.name for element in fit.model.elements) or 'none'}",
    ]


def _statistics(fit: Fit) -> list[str]:
    stats, unit = fit.stats, OUTPUT_UNITS[fit.campaign.output.quantity]
    scatter = f"{100 * stats.stiffness_scatter:.2g} % between records"
    if stats.segment_scatter > 0.0:
        scatter += f", {100 * stats.segment_scatter:.2g} % within them"
    noise = ", ".join(filter(None, (f"from {fit.noise.method.replace('_', ' ')}", fit.noise.range_words)))
    rows = [
        ("samples", f"{stats.samples}"),
        ("coefficients", f"{stats.coefficients}"),
        ("simulations", f"{stats.steps}"),
        ("chi-square", f"{stats.chi2:.6g}"),
        ("degrees of freedom", f"{stats.dof:.6g}"),
        ("reduced chi-square", f"{stats.chi2 / stats.dof:.5g}"),
        ("AIC", f"{stats.aic:.8g}"),
        ("BIC", f"{stats.bic:.8g}"),
        ("noise", f"{fit.noise.sigma:.4g} {unit} rms, {noise}"),
        ("stiffness scatter", scatter),
        ("integration", fit.integration),
    ]
    if math.isfinite(stats.integration_error):
        rows.append(("integration error", f"{stats.integration_error:.2g} of the noise when halved"))
    rows.append(("result", "successful" if is_successful(fit.result) else RESULTS[fit.result]))
    return [f"{label:<20} = {value}" for label, value in rows]


def _error_table(fit: Fit) -> list[str]:
    unit = OUTPUT_UNITS[fit.campaign.output.quantity]
    lines = [f"{'records':<10}{'free run RMSE':>20}{'NRMSE':>10}{'restarted NRMSE':>18}{'chi2/dof':>11}"]
    return lines + [
        _error_line(_ROLES[role], errors, unit) for role, errors in fit.errors.items() if errors is not None
    ]


def _error_line(role: str, errors: Errors, unit: str) -> str:
    rmse = f"{errors.rmse:.4g} {unit}"
    free, restarted = f"{100 * errors.nrmse:.3g} %", f"{100 * errors.nrmse_segments:.3g} %"
    return f"{role:<10}{rmse:>20}{free:>10}{restarted:>18}{errors.chi2_per_dof:>11.4g}"


def _coefficients(fit: Fit) -> list[str]:
    start = {entry.name: float(entry.value) for entry in list_parameters(fit.start)}
    errors = fit.standard_errors
    listed = list_parameters(fit.model)
    width = max(len(entry.name) for entry in listed) + 1
    return [
        f"{entry.name + ':':<{width}} {_value(entry, errors.get(entry.name), start.get(entry.name), fit)}"
        for entry in listed
    ]


def _value(entry: Parameter, error: float | None, start: float | None, fit: Fit) -> str:
    value, unit = float(entry.value), plain_unit(entry.spec.unit, fit.campaign)
    if error is None:
        return f"{value:<12.6g} {unit} (fixed)"
    begun = "(added)" if start is None else f"(init = {start:.6g})"
    if not is_successful(fit.result):
        return f"{'not found':<12} {unit} {begun}"
    if not math.isfinite(error):
        return f"{value:<12.6g} +/- unknown {unit} {begun}"
    share = f" ({100 * error / abs(value):.2g} %)" if value != 0.0 else ""
    return f"{value:<12.6g} +/- {error:.3g} {unit}{share} {begun}"


def _correlations(fit: Fit) -> list[str]:
    if not is_successful(fit.result):
        return []
    correlation = fit.estimate.uncertainty.correlation
    pairs = [
        (float(correlation[i, j]), fit.free[i], fit.free[j])
        for i in range(len(fit.free))
        for j in range(i + 1, len(fit.free))
        if np.abs(correlation[i, j]) >= _STRONG
    ]
    ordered = sorted(pairs, key=lambda pair: -abs(pair[0]))
    return [f"C({one}, {other}) = {value:+.4f}" for value, one, other in ordered]


def warnings_of(fit: Fit) -> list[str]:
    """Give what a reader must know before using the coefficients of a fit.

    Args:
        fit: the fit.

    Returns:
        One sentence each; none if there is nothing to warn of.
    """
    lines = [] if is_successful(fit.result) else [f"The search failed. {RESULTS[fit.result]}"]
    lines += [
        f"The blow of {blow.record} lasts {blow.samples} samples: its shape between them, and so the "
        "momentum that it gave, is a guess. Sample faster or use a softer tip."
        for blow in brief_blows(fit.campaign)
    ]
    if not is_successful(fit.result):
        return lines
    lines += _not_determined(fit)
    lines += [bent_words(fit)] if fit.evaluation.bent else []
    start = {entry.name: float(entry.value) for entry in list_parameters(fit.start)}
    errors = fit.standard_errors
    for entry in list_parameters(fit.model):
        if entry.name not in errors:
            continue
        bound = _touched_bound(entry, errors[entry.name])
        if bound is not None:
            lines.append(
                f"{entry.name} is at its bound of {bound:g} {plain_unit(entry.spec.unit, fit.campaign)}; "
                "its error bar means little."
            )
        begun = start.get(entry.name, math.nan)
        if abs(float(entry.value) - begun) <= _UNMOVED * abs(begun):
            lines.append(f"{entry.name} never moved from its start value {begun:g}.")
    return lines


def bent_words(fit: Fit) -> str:
    """Say which standard errors do not describe how chi2 rises, and by how much.

    Args:
        fit: the fit, of which there are some.

    Returns:
        A sentence.
    """
    names = ", ".join(fit.free[one.place] for one in fit.evaluation.bent)
    rises = np.concatenate([one.rises for one in fit.evaluation.bent])
    worst = max(rises[~np.isnan(rises)], key=lambda rise: abs(rise - 1.0))
    return (
        f"The standard errors of {names} describe no more than a tangent: one of them away from the fit chi2 "
        f"rises by {worst:.3g} times what it should. The values that the data allow form a bent valley. Ask "
        "`profile` for intervals."
    )


def _not_determined(fit: Fit) -> list[str]:
    known = fit.estimate.uncertainty
    grouped = {place for group in known.partners for place in group}
    lines = [
        f"{fit.free[group[0]]} is not determined: the data hold no trace of it. Fix it."
        if len(group) == 1
        else f"{', '.join(fit.free[place] for place in group)} are not determined apart: the data fix only a "
        "combination of them. Fix one, or add records that separate them."
        for group in known.partners
    ]
    return lines + [
        f"{name} is not determined: the data hold no trace of it. Fix it."
        for place, name in enumerate(fit.free)
        if not known.determined[place] and place not in grouped
    ]


def _touched_bound(entry: Parameter, error: float) -> float | None:
    """Give the bound that a value stands on: within its standard error, or exactly."""
    value, near = float(entry.value), error if math.isfinite(error) else 0.0
    bounds = (bound for bound in (entry.spec.lower, entry.spec.upper) if math.isfinite(bound))
    return next((bound for bound in bounds if abs(value - bound) <= near), None)
