"""Coefficients estimated from time histories, with the scatter of the stiffness from record to record."""

from collections import defaultdict
from collections.abc import Callable
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
import optimistix as optx
from jaxtyping import Array

from ..._parameters import Parameter, list_parameters, replace_parameters
from ..._results import RESULTS, is_successful
from ...elements import Scales
from ...excitations import Hold
from ...models import Isolator
from ...records import Record
from ..jacobian import STIFFNESS_SCALE_UNIT, has_stiffness_scale
from ._covariance import Uncertainty, uncertainty, unknown
from ._descent import Rival, descend
from ._elimination import Nuisances, Spread
from ._initial_states import HELD, best_nuisances
from ._problem import Point, Simulator, one_hot
from ._segment_scatter import segment_scatter

FIRST_STIFFNESS_SPREAD = Spread(1e-2)
"""Prior of the stiffness scales before the records have said how much they scatter: one percent."""

SMALLEST_STIFFNESS_SPREAD = 1e-5

_SAME_SCATTER = 0.1
"""Relative difference up to which two scatters within records are one."""


class Estimate(NamedTuple):
    """Fitted coefficients and what is known of them.

    Attributes:
        model: the fitted isolator.
        places: free coefficients, by their place in `list_parameters`.
        simulator: the records it was held against.
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
    def excess(self) -> float:
        """What the model leaves unexplained beyond the noise: chi2 - dof."""
        return self.chi2 - self.dof


def free_places(
    model: Isolator, fixed: tuple[str, ...], free: tuple[str, ...] | None, mass_free: bool
) -> tuple[int, ...]:
    """Give the coefficients to fit.

    Args:
        model: the isolator.
        fixed: names to hold.
        free: names to fit, and no others; by default every fitted kind.
        mass_free: whether the mass is among them by default.

    Returns:
        Their places in `list_parameters`.

    Raises:
        ValueError: if a name is no parameter of the model, or nothing is left to fit.
    """
    listed = list_parameters(model)
    known = [entry.name for entry in listed]
    for argument, names in (("fixed", fixed), ("free", free or ())):
        for name in names:
            if name not in known:
                raise ValueError(
                    f"Argument `{argument}` must name parameters of the model ({', '.join(known)}), "
                    f"but holds {name!r}."
                )

    def chosen(entry: Parameter) -> bool:
        if free is not None:
            return entry.name in free
        wanted = entry.spec.fitted or (entry.name == "mass" and mass_free)
        return wanted and entry.name not in fixed

    places = tuple(place for place, entry in enumerate(listed) if chosen(entry))
    if not places:
        raise ValueError(
            "Arguments `free` and `fixed` must leave at least one coefficient to fit, but leave none."
        )
    return places


def magnitudes(model: Isolator, places: tuple[int, ...], scales: Scales) -> tuple[float, ...]:
    """Give the magnitude of each free coefficient: its value, or what would matter where it is zero.

    Args:
        model: the isolator.
        places: free coefficients.
        scales: magnitudes of the records.

    Returns:
        One positive number a coefficient.
    """
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


def stiffness_scatter(records: tuple[Record, ...], point: Point, inflation: float) -> float:
    """Give the standard deviation of the linear stiffness between repeats of a record.

    Repeats at equal level and direction share every deterministic error of the model, so that their
    differences show repeatability alone; without repeats, records of equal level serve, then all records.

    Args:
        records: the records.
        point: equations with loose stiffness scales.
        inflation: chi2/dof.

    Returns:
        Relative standard deviation, not below `SMALLEST_STIFFNESS_SPREAD`.
    """
    values = (point.nuisances.stiffness + point.reduced.stiffness_map[:, -1]) * STIFFNESS_SCALE_UNIT
    variance = point.reduced.stiffness_variance * max(1.0, inflation)
    for key in (lambda r: (r.level, r.direction), lambda r: r.level, lambda r: None):
        groups = defaultdict(list)
        for place, record in enumerate(records):
            groups[key(record)].append(place)
        groups = [group for group in groups.values() if len(group) > 1]
        if groups:
            squares = sum(np.sum((values[group] - values[group].mean()) ** 2) for group in groups)
            expected = sum(np.mean(variance[group]) * (len(group) - 1) for group in groups)
            freedom = sum(len(group) - 1 for group in groups)
            return float(np.sqrt(max((squares - expected) / freedom, SMALLEST_STIFFNESS_SPREAD**2)))
    return 1e-3


def _spread(
    simulator: Simulator, point: Point, places: tuple[int, ...], within: float, inflation: float
) -> Spread:
    """Tell the scatter of the stiffness between records, beside that within them."""
    records = simulator.problem.records
    if len(records) == 1:
        return Spread(SMALLEST_STIFFNESS_SPREAD, within)
    loose = FIRST_STIFFNESS_SPREAD._replace(segments=within)
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
        return jnp.asarray(replace_parameters(model, values).shift(), dtype=float)

    slopes = jax.jacfwd(shift)([jnp.asarray(entry.value, dtype=float) for entry in listed])
    for place in places:
        if float(slopes[place]) != 0.0:
            raise ValueError(
                f"{listed[place].name} cannot be fitted where the drive is held from sample to "
                "sample: what jumps has no derivative in time. Fix it, or declare another [input] hold."
            )


def estimate(
    simulator: Simulator,
    model: Isolator,
    places: tuple[int, ...],
    scales: Scales,
    *,
    nuisances: Nuisances | None,
    solver: optx.AbstractLeastSquaresSolver,
    max_steps: int,
    progress: Callable[[str], None],
    tolerance: float = 1e-2,
    rival: Rival | None = None,
    anew: bool = False,
) -> Estimate:
    """Fit the free coefficients of a model to records.

    Args:
        simulator: the records.
        model: start.
        places: free coefficients.
        scales: magnitudes of the records.
        nuisances: known nuisances of an earlier fit, with the scatter of the stiffness; else it is estimated.
        solver: an optimistix least-squares solver.
        max_steps: evaluations after which a search gives up.
        progress: told a line a step.
        tolerance: decrease of chi2 per max(chi2/dof, 1) below which the search is over.
        rival: another model, far behind which the search is given up.
        anew: whether the scatter of the stiffness within records is told again from this model, though it is
            known of another.

    Returns:
        The estimate.
    """
    _check_delay(model, places, simulator.problem.hold)
    carried = len(model.elements)
    known = nuisances is not None
    start = simulator.settle(nuisances, model, carried, FIRST_STIFFNESS_SPREAD)
    if not known and any(record.kind == "free_decay" for record in simulator.problem.records):
        # A release is largest where its integral is least known: the states are sought before a coefficient.
        settled = best_nuisances(simulator, model, HELD)
        if settled.is_finite:
            start = settled.nuisances._replace(spread=FIRST_STIFFNESS_SPREAD)
    sizes = magnitudes(model, places, scales)
    # The scatter of the stiffness is found from a rough solution; the search goes on from there.
    rough = max(tolerance, 1.0) if has_stiffness_scale(model) and not known else tolerance
    found = descend(
        simulator,
        model,
        places,
        sizes,
        start,
        solver=solver,
        max_steps=max_steps,
        tolerance=rough,
        rival=rival,
        progress=progress,
    )
    steps = found.steps
    if is_successful(found.result) and has_stiffness_scale(model) and (anew or not known):
        problem, old = simulator.problem, found.point.nuisances
        inflation = found.point.chi2 / max(1.0, found.point.free_samples)
        within = segment_scatter(problem.records, problem.segments, found.point, inflation)
        moved = abs(within - old.spread.segments) > _SAME_SCATTER * max(within, old.spread.segments)
        if moved or not known:
            spread = _spread(simulator, found.point, places, within, inflation)
            progress(
                f"linear stiffness scatters by {100 * spread.records:.2g} % between records"
                + (f" and by {100 * within:.2g} % within them" if within else "")
            )
            own = old.segments if within else np.zeros_like(old.segments)
            found = descend(
                simulator,
                found.point.model,
                places,
                sizes,
                old._replace(segments=own, spread=spread),
                solver=solver,
                max_steps=max_steps,
                tolerance=tolerance,
                progress=progress,
            )
            steps += found.steps
    point = found.point
    dof = max(1.0, point.free_samples - len(places))
    error = (
        uncertainty(point.reduced.matrix[:-1, :-1], max(1.0, point.chi2 / dof))
        if is_successful(found.result)
        else unknown(len(places))
    )
    return Estimate(point.model, places, simulator, point, error, found.result, steps)
