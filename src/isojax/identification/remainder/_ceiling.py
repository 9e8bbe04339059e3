"""Ceilings: how much of the latent force any law could explain, from the motion alone or with memories.

Both are regressions of the latent force, held against samples that they have not seen. Their inputs come from
the motion of the fitted model, not from the measured one: the noise of that is in the latent force, too, and
could be told from it. What they learn is no law that could be named, and is thrown away.
"""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from jaxtyping import Float, Int
from scipy.interpolate import BSpline
from scipy.signal import lfilter

from ...elements import Scales
from ._force_residual import ForceResidual

_SAMPLES = 40_000
"""Samples that a regression sees."""

_KNOTS = 9
"""Pieces of the static surface along each axis, as many samples in each."""

_FEATURES = 300
"""Random features of the black box."""

_STANDS_OUT = 0.03
"""Power over that of the noise below which what is left of the latent force is as uncertain as the noise."""

_FOLDS = 5
_PERIODS_A_BLOCK = 20.0
_DRAWS = 200

_FADING = (0.3, 1.0, 3.0)
"""Times of the fading memories of the black box, over 1/w of the centre of the band."""

_REACHES = (0.1, 0.3)
"""Reaches of its memories without time, over the largest displacement."""

_PENALTIES = (1e-6, 1e-4, 1e-2, 1.0)
"""Penalties of a regression over its mean curvature."""


class Ceiling(NamedTuple):
    """How much of the latent force a regression explains where it was not fitted.

    Attributes:
        share: of the mean square beyond the noise that refitted coefficients leave, 1 at most; below zero
            where the regression does worse than they do; NaN where next to nothing stands out of the noise,
            or where there is but one block of samples (a single dwell), which no other can predict.
        error: its standard error, from the scatter between blocks of samples [1].
        weights: numbers that were fitted.
        held_out: whether held-out records were scored, or else blocks of samples left out in turn.
    """

    share: float
    error: float
    weights: int
    held_out: bool


class _Table(NamedTuple):
    """Samples of all records, thinned out."""

    force: Float[np.ndarray, " sample"]
    noise: Float[np.ndarray, " sample"]
    base: Float[np.ndarray, "sample coefficient"]
    inputs: Float[np.ndarray, "sample input"]
    block: Int[np.ndarray, " sample"]
    held_out: Int[np.ndarray, " sample"]
    centred: bool


def _internal(one: ForceResidual, scales: Scales) -> Float[np.ndarray, "time memory"]:
    """Give what a force with memory may depend on: fading and slipping followers of the motion."""
    step = 1.0 / one.record.rate
    x = one.quiet[0] / scales.displacement
    columns = []
    for share in _FADING:
        time = share / scales.angular_frequency
        # p' = x' - p/tau by the trapezoidal rule.
        half = 0.5 * step / time
        numbers = ([1.0 / (1.0 + half), -1.0 / (1.0 + half)], [1.0, -(1.0 - half) / (1.0 + half)])
        columns.append(lfilter(*numbers, x))
    reach = np.array(_REACHES)
    followed, state = np.zeros((x.size, reach.size)), np.zeros(reach.size)
    change = np.diff(x, prepend=x[0])
    for place in range(x.size):
        state = np.minimum(np.maximum(state + change[place], -reach), reach)
        followed[place] = state
    return np.column_stack([*columns, followed])


def _blocks(one: ForceResidual, scales: Scales) -> Int[np.ndarray, " time"]:
    """Number the dwells of a record, or windows of some periods."""
    size = one.record.time.size
    if one.record.dwells:
        edges = [dwell.start for dwell in one.record.dwells][1:]
    else:
        length = _PERIODS_A_BLOCK * 2.0 * np.pi / scales.angular_frequency * one.record.rate
        length = min(length, size / 2)  # one block could not be predicted from others
        edges = [round(length * place) for place in range(1, int(size / length))]
    return np.searchsorted(np.array(edges), np.arange(size), side="right")


def _tabulate(latent: tuple[ForceResidual, ...], scales: Scales) -> _Table:
    """Lay the records one after the other; the largest number of samples is kept to."""
    total = sum(len(range(*one.trusted.indices(one.force.size))) for one in latent)
    thin = max(1, -(-total // _SAMPLES))
    parts, first = [], 0
    for one in latent:
        kept = slice(one.trusted.start, one.trusted.stop, thin)
        motion = np.column_stack(
            [one.quiet[0] / scales.displacement, one.quiet[1] / scales.velocity, _internal(one, scales)]
        )
        block = _blocks(one, scales) + first
        first = int(block[-1]) + 1
        held_out = np.full(one.force.size, one.record.role == "holdout").astype(int)
        columns = (one.force, np.mean(one.noise**2, axis=0), one.quiet_columns, motion, block, held_out)
        parts.append([column[kept] for column in columns])
    force, *others = (np.concatenate(column) for column in zip(*parts, strict=True))
    block = others[3]
    # Where the mean force was not measured, that of a law counts as little.
    centred = any(one.lowest is not None for one in latent)
    if centred:
        force = force - _block_means(force[:, None], block)[:, 0]
    noise, base, inputs, block, held_out = others
    return _Table(force, noise, base, inputs, block, held_out, centred)


def _block_means(
    columns: Float[np.ndarray, "sample column"], block: Int[np.ndarray, " sample"]
) -> Float[np.ndarray, "sample column"]:
    """Give the mean of each column over the block of each sample."""
    edges = np.flatnonzero(np.diff(block, prepend=-1))
    counts = np.diff(np.append(edges, block.size))
    return np.repeat(np.add.reduceat(columns, edges, axis=0) / counts[:, None], counts, axis=0)


_Features = Callable[[Float[np.ndarray, "sample input"]], Float[np.ndarray, "sample feature"]]


def _spline_features(inputs: Float[np.ndarray, "sample input"]) -> _Features:
    """Give the products of cubic B-splines of x and v, knots at quantiles of what was visited."""
    knots = []
    for column in inputs[:, :2].T:
        inner = np.unique(np.quantile(column, np.linspace(0.0, 1.0, _KNOTS + 1)))
        knots.append(np.concatenate([[inner[0]] * 3, inner, [inner[-1]] * 3]))

    def features(values: Float[np.ndarray, "sample input"]) -> Float[np.ndarray, "sample feature"]:
        sides = [
            BSpline.design_matrix(np.clip(column, own[0], own[-1]), own, 3).toarray()
            for column, own in zip(values[:, :2].T, knots, strict=True)
        ]
        return (sides[0][:, :, None] * sides[1][:, None, :]).reshape(values.shape[0], -1)

    return features


def _random_features(inputs: Float[np.ndarray, "sample input"]) -> _Features:
    """Give a layer of sigmoids with drawn weights, and the inputs themselves.

    Source: Huang, Zhu & Siew 2006 (random hidden layers); Rahimi & Recht 2008.
    """
    draw = np.random.default_rng(0)
    scale = np.std(inputs, axis=0)
    size = inputs.shape[1]
    steep = np.exp(draw.uniform(np.log(0.5), np.log(4.0), _FEATURES))
    weights = draw.standard_normal((size, _FEATURES)) * steep / np.sqrt(size)
    # Each sigmoid turns where there are samples.
    centres = inputs[draw.integers(0, inputs.shape[0], _FEATURES)] / scale
    shift = np.einsum("fi,if->f", centres, weights)

    def features(values: Float[np.ndarray, "sample input"]) -> Float[np.ndarray, "sample feature"]:
        scaled = values / scale
        return np.column_stack([scaled, np.tanh(scaled @ weights - shift)])

    return features


def _predict(
    design: Float[np.ndarray, "sample column"],
    force: Float[np.ndarray, " sample"],
    train: np.ndarray,
    test: np.ndarray,
    free: int,
    penalty: float,
) -> Float[np.ndarray, " tested"]:
    """Fit by ridge regression, the first columns without a penalty; give the predictions elsewhere."""
    own = design[train]
    gram = own.T @ own
    weight = np.full(design.shape[1], penalty * np.trace(gram) / design.shape[1])
    weight[:free] = 1e-12 * np.trace(gram) / design.shape[1]
    solution = np.linalg.solve(gram + np.diag(weight), own.T @ force[train])
    return design[test] @ solution


def _ceiling(table: _Table, features: _Features | None, held_out: bool) -> Float[np.ndarray, " sample"]:
    """Give the error of each sample, predicted from others; NaN where it was not."""
    base = table.base / np.maximum(np.linalg.norm(table.base, axis=0), 1e-300) * np.sqrt(table.force.size)
    design = base if features is None else np.column_stack([base, features(table.inputs)])
    if table.centred:
        design = design - _block_means(design, table.block)
    free = base.shape[1]
    fold = table.block % _FOLDS
    inside = table.held_out == 0

    def crossed(penalty: float) -> Float[np.ndarray, " sample"]:
        error = np.full(table.force.size, np.nan)
        for place in range(_FOLDS):
            test = inside & (fold == place)
            train = inside & (fold != place)
            if np.any(test) and np.any(train):
                error[test] = table.force[test] - _predict(design, table.force, train, test, free, penalty)
        return error

    penalties = _PENALTIES if features is not None else (0.0,)
    errors = {penalty: crossed(penalty) for penalty in penalties}
    penalty = min(errors, key=lambda one: float(np.nansum(errors[one] ** 2)))
    if not held_out:
        return errors[penalty]
    error = np.full(table.force.size, np.nan)
    error[~inside] = table.force[~inside] - _predict(design, table.force, inside, ~inside, free, penalty)
    return error


def _score(
    table: _Table, without: Float[np.ndarray, " sample"], error: Float[np.ndarray, " sample"]
) -> tuple[float, float]:
    """Give the share explained and its standard error."""
    seen = np.isfinite(error) & np.isfinite(without)
    names, place = np.unique(table.block[seen], return_inverse=True)
    gained = np.bincount(place, without[seen] ** 2 - error[seen] ** 2)
    there = np.bincount(place, without[seen] ** 2 - table.noise[seen])
    draws = np.random.default_rng(0).integers(0, names.size, (_DRAWS, names.size))
    total = there.sum()
    noise = float(np.sum(table.noise[seen]))
    if not total > _STANDS_OUT * noise:
        return float("nan"), float("nan")
    several = gained[draws].sum(axis=1) / np.maximum(there[draws].sum(axis=1), 0.3 * total)
    return min(1.0, float(gained.sum() / total)), float(np.std(several))


def find_ceilings(latent: tuple[ForceResidual, ...], scales: Scales) -> tuple[Ceiling, Ceiling]:
    """Find how much of the latent force any static law, and any law with memories, could explain.

    The static one is a surface over the plane of x and v; samples are left out by whole dwells, or windows,
    and predicted from the others. The black box sees x, v, and followers of x that fade or slip; held-out
    records are predicted where there are any.

    Args:
        latent: of all records.
        scales: magnitudes of the records.

    Returns:
        The static ceiling and that of the black box; shares are NaN where the latent force does not stand
        out of its noise.

    Source: Masri & Caughey 1979 for the surface; Huang, Zhu & Siew 2006 for the black box.
    """
    table = _tabulate(latent, scales)
    inside = table.held_out == 0
    surface, box = _spline_features(table.inputs[inside]), _random_features(table.inputs[inside])
    base = table.base.shape[1]
    any_held_out = bool(np.any(~inside))
    static = _score(table, _ceiling(table, None, False), _ceiling(table, surface, False))
    black = _score(table, _ceiling(table, None, any_held_out), _ceiling(table, box, any_held_out))
    few = table.inputs[:1]
    return (
        Ceiling(*static, base + surface(few).shape[1], False),
        Ceiling(*black, base + box(few).shape[1], any_held_out),
    )
