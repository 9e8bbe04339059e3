"""Which record to measure next, found by simulation with the fitted model."""

import itertools
from collections.abc import Callable, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
from jaxtyping import Float

from ..._cores import in_own_threads
from ..._parameters import element_names, list_parameters
from ..._results import RESULTS, is_successful
from ..._types import check_float64
from ...elements import CATALOGUE, AbstractElement
from ...models import Isolator, coefficient_errors
from ...records import Campaign
from ..diagnosis import Experiment
from ..fitting import Fit, Fitted, Point, Uncertainty, as_fit, expect_uncertainty, plain_unit
from ..guess import scales as campaign_scales
from ._candidate_experiments import repeated_campaign
from ._proposals import NextTest, Proposal, rank_proposals
from ._record_candidates import (
    USUAL_DWELLS,
    outline_of_record,
    record_candidates,
    usual_bands,
    usual_levels,
)
from ._simulated_records import TrialRun
from ._test_outline import TestOutline, find_test_outline
from ._test_plan import plan_of
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

_SIDE_BY_SIDE = 24
"""Records that are simulated together; fewer are filled up, so that compiled code serves all."""

_TOO_FAR = "it moves farther than argument `farthest` allows"


class _Asked(NamedTuple):
    """What each record is asked.

    Attributes:
        fit: the present fit.
        columns: its coefficients, and the rival of an effect.
        gradient: of each number of the quantity by the coefficients.
        quantity_errors: of each at present.
        old: information of the present records, the rival among its columns; None where none is asked for.
        effect: column of the effect that has a rival.
        inflation: factor on the squared noise.
    """

    fit: Fit
    columns: Columns
    gradient: Float[np.ndarray, "number coefficient"]
    quantity_errors: Float[np.ndarray, " number"]
    old: Float[np.ndarray, "column column"] | None
    effect: int
    inflation: float

    def expected_chi2(self, information: Float[np.ndarray, "column column"]) -> float:
        """Give the chi2 between the rivals that records of this information are expected to show."""
        count = len(self.fit.free)
        strength = float(self.fit.model[self.fit.free[self.effect]]) / self.columns.sizes[self.effect]
        known = tuple(place for place in range(count) if place != self.effect)
        return expected_chi2(information, known, self.effect, count, strength) / self.inflation


@in_own_threads
def next_test(
    fit: Fit | Fitted,
    quantity: Callable[[Isolator], Any] | None = None,
    *,
    rivals: tuple[str, str | AbstractElement] | None = None,
    seconds: float | None = None,
    levels: Sequence[float] | float | None = None,
    bands: Sequence[tuple[float, float]] | tuple[float, float] | None = None,
    dwells: Sequence[int] | int = USUAL_DWELLS,
    farthest: float = 1.2,
    conditions: Sequence[Mapping[str, float]] | Mapping[str, float] | None = None,
) -> NextTest:
    """Find the record that shrinks the intervals most, or that separates two effects best.

    Each candidate is simulated with the fitted model, and its information is added to that of the records.
    The covariance is the one that a fit to all of them is expected to report, with the noise and sampling
    rate of the campaign, free initial states, and the scatter of the stiffness known from one record
    more. Without `quantity` the best candidate has the smallest determinant of it (D-optimal), with one the
    smallest variance `g' C g` of the quantity, g its gradient (c-optimal). With `rivals` it is the one with
    the largest expected chi2 between the two, over the present records and the new one.

    Args:
        fit: a fit, or what ends with one; a saved one, or one at an operating condition, has no records to
            add to.
        quantity: function of an isolator that gives real numbers, as in `uncertainty`; of several numbers,
            the geometric mean of their standard errors counts.
        rivals: catalogue name of an effect of the model with a fitted strength, and name or element of the
            one that may stand in its place. Its strength is free, its shape is not: that of the element, or
            a first guess where only a name is given.
        seconds: length of the record [s]; the mean of the fitted ones if omitted.
        levels: rms of the drive [N, or m/s^2 of the base]; those of the campaign and a third of the lowest if
            omitted.
        bands: lowest and highest frequency of each [Hz]; the campaign's, parts of it, and to half the lowest
            and twice the highest frequency if omitted.
        dwells: of a stepped sine; each lasts the same share of the record. One level, one band or one number
            of dwells may stand alone.
        farthest: largest displacement over that of the campaign; records that go beyond it are left out,
            because neither the model nor the room for motion was tested there.
        conditions: operating conditions of the record, such as {"pressure": 2e5} [Pa]; those of the campaign,
            the lowest, the middle and the highest, if omitted.

    Returns:
        The candidates, best first: stepped and swept sines upwards and downwards, and multisines.

    Raises:
        ValueError: if the fit failed or nothing drove its records on and on; if the data do not determine a
            coefficient and a quantity is asked for; if the quantity is not finite or depends on no fitted
            coefficient, `rivals` are not such effects, or levels, bands, dwells, length, reach or conditions
            are not what they must be.
        RuntimeError: if JAX is not in 64-bit mode.

    Source: Fedorov 1972, Theory of Optimal Experiments, ch. 2 (D- and c-optimality); Hunter & Reiner 1965,
    Technometrics 7:307 (rivals).

    Example:
        With the fit of `fit`'s example:

        >>> test = ij.next_test(fitted, levels=[60.0], bands=[(4.0, 7.0), (5.0, 6.0)])
        >>> bool(0.3 < test.best.shrinkage < 1.0), len(test.proposals)
        (True, 18)
        >>> print(test.best.declaration.splitlines()[0])
        [[record]]
    """
    check_float64()
    fit = as_fit(fit)
    if not is_successful(fit.result):
        raise ValueError(f"Argument `fit` must have succeeded, but it did not. {RESULTS[fit.result]}")
    plan = plan_of(seconds, levels, bands, dwells, farthest, conditions)
    asked = _ask(fit, quantity, rivals)
    whole = Isolator(fit.model.mass, (*fit.model.elements, *asked.columns.probes), fit.model.excitation)
    for one in plan.conditions or ():
        whole.at(**dict(one))  # which refuses those that nothing follows, and asks for those that are
    campaign, problem = fit.campaign, fit.estimate.problem
    steps = problem.integrator.record_steps(fit.model)
    outline = find_test_outline(campaign, steps, every_sample=needs_every_sample(asked.columns))
    if outline is None:
        raise ValueError("Argument `fit` must be of records that are driven on and on, but none is.")
    seconds = plan.seconds
    if seconds is None:
        seconds = float(np.mean([one.input.size / one.rate for one in campaign.fit_records]))
    candidates = record_candidates(
        campaign,
        outline_of_record(outline, seconds, steps),
        plan.levels or usual_levels(outline),
        plan.bands or usual_bands(outline),
        plan.dwells,
        plan.conditions or outline.conditions,
    )
    largest = _largest_motion(asked.columns, campaign, outline)
    proposals = []
    for _, group in itertools.groupby(candidates, lambda one: (one.waveform, one.dwells)):
        alike = tuple(group)
        for first in range(0, len(alike), _SIDE_BY_SIDE):
            proposals += _proposals(
                asked, outline, alike[first : first + _SIDE_BY_SIDE], seconds, plan.farthest * largest
            )
    listed = {entry.name: entry for entry in list_parameters(fit.model)}
    value = np.zeros(0) if quantity is None else np.ravel(np.asarray(quantity(fit.model), dtype=float))
    return NextTest(
        fit.free,
        tuple(plain_unit(listed[name].spec.unit, campaign) for name in fit.free),
        np.array([float(listed[name].value) for name in fit.free]),
        fit.estimate.uncertainty.standard_error,
        value,
        asked.quantity_errors,
        () if rivals is None else (rivals[0], asked.columns.probes[0].name),
        seconds,
        rank_proposals(proposals),
        float("nan") if asked.old is None else asked.expected_chi2(asked.old),
    )


def _ask(
    fit: Fit,
    quantity: Callable[[Isolator], Any] | None,
    rivals: tuple[str, str | AbstractElement] | None,
) -> _Asked:
    """Collect what each record is asked."""
    known = fit.estimate.uncertainty
    gradient, errors = np.zeros((0, len(fit.free))), np.zeros(0)
    if quantity is not None:
        carrying = coefficient_errors(fit)
        sizes = known.standard_error
        value, change = carrying._replace(root=np.diag(sizes)).carry(quantity)
        gradient = np.reshape(np.asarray(change), (-1, sizes.size)) / sizes
        if not (np.all(np.isfinite(value)) and np.all(np.isfinite(gradient))):
            raise ValueError(
                "Argument `quantity` must give finite real numbers with finite derivatives at the fitted "
                f"coefficients, but gave {np.asarray(value)}."
            )
        errors = _errors_of(gradient, fit.covariance)
        if not np.all(errors > 0.0):
            raise ValueError(
                "Argument `quantity` must depend on the fitted coefficients, but number "
                f"{int(np.argmin(errors))} of it does not."
            )
    probes, effect = _rival(fit, rivals)
    scales = campaign_scales(fit.campaign)
    columns = trial_columns(fit.estimate, probes, tuple(probe.typical_strength(scales) for probe in probes))
    old = full_matrix(columns, old_point(columns)) if probes else None
    if old is not None and not np.all(np.isfinite(old)):
        raise ValueError(
            "Argument `rivals` must end with an effect that stays finite along the motion of the records, "
            f"but {probes[0].name} does not. Give an element of another shape."
        )
    return _Asked(fit, columns, gradient, errors, old, effect, fit.estimate.inflation)


def _errors_of(
    gradient: Float[np.ndarray, "number coefficient"],
    covariance: Float[np.ndarray, "coefficient coefficient"],
) -> Float[np.ndarray, " number"]:
    return np.sqrt(np.einsum("ni,ij,nj->n", gradient, covariance, gradient))


def _rival(
    fit: Fit, rivals: tuple[str, str | AbstractElement] | None
) -> tuple[tuple[AbstractElement, ...], int]:
    """Give what may stand in place of an effect, at zero strength, and the column of the effect."""
    if rivals is None:
        return (), -1
    if not isinstance(rivals, tuple | list) or len(rivals) != 2 or rivals[0] == rivals[1]:
        raise ValueError(
            "Argument `rivals` must be a pair, an effect of the model and another that may stand in its "
            f"place, but is {rivals!r}."
        )
    name, given = rivals
    labels = element_names(fit.model)
    strengths = {
        label: f"{label}.{one.strength}" for label, one in zip(labels, fit.model.elements, strict=True)
    }
    fitted = [label for label, strength in strengths.items() if strength in fit.free]
    if name not in fitted:
        raise ValueError(
            "Argument `rivals` must begin with an effect of the model with a fitted strength "
            f"({', '.join(fitted)}), but begins with {name!r}."
        )
    if isinstance(given, str):
        if given not in CATALOGUE:
            raise ValueError(
                "Argument `rivals` must end with an element or a name of the catalogue, but ends with "
                f"{given!r}."
            )
        given = CATALOGUE[given].guess(campaign_scales(fit.campaign))
    if not isinstance(given, AbstractElement):
        raise ValueError(
            "Argument `rivals` must end with an element or a name of the catalogue, but ends with one of "
            f"type {type(given).__name__}."
        )
    rival = absent(given)
    known = [one for label, one in zip(labels, fit.model.elements, strict=True) if label in fitted]
    if any(type(one) is type(rival) and _shape(one) == _shape(rival) for one in known):
        raise ValueError(
            "Argument `rivals` must end with an effect that the model lacks, because records cannot tell an "
            f"effect from itself, but the model has {rival.name}."
        )
    return (rival,), fit.free.index(strengths[name])


def _shape(element: AbstractElement) -> tuple[float, ...]:
    """Give the numbers of an effect beside its strength."""
    own = list_parameters(element)
    return tuple(float(entry.value) for entry in own if entry.name != element.strength)


def _largest_motion(columns: Columns, campaign: Campaign, outline: TestOutline) -> float:
    """Give the largest displacement that the campaign went through [m]; NaN where it diverges."""
    made = carry_out(columns, repeated_campaign(campaign, outline), 0.0)
    return float(np.max(np.abs(made.displacement))) if isinstance(made, TrialRun) else float("nan")


def _proposals(
    asked: _Asked, outline: TestOutline, some: tuple[Experiment, ...], seconds: float, farthest: float
) -> list[Proposal]:
    """Simulate some records of one waveform side by side, and give what each is expected to say."""
    can = [place for place, one in enumerate(some) if not one.lacking]
    made = _simulated(asked, [some[place] for place in can], seconds)
    if isinstance(made, str):
        return [_left_out(asked, outline, one, one.lacking or made) for one in some]
    reach = np.max(np.abs(made.displacement), axis=1)[: len(can)]
    good = np.flatnonzero(made.finite[: len(can)] & ~(reach > farthest))
    point = None
    if good.size:
        rows = np.resize(good, _SIDE_BY_SIDE)
        kept = TrialRun(tuple(made.records[row] for row in rows), made.path[:, rows])
        point = trial_point(asked.columns, some[can[0]], kept, asked.fit.campaign.rate, 1.0)
    lanes = {can[row]: lane for lane, row in enumerate(good.tolist())}
    proposals = []
    for place, one in enumerate(some):
        if point is not None and place in lanes:
            found = _proposal(asked, outline, one, point, lanes[place], seconds)
        elif one.lacking:
            found = _left_out(asked, outline, one, one.lacking)
        elif place in lanes:
            found = _left_out(asked, outline, one, "its records have not what the rival follows")
        elif made.finite[can.index(place)]:
            found = _left_out(asked, outline, one, _TOO_FAR)
        else:
            found = _left_out(asked, outline, one, DIVERGES)
        proposals.append(found)
    return proposals


def _simulated(asked: _Asked, some: list[Experiment], seconds: float) -> TrialRun | str:
    """Simulate records side by side, filled up by repeating them."""
    if not some:
        return ""
    alike = [some[place % len(some)] for place in range(_SIDE_BY_SIDE)]
    together = some[0]._replace(
        drive=np.concatenate([one.drive for one in alike]),
        conditions=tuple(at for one in alike for at in one.conditions),
    )
    lasted = sum(one.input.size / one.rate for one in asked.fit.campaign.fit_records)
    after = (1.0, 1.0 + seconds / lasted)
    return carry_out(asked.columns, together, 0.0, after)


def _level(outline: TestOutline, experiment: Experiment) -> float:
    return outline.nominal * float(np.std(experiment.drive))


def _left_out(asked: _Asked, outline: TestOutline, experiment: Experiment, reason: str) -> Proposal:
    nothing = np.full(len(asked.fit.free), np.nan)
    lost = np.full(len(asked.gradient), np.nan)
    return Proposal(experiment, _level(outline, experiment), nothing, lost, np.nan, np.nan, reason)


def _proposal(
    asked: _Asked,
    outline: TestOutline,
    experiment: Experiment,
    point: Point,
    row: int,
    seconds: float,
) -> Proposal:
    """Give what one of the simulated records is expected to say."""
    fit, columns = asked.fit, asked.columns
    repeats = seconds / experiment.seconds
    own = point.reduced.of_record(row)
    if not np.all(np.isfinite(own.matrix)):
        return _left_out(asked, outline, experiment, DIVERGES)
    chi2 = float("nan")
    count = len(fit.free)
    if asked.old is not None:
        new = full_matrix(columns, point._replace(reduced=own))
        chi2 = asked.expected_chi2(asked.old + repeats * new)
        if np.isnan(chi2):
            return _left_out(asked, outline, experiment, DIVERGES)
    planned = own.rescaled(np.array(columns.sizes[:count]))
    estimate = fit.estimate
    after = expect_uncertainty(
        estimate.point.reduced, estimate.point.nuisances, planned, repeats, asked.inflation
    )
    quantity_errors = _errors_of(asked.gradient, after.covariance)
    shrinkage = (
        float(np.exp(np.mean(np.log(quantity_errors / asked.quantity_errors))))
        if len(asked.gradient)
        else _shrinkage(estimate.uncertainty, after)
    )
    return Proposal(
        experiment,
        _level(outline, experiment),
        after.standard_error,
        quantity_errors,
        shrinkage,
        chi2,
    )


def _shrinkage(now: Uncertainty, after: Uncertainty) -> float:
    """Give the geometric mean factor on the axes of the ellipsoid of what is determined now."""
    known = now.determined & after.determined
    if not known.any():
        return float("nan")
    volumes = []
    for one in (now, after):
        # Correlation and errors apart: stiffness in N/m and in N/m^3 must not spoil each other.
        _, logarithm = np.linalg.slogdet(one.correlation[np.ix_(known, known)])
        volumes.append(0.5 * logarithm + np.sum(np.log(one.standard_error[known])))
    return float(np.exp((volumes[1] - volumes[0]) / np.count_nonzero(known)))
