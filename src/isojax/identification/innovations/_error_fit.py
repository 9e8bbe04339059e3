"""A model fitted together with the sizes of its errors."""

import dataclasses
from functools import cached_property

import numpy as np
from jaxtyping import Float

from ..._parameters import list_parameters
from ..._results import RESULTS
from ...models import Isolator
from ._ahead import free_squares
from ._first_states import covariance_of
from ._measured import Measured
from ._record_filter import COPIES, RecordFilter
from ._sizes import Sizes, Way

_NO_FORCE = 0.05
"""Share of the innovations' variance below which the random force does not matter."""

_DETERMINED = 10.0
"""Information of the logarithm of the random force's variance from which there is a force: its variance is
then known to a third."""

_LAGS = 20
"""Samples back from which an innovation may be foretold."""

_WHITE_ENOUGH = 0.03
"""Share of an innovation's variance that those before it may foretell where the error is noise."""

_RECORDS_ALIKE = 0.3
"""Difference of the innovations' variance from that expected, relative, up to which records are alike."""


@dataclasses.dataclass(frozen=True, eq=False)
class ErrorFit:
    """A model fitted together with the sizes of its errors.

    Attributes:
        model: the fitted isolator.
        places: free coefficients, by their place in `list_parameters`.
        sizes: of the errors.
        deviance: of each record: -2 log-likelihood of its innovations but for a constant.
        products: `A^T A` of each record, of the innovations' slopes with the coefficients [inverse product of
            their units] and, last, the innovations; over their standard deviations.
        samples: samples that count.
        result: how the search ended.
        steps: steps that it took.
        filter: of the model over the records.
        way: of the filter at the solution.
        unkept: decrease of the deviance that its slopes promise at the solution, and that no step keeps.
    """

    model: Isolator
    places: tuple[int, ...]
    sizes: Sizes
    deviance: Float[np.ndarray, " record"]
    products: Float[np.ndarray, "row row record"]
    samples: float
    result: RESULTS
    steps: int
    filter: RecordFilter
    way: Way
    unkept: float = 0.0

    @property
    def values(self) -> Float[np.ndarray, " column"]:
        """The free coefficients."""
        listed = list_parameters(self.model)
        return np.array([float(listed[place].value) for place in self.places])

    @property
    def names(self) -> tuple[str, ...]:
        """Their names."""
        listed = list_parameters(self.model)
        return tuple(listed[place].name for place in self.places)

    @property
    def information(self) -> Float[np.ndarray, "column column"]:
        """Of the coefficients [inverse product of their units]."""
        return self.products.sum(axis=-1)[:-1, :-1]

    @property
    def covariance(self) -> Float[np.ndarray, "column column"]:
        """Of the coefficients [product of their units]; zero where the records determine nothing."""
        return covariance_of(self.information)

    @property
    def chi2(self) -> float:
        """Sum of squared innovations over their variances."""
        return float(self.products[-1, -1].sum())

    @cached_property
    def seen(self) -> list[tuple[Float[np.ndarray, " time"], Float[np.ndarray, " time"]]]:
        """Innovations of each record and their standard deviations, where they count [unit of the output]."""
        prepared, found = self.filter.prepared, {}
        width = prepared.order.size // len(prepared.batches)
        for part, trace in enumerate(self.way.traces):
            error, deviation = np.asarray(trace.error), np.asarray(trace.deviation)
            for lane in range(width):
                counted = np.isfinite(deviation[:, lane])
                place = int(prepared.order[part * width + lane])
                found[place] = error[counted, lane], deviation[counted, lane]
        return [found[place] for place in range(self.filter.count)]

    @property
    def innovations(self) -> list[Float[np.ndarray, " time"]]:
        """Innovations of each record over their standard deviations."""
        return [error / deviation for error, deviation in self.seen]

    @property
    def misses(self) -> Float[np.ndarray, " record"]:
        """Rms of the innovations of each record [SI unit of the output]; 0 where no sample counts."""
        return np.array([np.sqrt(np.sum(error**2) / max(error.size, 1)) for error, _ in self.seen])

    @cached_property
    def force_share(self) -> float:
        """Share of the innovations' variance that the random force causes, at most over the records."""
        pairs = zip(np.exp(self.sizes.noise), self.seen, strict=True)
        shares = [1.0 - noise * float(np.mean(own**-2)) for noise, (_, own) in pairs if own.size]
        return max(shares, default=0.0)

    @cached_property
    def colour(self) -> float:
        """How well earlier innovations foretell one, the worst of any record: squared correlations."""
        return max(map(foretold, self.innovations), default=0.0)

    @property
    def inflation(self) -> float:
        """Factor on the covariance: the correlation time of the innovations [samples]."""
        times = [1.0]
        for white in self.innovations:
            own = white - white.mean()
            power = float(own @ own) or 1.0
            times.append(
                1.0 + 2.0 * sum(float(own[:-lag] @ own[lag:]) / power for lag in range(1, _LAGS + 1))
            )
        return max(times)

    @cached_property
    def has_force(self) -> bool:
        """Whether the records determine a random force beside the noise of the output, however small."""
        fisher = np.where(np.isfinite(self.way.fisher), self.way.fisher, 0.0)
        noise = np.maximum(fisher[2, 2], 1e-300)
        return float(np.sum(fisher[0, 0] - fisher[0, 2] ** 2 / noise)) > _DETERMINED

    @property
    def is_noise_of_output(self) -> bool:
        """Whether the error is noise of the output alone."""
        return bool(np.isfinite(self.deviance.sum())) and self.force_share < _NO_FORCE

    @property
    def is_noise(self) -> bool:
        """Whether the error is noise: of the output alone, or white and as large in every record."""
        if not np.isfinite(self.deviance.sum()):
            return False
        if self.is_noise_of_output:
            return True
        counted = np.array([max(own.size, 1) for own in self.innovations])
        levels = self.products[-1, -1] / counted
        return self.colour < _WHITE_ENOUGH and bool(np.all(np.abs(levels - 1.0) < _RECORDS_ALIKE))

    @cached_property
    def free_squares(self) -> Float[np.ndarray, " record"]:
        """Squared error of each record, simulated with nothing fed back [squared SI unit of the output]."""
        return free_squares(self.filter, self.places, self.values, self.way)

    def followed(self, measured: Measured) -> tuple[RecordFilter, Way]:
        """Filter other records of the campaign, their noise as loud as that of the fitted ones.

        Args:
            measured: the records.

        Returns:
            The filter of the model over them, and its way along them.
        """
        other = RecordFilter(self.model, measured, self.filter.steps)
        noise = np.log(np.mean(np.exp(self.sizes.noise)))
        sizes = self.sizes._replace(noise=np.full(other.count, noise)).around()
        points = np.repeat(self.values[None], COPIES, axis=0)
        other.widen(other.follow(self.places, points, sizes).squares)
        return other, other.follow(self.places, points, sizes)

    @property
    def free_error(self) -> float:
        """The rms of that error over all records [SI unit of the output]; infinite where one diverges."""
        squares = self.free_squares.sum()
        return float(np.sqrt(squares / self.samples)) if np.isfinite(squares) else np.inf

    @property
    def criterion(self) -> float:
        """Schwarz's criterion."""
        return float(self.deviance.sum()) + len(self.places) * float(np.log(self.samples))


def foretold(errors: Float[np.ndarray, " time"]) -> float:
    """Give how well earlier errors foretell one.

    Args:
        errors: sample by sample.

    Returns:
        Sum of squared correlations with those up to some samples back, less what chance gives.
    """
    own = errors - errors.mean() if errors.size else errors
    power = float(own @ own) or 1.0
    lags = range(1, min(_LAGS, own.size - 1) + 1)
    return sum((float(own[:-lag] @ own[lag:]) / power) ** 2 for lag in lags) - len(lags) / max(own.size, 1)
