"""A model held against records: everything that stays the same while coefficients are sought."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from jaxtyping import Float

from .._parameters import list_parameters
from ..excitations import Hold
from ..models import Integrator, Isolator, Quantity
from ..records import Record
from ._batch import Prepared, internal_starts, prepare
from ._columns import column_information
from ._elimination import Nuisances, Reduced, eliminate
from ._information import STIFFNESS_SCALE_UNIT, Unknowns, has_stiffness_scale, information
from ._segments import Segment, cut_segments


class Problem(NamedTuple):
    """Records cut into segments, and the noise against which errors are held.

    Attributes:
        records: the records.
        segments: pieces of them.
        quantity: what the sensor measures.
        hold: what the drive does between samples.
        noise: rms of the noise [SI unit of the output].
        integrator: solver and steps.
    """

    records: tuple[Record, ...]
    segments: tuple[Segment, ...]
    quantity: Quantity
    hold: Hold
    noise: float
    integrator: Integrator


class Point(NamedTuple):
    """A model with the nuisances that belong to it, and the equations there.

    Attributes:
        model: the isolator.
        nuisances: where they stand.
        reduced: normal equations of the columns asked for.
        samples: count of samples that count in each record.
    """

    model: Isolator
    nuisances: Nuisances
    reduced: Reduced
    samples: Float[np.ndarray, " record"]

    @property
    def free_samples(self) -> float:
        """Samples less the degrees of freedom that the nuisances took."""
        return float(np.sum(self.samples - self.reduced.eliminated))

    @property
    def chi2(self) -> float:
        """Sum of squared whitened residuals after the nuisances, with their priors."""
        return float(self.reduced.matrix[-1, -1])

    @property
    def is_finite(self) -> bool:
        """Whether every segment's simulation stayed finite."""
        return bool(np.all(np.isfinite(self.reduced.matrix)))


class Bench:
    """Simulates a model against a problem; keeps the batches and start states that do not change.

    The batches depend on the delay and on the steps a sample only, the start states on the memories of the model
    only; both are remade when those change and at no other time.
    """

    def __init__(self, problem: Problem):
        """Keep the problem; nothing is simulated yet."""
        self.problem = problem
        self._prepared: dict[tuple[int, float], Prepared] = {}
        self._starts: (
            tuple[object, Float[np.ndarray, "state lanes"], Float[np.ndarray, "state lanes"]] | None
        ) = None

    def prepared(self, model: Isolator, carried: int) -> Prepared:
        """Give the batches for a model.

        Args:
            model: the isolator.
            carried: count of its elements that move the state (probes need no finer steps).

        Returns:
            The batches.
        """
        problem = self.problem
        steps = problem.integrator.steps_per_sample(
            Isolator(model.mass, model.elements[:carried], model.excitation)
        )
        key = (steps, float(model.shift()))
        if key not in self._prepared:
            self._prepared.clear()
            self._prepared[key] = prepare(
                problem.records,
                problem.segments,
                quantity=problem.quantity,
                hold=problem.hold,
                substeps=steps,
                shift=key[1],
            )
        return self._prepared[key]

    def starts(
        self, model: Isolator, prepared: Prepared
    ) -> tuple[Float[np.ndarray, "state lanes"], Float[np.ndarray, "state lanes"]]:
        """Give measured start states and their scales.

        Args:
            model: the isolator; the memories of its elements follow the measured motion.
            prepared: the batches.

        Returns:
            States and scales, one row a state.
        """
        key = tuple(element.name for element in model.elements if element.internal_states)
        if self._starts is None or self._starts[0] != key:
            inner, spread = internal_starts(model, self.problem.records, prepared)
            self._starts = (key, np.vstack([prepared.starts, inner]), np.vstack([prepared.spread, spread]))
        return self._starts[1], self._starts[2]

    def settle(self, nuisances: Nuisances | None, model: Isolator, carried: int, spread: float) -> Nuisances:
        """Give nuisances to begin with: those given, else none but the measured states.

        Args:
            nuisances: known ones, or None.
            model: the isolator.
            carried: count of its elements that move the state.
            spread: prior standard deviation of the stiffness scales.

        Returns:
            The nuisances.
        """
        lanes = self.prepared(model, carried).record.size
        states = 2 + sum(element.internal_states for element in model.elements[:carried])
        if nuisances is not None and nuisances.states.shape == (lanes, states):
            return nuisances
        stiffness = np.zeros(len(self.problem.records)) if nuisances is None else nuisances.stiffness
        spread = spread if nuisances is None else nuisances.stiffness_spread
        return Nuisances(np.zeros((lanes, states)), stiffness, spread)

    def evaluate(
        self,
        model: Isolator,
        directions: Float[np.ndarray, "parameter column"],
        nuisances: Nuisances,
        carried: int | None = None,
    ) -> Point:
        """Simulate, differentiate, and eliminate the nuisances.

        Args:
            model: the isolator; elements beyond `carried` are probes at zero strength.
            directions: changes of the parameters, one column each.
            nuisances: where they stand.
            carried: count of elements that move the state; all if omitted.

        Returns:
            The point.
        """
        carried = len(model.elements) if carried is None else carried
        prepared = self.prepared(model, carried)
        starts, scales = self.starts(model, prepared)
        own = nuisances.states.shape[1]
        states = starts.copy()
        states[:own] += scales[:own] * nuisances.states.T
        factor = 1.0 + stiffness_deviation(nuisances)[prepared.record]
        unknowns = Unknowns(model, directions, factor, states, scales)
        if carried == len(model.elements):
            matrices = information(unknowns, prepared)
        else:
            matrices = column_information(unknowns, carried, prepared)
        reduced = eliminate(
            matrices,
            self.problem.noise,
            prepared.record,
            len(prepared.segments),
            len(self.problem.records),
            directions.shape[1],
            has_stiffness_scale(model),
            nuisances,
        )
        return Point(model, nuisances, reduced, prepared.count)


def stiffness_deviation(nuisances: Nuisances) -> Float[np.ndarray, " record"]:
    """Give each record's relative deviation of the linear stiffness.

    Args:
        nuisances: where they stand.

    Returns:
        Relative deviations, one a record.
    """
    return nuisances.stiffness * STIFFNESS_SCALE_UNIT


def one_hot(
    model: Isolator, places: Sequence[int], sizes: Sequence[float]
) -> Float[np.ndarray, "parameter column"]:
    """Give directions along single parameters.

    Args:
        model: the isolator.
        places: parameters, by their place in `list_parameters`.
        sizes: size of one unit of change of each.

    Returns:
        One column a place.
    """
    directions = np.zeros((len(list_parameters(model)), len(places)))
    directions[list(places), range(len(places))] = sizes
    return directions


def build_problem(
    records: tuple[Record, ...],
    model: Isolator,
    *,
    quantity: Quantity,
    hold: Hold,
    noise: float,
    integrator: Integrator,
) -> Problem:
    """Cut records into segments for a model.

    Args:
        records: the records.
        model: the isolator, for its memory.
        quantity: what the sensor measures.
        hold: what the drive does between samples.
        noise: rms of the noise [SI unit of the output].
        integrator: solver and steps.

    Returns:
        The problem.
    """
    return Problem(records, cut_segments(records, model), quantity, hold, noise, integrator)
