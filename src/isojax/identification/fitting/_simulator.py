"""A model simulated against records: everything that stays the same while coefficients are sought."""

import dataclasses

import numpy as np
from jaxtyping import Float

from ..._kept import recall
from ..._parameters import element_names, list_parameters
from ...models import Isolator
from ..jacobian import Prepared, Tables, Unknowns, information, internal_starts, score_information
from ._elimination import Nuisances, Spread, eliminate
from ._problem import Point, Problem

HUGE = 1e150
"""A product of residuals or derivatives above this comes of a simulation that diverged, finite or not."""


class Simulator:
    """Simulates a model against a problem; keeps the batches and start states that do not change.

    The batches depend on the delay, on its growth and on the steps a sample only, the start states on the
    internal states of the model only; both are remade when those change and at no other time.
    """

    def __init__(self, problem: Problem, at_rest: bool = False):
        """Keep the problem; nothing is simulated yet.

        Args:
            problem: the records.
            at_rest: whether internal states start at zero and are no nuisances.
        """
        self.problem = problem
        self.at_rest = at_rest
        self._heads = Simulator(problem._replace(segments=problem.heads, heads=())) if problem.heads else None
        self._tables = Tables(
            problem.records,
            problem.segments,
            problem.quantity,
            problem.hold,
            problem.integrator,
            problem.whitening,
        )
        self._internal: dict[str, Float[np.ndarray, "2 internal lanes"]] = {}
        self._last: tuple[tuple[np.ndarray, ...], Float[np.ndarray, "lanes column column"]] | None = None

    def forget(self) -> None:
        """Drop the batches, which are large; they are made again when they are next asked for."""
        self._tables.forget()
        if self._heads is not None:
            self._heads.forget()

    def sampled_otherwise(self) -> "Simulator":
        """Give the same records, taken for point samples in place of band-limited ones, or back.

        Returns:
            The simulator; deviations of initial states mean there what they mean here.
        """
        old = self.problem.integrator
        integrator = dataclasses.replace(old, band_limited=not old.band_limited)
        other = Simulator(self.problem._replace(integrator=integrator), self.at_rest)
        other._internal = dict(self._internal)
        if self._heads is not None and other._heads is not None:
            other._heads._internal = dict(self._heads._internal)
        return other

    def prepared(self, model: Isolator, carried: int) -> Prepared:
        """Give the batches for a model.

        Args:
            model: the isolator.
            carried: count of its elements that move the state (probes need no finer steps).

        Returns:
            The batches.

        Raises:
            ValueError: if an effect follows signals that no record has.
        """
        return self._tables.prepared(model, carried)

    def starts(
        self, model: Isolator, prepared: Prepared, carried: int | None = None
    ) -> tuple[Float[np.ndarray, "state lanes"], Float[np.ndarray, "state lanes"]]:
        """Give measured start states and their scales.

        Args:
            model: the isolator; the internal states of its elements follow the measured motion.
            prepared: the batches.
            carried: count of its elements that move the state; all if omitted.

        Returns:
            States and scales, one row a state.
        """
        carried = len(model.elements) if carried is None else carried
        names = element_names(model)
        known = [self._internal.get(name) for name in names[:carried]] + [None] * len(names[carried:])
        if any(states is None for states in known):
            internal = np.stack(
                recall(
                    "internal states",
                    lambda: internal_starts(model, self.problem.records, prepared, carried),
                    model,
                    carried,
                    self.problem.thinned,
                )
            )
            ends = np.cumsum([element.internal_states for element in model.elements])
            fresh = np.split(internal, ends[:-1], axis=1)
            # Nuisances are deviations from the starts, which must therefore stay while they are carried on.
            known = [new if old is None else old for old, new in zip(known, fresh, strict=True)]
            self._internal.update(zip(names[:carried], known[:carried], strict=True))
        rows = np.concatenate(
            [np.stack([prepared.starts, prepared.spread]), *(one for one in known if one is not None)], axis=1
        )
        if self.at_rest:
            rows[:, 2:] = 0.0
        return rows[0], rows[1]

    def settle(self, nuisances: Nuisances | None, model: Isolator, carried: int, spread: Spread) -> Nuisances:
        """Give nuisances to start from: those given, else none but the measured states.

        Args:
            nuisances: known ones, or None.
            model: the isolator.
            carried: count of its elements that move the state.
            spread: prior standard deviations of the stiffness scales.

        Returns:
            The nuisances.
        """
        lanes = self.prepared(model, carried).record.size
        states = 2 + sum(element.internal_states for element in model.elements[:carried])
        if nuisances is not None and nuisances.states.shape == (lanes, states):
            return nuisances
        stiffness = np.zeros(len(self.problem.records)) if nuisances is None else nuisances.stiffness
        spread = spread if nuisances is None else nuisances.spread
        known = nuisances is not None and nuisances.segments.size == lanes
        segments = nuisances.segments if nuisances is not None and known else np.zeros(lanes)
        return Nuisances(np.zeros((lanes, states)), stiffness, segments, spread)

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
        starts, scales = self.starts(model, prepared, carried)
        own = nuisances.states.shape[1]
        states = starts.copy()
        states[:own] += scales[:own] * nuisances.states.T
        factor = nuisances.factor(prepared.record)
        unknowns = Unknowns(model, directions, factor, states, scales)
        used = len(prepared.segments)
        matrices = self._matrices(unknowns, carried, prepared)[:used]
        heads = None
        if self._heads is not None:
            heads = _matrices(unknowns, carried, self._heads.prepared(model, carried))[:used]
        owner = prepared.record[:used]
        reduced = eliminate(matrices, self.problem.noise, owner, directions.shape[1], nuisances, heads)
        # Of absent effects so many columns a segment would fill the memory, and serve nothing.
        if carried < len(model.elements):
            reduced = reduced._replace(by_segment=reduced.by_segment[:0])
        return Point(model, nuisances, reduced, prepared.samples * self.problem.share)

    def _matrices(
        self, unknowns: Unknowns, carried: int, prepared: Prepared
    ) -> Float[np.ndarray, "lanes column column"]:
        """Give the information matrices, worked out anew only where something moved."""
        values = np.array([float(entry.value) for entry in list_parameters(unknowns.model)])
        at = (values, unknowns.directions, unknowns.stiffness_scale, unknowns.states, np.array([carried]))
        if self._last is not None and all(
            old.shape == new.shape and np.allclose(old, new, rtol=1e-13, atol=0.0)
            for old, new in zip(self._last[0], at, strict=True)
        ):
            return self._last[1]
        matrices = _matrices(unknowns, carried, prepared)
        self._last = (at, matrices)
        return matrices


def _matrices(
    unknowns: Unknowns, carried: int, prepared: Prepared
) -> Float[np.ndarray, "lanes column column"]:
    """Give the information matrices, NaN where a simulation left every bound."""
    sampling = prepared.sampling

    def compute() -> tuple[np.ndarray]:
        if carried == len(unknowns.model.elements):
            return (information(unknowns, prepared),)
        return (score_information(unknowns, carried, prepared),)

    (matrices,) = recall(
        "information", compute, unknowns, carried, float(sampling.time), sampling.integrator.band_limited
    )
    return np.where(np.abs(matrices) < HUGE, matrices, np.nan)
