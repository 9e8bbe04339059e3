"""The search for coefficients and the sizes of the errors, by the likelihood of the innovations."""

import dataclasses
from collections.abc import Callable, Sequence
from functools import partial
from typing import Any

import numpy as np
from jaxtyping import Float

from ..._parameters import list_parameters, replace_at, to_free
from ..._results import RESULTS
from ._error_fit import ErrorFit
from ._physical import physical
from ._record_filter import COPIES, RecordFilter
from ._sizes import FURTHEST, Sizes, Way

_MOST_SCORINGS = 40
"""Steps of a search at most."""

_SETTLED_DEVIANCE = 0.05
"""Change of the deviance by a step below which a search is over."""

_SMALL_CHANGE = 0.01
"""Step of the logarithm of a size below which it is over as well, however the deviance creeps: beside a jump
a sample may hold a size down to where nothing else asks for it."""

_USUAL_SCORINGS, _ROUGH_DEVIANCE = 16, 0.5
"""The same of a search whose end is only ranked: far below what tells two laws apart. It goes on beyond its
usual steps where it may still overtake the best of the others."""

_STEPS_BACK = 4
"""Steps over which the pace of a search is taken."""

_TRIED = np.array([1e-3, 0.03, 1.0, 30.0])
"""Marquardt's dampings that a step tries side by side, over that of the last step."""

_UNDETERMINED = 1e-10
"""Information of a combination of coefficients, each scaled to one, below which it is not determined."""

_FAR = 3.0
"""Longest step of a variable that stands for a bounded number, beyond itself: it bends near its bound."""

_LEAST_FORCE = 1e-5
"""Random force below which there is none [rms of the drive, or of the inertia where nothing drives]."""

_FIRST_FORCE = 0.1
"""Random force to start from [rms of the drive]."""

_LEAST_NOISE = 1e-6
"""Noise below which the output has none but rounding and the error of the steps [rms of the output]."""

_ASTRAY = 10.0
"""Surprise a sample from which a filter may have begun in a wrong state."""

_NO_WORSE = 10.0
"""Rise of the deviance up to which there is no random force: Schwarz's criterion of one size less."""

_NOISE_STEPS = 4
"""Steps of Fisher's scoring of the noise alone."""

_WHITE = -1.0
"""Correlation time below which a random force is white [log of samples]."""

_FIRST_MEMORY = 3.0
"""Correlation time to start from [samples]."""

_LONGEST_MEMORY = 8.0
"""Longest correlation time [log of samples]: nothing in a record tells it from a longer one."""


def _drive_size(record_filter: RecordFilter) -> float:
    """Give the largest rms of the drive [its SI unit]."""
    records = record_filter.tables.records
    drive = max(float(np.std(record.input)) for record in records)
    if drive > 0.0:
        return drive
    # Nothing drives: a scale will do.
    return float(record_filter.model.mass) * max(float(np.std(record.output)) for record in records)


def least_sizes(record_filter: RecordFilter) -> Sizes:
    """Give the sizes below which an error is none, or is declared to be at least."""
    outputs = np.array([float(np.std(record.output)) for record in record_filter.tables.records])
    lanes = [segment.record for segment in record_filter.prepared.segments]
    least = np.maximum(outputs, 1e-3 * outputs.max())[lanes]
    force = max(_LEAST_FORCE * _drive_size(record_filter), record_filter.measured.force[0])
    return Sizes(2.0 * np.log(force), _WHITE, 2.0 * np.log(_LEAST_NOISE * least))


def first_sizes(record_filter: RecordFilter) -> Sizes:
    """Give sizes for a model that is far from the records: much of the drive is not trusted."""
    least = least_sizes(record_filter)
    return Sizes(
        2.0 * np.log(_FIRST_FORCE * _drive_size(record_filter)),
        np.log(_FIRST_MEMORY) if record_filter.feeds_through else _WHITE,
        least.noise + 2.0 * np.log(0.01 / _LEAST_NOISE),
    )


def simulation_sizes(record_filter: RecordFilter) -> Sizes:
    """Give sizes of a filter that all but simulates: whatever its model leaves is noise."""
    least = least_sizes(record_filter)
    return least._replace(noise=least.noise - 2.0 * np.log(_LEAST_NOISE))


def fit_errors(
    record_filter: RecordFilter,
    places: tuple[int, ...],
    magnitudes: Sequence[float],
    sizes: Sizes,
    *,
    loudest: Float[np.ndarray, " record"],
    rough: bool = False,
    starts: Sequence[Float[np.ndarray, " column"]] = (),
    judged: Float[np.ndarray, " record"] | None = None,
    rival: float = -np.inf,
) -> ErrorFit:
    """Fit coefficients and the sizes of the errors.

    With the gains held the innovations are a problem of least squares: each step is one of Gauss and Newton,
    with several dampings tried side by side; each record's first states follow the coefficients. The sizes
    take a step of Fisher's scoring. A filter follows the records however far the coefficients are off, as
    long as its random force is large. So it starts large, and falls as the innovations do.

    Args:
        record_filter: the model and the records.
        places: coefficients to fit.
        magnitudes: of each.
        sizes: to start from.
        loudest: variance above which the noise of each record cannot be, log [squared SI unit of the output].
        rough: whether the fit is only ranked among others.
        starts: other values of the coefficients, of which the best is taken.
        judged: 1 for the records that are fitted, 0 for those that take no part; all if omitted.
        rival: a rough search takes more than the usual steps where its deviance falls fast enough to come
            below this.

    Returns:
        The fit.

    Source: Ljung 1999, System Identification, sec. 7.2 (innovations); Kristensen, Madsen & Jorgensen 2004.
    """
    # Another fit may hold this filter, with the first states that belong to its coefficients.
    record_filter = record_filter.with_own_starts()
    listed = list_parameters(record_filter.model)
    part = np.ones(record_filter.count) if judged is None else judged

    def over(values: Float[np.ndarray, "*any record"]) -> Float[np.ndarray, "*any"]:
        """Sum over the records that are fitted: another may have diverged."""
        return np.asarray(values[..., part > 0.0].sum(axis=-1))

    specs, scales = tuple(listed[place].spec for place in places), tuple(magnitudes)
    begun = [np.array([float(listed[place].value) for place in places]), *starts]
    bounded = [bool(np.isfinite([spec.lower, spec.upper]).any()) for spec in specs]
    frees = [
        np.array([to_free(*each) for each in zip(values, specs, scales, strict=True)]) for values in begun
    ]
    least, size, step = least_sizes(record_filter), len(places), 0

    # A force that is declared is white.
    loudest_force = record_filter.measured.force[1]
    any_memory = record_filter.feeds_through and np.isinf(loudest_force)
    longest = _LONGEST_MEMORY if any_memory else least.memory
    most = max(least.force, 2.0 * float(np.log(loudest_force)))
    bounds = least, Sizes(most, longest, np.maximum(loudest, least.noise))
    sizes = sizes.within(bounds)
    settled_at = _ROUGH_DEVIANCE if rough else _SETTLED_DEVIANCE

    def points(frees: Sequence[np.ndarray]) -> Float[np.ndarray, "copy column"]:
        return np.array([physical(free, specs, scales)[0] for free in frees])

    def followed(frees: Sequence[np.ndarray], sizes: Sequence[Sizes]) -> Way:
        more = COPIES - len(frees)  # always as many, so that they share compiled code
        return record_filter.follow(
            places, points([*frees, *[frees[0]] * more]), [*sizes, *[sizes[0]] * more]
        )

    free, damping, slack = frees[0], 1e-3, np.full(record_filter.count, 1e-3)
    if len(frees) > 1:
        deviances = over(followed(frees, [sizes] * len(frees)).deviance)
        free = frees[int(np.argmin(deviances[: len(frees)]))]
    last, before, trust, alone, sought = np.inf, sizes, FURTHEST, False, rough
    result: Any = RESULTS.not_converged
    stands, promised = False, 0.0  # no step gains
    fallen: list[float] = []
    for step in range(1, _MOST_SCORINGS + 1):
        if rough and step > _USUAL_SCORINGS:
            pace = (fallen[-1 - _STEPS_BACK] - fallen[-1]) / _STEPS_BACK
            if fallen[-1] - (_MOST_SCORINGS + 1 - step) * pace > rival:
                break
        way = followed([free] * COPIES, sizes.around())
        lost = not way.surprise < _ASTRAY * record_filter.samples
        if step == 1 and (lost or np.all(np.isinf(loudest))):
            if lost:  # it trusts a model that is too far off, by little in a motion that is irregular
                force = max(sizes.force, first_sizes(record_filter).force)
                sizes = sizes._replace(force=force).within(bounds)
            record_filter.seek_starts(places, points([free])[0], sizes)
            way = followed([free] * COPIES, sizes.around())
        if step in (1, 3):  # internal states start anywhere in the range that they visit
            record_filter.widen(way.squares)
        deviance = float(over(way.deviance[0]))
        fallen.append(deviance)
        products = record_filter.slopes(places, points([free])[0], way)
        if not (np.isfinite(deviance) and np.all(np.isfinite(over(products)))):
            result = RESULTS.not_finite
            break
        unit = np.r_[physical(free, specs, scales)[1], np.ones(len(products) - size)]
        first = record_filter.eliminate(products * np.outer(unit, unit)[..., None], slack)
        record_filter.scatter_as(first, part > 0.0)
        tried, promised = _damped_steps(
            over(first.reduced), damping * _TRIED, np.where(bounded, _FAR + np.abs(free), np.inf)
        )
        steps = np.array([*tried, *np.zeros((2, size))])
        begins = record_filter.starts + first.settled + np.einsum("src,tr->tsc", first.along, steps)
        if record_filter.model.slides:  # no small step leads to where friction holds the mass
            begins[-1, 1] = 0.0
        squares = record_filter.squares(places, points(list(free + steps)), way, begins)
        squares = np.nan_to_num(squares + record_filter.penalties(begins), nan=np.inf)
        here = products[-1, -1] + record_filter.penalties(record_filter.starts[None])[0]
        slack = np.where(squares[-2] < here, np.maximum(1e-9, 1e-3 * slack), np.minimum(1e9, 1e3 * slack))
        standing = np.array([here, *squares[len(tried) :]])  # with the coefficients as they are
        best, lowest = int(np.argmin(over(squares[: len(tried)]))), standing.min(axis=0)
        gain = float(over(here) - over(lowest))
        if over(squares[best]) < over(lowest):
            gain = float(over(here) - over(squares[best]))
            record_filter.begin(begins[best], first.spread, (part > 0.0) | (squares[best] < here))
            free, damping = free + tried[best], float(np.clip(damping * _TRIED[best], 1e-9, 1e9))
        else:
            for begin, own in zip(begins[len(tried) :], standing[1:], strict=True):
                record_filter.begin(begin, first.spread, (own == lowest) & (own < here))
            damping = min(1e9, 1e3 * damping)
        still = abs(last - deviance) < settled_at
        if deviance > last + settled_at and trust > _SMALL_CHANGE:  # the last step of the sizes went too far
            trust *= 0.25
            new = Sizes(
                before.force + 0.25 * (sizes.force - before.force),
                before.memory + 0.25 * (sizes.memory - before.memory),
                before.noise + 0.25 * (sizes.noise - before.noise),
            )
        else:
            trust = min(2.0 * trust, FURTHEST)
            last, before, new = deviance, sizes, sizes.moved(way, part, bounds, trust)
        still = still or sizes.moved(way, part, bounds, FURTHEST).distance(sizes) < _SMALL_CHANGE
        settled = step > 2 and still and gain < settled_at
        ended = settled and (promised < settled_at or damping >= 1e6)
        if (ended or step > _USUAL_SCORINGS) and not sought and sizes.force > least.force:
            sought = True  # a record may have begun in another well
            record_filter.seek_starts(places, points([free])[0], sizes)
            last = np.inf
            continue
        if ended:
            if record_filter.feeds_through and not alone and sizes.force > least.force:
                alone = True
                only = bounds[0], bounds[1]._replace(force=least.force, memory=least.memory)
                noise = _noise_alone(partial(followed, [free] * COPIES), sizes, part, only)
                if noise is not None and noise[1] < deviance + _NO_WORSE:
                    sizes, bounds, last = noise[0], only, np.inf
                    continue
            stands = True
            result = RESULTS.successful if promised < 1.0 else RESULTS.not_converged
            break
        sizes = new
    way = followed([free] * COPIES, sizes.around())
    products, beside = record_filter.of_coefficients(record_filter.slopes(places, points([free])[0], way))
    found = ErrorFit(
        replace_at(record_filter.model, places, physical(free, specs, scales)[0]),
        places,
        sizes,
        way.deviance[0] + beside,
        products,
        record_filter.samples,
        result,
        step,
        record_filter,
        way,
    )
    if stands and found.is_noise_of_output:
        # Beside the jumps of a law slopes promise what no step of any length keeps.
        return dataclasses.replace(found, result=RESULTS.successful, unkept=promised)
    return found


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
        deviance = float(way.deviance[0, judged > 0.0].sum())
        if not np.isfinite(deviance):
            return None
        own = own.moved(way, judged, bounds, FURTHEST)
    deviance = float(follow(own.around()).deviance[0, judged > 0.0].sum())
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
