"""Coefficients estimated from time histories, with the scatter of the stiffness from record to record."""

from collections import defaultdict
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array

from ..._parameters import Parameter, full_names, list_parameters, replace_parameters
from ..._results import RESULTS, is_successful
from ..._show import shown
from ...elements import Scales
from ...excitations import Hold
from ...models import Isolator
from ...records import Record
from .._rules import Rules
from ..jacobian import STIFFNESS_SCALE_UNIT, has_stiffness_scale
from ._covariance import Uncertainty, invert_information, unknown
from ._descent import descend
from ._elimination import Nuisances, Spread
from ._initial_states import HELD, best_nuisances, may_start_wrong
from ._problem import Point, Problem, one_hot
from ._scatter_mixture import integrate_scatter, scatter_of_next
from ._search import ROUGH, Search
from ._segment_scatter import segment_scatter
from ._simulator import Simulator

FIRST_SCATTER = 1e-2
"""Standard deviation of the linear stiffness between records before they show one [relative]: the prior."""


@shown
class Estimate(NamedTuple):
    """Fitted coefficients and what is known of them.

    Attributes:
        model: the fitted isolator.
        places: free coefficients, by their place in `list_parameters`.
        simulator: the records it was fitted to.
        point: equations at the solution, columns in physical units.
        uncertainty: of the free coefficients.
        result: how the search ended.
        steps: evaluations of simulation and derivatives.
    """

    model: Isolator
    places: tuple[int, ...]
    simulator: Simulator
    point: Point
    uncertainty: Uncertainty
    result: RESULTS
    steps: int

    @property
    def problem(self) -> Problem:
        """The records that it was fitted to, cut into segments."""
        return self.simulator.problem

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the free coefficients."""
        listed = list_parameters(self.model)
        return tuple(listed[place].name for place in self.places)

    @property
    def chi2(self) -> float:
        """Sum of squared whitened residuals after the nuisances."""
        return self.point.chi2

    @property
    def dof(self) -> float:
        """Samples less nuisances less free coefficients."""
        return max(1.0, self.point.free_samples - len(self.places))

    @property
    def misfit(self) -> float:
        """chi2 and the degrees of freedom that the nuisances took: alike for models of more and fewer states.

        Each initial state that a model adds to a segment lowers chi2 by what it takes, law or no law.
        """
        return self.chi2 + float(np.sum(self.point.reduced.eliminated))

    @property
    def inflation(self) -> float:
        """Factor on the squared noise in error bars: max(1, chi2/dof)."""
        return max(1.0, self.chi2 / self.dof)

    @property
    def comparable_nuisances(self) -> Nuisances:
        """Nuisances from which chi2 may be compared at other coefficients.

        Where the motion is split at kinks chi2 is rough in the initial states: they stay where they stand.
        """
        own = self.point.nuisances
        return own.held_fast() if self.model.splits else own

    @property
    def shows_scatter(self) -> bool:
        """Whether error bars allow for a scatter of the stiffness; a single record shows none."""
        return has_stiffness_scale(self.model) and self.point.samples.size > 1

    @property
    def next_stiffness_scatter(self) -> float:
        """By how much the linear stiffness of a further record deviates [relative]; NaN where none shows."""
        if not self.shows_scatter:
            return float("nan")
        return scatter_of_next(self.point.reduced, self.point.nuisances, self.inflation)

    @property
    def excess(self) -> float:
        """What the model leaves unexplained beyond the noise: chi2 - dof."""
        return self.chi2 - self.dof


def free_places(
    model: Isolator, fixed: tuple[str, ...], free: tuple[str, ...] | None, mass_free: bool
) -> tuple[int, ...]:
    """Give the coefficients to fit.

    Args:
        model: the isolator.
        fixed: names or symbols to hold.
        free: names or symbols to fit, and no others; by default every fitted kind.
        mass_free: whether the mass is among them by default.

    Returns:
        Their places in `list_parameters`.

    Raises:
        ValueError: if a name is no parameter of the model or names one again, or nothing is left to fit.
    """
    held, chosen = full_names(model, fixed, "fixed"), full_names(model, free or (), "free")

    def is_free(entry: Parameter) -> bool:
        if free is not None:
            return entry.name in chosen
        wanted = entry.spec.fitted or (entry.name == "mass" and mass_free)
        return wanted and entry.name not in held

    places = tuple(place for place, entry in enumerate(list_parameters(model)) if is_free(entry))
    if not places:
        raise ValueError(
            "Arguments `free` and `fixed` must leave at least one coefficient to fit, but leave none."
        )
    return places


def magnitudes(model: Isolator, places: tuple[int, ...], scales: Scales) -> tuple[float, ...]:
    """Give the magnitude of each free coefficient: its value, or what would matter where it is zero."""
    typical = {
        f"{element.name}.{element.strength}": abs(element.typical_strength(scales))
        for element in model.elements
    }
    listed = list_parameters(model)
    sizes = []
    for place in places:
        value = abs(float(listed[place].value))
        floor = 1e-3 * typical.get(listed[place].name, 0.0)
        sizes.append(max(value, floor) or 1.0)
    return tuple(sizes)


MUCH_LESS_SCATTER = 0.1
"""Scatter that a model shows, over that of a model before it, below which that was the model's own error."""

SMALLEST_SCATTER = 1e-5
"""Least scatter of the linear stiffness between records [relative]: that of a rig whose repeats show none."""


def stiffness_scatter(records: tuple[Record, ...], point: Point, inflation: float) -> float:
    """Give the standard deviation of the linear stiffness between repeats of a record.

    Repeats at equal level, direction and operating conditions share every deterministic error of the model,
    so that their differences show repeatability alone; without repeats, records of equal level serve, then
    those of equal conditions, then all. Records at unequal pressures would pass its effect for scatter.

    Args:
        records: the records, two at least.
        point: equations with loose stiffness scales.
        inflation: chi2/dof.

    Returns:
        Relative standard deviation.
    """
    values = (point.nuisances.stiffness + point.reduced.stiffness_map[:, -1]) * STIFFNESS_SCALE_UNIT
    variance = point.reduced.stiffness_variance * max(1.0, inflation)
    groups: list[list[int]] = []
    for key in (
        lambda r: (r.conditions, r.level, r.direction),
        lambda r: (r.conditions, r.level),
        lambda r: r.conditions,
        lambda r: None,
    ):
        alike = defaultdict(list)
        for place, record in enumerate(records):
            alike[key(record)].append(place)
        groups = groups or [group for group in alike.values() if len(group) > 1]
    squares = sum(np.sum((values[group] - values[group].mean()) ** 2) for group in groups)
    expected = sum(np.mean(variance[group]) * (len(group) - 1) for group in groups)
    freedom = sum(len(group) - 1 for group in groups)
    return float(np.sqrt(max((squares - expected) / freedom, SMALLEST_SCATTER**2)))


def _spread(
    simulator: Simulator, point: Point, places: tuple[int, ...], within: float, rules: Rules
) -> Spread:
    """Estimate the scatter of the stiffness between records, beside that within them."""
    records = simulator.problem.records
    if len(records) == 1:
        return Spread(SMALLEST_SCATTER, within)
    inflation = _inflation(point)
    loose = Spread(FIRST_SCATTER, within)
    if point.nuisances.spread != loose:
        # What scatters within records moves their means, too, and must not count twice.
        directions = one_hot(point.model, places, [1.0] * len(places))
        point = simulator.evaluate(point.model, directions, point.nuisances._replace(spread=loose))
    return Spread(stiffness_scatter(records, point, inflation), within)


def _check_delay(model: Isolator, places: tuple[int, ...], hold: Hold) -> None:
    """Refuse to fit a delay of a drive that jumps: the response has no derivative with respect to it."""
    if hold != "zero_order":
        return
    listed = list_parameters(model)

    def shift(values: list[Array]) -> Array:
        return jnp.asarray(replace_parameters(model, values).shift(1.0), dtype=float)

    slopes = jax.jacfwd(shift)([jnp.asarray(entry.value, dtype=float) for entry in listed])
    for place in places:
        if float(slopes[place]) != 0.0:
            raise ValueError(
                f"{listed[place].name} cannot be fitted where the drive is held from sample to "
                "sample: what jumps has no derivative in time. Fix it, or declare another [input] hold."
            )


def _inflation(point: Point) -> float:
    return point.chi2 / max(1.0, point.free_samples)


def estimate(
    simulator: Simulator,
    model: Isolator,
    places: tuple[int, ...],
    search: Search,
    nuisances: Nuisances | None = None,
    anew: bool = False,
) -> Estimate:
    """Fit the free coefficients of a model to records.

    Args:
        simulator: the records.
        model: start.
        places: free coefficients.
        search: how to search.
        nuisances: known nuisances of an earlier fit, with the scatter of the stiffness; else it is estimated.
        anew: whether the scatter of the stiffness is estimated again with this model, though it is known with
            another: that within records, and that between them where it was another's error.

    Returns:
        The estimate.
    """
    _check_delay(model, places, simulator.problem.hold)
    known, scatters = nuisances is not None, has_stiffness_scale(model)
    sizes = magnitudes(model, places, search.scales)
    # The scatter of the stiffness is estimated at a rough solution; the search goes on from there.
    rough = (
        max(search.tolerance, ROUGH * search.rules.close_bic) if scatters and not known else search.tolerance
    )
    start = _start(simulator, model, nuisances, Spread(FIRST_SCATTER))
    found = descend(simulator, model, places, sizes, start, search._replace(tolerance=rough))
    steps = found.steps
    if is_successful(found.result):
        simulator, fits_better = _sampled_as_measured(simulator, found.point, places, search)
        if fits_better:
            own = search._replace(tolerance=rough)
            found = descend(simulator, found.point.model, places, sizes, found.point.nuisances, own)
            steps += found.steps
    if is_successful(found.result) and may_start_wrong(simulator, found.point, known):
        settled = best_nuisances(simulator, found.point.model, HELD, places=places)
        if settled.chi2 < found.point.chi2 - search.rules.close_bic:
            start = settled.nuisances._replace(spread=found.point.nuisances.spread)
            found = descend(simulator, settled.model, places, sizes, start, search._replace(tolerance=rough))
            steps += found.steps
    if is_successful(found.result) and scatters and (anew or not known):
        settled = _with_scatter(simulator, found.point, places, search, known)
        if settled is not None:
            again = search._replace(rival=None)
            found = descend(simulator, found.point.model, places, sizes, settled, again)
            steps += found.steps
    model, nothing = found.point.model, unknown(len(places))
    whole = Estimate(model, places, simulator, found.point, nothing, found.result, steps)
    return whole._replace(uncertainty=_uncertainty(whole)) if is_successful(found.result) else whole


def _sampled_as_measured(
    simulator: Simulator, point: Point, places: tuple[int, ...], search: Search
) -> tuple[Simulator, bool]:
    """Find out whether the samples of a reading that jumps are band-limited.

    Nothing in the records says whether an anti-aliasing filter stood before them. The fit does.

    Returns:
        The simulator that agrees with the records, and whether it is another one.
    """
    problem = simulator.problem
    if not point.model.splits or problem.quantity != "acceleration" or not problem.integrator.is_locked:
        return simulator, False
    other = simulator.sampled_otherwise()
    columns = one_hot(point.model, places, [1.0] * len(places))
    chi2 = other.evaluate(point.model, columns, point.nuisances).chi2
    if not chi2 < point.chi2 - search.rules.close_bic:
        return simulator, False
    words = "band-limited" if other.problem.integrator.band_limited else "taken at instants"
    search.progress(f"samples beside a jump agree with readings {words}")
    return other, True


def _uncertainty(found: Estimate) -> Uncertainty:
    """Give the error bars; a single record shows no scatter and has none in them."""
    if found.shows_scatter:
        return integrate_scatter(found.point.reduced, found.point.nuisances, found.inflation)
    return invert_information(found.point.reduced.matrix[:-1, :-1], found.inflation)


def _start(simulator: Simulator, model: Isolator, nuisances: Nuisances | None, spread: Spread) -> Nuisances:
    """Give the nuisances that a search starts from."""
    if nuisances is None and any(record.kind == "free_decay" for record in simulator.problem.records):
        # A release is largest where its integral is least known: the states are sought before a coefficient.
        settled = best_nuisances(simulator, model, HELD)
        if settled.is_finite:
            return settled.nuisances._replace(spread=spread)
    return simulator.settle(nuisances, model, len(model.elements), spread)


def _with_scatter(
    simulator: Simulator, point: Point, places: tuple[int, ...], search: Search, known: bool
) -> Nuisances | None:
    """Give the nuisances with the scatter that repeats show; None where it is known and stays as it is."""
    problem, old, rules = simulator.problem, point.nuisances, search.rules
    within = segment_scatter(problem.records, problem.segments, point, _inflation(point), rules)
    spread = _spread(simulator, point, places, within, rules)
    if known and within == old.spread.segments and spread.records > MUCH_LESS_SCATTER * old.spread.records:
        return None
    search.progress(
        f"linear stiffness scatters by {100 * spread.records:.2g} % between records"
        + (f" and by {100 * within:.2g} % within them" if within else "")
    )
    own = old.segments if within else np.zeros_like(old.segments)
    return old._replace(segments=own, spread=spread)
