"""Coefficients and the sizes of the errors, by the likelihood of the innovations."""

import dataclasses
from collections.abc import Callable, Sequence
from functools import cached_property, partial
from typing import Any

import jax.numpy as jnp
import numpy as np
from jaxtyping import Float

from ..._parameters import list_parameters, replace_parameters, to_free
from ..._results import RESULTS
from ..._types import on_device
from ...models import Isolator
from ._filter import Trace
from ._record_filter import COPIES, FURTHEST, RecordFilter, Sizes, Way, physical

MOST_SCORINGS = 40
"""Steps of a search at most."""

SETTLED_DEVIANCE = 0.05
"""Decrease of the deviance of a step below which a search is over."""

_TRIED = np.array([1e-3, 0.03, 1.0, 30.0])
"""Marquardt's dampings that a step tries side by side, over that of the last step."""

_UNDETERMINED = 1e-10
"""Information of a combination of coefficients, each scaled to one, below which it is not determined."""

_FAR = 3.0
"""Longest step of a variable that stands for a bounded number, beyond itself: it bends near its bound."""

_LEAST_FORCE = 1e-5
"""Random force below which there is none [rms of the drive, or of the inertia where nothing drives]."""

_LEAST_NOISE = 1e-4
"""Noise below which the output has none but rounding and the error of the steps [rms of the output]."""


_NO_FORCE = 0.05
"""Share of the innovations' variance below which the random force does not matter."""

_NO_WORSE = 10.0
"""Rise of the deviance up to which there is no random force: Schwarz's criterion of one size less."""

_NOISE_STEPS = 4
"""Steps of Fisher's scoring of the noise alone."""

_LAGS = 20
"""Samples back from which an innovation may be foretold."""

_WHITE_ENOUGH = 0.03
"""Share of an innovation's variance that those before it may foretell where the error is noise."""

_RECORDS_ALIKE = 0.3
"""Difference of the innovations' variance from that expected, relative, up to which records are alike."""

_WHITE = -1.0
"""Correlation time below which a random force is white [log of samples]."""

_FIRST_MEMORY = 3.0
"""Correlation time to start from [samples]."""

_LONGEST_MEMORY = 8.0
"""Longest correlation time [log of samples]: nothing in a record tells it from a longer one."""


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
    def chi2(self) -> float:
        """Sum of squared innovations over their variances."""
        return float(self.products[-1, -1].sum())

    @property
    def innovations(self) -> list[Float[np.ndarray, " time"]]:
        """Innovations of each record over their standard deviations, of the samples that count."""
        prepared, found = self.filter.prepared, {}
        width = prepared.order.size // len(prepared.batches)
        for part, trace in enumerate(self.way.traces):
            white = np.asarray(trace.error) / np.asarray(trace.deviation)
            for lane in range(width):
                counted = np.isfinite(np.asarray(trace.deviation)[:, lane])
                found[int(prepared.order[part * width + lane])] = white[counted, lane]
        return [found[place] for place in range(self.filter.count)]

    @cached_property
    def force_share(self) -> float:
        """Share of the innovations' variance that the random force causes, at most over the records."""
        noise, shares = np.exp(self.sizes.noise), []
        prepared = self.filter.prepared
        width = prepared.order.size // len(prepared.batches)
        for part, trace in enumerate(self.way.traces):
            deviation = np.asarray(trace.deviation)
            for lane in range(width):
                place = int(prepared.order[part * width + lane])
                own = deviation[:, lane][np.isfinite(deviation[:, lane])]
                if place < self.filter.count and own.size:
                    shares.append(1.0 - noise[place] * float(np.mean(own**-2)))
        return max(shares, default=0.0)

    @cached_property
    def colour(self) -> float:
        """How well earlier innovations foretell one, the worst of any record: squared correlations."""
        found = []
        for white in self.innovations:
            own = white - white.mean()
            power = float(own @ own) or 1.0
            lags = range(1, min(_LAGS, own.size - 1) + 1)
            chance = len(lags) / own.size
            found.append(sum((float(own[:-lag] @ own[lag:]) / power) ** 2 for lag in lags) - chance)
        return max(found, default=0.0)

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

    @property
    def criterion(self) -> float:
        """Schwarz's criterion."""
        return float(self.deviance.sum()) + len(self.places) * float(np.log(self.samples))


def least_sizes(record_filter: RecordFilter) -> Sizes:
    """Give the sizes below which an error is none."""
    records = record_filter.tables.records
    drive = max(float(np.std(record.input)) for record in records)
    outputs = np.array([float(np.std(record.output)) for record in records])
    if drive == 0.0:
        drive = float(record_filter.model.mass) * float(outputs.max())  # nothing drives: a scale will do
    lanes = [segment.record for segment in record_filter.prepared.segments]
    least = np.maximum(outputs, 1e-3 * outputs.max())[lanes]
    return Sizes(2.0 * np.log(_LEAST_FORCE * drive), _WHITE, 2.0 * np.log(_LEAST_NOISE * least))


def first_sizes(record_filter: RecordFilter) -> Sizes:
    """Give sizes for a model that is far from the records: much of the drive is not trusted."""
    least = least_sizes(record_filter)
    return Sizes(
        least.force + 2.0 * np.log(0.1 / _LEAST_FORCE),
        np.log(_FIRST_MEMORY) if record_filter.feeds_through else _WHITE,
        least.noise + 2.0 * np.log(0.01 / _LEAST_NOISE),
    )


def fit_errors(
    record_filter: RecordFilter,
    places: tuple[int, ...],
    magnitudes: Sequence[float],
    sizes: Sizes,
    *,
    loudest: Float[np.ndarray, " record"],
    most_steps: int = MOST_SCORINGS,
    starts: Sequence[Float[np.ndarray, " column"]] = (),
    judged: Float[np.ndarray, " record"] | None = None,
) -> ErrorFit:
    """Fit coefficients and the sizes of the errors.

    With the gains held the innovations are a problem of least squares: each step is one of Gauss and Newton,
    with several dampings tried side by side. The sizes take a step of Fisher's scoring. A filter follows the
    records however far the coefficients are off, as long as its random force is large. So it starts large,
    and falls as the innovations do.

    Args:
        record_filter: the model and the records.
        places: coefficients to fit.
        magnitudes: of each.
        sizes: to start from.
        loudest: variance above which the noise of each record cannot be, log [squared SI unit of the output].
        most_steps: at most.
        starts: other values of the coefficients, of which the best is taken.
        judged: 1 for the records that are fitted, 0 for those that take no part; all if omitted.

    Returns:
        The fit.

    Source: Ljung 1999, System Identification, sec. 7.2 (innovations); Kristensen, Madsen & Jorgensen 2004.
    """
    listed = list_parameters(record_filter.model)
    part = np.ones(record_filter.count) if judged is None else judged
    specs, scales = tuple(listed[place].spec for place in places), tuple(magnitudes)
    begun = [np.array([float(listed[place].value) for place in places]), *starts]
    bounded = [bool(np.isfinite([spec.lower, spec.upper]).any()) for spec in specs]
    frees = [
        np.array([to_free(*each) for each in zip(values, specs, scales, strict=True)]) for values in begun
    ]
    least, size, step = least_sizes(record_filter), len(places), 0

    longest = _LONGEST_MEMORY if record_filter.feeds_through else least.memory
    bounds = least, Sizes(np.inf, longest, np.maximum(loudest, least.noise))

    def points(frees: Sequence[np.ndarray]) -> Float[np.ndarray, "copy column"]:
        return np.array([physical(free, specs, scales)[0] for free in frees])

    def followed(frees: Sequence[np.ndarray], sizes: Sequence[Sizes]) -> Way:
        more = COPIES - len(frees)  # always as many, so that they share compiled code
        return record_filter.follow(
            places, points([*frees, *[frees[0]] * more]), [*sizes, *[sizes[0]] * more]
        )

    free, damping = frees[0], 1e-3
    if len(frees) > 1:
        deviances = followed(frees, [sizes] * len(frees)).deviance @ part
        free = frees[int(np.argmin(deviances[: len(frees)]))]
    last, before, trust, alone = np.inf, sizes, FURTHEST, False
    result: Any = RESULTS.not_converged
    for step in range(1, most_steps + 1):
        way = followed([free] * COPIES, sizes.around())
        if step in (1, 3):  # internal states start anywhere in the range that they visit
            record_filter.spread[2:] = np.where(np.isfinite(way.squares), way.squares, 0.0)
        deviance = float(way.deviance[0] @ part)
        products = record_filter.products(places, points([free]), way, columns=True)[:, :, 0] @ part
        if not (np.isfinite(deviance) and np.all(np.isfinite(products))):
            result = RESULTS.not_finite
            break
        slopes = np.append(physical(free, specs, scales)[1], 1.0)
        products = products * np.outer(slopes, slopes)
        tried, promised = _damped_steps(
            products, damping * _TRIED, np.where(bounded, _FAR + np.abs(free), np.inf)
        )
        squares = record_filter.products(places, points([free + one for one in tried]), way, columns=False)
        squares = np.nan_to_num(squares[0, 0] @ part, nan=np.inf)
        best = int(np.argmin(squares)) if size else 0
        gain = float(products[-1, -1] - squares[best]) if size else 0.0
        if gain > 0.0:
            free, damping = free + tried[best], float(np.clip(damping * _TRIED[best], 1e-9, 1e9))
        else:
            damping = min(1e9, 1e3 * damping)
        if deviance > last + SETTLED_DEVIANCE:  # the last step of the sizes went too far
            trust *= 0.25
            new = Sizes(
                before.force + 0.25 * (sizes.force - before.force),
                before.memory + 0.25 * (sizes.memory - before.memory),
                before.noise + 0.25 * (sizes.noise - before.noise),
            )
        else:
            trust, before, new = min(2.0 * trust, FURTHEST), sizes, sizes.moved(way, part, bounds, trust)

        settled = step > 2 and abs(last - deviance) < SETTLED_DEVIANCE and gain < SETTLED_DEVIANCE
        if settled and (promised < SETTLED_DEVIANCE or damping >= 1e6):
            if record_filter.feeds_through and not alone:
                alone = True
                only = bounds[0], bounds[1]._replace(force=least.force, memory=least.memory)
                noise = _noise_alone(partial(followed, [free] * COPIES), sizes, part, only)
                if noise is not None and noise[1] < deviance + _NO_WORSE:
                    sizes, bounds, last = noise[0], only, np.inf
                    continue
            result = RESULTS.successful if promised < 1.0 else RESULTS.not_converged
            break
        sizes, last = new, deviance
    way = followed([free], [sizes])
    numbers = [entry.value for entry in listed]
    for place, value in zip(places, physical(free, specs, scales)[0], strict=True):
        numbers[place] = on_device(np.asarray(value))
    return ErrorFit(
        replace_parameters(record_filter.model, numbers),
        places,
        sizes,
        way.deviance[0],
        record_filter.products(places, points([free]), way, columns=True)[:, :, 0],
        float(sum(np.asarray(batch.weight).sum() for batch in record_filter.prepared.batches)),
        result,
        step,
        record_filter,
        way,
    )


def _noise_alone(
    follow: Callable[[Sequence[Sizes]], Way],
    sizes: Sizes,
    judged: Float[np.ndarray, " record"],
    bounds: tuple[Sizes, Sizes],
) -> tuple[Sizes, float] | None:
    """Give the sizes without a random force, and the deviance with them; None where a filter diverges.

    A force that is all but white, straight on an accelerometer, reads as noise of the output does. Nothing
    but their names tells them apart then, and noise is the plainer one.
    """
    own, deviance = sizes._replace(force=bounds[1].force, memory=bounds[1].memory), np.inf
    for _ in range(_NOISE_STEPS):
        way = follow(own.around())
        deviance = float(way.deviance[0] @ judged)
        if not np.isfinite(deviance):
            return None
        own = own.moved(way, judged, bounds, FURTHEST)
    deviance = float(follow(own.around()).deviance[0] @ judged)
    return (own, deviance) if np.isfinite(deviance) else None


def _damped_steps(
    products: Float[np.ndarray, "row row"],
    dampings: Float[np.ndarray, " try"],
    furthest: Float[np.ndarray, " column"],
) -> tuple[list[Float[np.ndarray, " column"]], float]:
    """Give Marquardt's steps of the unbounded variables, and what the longest promises."""
    inner, outer = products[:-1, :-1], products[:-1, -1]
    unit = np.sqrt(np.maximum(np.diag(inner), 1e-300))
    values, vectors = np.linalg.eigh(inner / np.outer(unit, unit))
    known = values > _UNDETERMINED * unit.size
    values, vectors = values[known], vectors[:, known]
    along = vectors.T @ (outer / unit)
    steps = [-(vectors @ (along / (values + own))) / unit for own in dampings]
    promised = float(-steps[0] @ outer)
    shares = [np.min(furthest / np.maximum(np.abs(one), 1e-300), initial=1.0) for one in steps]
    return [share * one for share, one in zip(shares, steps, strict=True)], promised


def free_squares(fit: ErrorFit) -> Float[np.ndarray, " record"]:
    """Give the squared error of each record, simulated with nothing fed back [squared SI unit].

    Args:
        fit: the model.

    Returns:
        The sums.
    """

    def free(trace: Trace) -> Trace:
        counted = jnp.isfinite(trace.deviation)
        return trace._replace(
            gains=tuple(jnp.zeros_like(gain) for gain in trace.gains),
            deviation=jnp.where(counted, 1.0, jnp.inf),
        )

    way = fit.way._replace(traces=[free(one) for one in fit.way.traces])
    return fit.filter.products(fit.places, fit.values[None], way, columns=False)[0, 0, 0]
