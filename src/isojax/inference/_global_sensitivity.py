"""Sobol's indices: which share of the variance of a quantity each input causes, over its whole range."""

from collections.abc import Callable, Mapping
from typing import Any, NamedTuple, Protocol, runtime_checkable

import numpy as np
from jaxtyping import Array, Float
from scipy import stats

from .._given_numbers import as_numbers, given_chance, given_count
from .._parameters import find_parameter, full_names, list_parameters, replace_parameters
from .._progress import silent
from .._results import RESULTS, cell_results
from .._show import Row, brief, number, shown
from .._types import check_float64
from ..models import Isolator, Modelled, as_isolator
from ._evaluate import NOT_FINITE, evaluate
from ._named_quantity import NamedQuantity

_UNMOVED = 1e-12
"""Standard deviation of a quantity over its mean, up to which it does not depend on the inputs."""

_RESAMPLES = 999
"""Resamples of the bootstrap."""


@runtime_checkable
class _Law(Protocol):
    """A distribution of one number, such as those of `scipy.stats`."""

    def ppf(self, q: Any, /) -> Any:
        """Give the quantiles of chances."""
        ...


@shown
class GlobalSensitivity(NamedTuple):
    """Shares of the variance of a quantity, by input.

    Attributes:
        inputs: their names.
        first: share of the variance that an input causes by itself [1]; input first, then the shape of the
            quantity. NaN where the quantity does not vary.
        total: the same together with its interactions with all others [1].
        first_interval: lower and upper end, first axis.
        total_interval: lower and upper end, first axis.
        confidence: chance that an interval is meant to hold the index.
        mean: of the quantity.
        variance: of the quantity.
        samples: points at which the quantity was evaluated.
        failed_at: inputs at which it failed; each takes its row of `inputs + 2` samples out of the estimate.
        reason: why it failed there; "" where nothing failed.
        names: of the numbers, in the order of the last axis, where the quantity gives a dict; else empty.
    """

    inputs: tuple[str, ...]
    first: Float[np.ndarray, "input ..."]
    total: Float[np.ndarray, "input ..."]
    first_interval: Float[np.ndarray, "2 input ..."]
    total_interval: Float[np.ndarray, "2 input ..."]
    confidence: float
    mean: Float[np.ndarray, "..."]
    variance: Float[np.ndarray, "..."]
    samples: int
    failed_at: Float[np.ndarray, "failed input"]
    reason: str
    names: tuple[str, ...] = ()

    def _headline(self) -> str:
        lost = f", {len(self.failed_at)} failed" if len(self.failed_at) else ""
        return f"first and total index of {len(self.inputs)} inputs, {self.samples} samples{lost}"

    def _rows(self) -> list[Row]:
        parts = [(f"{name}, ", (place,)) for place, name in enumerate(self.names)] or [("", ())]
        return [
            Row(
                f"{part}{name}",
                _words(self.first[at, *own], self.first_interval[:, at, *own]),
                f"total {_words(self.total[at, *own], self.total_interval[:, at, *own])}",
            )
            for part, own in parts
            for at, name in enumerate(self.inputs)
        ]

    def _lines(self) -> list[str]:
        if not len(self.failed_at):
            return []
        ends = zip(self.inputs, self.failed_at.min(axis=0), self.failed_at.max(axis=0), strict=True)
        where = ", ".join(f"{name} {number(float(low))} to {number(float(high))}" for name, low, high in ends)
        return [
            f"{len(self.failed_at)} of {self.samples} samples failed and are left out: {self.reason}. They "
            f"lie at {where}."
        ]


def _words(index: Any, interval: Any) -> str:
    """Give one index with its interval; of several the range."""
    if np.ndim(index):
        return brief(np.asarray(index))
    return f"{float(index):.3f} ({float(interval[0]):.3f} to {float(interval[1]):.3f})"


def global_sensitivity(
    quantity: Callable[[Any], Any],
    ranges: Mapping[str, Any],
    model: Isolator | Modelled | None = None,
    *,
    samples: int = 2048,
    confidence: float = 0.95,
    seed: int = 0,
    progress: Callable[[str], None] = silent,
) -> GlobalSensitivity:
    """Give the share of a quantity's variance that each input causes over its range: Sobol's indices.

    `S_i = Var(E(q | x_i)) / Var(q)` and `T_i = E(Var(q | all but x_i)) / Var(q)`. Their difference is what
    the input does together with others. The inputs are independent.

    Args:
        quantity: function that gives real numbers: one, an array, or a dict of single ones by their names,
            which the answer keeps; or a pair of these and a `RESULTS`, which then says why a sample failed.
            With a `model` it is a function of the isolator, as in
            `sensitivity` and `uncertainty`; without, of a dictionary of numbers by the names in `ranges`.
            Where `jax.vmap` cannot go through it, it is evaluated sample by sample; where it raises, the
            sample has failed.
        ranges: for each input its least and greatest value, between which all are equally likely, or a law
            of `scipy.stats`, such as `stats.norm(value, standard_error)`. With a `model` the names are those
            of its parameters, or their symbols.
        model: the isolator, or what holds one, such as a fit, if the quantity is a function of one.
        samples: rows of the design, a power of 2; the quantity is evaluated `inputs + 2` times in each.
        confidence: chance that an interval is to hold the index.
        seed: of the samples and of the bootstrap.
        progress: receives a line a chunk of samples.

    Returns:
        Both indices of each input, with intervals.

    Raises:
        ValueError: if a range is no range, leaves the bounds of a parameter or names none, `samples` is no
            power of 2, the quantity is complex, or more than half of the rows failed.
        RuntimeError: if JAX is not in 64-bit mode.

    Source: Sobol 2001, Math. Comput. Simul. 55:271; Saltelli et al. 2010, Comput. Phys. Commun. 181:259,
    table 2 (b) and (f) (estimators); percentile bootstrap over the rows.

    Example:
        The damping ratio where the linear spring and damper may each be off by 5 %:

        >>> model = ij.paper.y_direction()
        >>> k, c = "linear_stiffness.coefficient", "linear_damping.coefficient"
        >>> def damping_ratio(model):
        ...     return model[c] / (2.0 * (model[k] * model.mass) ** 0.5)
        >>> ranges = {name: (0.95 * model[name], 1.05 * model[name]) for name in (k, c)}
        >>> found = ij.global_sensitivity(damping_ratio, ranges, model)
        >>> print([f"{share:.1f}" for share in found.first])
        ['0.2', '0.8']
    """
    check_float64()
    confidence, seed = given_chance("confidence", confidence), given_count("seed", seed, least=0)
    samples = given_count("samples", samples)
    if samples < 64 or samples & (samples - 1):
        raise ValueError(f"Argument `samples` must be a power of 2, at least 64, but is {samples}.")
    if not callable(quantity):
        raise ValueError(
            "Argument `quantity` must be a function, such as lambda model: model.mass, but is "
            f"{brief(quantity)}."
        )
    isolator = None if model is None else as_isolator(model, recorded=True)
    if not isinstance(ranges, Mapping):
        raise ValueError(
            "Argument `ranges` must be a dictionary of the ends of each input by its name, but is of type "
            f"{type(ranges).__name__}."
        )
    if isolator is not None:
        ranges = dict(zip(full_names(isolator, ranges, "ranges"), ranges.values(), strict=True))
    names = tuple(ranges)
    if not names:
        raise ValueError("Argument `ranges` must name at least one input, but is empty.")
    points = _design([_law(name, ranges[name]) for name in names], samples, seed)
    flat = points.reshape(-1, len(names))
    if isolator is not None:
        _check_bounds(isolator, names, flat)
    asked = NamedQuantity(quantity)

    def at(numbers: Float[Array, " input"]) -> tuple[Array, RESULTS | None]:
        own = {name: numbers[place] for place, name in enumerate(names)}
        answer = asked(own if isolator is None else _moved(isolator, own))
        told = isinstance(answer, tuple) and len(answer) == 2 and isinstance(answer[1], RESULTS)
        value, result = answer if told else (answer, None)
        return as_numbers("quantity", value), result

    (values, result), raised = evaluate(at, flat, progress)
    failed, reason = _failures(values, result, raised)
    kept = ~failed.reshape(points.shape[:2]).any(axis=1)
    if not 2 * kept.sum() >= samples:
        raise ValueError(
            f"Argument `quantity` must succeed in more than half of the rows of {len(names) + 2} points, but "
            f"failed in {samples - kept.sum()} of {samples} rows: {reason}."
        )
    shape = values.shape[1:]
    rows = values.reshape(samples, len(names) + 2, -1)[kept].astype(float)
    mean = rows[:, :2].mean(axis=(0, 1))
    variance = rows[:, :2].var(axis=(0, 1))
    if not np.any(variance > (_UNMOVED * np.abs(mean)) ** 2):
        raise ValueError(
            f"Argument `quantity` must depend on an input of `ranges`, but is {brief(mean.reshape(shape))} "
            f"for all {len(flat)} samples."
        )
    rows = rows - mean  # Sobol & Levitan 1999: a mean far from zero would only add noise
    both = _indices(rows).reshape(2, len(names), *shape)
    ends = stats.bootstrap(
        (np.arange(len(rows)),),
        lambda places: _indices(rows[places]),
        vectorized=False,
        n_resamples=_RESAMPLES,
        confidence_level=confidence,
        method="percentile",
        rng=np.random.default_rng(seed),
    ).confidence_interval
    low, high = (end.reshape(both.shape) for end in (ends.low, ends.high))
    return GlobalSensitivity(
        names,
        both[0],
        both[1],
        np.stack([low[0], high[0]]),
        np.stack([low[1], high[1]]),
        confidence,
        mean.reshape(shape),
        variance.reshape(shape),
        len(flat),
        flat[failed],
        reason,
        asked.names,
    )


def _law(name: str, given: Any) -> _Law:
    """Give the law of an input: between two numbers all are equally likely."""
    if isinstance(given, stats.rv_continuous | stats.rv_discrete):
        raise ValueError(
            f"Argument `ranges` must give a law of scipy.stats with its numbers, such as "
            f"stats.norm(value, standard_error), but gives {name} the law {given.name} without any."
        )
    if isinstance(given, _Law):
        return given
    ends = np.asarray(given)
    numbers = ends.dtype.kind in "iuf" and ends.shape == (2,)
    if not (numbers and np.all(np.isfinite(ends)) and ends[0] < ends[1]):
        raise ValueError(
            f"Argument `ranges` must give each input its least and greatest value or a law of scipy.stats, "
            f"but gives {name} {brief(given)}."
        )
    return stats.uniform(ends[0], ends[1] - ends[0])


def _design(laws: list[_Law], samples: int, seed: int) -> Float[np.ndarray, "row sample input"]:
    """Give A, B, and A with one input after the other from B, a row each."""
    count = len(laws)
    chances = stats.qmc.Sobol(2 * count, bits=64, rng=np.random.default_rng(seed)).random(samples)
    drawn = np.stack([law.ppf(chances[:, place::count]) for place, law in enumerate(laws)], axis=-1)
    mixed = np.repeat(drawn[:, :1], count, axis=1)
    mixed[:, range(count), range(count)] = drawn[:, 1]
    return np.concatenate([drawn, mixed], axis=1)


def _moved(model: Isolator, own: Mapping[str, Array]) -> Isolator:
    return replace_parameters(model, [own.get(entry.name, entry.value) for entry in list_parameters(model)])


def _check_bounds(model: Isolator, names: tuple[str, ...], points: Float[np.ndarray, "point input"]) -> None:
    for name, drawn in zip(names, points.T, strict=True):
        spec = list_parameters(model)[find_parameter(model, name)].spec
        outside = int(np.sum((drawn < spec.lower) | (drawn > spec.upper)))
        if outside:
            raise ValueError(
                f"Argument `ranges` must keep {name} between {spec.lower:g} and {spec.upper:g} {spec.unit}, "
                f"but {outside} of {drawn.size} samples lie outside. A law such as stats.lognorm or "
                "stats.truncnorm keeps to a bound."
            )


def _failures(values: np.ndarray, result: Any, raised: str) -> tuple[np.ndarray, str]:
    """Say which samples failed, and why."""
    failed = np.asarray(~np.isfinite(values).reshape(len(values), -1).all(axis=1))
    outcomes = None if result is None else cell_results(result)
    if outcomes is not None:
        failed = failed | ~np.asarray(outcomes == RESULTS.successful)
    if not failed.any() or raised:
        return failed, raised
    return failed, NOT_FINITE if outcomes is None else brief(outcomes[failed])


def _indices(rows: Float[np.ndarray, "row sample entry"]) -> Float[np.ndarray, "2 input entry"]:
    """Give first and total indices.

    Not `scipy.stats.sobol_indices`, which these equal: it takes no design that lost a row, and seeds no
    bootstrap.
    """
    a, b, mixed = rows[:, :1], rows[:, 1:2], rows[:, 2:]
    both = np.stack([np.mean(b * (mixed - a), axis=0), 0.5 * np.mean((mixed - a) ** 2, axis=0)])
    variance = rows[:, :2].var(axis=(0, 1))
    with np.errstate(invalid="ignore"):
        return both / np.where(variance > 0.0, variance, np.nan)
